"""Which column of a file holds the time."""

import re
from dataclasses import replace

import numpy as np

from sigdb.core.errors import InputError, suggestion
from sigdb.measurement.readers.contents import Column
from sigdb.measurement.time_base import SECONDS, rises_evenly

_TIME = re.compile(r"(?:.*[./\s])?(t|time|times|zeit|temps|tiempo|x_value|timestamp|elapsed)[ _]?(s|sec|ms|us|ns|min)?")


def split_time(
    columns: tuple[Column, ...], *, time: str | bool | None, named: bool
) -> tuple[Column | None, tuple[Column, ...], tuple[str, ...]]:
    """The column of times, if there is one, the other columns, and what was handled.

    Parameters
    ----------
    time
        Its name; False if there is none; None to find it by its name, or, among columns without names, as a first
        one that rises evenly.
    named
        Whether the file names its columns.

    Raises
    ------
    InputError
        If there is no such column, or there are two.
    """
    if time is False or len(columns) == 1:
        return None, columns, ()
    if isinstance(time, str):
        found = [column for column in columns if column.name == time]
        if not found:
            raise InputError(f"no column {time!r} with the time{suggestion(time, [one.name for one in columns])}")
    else:
        found = [column for column in columns if named and _TIME.fullmatch(column.name.lower())]
    if len(found) > 1:
        raise InputError(f"both {found[0].name} and {found[1].name} may hold the time; give time='{found[0].name}'")
    if found:
        return _with_unit(found[0]), _without(columns, found[0]), ()
    return _unnamed(columns) if not named else (None, columns, ())


def _unnamed(columns: tuple[Column, ...]) -> tuple[Column | None, tuple[Column, ...], tuple[str, ...]]:
    first = columns[0]
    values = first.values.astype(float)
    if not rises_evenly(values):
        return None, columns, ()
    rest = _without(columns, first)
    if np.all(np.diff(values) == 1):
        return None, rest, (f"{first.name} counts samples and was left out",)
    return first, rest, (f"{first.name} rises evenly and was taken as the time in seconds; time=false if it is not",)


def _with_unit(column: Column) -> Column:
    """The column with its unit, which may stand in its name."""
    end = re.split(r"[ _]", column.name.lower())[-1]
    return replace(column, unit=end) if not column.unit and end in SECONDS else column


def _without(columns: tuple[Column, ...], one: Column) -> tuple[Column, ...]:
    return tuple(column for column in columns if column is not one)
