"""Sampling rates: from an option, from a column of times, from each column, or from the file."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import DataColumn
from sigdb.recording.files.time_base import EVEN, refuse_coarse
from sigdb.recording.files.time_columns import SAME, TimeColumn

HIGHEST = 1e9
"""Highest sampling rate in Hz; a file that states more is wrong."""

LOWEST = 1.0
"""Rate in Hz that stands for none: an increment of 1 is the default of many programs."""

LATEST = 1e12
"""Latest start in s, 30 000 years after the origin of a file's times."""

LOWEST_ASSUMED = 100.0
"""Lowest rate in Hz from times without a unit; slower times are hardly in s."""


@dataclass(frozen=True, kw_only=True)
class SeriesTiming:
    """Sampling rate of a series in Hz, its source in words, and the time of its first sample in s, if stated."""

    sampling_rate: float
    source: str
    start: float | None = None


def series_timing(
    columns: Sequence[DataColumn],
    *,
    requested: float | None,
    times: Mapping[str, TimeColumn],
    stated: float | None,
    source: str,
    hint: str = "",
) -> tuple[list[SeriesTiming], list[Note]]:
    """Return the rate and start of each column, and notes on their sources.

    Parameters
    ----------
    columns
        Series, with the rate that the file states for each, if any.
    requested
        Rate from the options; it wins.
    times
        The column of times of each series by its name, if there is one; it wins over rates in the file.
    stated
        Rate that the file states for all columns.
    source
        Name of the entry in the file that states it.
    hint
        Further remedy where no rate is stated.

    Raises
    ------
    InputError
        If there is none, or it is none that a vibration is sampled at.
    """
    timing: list[SeriesTiming] = []
    notes: list[Note] = []
    for column in columns:
        time = times.get(column.name)
        rate, origin, new = _rate_of(column, time, requested=requested, stated=stated, source=source, hint=hint)
        start = column.start if time is None or column.start is not None else _start(time, rate)
        if start is not None and not abs(start) < LATEST:
            raise InputError(f"channel {column.name}: the file states a start of {start:.3g} s, which is no time")
        timing.append(SeriesTiming(sampling_rate=rate, source=origin, start=start))
        notes += new
    return timing, list({note.text: note for note in notes}.values())


def _start(time: TimeColumn, rate: float) -> float:
    """Return the time of the first sample, s; without a unit the rate is that of the times."""
    return time.base.start if time.unit else time.base.start * time.base.sampling_rate / rate


def _rate_of(
    column: DataColumn,
    time: TimeColumn | None,
    *,
    requested: float | None,
    stated: float | None,
    source: str,
    hint: str,
) -> tuple[float, str, list[Note]]:
    in_file = {}
    if stated is not None:
        in_file[source] = stated
    if column.sampling_rate is not None:
        in_file[column.rate_from] = column.sampling_rate
    if requested is not None:
        if time is not None:
            in_file[f"column {time.name}"] = time.base.sampling_rate
        rates = sorted({rate for rate in in_file.values() if abs(rate - requested) > SAME * requested})
        notes = [
            _ignored(rate, f"the file states {rate:.9g} Hz; the given {requested:.9g} Hz was taken") for rate in rates
        ]
        return requested, "sampling_rate", notes
    if time is not None:
        rate = time.base.sampling_rate
        refuse_times(time)
        others = {entry: other for entry, other in in_file.items() if abs(other - rate) > SAME * rate}
        notes = [
            _ignored(other, f"{entry} states {other:.9g} Hz; the times were taken") for entry, other in others.items()
        ]
        return rate, f"column {time.name}", [*_time_notes(time), *notes]
    if column.sampling_rate is not None:
        rate = _checked(column, column.sampling_rate, column.rate_from)
        notes = [] if stated is None or abs(stated - rate) <= SAME * rate else [
            _ignored(stated, f"{source} states {stated:.9g} Hz; {column.name} has its own rate")
        ]  # fmt: skip
        return rate, column.rate_from, [_rate_note(rate, column.rate_from), *notes]
    if stated is not None:
        rate = _checked(column, stated, source)
        return rate, source, [_rate_note(rate, source)]
    raise InputError(
        f"channel {column.name}: the file does not state the sampling rate; give sampling_rate, in Hz, or the "
        f"column of times (time){hint}"
    )


def without_slow(
    columns: tuple[DataColumn, ...], wanted: Collection[str | None]
) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns without those whose own rate no vibration is sampled at, and notes on these.

    Parameters
    ----------
    columns
        Columns with the rates that the file states for each.
    wanted
        Names of columns that are kept at any rate. If no column has a higher rate, all are kept.
    """
    rates = {column.name: column.sampling_rate for column in columns if column.sampling_rate is not None}
    if not any(rate > LOWEST for rate in rates.values()):
        return columns, []
    slow = {name: rate for name, rate in rates.items() if not rate > LOWEST and name not in wanted}
    notes = [
        Note(
            code="channel-left-out",
            text=f"{name} was left out: it has {rate:.6g} Hz, at which no vibration is sampled",
            values={"channel": name, "sampling_rate": rate},
        )
        for name, rate in slow.items()
    ]
    return tuple(column for column in columns if column.name not in slow), notes


def refuse_times(time: TimeColumn) -> None:
    """Refuse times that no vibration is sampled at."""
    rate, base = time.base.sampling_rate, time.base
    if not time.unit and rate < LOWEST_ASSUMED:
        raise InputError(
            f"column {time.name} has no unit and rises by {1 / rate:.6g} a sample, which is {rate:.6g} Hz if it is in "
            f"s; give its unit by units, such as units={{{time.name!r}: 'ms'}}, or sampling_rate"
        )
    if not LOWEST < rate <= HIGHEST:
        raise InputError(
            f"column {time.name}, in {time.unit or 's'}, gives a sampling rate of {rate:.6g} Hz, at which no vibration "
            "is sampled; give its unit by units, or sampling_rate"
        )
    refuse_coarse(base, name=time.name)


def _time_notes(time: TimeColumn) -> list[Note]:
    base = time.base
    unit = f"in {time.unit}" if time.unit else "taken as s, since its unit is not stated"
    notes = [_rate_note(base.sampling_rate, f"column {time.name}, {unit}")]
    if base.resolution:
        text = (
            f"column {time.name} is rounded to {base.resolution:.3g} s; the rate is the slope of its times, within "
            f"{100 * base.uncertainty:.2g} %; give sampling_rate if it is known"
        )
        values: dict[str, str | float] = {"column": time.name, "resolution": base.resolution}
        notes.append(Note(code="rounded-times", text=text, values=values | {"uncertainty": base.uncertainty}))
    elif base.jitter > EVEN:
        text = f"column {time.name} is up to {base.jitter:.2g} steps away from even times, which were taken"
        notes.append(Note(code="uneven-times", text=text, values={"column": time.name, "steps": base.jitter}))
    return notes


def _rate_note(rate: float, source: str) -> Note:
    return Note(
        code="sampling-rate",
        text=f"sampling rate {rate:.9g} Hz from {source}",
        values={"sampling_rate": rate, "source": source},
    )


def _ignored(rate: float, text: str) -> Note:
    return Note(code="ignored-sampling-rate", text=text, values={"sampling_rate": rate})


def _checked(column: DataColumn, rate: float, source: str) -> float:
    if rate == LOWEST:
        raise InputError(
            f"channel {column.name}: {source} states a sampling rate of 1 Hz, which is the default of many programs "
            "and stands for none; give sampling_rate, in Hz, or the column of times (time)"
        )
    if not LOWEST < rate <= HIGHEST:
        raise InputError(
            f"channel {column.name}: {source} states a sampling rate of {rate:.3g} Hz, at which no vibration is "
            "sampled; give sampling_rate"
        )
    return float(rate)
