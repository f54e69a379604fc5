"""Columns of times among the columns of a file."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sigdb.core import FloatArray, InputError, Note, suggestion
from sigdb.recording.files.formats.contents import DataColumn
from sigdb.recording.files.ramps import ramp_kind
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.files.time_base import TimeBase, time_base, unit_of_times
from sigdb.recording.files.time_names import TimeName, seconds_of, time_name

SAME = 1e-3
"""Relative difference below which two rates are equal."""

CLEARLY_EVEN = 0.1
"""Distance from even times, in steps, up to which a ramp without a name is taken for times."""

_MOSTLY = 0.9
"""Share of steps that rise in a column whose short name makes it the time."""


@dataclass(frozen=True, kw_only=True)
class TimeColumn:
    """A column of times.

    Attributes
    ----------
    name, unit
        Its name, and the unit of its times; the latter is empty where it is not stated and s is assumed.
    size
        Number of its times.
    base
        Even times nearest to it.
    """

    name: str
    unit: str
    size: int
    base: TimeBase

    def agrees(self, other: "TimeColumn") -> bool:
        """Return whether two columns of times give one rate."""
        tolerance = SAME + self.base.uncertainty + other.base.uncertainty
        return abs(self.base.sampling_rate / other.base.sampling_rate - 1) <= tolerance


def time_columns(
    columns: Sequence[DataColumn], settings: RecordingSettings, *, named: bool
) -> tuple[tuple[TimeColumn, ...], list[Note]]:
    """Return the columns of times, and notes.

    The setting ``time`` names the column, or is False if there is none. Otherwise columns are found by name and unit,
    and among columns without names the first is the time if it rises evenly.

    Raises
    ------
    InputError
        If there is no such column, or its times are not even.
    """
    if settings.time is False:
        return (), []
    if isinstance(settings.time, str):
        chosen = [column for column in columns if column.name == settings.time]
        if not chosen:
            names = [column.name for column in columns]
            raise InputError(f"no column {settings.time!r} with the time{suggestion(settings.time, names)}")
        column = chosen[0]
        unit = _stated_unit(column, settings)
        candidates = [replace(column, unit=time_name(column.name, unit).unit or unit)]
    else:
        candidates = _by_name(columns, settings, named=named)
    notes: list[Note] = []
    if not candidates and settings.time is None:
        candidates, notes = _first_ramp(columns, settings, named=named)
    times = []
    for column in candidates:
        t = np.asarray(column.values, dtype=float)
        if len(candidates) > 1 and t.size and np.ptp(t) == 0:
            text = f"{column.name} is constant, so not the time, and was left out"
            notes.append(Note(code="second-time-left-out", text=text, values={"column": column.name}))
            continue
        time, unit_notes = _time_column(column, t)
        times.append(time)
        notes += unit_notes
    return tuple(times), notes


def _time_column(column: DataColumn, t: FloatArray) -> tuple[TimeColumn, list[Note]]:
    unit = column.unit
    notes: list[Note] = []
    if t.size and np.isfinite(t).all() and seconds_of(unit) is not None:
        unit, notes = unit_of_times(t, name=column.name, unit=unit)
    base = time_base(t, name=column.name, unit=unit)
    return TimeColumn(name=column.name, unit=unit, size=t.size, base=base), notes


def _stated_unit(column: DataColumn, settings: RecordingSettings) -> str:
    """Return the unit of a column; the settings may state that of a column of times too."""
    return settings.units.get(column.name, column.unit) if isinstance(settings.units, dict) else column.unit


def _by_name(columns: Sequence[DataColumn], settings: RecordingSettings, *, named: bool) -> list[DataColumn]:
    """Return the columns that hold times by their names and units; the surest of them."""
    candidates: list[tuple[TimeName, DataColumn]] = []
    for column in columns:
        if column.name == settings.tacho or not (named and column.named) or column.values.dtype.kind not in "biuf":
            continue
        meaning = time_name(column.name, _stated_unit(column, settings))
        if meaning.kind not in ("other", "count") and _holds_times(meaning, column.numbers):
            candidates.append((meaning, replace(column, unit=meaning.unit)))
    sure = [column for meaning, column in candidates if meaning.kind != "perhaps" or meaning.unit]
    return sure or [column for _, column in candidates]


def _holds_times(meaning: TimeName, x: FloatArray) -> bool:
    ramp = ramp_kind(x)
    if ramp == "counts":
        return bool(meaning.unit)
    if meaning.kind == "short":
        steps = np.diff(x)
        return ramp == "rises" or bool(steps.size and np.count_nonzero(steps > 0) > _MOSTLY * steps.size)
    return meaning.kind == "time" or ramp == "rises"


def _first_ramp(
    columns: Sequence[DataColumn], settings: RecordingSettings, *, named: bool
) -> tuple[list[DataColumn], list[Note]]:
    """Return the first column, or first column of a matrix, if it has no name and rises evenly."""
    for i, column in enumerate(columns):
        if not _is_nameless(column, named=named) or (i and (not named or column.named)):
            continue
        x = column.numbers
        if column.name != settings.tacho and rises_evenly(x) and np.any(x != np.round(x)):
            text = f"{column.name} rises evenly and was taken as the time in seconds; time=false if it is not"
            return [replace(column, unit="")], [Note(code="time-assumed", text=text, values={"column": column.name})]
        if not column.named:
            break
    return [], []


def _is_nameless(column: DataColumn, *, named: bool) -> bool:
    """Return whether a column of numbers has no name, or that of an index."""
    if column.values.dtype.kind not in "biuf":
        return False
    by_reader = not named or not column.named or re.fullmatch(r"column\d*", column.name) is not None
    return by_reader or time_name(column.name, column.unit).kind == "count"


def rises_evenly(t: FloatArray) -> bool:
    """Return whether a series can only be times or counts of samples: it rises within a tenth of a step from even."""
    if t.size < 16 or not np.isfinite(t).all() or np.diff(t).min() <= 0:
        return False
    i = np.arange(t.size) - (t.size - 1) / 2
    centred = t - t.mean()
    step = float(i @ centred / (i @ i))
    return bool(np.abs(centred - step * i).max() <= CLEARLY_EVEN * step)


def times_of(
    columns: Sequence[DataColumn], times: Sequence[TimeColumn], *, requested: float | None
) -> tuple[Mapping[str, TimeColumn], list[Note]]:
    """Return the times of each column by its name, and notes on columns of times that are not needed.

    With several columns of times, a column has those of its length and, if these disagree, of its group or name.

    Raises
    ------
    InputError
        If a column without a rate has no times, or times that disagree.
    """
    by_name: dict[str, TimeColumn] = {}
    for column in columns:
        alike = [time for time in times if time.size == column.values.size]
        if times and not alike and column.sampling_rate is None and requested is None:
            raise InputError(
                f"{times[0].name} has {times[0].size} times, channel {column.name} {column.values.size} samples; "
                "choose channels that belong to it"
            )
        if alike:
            by_name[column.name] = _nearest(column, alike, requested=requested)
    used = {time.name for time in by_name.values()}
    notes = [
        Note(
            code="second-time-left-out",
            text=f"{time.name} is another column of times and was left out",
            values={"column": time.name},
        )
        for time in times
        if time.name not in used
    ]
    return by_name, notes


def _nearest(column: DataColumn, times: list[TimeColumn], *, requested: float | None) -> TimeColumn:
    of_group = [time for time in times if _group(time.name) == _group(column.name)] or times
    of_name = [time for time in of_group if column.name.casefold() in time.name.casefold()]
    for chosen in (times, of_group, of_name):
        if chosen and all(a.agrees(b) for a, b in pairwise(chosen)):
            return of_group[0] if chosen is times else chosen[0]
    if requested is not None:
        return min(of_group, key=lambda time: abs(time.base.sampling_rate - requested))
    first, second = of_group[0], next(time for time in of_group[1:] if not time.agrees(of_group[0]))
    raise InputError(
        f"both {first.name} and {second.name} may hold the time, and they disagree: {first.base.sampling_rate:.6g} and "
        f"{second.base.sampling_rate:.6g} Hz; give time={first.name!r}"
    )


def _group(name: str) -> str:
    return re.split(r"[./](?=[^./]*$)", name)[0] if re.search(r"[./]", name) else ""
