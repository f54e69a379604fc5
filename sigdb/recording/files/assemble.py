"""Assembly of a recording from the columns of a file: names, time, rates, scale, units, missing samples."""

from collections import Counter
from dataclasses import replace
from hashlib import blake2b

import numpy as np

from sigdb.core import FloatArray, InputError, Note, suggestion
from sigdb.recording.files.formats.contents import Contents, DataColumn
from sigdb.recording.files.formats.stated_rates import SPEED_TO_CONFIRM
from sigdb.recording.files.formats.text.units import name_and_unit
from sigdb.recording.files.missing_samples import fill_gaps
from sigdb.recording.files.ramps import Ramp, ramp_kind, without_spectra
from sigdb.recording.files.sampling_rates import SeriesTiming, series_timing, without_slow
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.files.shared_time import share_time
from sigdb.recording.files.time_columns import time_columns, times_of
from sigdb.recording.files.time_names import seconds_of, time_name
from sigdb.recording.overview.overview_table import fault_notes, is_constant
from sigdb.recording.recording import Channel, Recording

SPEED_RANGE = 0.2
"""Relative difference between the given speed and that of the file up to which they agree."""

RARE = 0.05
"""Share of the steps of a count of samples up to which leaps are missing samples."""

LATEST = 1e8
"""Start in s above which times count from 1970; the time axis then begins at the first sample."""

LARGEST = 1e30
"""Largest number of a channel in any unit; powers of it, as in moments, are finite."""


def assemble(
    contents: Contents,
    settings: RecordingSettings,
    *,
    source: str,
    seek_ramps: bool = True,
    seek_faults: bool = True,
) -> Recording:
    """Return the recording that a file and its settings describe.

    Parameters
    ----------
    contents
        The columns of the file.
    settings
        Settings of reading.
    source
        Name of the file.
    seek_ramps, seek_faults
        Whether ramps are left out and faults of samples noted. For a part of a file, the file's first part decides on
        ramps.

    Raises
    ------
    InputError
        If they describe none.
    """
    named, notes = named_columns(contents, settings)
    named, other_notes = _over_time(named, settings)
    times, time_notes = time_columns(named, settings, named=contents.named or bool(settings.names))
    columns = _chosen(named, settings, tuple(time.name for time in times))
    _refuse_unknown(columns, settings, tuple(time.name for time in times))
    if seek_ramps and not settings.channels:
        sure = {column.values.size for column in contents.columns if column.abscissa != "time"}
        columns, spectra = without_spectra(columns, settings.tacho, sure | {time.size for time in times})
        other_notes = [*other_notes, *spectra]
    slow: list[Note] = []
    if settings.channels is None and settings.sampling_rate is None and not times:
        columns, slow = without_slow(columns, (settings.tacho,))
    columns, ramps = _without_ramps(columns, settings) if seek_ramps else (columns, [])
    pulses = tuple(column for column in columns if _holds_pulse_times(column, settings))
    columns = tuple(column for column in columns if not _holds_pulse_times(column, settings))
    if not columns:
        raise InputError(f"holds no channel besides the pulse times in {pulses[0].name}")
    series = [_number(column) for column in columns]
    times_by_name, other_times = times_of(columns, times, requested=settings.sampling_rate)
    timing, rate_notes = series_timing(
        columns,
        requested=settings.sampling_rate,
        times=times_by_name,
        stated=contents.sampling_rate,
        source=contents.rate_from,
        hint="".join(f" ({note.text})" for note in (*ramps, *contents.notes) if note.code in _HINTS)[:_LONGEST_HINT],
    )
    names = [column.name for column in columns]
    series, starts, cut_notes = share_time(series, names, timing)
    origin = min(starts) if min(starts) > LATEST else 0.0
    channels, sample_notes = _channels(series, columns, timing, [start - origin for start in starts], settings)
    everything = (
        *_reader_notes(contents, settings), *notes, *other_notes, *time_notes, *other_times, *slow, *ramps, *rate_notes,
        *cut_notes, *sample_notes,
        *((*fault_notes(channels, tacho=settings.tacho), *_same_channels(channels)) if seek_faults else ()),
    )  # fmt: skip
    return Recording(
        source=source, channels=channels, tacho=settings.tacho, pulses_per_rev=settings.pulses_per_rev,
        pulse_times=pulse_times_of(pulses[0], origin, settings) if pulses else None,
        tacho_kind=settings.tacho_kind, threshold=settings.threshold, hysteresis=settings.hysteresis,
        edge=settings.edge, ratio=settings.ratio, teeth=settings.teeth,
        speed_rpm=contents.speed_rpm if settings.speed_rpm is None else settings.speed_rpm, torque=settings.torque,
        load=settings.load,
        zero_time=origin or contents.zero_time,
        notes=tuple({note.text: note for note in everything}.values()),
    )  # fmt: skip


def named_columns(contents: Contents, settings: RecordingSettings) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns with the names from the settings, all different."""
    columns = contents.columns
    if settings.names is not None:
        if len(settings.names) != len(columns):
            raise InputError(
                f"names gives {len(settings.names)} names, the file holds {len(columns)} columns; name all"
            )
        columns = tuple(
            replace(column, name=name, named=True) for column, name in zip(columns, settings.names, strict=True)
        )
    columns = tuple(
        replace(column, name=_clean(column.name), unit=_clean(column.unit), rate_from=_clean(column.rate_from))
        for column in columns
    )
    columns = tuple(map(with_unit, columns))
    taken: Counter[str] = Counter()
    renamed, notes = [], []
    used = {column.name for column in columns}
    for column in columns:
        taken[column.name] += 1
        name = column.name
        while taken[column.name] > 1 and name in used:
            name = f"{column.name} ({taken[column.name]})"
            taken[column.name] += name in used
        if name != column.name:
            used.add(name)
            text = f"a second column {column.name} is called {name}"
            notes.append(Note(code="renamed-column", text=text, values={"column": column.name, "name": name}))
        renamed.append(replace(column, name=name))
    return tuple(renamed), notes


def with_unit(column: DataColumn) -> DataColumn:
    """Return a column with the unit that stands in brackets at the end of its name, if no other is stated."""
    if column.unit or not column.name.endswith(("]", ")")):
        return column
    name, unit = name_and_unit(column.name)
    return replace(column, name=name, unit=unit)


def _clean(text: str) -> str:
    """Return printable text of a bounded length."""
    return "".join(sign for sign in text.strip()[:100] if sign.isprintable())


def _over_time(
    columns: tuple[DataColumn, ...], settings: RecordingSettings
) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns whose samples follow each other in time, and notes on the others, such as spectra."""
    others = [column for column in columns if column.abscissa != "time"]
    wanted = {*(settings.channels or ()), settings.tacho}
    for column in others:
        if column.name in wanted or len(others) == len(columns):
            raise InputError(
                f"channel {column.name} runs over {column.abscissa}, not over time, as a spectrum does; export the "
                "signal over time"
            )
    notes = [
        Note(
            code="not-over-time",
            text=f"{column.name} runs over {column.abscissa}, not over time, and was left out",
            values={"column": column.name, "abscissa": column.abscissa},
        )
        for column in others
    ]
    return tuple(column for column in columns if column.abscissa == "time"), notes


def _chosen(
    columns: tuple[DataColumn, ...], settings: RecordingSettings, times: tuple[str, ...]
) -> tuple[DataColumn, ...]:
    """Return the columns that the settings choose, or all that are no times."""
    by_name = {column.name: column for column in columns if column.name not in times}
    if settings.channels is None:
        return tuple(by_name.values())
    wanted = list(settings.channels)
    if settings.tacho is not None and settings.tacho not in wanted:
        wanted.append(settings.tacho)
    for name in wanted:
        if name in times:
            raise InputError(f"channels names {name!r}, which is the column of times; leave it out of channels")
        if name not in by_name:
            raise InputError(f"no channel {name!r}{suggestion(name, by_name)}")
    return tuple(by_name[name] for name in dict.fromkeys(wanted))


def _refuse_unknown(columns: tuple[DataColumn, ...], settings: RecordingSettings, times: tuple[str, ...]) -> None:
    """Refuse units, scales and a tacho of channels that do not exist."""
    names = [column.name for column in columns]
    if not names:
        raise InputError(f"holds no channel besides the times in {times[0]}" if times else "holds no channel")
    for key, by_channel in (("units", settings.units), ("scale", settings.scale)):
        for name in by_channel if isinstance(by_channel, dict) else ():
            if name not in names and not (key == "units" and name in times):
                raise InputError(f"{key} names {name!r}, which is no channel{suggestion(name, names)}")
    if settings.tacho is not None and settings.tacho not in names:
        raise InputError(f"tacho names {settings.tacho!r}, which is no channel{suggestion(settings.tacho, names)}")


_HINTS = {"ramp-left-out", "sample-count-left-out", "clock-column-left-out"}
_LONGEST_HINT = 200
"""Codes of notes on columns that may be meant as times, and the longest text of them in a refusal."""

_RAMPS: dict[Ramp, str] = {
    "counts": "counts samples",
    "rises": "only rises, as times, counts and angles do,",
    "falls": "only falls, as a ramp does,",
    "repeats": "is a ramp that begins again and again, as counts and angles do,",
}


def _without_ramps(
    columns: tuple[DataColumn, ...], settings: RecordingSettings
) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns that are no ramps, and notes on the others; a tacho of pulse times or counts may be a ramp.

    Raises
    ------
    InputError
        If a ramp is chosen by name, is a tacho with pulses, or if all columns are ramps.
    """
    kept, notes = [], []
    for column in columns:
        is_tacho = column.name == settings.tacho
        ramp = ramp_kind(column.numbers) if column.values.dtype.kind in "biuf" else ""
        if not ramp or (is_tacho and (settings.tacho_kind != "waveform" or ramp == "repeats")):
            kept.append(column)
            continue
        _refuse_missing_counts(column, ramp)
        code = "sample-count-left-out" if ramp == "counts" else "ramp-left-out"
        text = f"{column.name} {_RAMPS[ramp]}"
        if is_tacho:
            raise InputError(f"the tacho {text.rstrip(',')}; give tacho_kind, 'pulse-times', 'counts' or 'angle'")
        if column.name in (settings.channels or ()):
            raise InputError(f"channel {text.rstrip(',')}, so it is no vibration; leave it out of channels")
        notes.append(Note(code=code, text=f"{text} and was left out", values={"column": column.name}))
    if not kept or (len(kept) == 1 and kept[0].name == settings.tacho and notes):
        raise InputError(f"holds no vibration: {'; '.join(note.text for note in notes[:4])}")
    return tuple(kept), notes


def _refuse_missing_counts(column: DataColumn, ramp: Ramp) -> None:
    """Refuse a count of samples that leaps here and there, as the index of a table does whose rows were dropped."""
    steps = np.diff(column.values.astype(float))
    leaps = np.flatnonzero(steps > 1)
    if (
        ramp == "rises"
        and 0 < leaps.size <= RARE * steps.size
        and np.all(steps >= 1)
        and np.all(steps == np.round(steps))
    ):
        at = int(leaps[0])
        raise InputError(
            f"column {column.name} counts samples and leaps by {steps[at]:.6g} after sample {at + 1}: samples are "
            "missing there; cut the recording in two, or leave the column out by channels"
        )


def _holds_pulse_times(column: DataColumn, settings: RecordingSettings) -> bool:
    return column.name == settings.tacho and settings.tacho_kind == "pulse-times"


def pulse_times_of(column: DataColumn, origin: float, settings: RecordingSettings) -> FloatArray:
    """Return pulse times in s on the recording's time axis; nan at their end is padding."""
    t = column.numbers.reshape(-1)
    t = t[: t.size - int(np.argmax(np.isfinite(t[::-1])))] if np.isfinite(t).any() else t[:0]
    unit = _unit(column, settings, is_tacho=True) or time_name(column.name).unit
    factor = seconds_of(unit)
    if factor is None:
        raise InputError(f"the tacho {column.name} holds pulse times in {unit!r}, not a unit of time; mend it by units")
    if t.size < 2 or not np.isfinite(t).all() or np.diff(t).min() <= 0:
        raise InputError(f"the tacho {column.name} must hold two pulse times or more that rise, none of them missing")
    return np.ascontiguousarray(t * factor - origin)


def _number(column: DataColumn) -> FloatArray:
    if column.values.dtype.kind not in "biuf":
        raise InputError(f"channel {column.name} holds complex numbers or no numbers; choose others by channels")
    x = column.numbers
    wrong = np.abs(x) > LARGEST
    if wrong.any():
        at = int(np.argmax(wrong))
        size = "infinite" if np.isinf(x[at]) else f"{x[at]:.3g}, which no sensor measures"
        raise InputError(f"channel {column.name}: sample {at} is {size}; mend it, or leave it empty")
    return x


def _channels(
    series: list[FloatArray],
    columns: tuple[DataColumn, ...],
    timing: list[SeriesTiming],
    starts: list[float],
    settings: RecordingSettings,
) -> tuple[tuple[Channel, ...], list[Note]]:
    channels: list[Channel] = []
    notes: list[Note] = []
    for x, column, each, start in zip(series, columns, timing, starts, strict=True):
        is_tacho = column.name == settings.tacho
        whole, gap_notes = fill_gaps(x, name=column.name, longest=settings.longest_gap, is_tacho=is_tacho)
        factor = _scale(column.name, settings, is_tacho=is_tacho)
        unit = _unit(column, settings, is_tacho=is_tacho)
        notes += gap_notes
        if factor != 1:
            text = f"{column.name} was multiplied by {factor:.9g}"
            notes.append(Note(code="scaled", text=text, values={"channel": column.name, "factor": factor}))
        elif column.values.dtype.kind in "iu" and not unit:
            text = f"{column.name} holds integers ({column.values.dtype}) and was not scaled; see scale"
            notes.append(Note(code="integers-not-scaled", text=text, values={"channel": column.name}))
        with np.errstate(over="ignore"):  # refused below
            samples = whole * factor if factor != 1 else whole
        if np.abs(samples).max(initial=0.0) > LARGEST:
            raise InputError(f"channel {column.name}: scale = {factor} makes it larger than {LARGEST:g}")
        channels.append(
            Channel(
                name=column.name,
                samples=samples,
                sampling_rate=each.sampling_rate,
                unit=unit,
                rate_from=each.source,
                start=start,
            )
        )
    return tuple(channels), notes


def _scale(name: str, settings: RecordingSettings, *, is_tacho: bool) -> float:
    if isinstance(settings.scale, dict):
        return settings.scale.get(name, 1.0)
    return 1.0 if settings.scale is None or is_tacho else settings.scale


def _unit(column: DataColumn, settings: RecordingSettings, *, is_tacho: bool) -> str:
    if isinstance(settings.units, dict):
        return settings.units.get(column.name, column.unit)
    return column.unit if settings.units is None or is_tacho else settings.units


def _reader_notes(contents: Contents, settings: RecordingSettings) -> list[Note]:
    """Return the reader's notes, and one on a speed in the file, which is to be confirmed unless it is given."""
    others = [note for note in contents.notes if note.code != SPEED_TO_CONFIRM]
    if contents.speed_rpm is None:
        return others
    to_confirm = [note for note in contents.notes if note.code == SPEED_TO_CONFIRM]
    source = str(to_confirm[0].values.get("name", "the file")) if to_confirm else "the file"
    values: dict[str, str | float] = {"name": source, "speed_rpm": contents.speed_rpm}
    speed = settings.speed_rpm
    if speed is None:
        text = f"{source} states {contents.speed_rpm:.6g} rpm, a speed to be confirmed; give speed_rpm"
        return [*others, Note(code=SPEED_TO_CONFIRM, text=text, values=values)]
    if abs(contents.speed_rpm - speed) <= SPEED_RANGE * speed:
        return others
    text = f"{source} states {contents.speed_rpm:.6g} rpm; the given {speed:.6g} rpm was taken"
    return [*others, Note(code="ignored-speed", text=text, values=values)]


def _same_channels(channels: tuple[Channel, ...]) -> list[Note]:
    """Return notes on channels with the same samples."""
    notes = []
    seen: dict[bytes, str] = {}
    for channel in channels:
        name = channel.name
        is_same = (same := seen.setdefault(blake2b(channel.samples.data).digest(), name)) != name
        if is_same and not is_constant(channel):
            text = f"{name} is the same as {same}"
            notes.append(Note(code="same-channel", text=text, values={"channel": name, "same": same}))
    return notes
