"""Sampling rates: from an option, from each column, from a column of times, or from the file."""

import re
from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import FloatArray, InputError, Note, suggestion
from sigdb.recording.files.formats.contents import DataColumn

SECONDS = {
    "": 1.0, "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6,
    "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
}  # fmt: skip

EVEN = 0.01
"""Distance from even times, in steps, up to which times are even."""

CLEARLY_EVEN = 0.1
"""Distance from an even series, in steps, up to which a series without a name is taken for times."""

MISSING = 1.75
"""Length of a step, in mean steps, from which on a sample is missing."""

MISPLACED = 0.5
"""Distance from even times, in steps, beyond which times are refused: they may belong to another sample."""


@dataclass(frozen=True, kw_only=True)
class TimeBase:
    """Rate (Hz) of the even times nearest to measured times, and the largest deviation from them, in steps."""

    sampling_rate: float
    jitter: float


def time_base(t: FloatArray, *, name: str, unit: str = "") -> TimeBase:
    """Return the sampling rate of times that rise evenly.

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
    """Return whether a series can only be times or counts of samples: it rises within a tenth of a step from even."""
    if t.size < 16 or not np.isfinite(t).all() or np.diff(t).min() <= 0:
        return False
    return _even_times(t)[1] <= CLEARLY_EVEN


def _even_times(t: FloatArray) -> tuple[float, float]:
    """Return the step of the straight line through the times, and the largest distance from it in steps."""
    i = np.arange(t.size) - (t.size - 1) / 2
    step = float(i @ (t - t.mean()) / (i @ i))
    return step, float(np.abs(t - t.mean() - step * i).max() / step)


SAME = 1e-3
"""Relative difference below which two rates are equal."""

HIGHEST = 1e9
"""Highest sampling rate in Hz; a file that states more is wrong."""


def sampling_rates(
    columns: tuple[DataColumn, ...],
    *,
    requested: float | None,
    time: DataColumn | None,
    stated: float | None,
    source: str,
) -> tuple[list[float], list[Note]]:
    """Return the rate of each column in Hz, and notes on their sources.

    Parameters
    ----------
    columns
        Series, with the rate that the file states for each, if any.
    requested
        Rate from the options; it wins.
    time
        A column of times, if there is one.
    stated
        Rate that the file states for all columns.
    source
        Name of the entry in the file that states it.

    Raises
    ------
    InputError
        If there is none, or the times are not even.
    """
    if requested is not None:
        return [requested] * len(columns), _disagreements(requested, columns, time, stated)
    general, notes = stated, [] if stated is None else [_rate_note(stated, source)]
    if time is not None:
        general, notes = _from_times(time, columns)
        if stated is not None and abs(stated - general) > SAME * general:
            notes.append(_ignored_rate(stated, f"{source} states {stated:.9g} Hz; the times were taken"))
    rates = [_checked_rate(column, column.sampling_rate or general) for column in columns]
    of_columns = sorted({column.sampling_rate for column in columns if column.sampling_rate})
    return rates, [*notes, *(_rate_note(rate, "the file") for rate in of_columns)]


def _rate_note(rate: float, source: str) -> Note:
    return Note(
        code="sampling-rate",
        text=f"sampling rate {rate:.9g} Hz from {source}",
        values={"sampling_rate": rate, "source": source},
    )


def _ignored_rate(rate: float, text: str) -> Note:
    return Note(code="ignored-sampling-rate", text=text, values={"sampling_rate": rate})


def _from_times(time: DataColumn, columns: tuple[DataColumn, ...]) -> tuple[float, list[Note]]:
    for column in columns:
        if column.values.size != time.values.size and column.sampling_rate is None:
            raise InputError(
                f"{time.name} has {time.values.size} times, channel {column.name} {column.values.size} samples; "
                "choose channels that belong to it"
            )
    base = time_base(np.asarray(time.values, dtype=float), name=time.name, unit=time.unit)
    notes = [_rate_note(base.sampling_rate, f"column {time.name}, in {time.unit or 's'}")]
    if base.jitter > EVEN:
        text = f"column {time.name} is up to {base.jitter:.2g} steps away from even times, which were taken"
        notes.append(Note(code="uneven-times", text=text, values={"column": time.name, "steps": base.jitter}))
    return base.sampling_rate, notes


def _disagreements(
    requested: float, columns: tuple[DataColumn, ...], time: DataColumn | None, stated: float | None
) -> list[Note]:
    """Return notes on other rates in the file; times with missing samples are refused in this case too."""
    rates = {column.sampling_rate for column in columns if column.sampling_rate} | ({stated} if stated else set())
    if time is not None:
        rates.add(time_base(np.asarray(time.values, dtype=float), name=time.name, unit=time.unit).sampling_rate)
    return [
        _ignored_rate(rate, f"the file states {rate:.9g} Hz; the given {requested:.9g} Hz was taken")
        for rate in sorted(rates)
        if abs(rate - requested) > SAME * requested
    ]


def _checked_rate(column: DataColumn, rate: float | None) -> float:
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
) -> tuple[DataColumn | None, tuple[DataColumn, ...], tuple[Note, ...]]:
    """Return the column of times, if there is one, the other columns, and notes.

    Parameters
    ----------
    columns
        All columns of the file.
    time
        Name of the column of times; False if there is none; None to find it. It is then found by its name; among
        columns without names it is the first column if that rises evenly.
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
        times = [column for column in columns if column.name == time]
        if not times:
            raise InputError(f"no column {time!r} with the time{suggestion(time, [column.name for column in columns])}")
    else:
        times = [column for column in columns if named and _TIME.fullmatch(column.name.lower())]
    if len(times) > 1:
        raise InputError(f"both {times[0].name} and {times[1].name} may hold the time; give time='{times[0].name}'")
    if times:
        return _with_unit(times[0]), _without(columns, times[0]), ()
    return _unnamed(columns) if not named else (None, columns, ())


def _unnamed(columns: tuple[DataColumn, ...]) -> tuple[DataColumn | None, tuple[DataColumn, ...], tuple[Note, ...]]:
    first = columns[0]
    values = first.values.astype(float)
    if not rises_evenly(values):
        return None, columns, ()
    rest = _without(columns, first)
    if np.all(np.diff(values) == 1):
        text = f"{first.name} counts samples and was left out"
        return None, rest, (Note(code="sample-count-left-out", text=text, values={"column": first.name}),)
    text = f"{first.name} rises evenly and was taken as the time in seconds; time=false if it is not"
    return first, rest, (Note(code="time-assumed", text=text, values={"column": first.name}),)


def _with_unit(column: DataColumn) -> DataColumn:
    """Return the column with its unit, which may be part of its name."""
    end = re.split(r"[ _]", column.name.lower())[-1]
    return replace(column, unit=end) if not column.unit and end in SECONDS else column


def _without(columns: tuple[DataColumn, ...], left_out: DataColumn) -> tuple[DataColumn, ...]:
    return tuple(column for column in columns if column is not left_out)
