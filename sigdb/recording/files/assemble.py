"""From the columns of a file to a recording: names, time, rates, scale, units, missing samples."""

from collections import Counter
from dataclasses import replace
from hashlib import blake2b

import numpy as np

from sigdb.core import FloatArray, InputError, suggestion
from sigdb.recording.files.formats.contents import Contents, DataColumn
from sigdb.recording.files.missing_samples import common_part, ends, filled
from sigdb.recording.files.sampling_rates import sampling_rates, split_time
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.recording import Channel, Recording


def assemble(contents: Contents, settings: RecordingSettings, *, source: str) -> Recording:
    """The recording that a file and its settings describe.

    Raises
    ------
    InputError
        If they do not describe one.
    """
    named, notes = _named(contents, settings)
    time, columns, found = split_time(named, time=settings.time, named=contents.named or bool(settings.names))
    columns = _chosen(columns, settings)
    _refuse_unknown(columns, settings)
    series = [_number(column) for column in columns]
    rates, told = sampling_rates(
        columns,
        given=settings.sampling_rate,
        time=time,
        stated=contents.sampling_rate,
        source=contents.rate_from,
    )
    series, cut = _aligned(series, columns, rates)
    channels, handled = _channels(series, columns, rates, settings)
    everything = (*contents.notes, *notes, *found, *told, *cut, *handled, *_remarks(channels))
    return Recording(
        source=source, channels=channels, tacho=settings.tacho, pulses_per_rev=settings.pulses_per_rev,
        ratio=settings.ratio, teeth=settings.teeth, speed_rpm=settings.speed_rpm, torque=settings.torque,
        notes=tuple(dict.fromkeys(everything)),
    )  # fmt: skip


def _named(contents: Contents, settings: RecordingSettings) -> tuple[tuple[DataColumn, ...], list[str]]:
    """Columns with the names that were given, all different."""
    columns = contents.columns
    if settings.names is not None:
        if len(settings.names) != len(columns):
            raise InputError(
                f"names gives {len(settings.names)} names, the file holds {len(columns)} columns; name all"
            )
        columns = tuple(replace(one, name=name) for one, name in zip(columns, settings.names, strict=True))
    columns = tuple(replace(one, name=_clean(one.name), unit=_clean(one.unit)) for one in columns)
    taken: Counter[str] = Counter()
    made, notes = [], []
    used = {column.name for column in columns}
    for column in columns:
        taken[column.name] += 1
        name = column.name
        while taken[column.name] > 1 and name in used:
            name = f"{column.name} ({taken[column.name]})"
            taken[column.name] += name in used
        if name != column.name:
            used.add(name)
            notes.append(f"a second column {column.name} is called {name}")
        made.append(replace(column, name=name))
    return tuple(made), notes


def _clean(text: str) -> str:
    """Printable text of a bounded length."""
    return "".join(sign for sign in text.strip()[:100] if sign.isprintable())


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
    """Units, scales and a tacho of channels that are not there."""
    known = [column.name for column in columns]
    for what, given in (("units", settings.units), ("scale", settings.scale)):
        for name in given if isinstance(given, dict) else ():
            if name not in known:
                raise InputError(f"{what} names {name!r}, which is no channel{suggestion(name, known)}")
    if settings.tacho is not None and settings.tacho not in known:
        raise InputError(f"tacho names {settings.tacho!r}, which is no channel{suggestion(settings.tacho, known)}")


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
) -> tuple[list[FloatArray], list[str]]:
    """Series of one rate cut to the part that they share, so that sample i of all is the same instant."""
    if len(set(rates)) > 1:
        return [x[: ends(x, column.name)[1]] for x, column in zip(series, columns, strict=True)], [
            f"channels have {len(set(rates))} sampling rates"
        ]
    first, end = common_part(series, [column.name for column in columns])
    cut = max(x.size for x in series) - (end - first)
    notes = [f"cut to samples {first} to {end}, which all channels have"] if cut else []
    return [x[first:end] for x in series], notes


def _channels(
    series: list[FloatArray], columns: tuple[DataColumn, ...], rates: list[float], settings: RecordingSettings
) -> tuple[tuple[Channel, ...], list[str]]:
    channels: list[Channel] = []
    notes: list[str] = []
    for x, column, rate in zip(series, columns, rates, strict=True):
        is_tacho = column.name == settings.tacho
        whole, handled = filled(x, name=column.name, longest=settings.longest_gap, is_tacho=is_tacho)
        factor = _scale(column.name, settings, is_tacho=is_tacho)
        unit = _unit(column, settings, is_tacho=is_tacho)
        notes += handled
        if factor != 1:
            notes.append(f"{column.name} was multiplied by {factor:.9g}")
        elif column.values.dtype.kind in "iu" and not unit:
            notes.append(f"{column.name} holds integers ({column.values.dtype}) and was not scaled; see scale")
        with np.errstate(over="ignore"):  # told below
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


def _remarks(channels: tuple[Channel, ...]) -> list[str]:
    """What a person should know of channels that are as they were stored."""
    notes = []
    seen: dict[bytes, str] = {}
    for one in channels:
        if one.samples.min() == one.samples.max():
            notes.append(f"{one.name} is constant")
        elif (same := seen.setdefault(blake2b(one.samples.data).digest(), one.name)) != one.name:
            notes.append(f"{one.name} is the same as {same}")
    return notes
