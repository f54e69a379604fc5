"""Tables of cases: a CSV or Parquet file, or columns in the recipe itself; each row is a joint point."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from sigdb.core import FloatArray, check_file
from sigdb.sweep.design.axes import LIFE_AXES, WHOLE_AXES, axis_name, check_axis_name, check_bounds, flatten

_MOST_BYTES, _MOST_ROWS = 1_000_000_000, 2_000_000
"""Largest size and number of rows of a file: each value becomes a Python object."""

Columns = dict[str, tuple[float, ...] | tuple[int, ...] | tuple[str, ...]]


def read_table(table: object) -> Columns:
    """Return the columns of a table, checked: numbers by axis, and names of patterns.

    Parameters
    ----------
    table
        Path of a CSV or Parquet file, or columns by name.

    Raises
    ------
    ValueError
        Names the file, the row from 1 on, the column, the value and what to do.
    """
    if isinstance(table, str | Path):
        return check_columns(_read_file(Path(table)), owner=str(table))
    if isinstance(table, Mapping):
        columns = {name: getattr(values, "tolist", lambda values=values: values)() for name, values in flatten(table)}
        return check_columns(columns, owner="table")
    raise ValueError(
        f"table = {table!r} must be the path of a CSV or Parquet file, or columns: {{ tooth = [1, 2], ... }}"
    )


def check_columns(table: Mapping[str, object], *, owner: str) -> Columns:
    """Return the columns with checked names and values; see :func:`read_table`."""
    if not table:
        raise ValueError(f"{owner} has no columns; give one for each axis that it is to set")
    lists: dict[str, Sequence[object]] = {}
    for name, values in table.items():
        if not isinstance(values, Sequence) or isinstance(values, str):
            raise ValueError(f"{owner}: column {name} = {values!r} must be a list of values, one for each row")
        lists[name] = values
    lengths = {name: len(values) for name, values in lists.items()}
    first, rows = next(iter(lengths.items()))
    for name, length in lengths.items():
        if length != rows:
            raise ValueError(f"{owner}: column {name} has {length} rows and column {first} has {rows}; give as many")
    if not rows:
        raise ValueError(f"{owner} has no rows; give at least one")
    if len(lives := [name for name in LIFE_AXES if name in lists]) == 1:
        raise ValueError(f"{owner} has the column {lives[0]} alone; give {' and '.join(LIFE_AXES)} together")
    columns: Columns = {}
    for name, values in sorted((axis_name(name), values) for name, values in lists.items()):
        if f"rig.{name}" not in table:
            _check_name(name, owner)
        columns[name] = _names(values, owner) if name == "pattern" else _numbers(name, values, owner)
    return columns


def _check_name(name: str, owner: str) -> None:
    try:
        check_axis_name(name)
    except ValueError as error:
        raise ValueError(f"{owner}: column {name}: {error}") from None


def _names(values: Sequence[object], owner: str) -> tuple[str, ...]:
    names: list[str] = []
    for row, value in enumerate(values, 1):
        if not isinstance(value, str) or not value:
            raise ValueError(f"{owner}: row {row}: pattern = {value!r} must be the name of a pattern")
        names.append(value)
    return tuple(names)


def _numbers(name: str, values: Sequence[object], owner: str) -> tuple[float, ...] | tuple[int, ...]:
    for row, value in enumerate(values, 1):
        if isinstance(value, bool) or not isinstance(value, int | float):
            rule = "is empty; fill it in" if value in (None, "") else f"= {value!r} must be a number"
            raise ValueError(f"{owner}: row {row}: {name} {rule}")
    numbers = np.array(values, float) + 0.0
    for at in np.flatnonzero(~np.isfinite(numbers))[:1]:
        raise ValueError(f"{owner}: row {at + 1}: {name} = {numbers[at]} must be a finite number")
    if name == "life_number":
        for at in np.flatnonzero((numbers % 1 != 0) | (numbers < 0))[:1]:
            raise ValueError(f"{owner}: row {at + 1}: {name} = {numbers[at]:g} must be a whole number, 0 or more")
    if name not in WHOLE_AXES:
        _check_rows(name, numbers, owner, (int(numbers.argmin()), int(numbers.argmax())))
        return tuple(numbers.tolist())
    fractions = np.flatnonzero(numbers != np.floor(numbers))[:1]
    _check_rows(name, numbers, owner, (*fractions.tolist(), int(numbers.argmin()), int(numbers.argmax())))
    return tuple(numbers.astype(np.int64).tolist())


def _check_rows(name: str, numbers: FloatArray, owner: str, rows: tuple[int, ...]) -> None:
    """Check the values in some rows: bounds are intervals, so the extreme values stand for all."""
    for row in rows:
        try:
            check_bounds(name, float(numbers[row]))
        except ValueError as error:
            raise ValueError(f"{owner}: row {row + 1}: {error}") from None


def _read_file(path: Path) -> dict[str, list[object]]:
    try:
        check_file(path, most_bytes=_MOST_BYTES)
        table = pq.read_table(path) if path.suffix == ".parquet" else _read_csv(path)
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file; a table is a CSV or Parquet file in the recipe's folder") from None
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror or error})") from None
    except pa.ArrowInvalid as error:
        raise ValueError(f"{path}: not a readable table ({error})") from None
    if table.num_rows > _MOST_ROWS:
        raise ValueError(f"{path}: {table.num_rows} rows, and a table has at most {_MOST_ROWS}; make several grids")
    for name in table.column_names:
        if table.column_names.count(name) > 1:
            raise ValueError(f"{path}: column {name} is there twice; remove one")
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    return {name: values if name == "pattern" else [*map(_parse_number, values)] for name, values in columns.items()}


def _read_csv(path: Path) -> pa.Table:
    options = pa_csv.ConvertOptions(
        column_types={"pattern": pa.string()},
        null_values=[""],
        strings_can_be_null=True,
        true_values=[],
        false_values=[],
    )
    return pa_csv.read_csv(path, convert_options=options)


def _parse_number(value: object) -> object:
    """Return the number in a text, or the text: a single word makes a whole column of a CSV file text."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value
