"""The sampling rate of each channel: as given, as stated with it, by a column of times, or as stated for the file."""

import re
from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import FloatArray, InputError, suggestion
from sigdb.recording.files.formats.contents import DataColumn

SECONDS = {
    "": 1.0, "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6,
    "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
}  # fmt: skip

EVEN = 0.01
"""Times within this part of a step of even ones are even."""

CLEARLY_EVEN = 0.1
"""A series without a name within this part of a step of an even one is taken for times."""

MISSING = 1.75
"""A step longer than so many mean ones leaves a sample out."""

MISPLACED = 0.5
"""Times further than this part of a step from even ones are refused: they may belong to another sample."""


@dataclass(frozen=True, kw_only=True)
class TimeBase:
    """The rate (Hz) of the even times nearest to those given, and the largest deviation from them, in steps."""

    sampling_rate: float
    jitter: float


def time_base(t: FloatArray, *, name: str, unit: str = "") -> TimeBase:
    """The sampling rate of times that rise evenly.

    The step is the slope of the straight line through the times by least squares; the deviation is from that line.

    Raises
    ------
    InputError
        If the times do not rise, leave samples out, or are out of place by more than half a step.

    Examples
    --------
    >>> import numpy as np
    >>> round(time_base(np.arange(100) / 12_800, name="t").sampling_rate, 6)
    12800.0
    """
    if unit.lower() not in SECONDS:
        raise InputError(f"column {name} has the unit {unit!r}, not one of time; give time=false or sampling_rate")
    if t.size < 3 or not np.isfinite(t).all():
        raise InputError(f"column {name} must hold three times or more, none of them missing; or give sampling_rate")
    steps = np.diff(t)
    mean = float(steps.mean())
    if mean <= 0 or steps.min() < 0:
        at = int(np.argmin(steps)) + 1
        raise InputError(f"column {name} must rise, and does not after sample {at}; mend it, or give time=false")
    if steps.max() > MISSING * mean:
        at = int(np.argmax(steps)) + 1
        raise InputError(
            f"column {name} leaps by {steps.max() / np.median(steps):.3g} steps after sample {at}: samples are missing "
            "there; cut the recording in two"
        )
    step, jitter = _even_times(t)
    if jitter > MISPLACED:
        raise InputError(
            f"column {name} is up to {jitter:.3g} steps away from even times; resample it, or give sampling_rate and "
            "time=false if the times are wrong"
        )
    return TimeBase(sampling_rate=1 / (step * SECONDS[unit.lower()]), jitter=jitter)


def rises_evenly(t: FloatArray) -> bool:
    """Whether a series can only be times or counts of samples: it rises, a tenth of a step from even at most."""
    if t.size < 16 or not np.isfinite(t).all() or np.diff(t).min() <= 0:
        return False
    return _even_times(t)[1] <= CLEARLY_EVEN


def _even_times(t: FloatArray) -> tuple[float, float]:
    """Step of the straight line through the times, and the largest distance from it in steps."""
    i = np.arange(t.size) - (t.size - 1) / 2
    step = float(i @ (t - t.mean()) / (i @ i))
    return step, float(np.abs(t - t.mean() - step * i).max() / step)


SAME = 1e-3
"""Rates nearer than this part are not told as different."""

HIGHEST = 1e9
"""Hz; a file that states more is wrong."""


def sampling_rates(
    columns: tuple[DataColumn, ...], *, given: float | None, time: DataColumn | None, stated: float | None, source: str
) -> tuple[list[float], list[str]]:
    """Rate of each column, Hz, and where they are from.

    Parameters
    ----------
    columns
        Series, with the rate that the file states for each, if any.
    given
        By the user; it wins.
    time
        A column of times, if there is one.
    stated
        By the file for all.
    source
        What in the file states it.

    Raises
    ------
    InputError
        If there is none, or the times are not even.
    """
    if given is not None:
        return [given] * len(columns), _disagreeing(given, columns, time, stated)
    general, notes = stated, [] if stated is None else [f"sampling rate {stated:.9g} Hz from {source}"]
    if time is not None:
        general, notes = _from_times(time, columns)
        if stated is not None and abs(stated - general) > SAME * general:
            notes.append(f"{source} states {stated:.9g} Hz; the times were taken")
    rates = [_known(column, column.sampling_rate or general) for column in columns]
    own = sorted({column.sampling_rate for column in columns if column.sampling_rate})
    return rates, [*notes, *(f"sampling rate {rate:.9g} Hz from the file" for rate in own)]


def _from_times(time: DataColumn, columns: tuple[DataColumn, ...]) -> tuple[float, list[str]]:
    for column in columns:
        if column.values.size != time.values.size and column.sampling_rate is None:
            raise InputError(
                f"{time.name} has {time.values.size} times, channel {column.name} {column.values.size} samples; "
                "choose channels that belong to it"
            )
    base = time_base(np.asarray(time.values, dtype=float), name=time.name, unit=time.unit)
    notes = [f"sampling rate {base.sampling_rate:.9g} Hz from column {time.name}, in {time.unit or 's'}"]
    if base.jitter > EVEN:
        notes.append(f"column {time.name} is up to {base.jitter:.2g} steps away from even times, which were taken")
    return base.sampling_rate, notes


def _disagreeing(
    given: float, columns: tuple[DataColumn, ...], time: DataColumn | None, stated: float | None
) -> list[str]:
    """What the file says otherwise; times with samples missing are refused also where a rate is given."""
    rates = {column.sampling_rate for column in columns if column.sampling_rate} | ({stated} if stated else set())
    if time is not None:
        rates.add(time_base(np.asarray(time.values, dtype=float), name=time.name, unit=time.unit).sampling_rate)
    return [
        f"the file states {rate:.9g} Hz; the given {given:.9g} Hz was taken"
        for rate in sorted(rates)
        if abs(rate - given) > SAME * given
    ]


def _known(column: DataColumn, rate: float | None) -> float:
    if rate is None:
        raise InputError(
            f"channel {column.name}: the file does not state the sampling rate; give sampling_rate, in Hz, or the "
            "column of times by time"
        )
    if not 0 < rate <= HIGHEST:
        raise InputError(f"channel {column.name}: the file states a sampling rate of {rate:.3g} Hz; give sampling_rate")
    return float(rate)


_TIME = re.compile(r"(?:.*[./\s])?(t|time|times|zeit|temps|tiempo|x_value|timestamp|elapsed)[ _]?(s|sec|ms|us|ns|min)?")


def split_time(
    columns: tuple[DataColumn, ...], *, time: str | bool | None, named: bool
) -> tuple[DataColumn | None, tuple[DataColumn, ...], tuple[str, ...]]:
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


def _unnamed(columns: tuple[DataColumn, ...]) -> tuple[DataColumn | None, tuple[DataColumn, ...], tuple[str, ...]]:
    first = columns[0]
    values = first.values.astype(float)
    if not rises_evenly(values):
        return None, columns, ()
    rest = _without(columns, first)
    if np.all(np.diff(values) == 1):
        return None, rest, (f"{first.name} counts samples and was left out",)
    return first, rest, (f"{first.name} rises evenly and was taken as the time in seconds; time=false if it is not",)


def _with_unit(column: DataColumn) -> DataColumn:
    """The column with its unit, which may stand in its name."""
    end = re.split(r"[ _]", column.name.lower())[-1]
    return replace(column, unit=end) if not column.unit and end in SECONDS else column


def _without(columns: tuple[DataColumn, ...], one: DataColumn) -> tuple[DataColumn, ...]:
    return tuple(column for column in columns if column is not one)
