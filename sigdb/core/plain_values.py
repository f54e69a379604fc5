"""Values as plain formats of text hold them: JSON, and tables in Markdown."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from datetime import date
from math import isfinite
from pathlib import PurePath
from typing import Any, TypeAlias

import numpy as np

JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"
"""A value that JSON can hold."""


def plain(value: object) -> JsonValue:
    """Return a value as JSON can hold it: NumPy's numbers and arrays as Python's, NaN and infinity as None.

    Parameters
    ----------
    value
        A number, a text, an array, a path, a date, a dataclass, or a mapping or sequence of such.

    Raises
    ------
    TypeError
        If JSON cannot hold the value.

    Examples
    --------
    >>> import numpy as np
    >>> plain({"x": np.array([1.0, np.nan]), "n": np.int64(3)})
    {'x': [1.0, None], 'n': 3}
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, PurePath | date):
        return str(value)
    raise TypeError(f"{type(value).__name__} is no value that JSON can hold")


def json_text(value: object, *, indent: int | None = 1) -> str:
    """Return a value as JSON, in which a number that is not finite is null, with a line break at its end.

    Parameters
    ----------
    value
        A value that :func:`plain` takes.
    indent
        Spaces of each level; None for all on one line.

    Examples
    --------
    >>> json_text({"x": float("nan"), "y": [1, 2]}, indent=None)
    '{"x": null, "y": [1, 2]}\\n'
    """
    return json.dumps(plain(value), indent=indent, allow_nan=False) + "\n"


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown.

    Parameters
    ----------
    head
        Headings of the columns.
    rows
        Texts of the cells; a vertical bar in one is escaped.

    Examples
    --------
    >>> print(markdown_table(("axis", "unit"), [("torque", "N m"), ("|x|", "-")]))
    | axis | unit |
    | --- | --- |
    | torque | N m |
    | \\|x\\| | - |
    """
    lines = ([text.replace("|", "\\|") for text in cells] for cells in (head, *rows))
    first, *others = ("| " + " | ".join(cells) + " |" for cells in lines)
    return "\n".join([first, "|" + " --- |" * len(head), *others])


def without_keys(value: Any, keys: Sequence[str]) -> Any:
    """Return nested dictionaries and lists without some keys of the dictionaries.

    Examples
    --------
    >>> without_keys({"a": 1, "b": [{"a": 2, "c": 3}]}, ("a",))
    {'b': [{'c': 3}]}
    """
    if isinstance(value, dict):
        return {key: without_keys(item, keys) for key, item in value.items() if key not in keys}
    return [without_keys(item, keys) for item in value] if isinstance(value, list) else value
