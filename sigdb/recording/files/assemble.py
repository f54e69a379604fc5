"""Assembly of a recording from the columns of a file: names, time, rates, scale, units, missing samples."""

from collections import Counter
from dataclasses import replace
from hashlib import blake2b

import numpy as np

from sigdb.core import FloatArray, InputError, Note, suggestion
from sigdb.recording.files.formats.contents import Contents, DataColumn
from sigdb.recording.files.missing_samples import common_part, ends, fill_gaps
from sigdb.recording.files.sampling_rates import sampling_rates, split_time
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.recording import Channel, Recording


def assemble(contents: Contents, settings: RecordingSettings, *, source: str) -> Recording:
    """Return the recording that a file and its settings describe.

    Raises
    ------
    InputError
        If they describe none.
    """
    named, notes = _named(contents, settings)
    named, other_notes = _over_time(named, settings)
    time, columns, time_notes = split_time(named, time=settings.time, named=contents.named or bool(settings.names))
    columns = _chosen(columns, settings)
    _refuse_unknown(columns, settings)
    series = [_number(column) for column in columns]
    rates, rate_notes = sampling_rates(
        columns,
        requested=settings.sampling_rate,
        time=time,
        stated=contents.sampling_rate,
        source=contents.rate_from,
    )
    series, cut_notes = _aligned(series, columns, rates)
    channels, sample_notes = _channels(series, columns, rates, settings)
    everything = (
        *contents.notes, *notes, *other_notes, *time_notes, *rate_notes, *cut_notes, *sample_notes, *_remarks(channels)
    )  # fmt: skip
    return Recording(
        source=source, channels=channels, tacho=settings.tacho, pulses_per_rev=settings.pulses_per_rev,
        tacho_kind=settings.tacho_kind, threshold=settings.threshold, hysteresis=settings.hysteresis,
        edge=settings.edge, ratio=settings.ratio, teeth=settings.teeth,
        speed_rpm=settings.speed_rpm, torque=settings.torque,
        notes=tuple({note.text: note for note in everything}.values()),
    )  # fmt: skip


def _named(contents: Contents, settings: RecordingSettings) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns with the names from the settings, all different."""
    columns = contents.columns
    if settings.names is not None:
        if len(settings.names) != len(columns):
            raise InputError(
                f"names gives {len(settings.names)} names, the file holds {len(columns)} columns; name all"
            )
        columns = tuple(replace(column, name=name) for column, name in zip(columns, settings.names, strict=True))
    columns = tuple(replace(column, name=_clean(column.name), unit=_clean(column.unit)) for column in columns)
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


def _chosen(columns: tuple[DataColumn, ...], settings: RecordingSettings) -> tuple[DataColumn, ...]:
    by_name = {column.name: column for column in columns}
    if settings.channels is None:
        return columns
    wanted = list(settings.channels)
    if settings.tacho is not None and settings.tacho not in wanted:
        wanted.append(settings.tacho)
    for name in wanted:
        if name not in by_name:
            raise InputError(f"no channel {name!r}{suggestion(name, by_name)}")
    return tuple(by_name[name] for name in dict.fromkeys(wanted))


def _refuse_unknown(columns: tuple[DataColumn, ...], settings: RecordingSettings) -> None:
    """Refuse units, scales and a tacho of channels that do not exist."""
    names = [column.name for column in columns]
    for key, by_channel in (("units", settings.units), ("scale", settings.scale)):
        for name in by_channel if isinstance(by_channel, dict) else ():
            if name not in names:
                raise InputError(f"{key} names {name!r}, which is no channel{suggestion(name, names)}")
    if settings.tacho is not None and settings.tacho not in names:
        raise InputError(f"tacho names {settings.tacho!r}, which is no channel{suggestion(settings.tacho, names)}")


def _number(column: DataColumn) -> FloatArray:
    if column.values.dtype.kind not in "biuf":
        raise InputError(f"channel {column.name} holds complex numbers or no numbers; choose others by channels")
    x = np.ascontiguousarray(column.values, dtype=np.float64)
    wrong = np.isinf(x)
    if wrong.any():
        raise InputError(
            f"channel {column.name}: sample {int(np.argmax(wrong))} is infinite; mend it, or leave it empty"
        )
    return x


def _aligned(
    series: list[FloatArray], columns: tuple[DataColumn, ...], rates: list[float]
) -> tuple[list[FloatArray], list[Note]]:
    """Return the series; those of one rate are cut to their common part, so that sample i is the same instant."""
    if len(set(rates)) > 1:
        text = f"channels have {len(set(rates))} sampling rates"
        note = Note(code="several-sampling-rates", text=text, values={"rates": len(set(rates))})
        return [x[: ends(x, column.name)[1]] for x, column in zip(series, columns, strict=True)], [note]
    first, end = common_part(series, [column.name for column in columns])
    cut = max(x.size for x in series) - (end - first)
    text = f"cut to samples {first} to {end}, which all channels have"
    note = Note(code="cut-to-common-part", text=text, values={"first": first, "end": end})
    return [x[first:end] for x in series], [note] if cut else []


def _channels(
    series: list[FloatArray], columns: tuple[DataColumn, ...], rates: list[float], settings: RecordingSettings
) -> tuple[tuple[Channel, ...], list[Note]]:
    channels: list[Channel] = []
    notes: list[Note] = []
    for x, column, rate in zip(series, columns, rates, strict=True):
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
        if not np.isfinite(samples).all():
            raise InputError(f"channel {column.name}: scale = {factor} makes it infinite")
        channels.append(Channel(name=column.name, samples=samples, sampling_rate=rate, unit=unit))
    return tuple(channels), notes


def _scale(name: str, settings: RecordingSettings, *, is_tacho: bool) -> float:
    if isinstance(settings.scale, dict):
        return settings.scale.get(name, 1.0)
    return 1.0 if settings.scale is None or is_tacho else settings.scale


def _unit(column: DataColumn, settings: RecordingSettings, *, is_tacho: bool) -> str:
    if isinstance(settings.units, dict):
        return settings.units.get(column.name, column.unit)
    return column.unit if settings.units is None or is_tacho else settings.units


def _remarks(channels: tuple[Channel, ...]) -> list[Note]:
    """Return notes on constant channels and on channels with the same samples."""
    notes = []
    seen: dict[bytes, str] = {}
    for channel in channels:
        name = channel.name
        if channel.samples.min() == channel.samples.max():
            notes.append(Note(code="constant-channel", text=f"{name} is constant", values={"channel": name}))
        elif (same := seen.setdefault(blake2b(channel.samples.data).digest(), name)) != name:
            text = f"{name} is the same as {same}"
            notes.append(Note(code="same-channel", text=text, values={"channel": name, "same": same}))
    return notes
