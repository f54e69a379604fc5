"""Values of assumed numbers in the fields of a rig, as a rig file has them."""

from typing import Any

import numpy as np

from sigdb.transmission.dotted_path import Path, with_value
from sigdb.transmission.ensemble.assumed import Assumed
from sigdb.transmission.ensemble.assumption import Choice, Choices, Range, Tie
from sigdb.transmission.parts.described import NOTES, item


def value_in(data: Any, path: str) -> Any:
    """Return the value at a full dotted path of the fields of a rig."""
    for name in path.split("."):
        data = item(data, name)
    return data


def leading(value: Any) -> Any:
    """Return a number as it is, and of a list the first component that is not 0.

    Examples
    --------
    >>> leading([0.0, 2.0, 3.0])
    2.0
    """
    return next((number for number in value if number), 0.0) if isinstance(value, tuple | list) else value


def value_of(data: Any, number: Assumed) -> Any:
    """Return the present value of a number: a multiple, where its range is of multiples, and of a table its kind."""
    value = value_in(data, number.path)
    if isinstance(number.assumption, Choices):
        return value.get("kind", "trapezoid") if isinstance(value, dict) else value
    value = leading(value)
    if number.target is None:
        return value
    other = leading(value_in(data, number.target))
    return value / other if other else np.nan


def with_number(data: Any, number: Assumed, value: Any) -> Any:
    """Return fields of a rig with a value for a number, or with that which follows from another number."""
    path, now = tuple(number.path.split(".")), value_in(data, number.path)
    if isinstance(number.assumption, Range):
        size = value * leading(value_in(data, number.target)) if number.target else value
        if isinstance(now, tuple | list):
            return with_value(data, path, [component / leading(now) * size for component in now])
        return with_value(data, path, float(size))
    if isinstance(number.assumption, Choices) and isinstance(now, dict):
        return _with_table(data, path, number.assumption, value)
    return with_value(data, path, value if number.target is None else following(data, number))


def _with_table(data: Any, path: Path, choices: Choices, label: Choice) -> Any:
    """Return fields with another table; the table before takes its place among the choices."""
    now, kind = value_in(data, ".".join(path)), value_in(data, ".".join(path)).get("kind", "trapezoid")
    if label == kind:
        return data
    tables = [
        dict(now) | {"kind": kind} if name == kind else {"kind": label} if name == label else table
        for name, table in zip(choices.labels, choices.choices, strict=True)
    ]
    table = choices.choices[choices.labels.index(label)]
    assert isinstance(table, dict)
    data = with_value(data, path, dict(table))
    assumed = value_in(data, ".".join(path[:-1]))["assumed"]
    assumed[path[-1]] = {"choices": tables}
    return data


def following(data: Any, number: Assumed) -> Any:
    """Return the value that follows from another number."""
    assert number.target is not None
    other = value_in(data, number.target)
    if isinstance(number.assumption, Choices):
        *parents, name = number.target.split(".")
        theirs = Choices.model_validate((value_in(data, ".".join(parents)) if parents else data)["assumed"][name])
        return number.assumption.choices[theirs.labels.index(other) if other in theirs.labels else 0]
    assert isinstance(number.assumption, Tie)
    factor = number.assumption.factor
    if isinstance(other, dict):
        return {name: value for name, value in other.items() if name not in NOTES}
    if isinstance(other, tuple | list):
        return tuple(factor * component for component in other)
    return other if factor == 1 else factor * other


def agree(value: Any, expected: Any) -> bool:
    """Return whether a value is as expected, to the digits that files round to."""
    if isinstance(expected, dict):
        return {name: item for name, item in value.items() if name not in NOTES} == expected
    if isinstance(expected, str):
        return bool(value == expected)
    return bool(np.allclose(value, expected, rtol=1e-6, atol=0))
