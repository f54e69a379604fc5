"""Unit: a user's function is found by its name, gets the facts that it names, and its numbers are checked."""

import os
import re

import numpy as np
import pytest

from sigdb.core.errors import InputError
from sigdb.database.added.feature_function import FeatureFunction, NoNumbersError

MODULE = '''
"""Shapes of averages."""
import numpy as np
import pandas as pd

class Odd:
    pass

def crest(tsa):
    """Crest factor.

    More text.
    """
    return {"crest": abs(tsa).max() / tsa.std()}

def facts(tsa, teeth, *, unit, own=3, **more):
    return {"teeth": teeth, "own": own, "metres": unit == "m", "more": len(more)}

def everything(*averages):
    return {"count": len(averages)}

def labelled(tsa, stiffness_loss):
    return {"cheat": stiffness_loss}

def none():
    return {}

def changes_it(tsa):
    tsa[:] = 0
    return {"sum": tsa.sum()}

def leaves(tsa):
    raise SystemExit(3)

def noisy(tsa):
    return {"log": float(np.nan_to_num(np.log(np.zeros(1) - 1))[0])}

constant = 3

RETURNED = {
    "float": 3.0,
    "none": None,
    "nothing": {},
    "number": {3: 1.0},
    "quote": {'a"b': 1.0},
    "blank": {" ": 1.0},
    "spaces": {" a": 1.0},
    "lines": {"a\\nb": 1.0},
    "long": {"a" * 201: 1.0},
    "text": {"a": "b"},
    "digits": {"a": "3"},
    "complex": {"a": 1j},
    "array": {"a": np.zeros(2)},
    "infinite": {"a": -np.inf},
    "object": {"a": Odd()},
    "list": [("a", 1)],
}

def returns(tsa, sensor):
    return RETURNED[sensor]

def fine(tsa):
    return pd.Series({"int": 3, "bool": np.True_, "array": np.array([[2.5]]), "nan": np.nan, "none": None,
                      "half": np.float16(0.5), "masked": np.ma.masked, "name with (signs) = 2, x__y": 1})
'''


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    """A module in the working directory, under a name that no other test has used."""
    monkeypatch.chdir(tmp_path)
    name = re.sub(r"\W", "_", f"shapes_{tmp_path.name}")
    (tmp_path / f"{name}.py").write_text(MODULE, encoding="utf-8")
    return name


def loaded(module, name):
    return FeatureFunction.of(f"{module}:{name}").load()


def numbers(module, name, tsa=(1.0, -3.0, 2.0, 0.0), **facts):
    return loaded(module, name).numbers(np.array(tsa), facts)


def test_the_numbers_of_an_average(shapes):
    crest = loaded(shapes, "crest")
    assert crest.help == "Crest factor."
    assert crest.facts == ()
    assert crest.numbers(np.array([1.0, -3.0, 2.0, 0.0]), {}) == {"crest": pytest.approx(3 / np.sqrt(3.5))}


def test_a_parameter_gets_the_fact_of_its_name(shapes):
    assert loaded(shapes, "facts").facts == ("teeth", "unit")
    assert numbers(shapes, "facts", teeth=12, unit="m/s^2", torque=3.0) == {
        "teeth": 12,
        "own": 3,
        "metres": 0,
        "more": 0,
    }
    assert numbers(shapes, "everything") == {"count": 1}


def test_what_counts_as_a_number(shapes):
    values = numbers(shapes, "fine")
    assert {name for name, value in values.items() if np.isnan(value)} == {"nan", "none", "masked"}
    assert {name: values[name] for name in ("int", "bool", "array", "half")} == {
        "int": 3, "bool": 1, "array": 2.5, "half": 0.5
    }  # fmt: skip
    assert "name with (signs) = 2, x__y" in values


@pytest.mark.parametrize(
    ("returned", "says"),
    [
        ("float", r"returned 3\.0 \(a float\), not names with numbers such as \{'crest': 3\.2\}"),
        ("none", "returned None"),
        ("nothing", "returned no numbers"),
        ("list", "not names with numbers"),
        ("number", "returned the name 3; names must be text"),
        *((name, "returned the name .* no double quote") for name in ("quote", "spaces", "lines", "long")),
        ("blank", "names must be text"),
        *((name, r"returned .* for 'a', not a number") for name in ("text", "digits", "complex", "array", "object")),
        ("infinite", "returned -inf for 'a', not a finite number"),
    ],
)
def test_what_does_not(shapes, returned, says):
    with pytest.raises(NoNumbersError, match=says):
        numbers(shapes, "returns", sensor=returned)


def test_a_function_that_fails_says_why_and_one_that_warns_does_not_matter(shapes):
    with pytest.raises(NoNumbersError, match=r"^KeyError: 'neither'$"):
        numbers(shapes, "returns", sensor="neither")
    with pytest.raises(NoNumbersError, match=r"^SystemExit: 3$"):
        numbers(shapes, "leaves")
    assert numbers(shapes, "noisy") == {"log": 0.0}


def test_the_stored_average_stays_as_it_is(shapes):
    tsa = np.ones(3)
    assert loaded(shapes, "changes_it").numbers(tsa, {}) == {"sum": 0}
    assert tsa.sum() == 3


@pytest.mark.parametrize(
    ("function", "says"),
    [
        ("{}", "is no name of a function; give MODULE:FUNCTION"),
        ("{}:Odd.method", "is no name of a function"),
        ("../{}:crest", "is no name of a function"),
        ("{}:crost", r"has no crost; did you mean 'crest'\?"),
        ("{}:constant", "constant is a int; give a function"),
        ("{}:none", "first parameter must take an average"),
        ("{}:labelled", "parameter 'stiffness_loss' is none of teeth, speed_rpm, .*; rename it, or give it a default"),
        ("{}_absent:f", r"no such module in .* or on Python's path; go to its folder, or set PYTHONPATH"),
        ("{}.deeper:f", "cannot be imported"),
        ("math:sin", "has no source file"),
    ],
)
def test_a_name_that_is_no_function_is_refused(shapes, function, says):
    with pytest.raises(InputError, match=says):
        FeatureFunction.of(function.format(shapes))


@pytest.mark.parametrize("text", ["1 / 0", "raise SystemExit(2)", "def f(:"])
def test_a_module_that_cannot_be_imported_is_named(shapes, tmp_path, text):
    (tmp_path / f"{shapes}_bad.py").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=rf"{shapes}_bad: cannot be imported \((ZeroDivision|SystemExit|Syntax)"):
        FeatureFunction.of(f"{shapes}_bad:f")


def of_this_script(tsa):
    return {"n": len(tsa)}


def test_a_function_that_no_other_process_can_import_is_refused(monkeypatch):
    with pytest.raises(InputError, match="has no name in a module; write it with def"):
        FeatureFunction.of(lambda tsa: {})
    with pytest.raises(InputError, match="has no name in a module"):
        FeatureFunction.of(FeatureFunction.load)
    monkeypatch.setattr(of_this_script, "__module__", "__main__")
    with pytest.raises(InputError, match="of the script or notebook that runs; write it into a module of its own"):
        FeatureFunction.of(of_this_script)
    assert str(FeatureFunction.of(np.linalg.cond)) == "numpy.linalg:cond"


def test_a_module_is_read_again_when_it_has_changed(shapes, tmp_path):
    before = FeatureFunction.of(f"{shapes}:crest")
    path = tmp_path / f"{shapes}.py"
    path.write_text(MODULE.replace("abs(tsa).max()", "tsa.max()"), encoding="utf-8")
    os.utime(path, (path.stat().st_mtime + 2,) * 2)
    after = FeatureFunction.of(f"{shapes}:crest")
    assert before.sha256 != after.sha256
    assert after.load().numbers(np.array([1.0, -3.0]), {})["crest"] == 0.5
    with pytest.raises(InputError, match=f"the module {shapes} is not the one whose SHA-256 is {before.sha256}"):
        before.load()
