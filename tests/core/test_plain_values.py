"""Unit: values that JSON can hold, and notes that programs read by code and values."""

import json
from dataclasses import dataclass
from datetime import date
from pathlib import PurePosixPath

import numpy as np
import pytest

from sigdb.core import Note, json_text, plain


@dataclass
class Pair:
    name: str
    values: np.ndarray


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.float64(1.5), 1.5),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (np.float32("nan"), None),
        (float("inf"), None),
        (np.array([[1.0, np.nan], [2.0, 3.0]]), [[1.0, None], [2.0, 3.0]]),
        ({"a": (1, np.int8(2)), 3: None}, {"a": [1, 2], "3": None}),
        (Pair("x", np.arange(2)), {"name": "x", "values": [0, 1]}),
        (PurePosixPath("a/b"), "a/b"),
        (date(2020, 1, 2), "2020-01-02"),
    ],
)
def test_values_become_what_json_holds(value, expected):
    assert plain(value) == expected
    json.dumps(plain(value), allow_nan=False)


@pytest.mark.parametrize("indent", [None, 1])
def test_text_of_values_is_json_without_nan(indent):
    text = json_text({"x": [np.nan, np.float32(0.5)], "n": np.int64(3)}, indent=indent)
    assert json.loads(text, parse_constant=pytest.fail) == {"x": [None, 0.5], "n": 3}
    assert (text.endswith("}\n"), text.count("\n") == 1) == (True, indent is None)


def test_other_values_are_refused():
    with pytest.raises(TypeError, match="object is no value that JSON can hold"):
        plain({"a": [object()]})


def test_a_note_reads_as_its_text_and_cannot_be_changed():
    note = Note(code="few-revolutions", text="the average has 3 revolutions", values={"revolutions": 3})
    assert f"{note}" == "the average has 3 revolutions"
    assert plain(note) == {"code": note.code, "text": note.text, "values": {"revolutions": 3}}
    with pytest.raises(AttributeError):
        note.code = "other"
    assert Note(code="a", text="b").values == {}
