"""Rows of a recording: its averages by each gear and channel, their features and labels, or the reason for none."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import InputError, Note, plain, validated
from sigdb.database import StatusCode
from sigdb.ingest.averaged_rows import averaged_rows
from sigdb.ingest.facts.recording_facts import RecordingFacts
from sigdb.ingest.plan import IngestPlan, PlannedRecording
from sigdb.recording import (
    SPEED_UNLIKE_RIG,
    AveragingSettings,
    NoMeshError,
    RecordedAverages,
    Recording,
    RecordingBlocks,
    SharedChannels,
    in_si_unit,
    read_of_any_size,
    recorded_averages,
)
from sigdb.signature import FEATURES, features
from sigdb.transmission import Transmission, load_transmission, new_rig

Row = dict[str, Any]
"""Values of a row by column; a column that is left out is null."""

_ANY_RPM = (300.0, 6000.0)
"""Range in which an unknown speed is searched for a rig of tooth counts, rev/min."""

_PAIR = "tooth-counts"
"""Name of a rig of tooth counts."""

_ASSUMED_RPM, _ASSUMED_TORQUE = 1500.0, 50.0
"""Operating point of a rig of tooth counts, rev/min and N m; no average depends on it."""

_READING = ("tacho", "sampling_rate", "pulses_per_rev", "ratio")
"""Facts that are options of reading too."""


def recording_rows(plan: IngestPlan, recording: PlannedRecording) -> list[Row]:
    """Return the rows of a recording, at least one for each of its entries in the table.

    Raises
    ------
    InputError
        If a rig or a gear of the settings does not exist: a mistake that all recordings share.
    """
    digest = sha256_of(Path(recording.path))
    rows: list[Row] = []
    for facts, specimen in zip(recording.facts, recording.specimens, strict=True):
        common = _common(plan, recording, facts, specimen) | {"sha256": digest}
        rows += [common | _without_path(row, recording) for row in _rows_of(plan, recording, facts)]
    if len(rows) > plan.most_rows:
        count = f"{recording.name} gives {len(rows)} averages, more than {plan.most_rows}"
        why = f"{count}; average more revolutions, or split it"
        return [_common(plan, recording, recording.facts[0], None) | {"sha256": digest} | _failed("no_average", why)]
    return rows


def _common(plan: IngestPlan, recording: PlannedRecording, facts: RecordingFacts, specimen: int | None) -> Row:
    """Return the values that all rows of an entry share."""
    return {
        **facts.labels,
        "gear": facts.gear or "",
        "shaft": "",
        "pattern": "",
        "teeth": None,
        "torque": facts.torque,
        "speed_rpm": facts.speed_rpm,
        "specimen": specimen,
        "draw": 0,
        "source": plan.source,
        "recording": recording.name,
        "set": facts.set or "",
        "machine": facts.machine or "",
        "specimen_name": facts.specimen or "",
        "sensor": facts.sensor or "",
        "channel": "",
        "unit": "",
        "date": facts.date or "",
        "load": facts.load,
        "rig": facts.rig or plan.settings.rig or "",
        "notes": "[]",
    }


def _rows_of(plan: IngestPlan, recording: PlannedRecording, facts: RecordingFacts) -> Iterator[Row]:
    """Yield the rows of an entry, without what they share."""
    if plan.settings.averages_of is not None:
        yield from _averaged_rows(plan, recording, facts, plan.settings.averages_of)
        return
    try:
        read = _read(plan, recording, facts)
    except InputError as error:
        yield _failed(StatusCode.UNREADABLE, str(error))
        return
    rig = _rig(plan, facts)
    channels = facts.channel.split("+") if facts.channel else plan.settings.channels
    for gear in facts.gear.split("+") if facts.gear else plan.settings.gears or (None,):
        turned = _about(read, rig, plan, facts, gear)
        names = tuple(channels) or tuple(signal.name for signal in _whole(read).signals)
        shared = SharedChannels(names)
        for channel in names:
            yield from _gear_rows(plan, turned, facts, rig, gear, channel, shared)


def _averaged_rows(plan: IngestPlan, recording: PlannedRecording, facts: RecordingFacts, name: str) -> Iterator[Row]:
    """Yield the rows of the averages of a file of another program; one with the reason if it cannot be read."""
    unit = facts.unit or plan.settings.reading.units
    try:
        check_size(recording)
        rows = averaged_rows(
            Path(recording.path),
            name,
            facts,
            teeth=plan.settings.teeth,
            samples_per_tooth=plan.settings.samples_per_tooth,
            unit=unit if isinstance(unit, str) else "",
        )
        yield from list(rows)
    except InputError as error:
        yield _failed(StatusCode.UNREADABLE, str(error))


def check_size(recording: PlannedRecording) -> None:
    """Refuse a file that has another size than when it was planned.

    Raises
    ------
    InputError
        If it has changed.
    """
    size = Path(recording.path).stat().st_size if Path(recording.path).is_file() else None
    if size is not None and size != recording.bytes:
        raise InputError(f"{recording.path}: has {size} bytes, and had {recording.bytes} when it was planned")


def _read(plan: IngestPlan, recording: PlannedRecording, facts: RecordingFacts) -> Recording | RecordingBlocks:
    options = plan.settings.reading.model_dump(exclude_unset=True, exclude={"teeth", "speed_rpm", "torque"})
    options |= {name: getattr(facts, name) for name in _READING if getattr(facts, name) is not None}
    options |= {"units": facts.unit} if facts.unit else {}
    check_size(recording)
    return read_of_any_size(recording.path, **options)


def _gear_rows(
    plan: IngestPlan,
    read: Recording | RecordingBlocks,
    facts: RecordingFacts,
    rig: Transmission | None,
    gear: str | None,
    channel: str,
    shared: SharedChannels,
) -> Iterator[Row]:
    """Yield the rows of a gear by a channel."""
    place: Row = {"channel": channel, "sensor": facts.sensor or channel} | ({"gear": gear} if gear else {})
    try:
        settings = _averaging(plan, facts, rig, gear, channel)
        averages = recorded_averages(read, settings, rig=rig, averages=plan.settings.averages, shared=shared)
    except NoMeshError as error:
        yield place | _failed(StatusCode.NO_GEAR, str(error))
        return
    except InputError as error:
        yield place | _failed(StatusCode.NO_AVERAGE, str(error))
        return
    place |= {
        "gear": averages.gear or "",
        "shaft": averages.shaft or "",
        "teeth": averages.teeth,
        "unit": in_si_unit(averages.unit)[0],
        "angle": averages.angle,
        "absolute": averages.absolute,
        "kept": averages.kept,
        "highest_order": averages.highest_order,
        "presence_p": averages.presence.p_value,
        "notes": _notes_text(notes := _fitting_notes(averages, read, settings, rig)),
    }
    doubt = next((note for note in notes if note.code in plan.settings.doubts), None)
    if not averages.presence.present:
        yield place | _failed(StatusCode.NO_GEAR, averages.presence.reason)
    elif doubt is not None:
        accepting = f"{doubt.text}; mend it, or accept the doubt {doubt.code}"
        yield place | _failed(StatusCode.DOUBTFUL, accepting)
    else:
        torque = facts.torque if facts.torque is not None else _whole(read).torque
        yield from (place | row for row in _results(averages, rig, torque))


def _fitting_notes(
    averages: RecordedAverages, read: Recording | RecordingBlocks, settings: AveragingSettings, rig: Transmission | None
) -> list[Note]:
    """Return the notes of averages without one on the operating point of a pair of tooth counts, which is assumed."""
    assumed = rig is not None and rig.name == _PAIR and settings.speed_rpm is None and _whole(read).speed_rpm is None
    return [note for note in averages.notes if not (assumed and note.code == SPEED_UNLIKE_RIG)]


def _results(averages: RecordedAverages, rig: Transmission | None, torque: float | None) -> Iterator[Row]:
    """Yield the results of averages."""
    factor = in_si_unit(averages.unit)[1]
    tsa, noise = averages.tsa * factor, averages.noise * factor
    ratio = 1.0 if rig is None or averages.shaft is None else abs(rig.ratio(averages.shaft))
    values = features(tsa, teeth=averages.teeth)
    variance = np.mean(noise**2, axis=1)
    signal = np.maximum(tsa.var(axis=1) - variance, np.finfo(float).tiny)
    snr = 10 * np.log10(signal / np.maximum(averages.revolutions * variance, np.finfo(float).tiny))
    for i, average in enumerate(tsa):
        yield {
            "status": str(StatusCode.OK),
            "status_code": str(StatusCode.OK),
            "torque": torque,
            "speed_rpm": averages.speed_rpm[i] / ratio,
            "shaft_rpm": averages.speed_rpm[i],
            "draw": i,
            "begin": averages.begin[i],
            "averages": averages.revolutions,
            "snr_db": float(snr[i]),
            "scatter": averages.scatter[i] * factor,
            "tsa": average,
            "noise": noise[i],
            "groups": (averages.groups[i] * factor).ravel(),
            **{name: value[i].ravel() if FEATURES[name].axes else value[i] for name, value in values.items()},
        }


def _averaging(
    plan: IngestPlan, facts: RecordingFacts, rig: Transmission | None, gear: str | None, channel: str
) -> AveragingSettings:
    stated: dict[str, Any] = {
        **plan.settings.averaging.model_dump(exclude_unset=True),
        "channel": channel,
        "samples_per_tooth": plan.settings.samples_per_tooth,
    }
    teeth = facts.teeth or plan.settings.teeth
    if rig is not None:
        stated |= {"gear": gear}
        if teeth is not None and gear is None:
            stated |= {"gear": next(iter(rig.meshes.values())).driving}
    elif teeth is not None:
        stated |= {"teeth": int(teeth)}
    if facts.speed_rpm is not None:
        stated |= {"speed_rpm": facts.speed_rpm}
    elif teeth is not None and "speed_rpm" not in stated:
        stated.setdefault("speed_range_rpm", _ANY_RPM)
    return validated(AveragingSettings, stated, owner="ingest")


def _rig(plan: IngestPlan, facts: RecordingFacts) -> Transmission | None:
    """Return the rig of an entry: a described one, or a pair of its tooth counts; None for a single tooth count."""
    name = facts.rig or (None if facts.teeth else plan.settings.rig)
    if name is not None:
        return plan.rigs[name]
    teeth = facts.teeth or plan.settings.teeth
    return pair_of(teeth) if teeth and not teeth.strip().isdigit() else None


@lru_cache
def pair_of(teeth: str) -> Transmission:
    """Return a rig of two tooth counts such as ``32/80``."""
    return new_rig(teeth=teeth, speed=_ASSUMED_RPM, torque=_ASSUMED_TORQUE, name=_PAIR)


def _about(
    read: Recording | RecordingBlocks,
    rig: Transmission | None,
    plan: IngestPlan,
    facts: RecordingFacts,
    gear: str | None,
) -> Recording | RecordingBlocks:
    """Return a recording whose ratio and speed are of the shaft of a gear; those stated are of the first gear's."""
    first = facts.gear.split("+")[0] if facts.gear else next(iter(plan.settings.gears), gear)
    if rig is None or gear is None or first is None or gear == first or not {gear, first} <= rig.gears.keys():
        return read  # a gear that the rig lacks is refused later
    turns = abs(rig.ratio(rig.gears[gear].shaft) / rig.ratio(rig.gears[first].shaft))
    whole = _whole(read)
    speed = None if whole.speed_rpm is None else whole.speed_rpm * turns
    whole = replace(whole, ratio=whole.ratio * turns, speed_rpm=speed, teeth=None)
    return replace(read, whole=whole) if isinstance(read, RecordingBlocks) else whole


def _whole(read: Recording | RecordingBlocks) -> Recording:
    return read.whole if isinstance(read, RecordingBlocks) else read


def _failed(code: str, why: str) -> Row:
    return {"status": why, "status_code": str(code)}


def _without_path(row: Row, recording: PlannedRecording) -> Row:
    """Return a row whose status names the recording by its name: its place may change."""
    return row | {"status": row["status"].replace(recording.path, recording.name)}


def _notes_text(notes: Sequence[Note]) -> str:
    return json.dumps([{"code": note.code, "text": note.text, "values": plain(dict(note.values))} for note in notes])


def sha256_of(path: Path) -> str | None:
    """Return the SHA-256 of a file; None if it cannot be read."""
    try:
        with path.open("rb") as file:
            digest = hashlib.sha256()
            for block in iter(partial(file.read, 1 << 20), b""):
                digest.update(block)
            return digest.hexdigest()
    except OSError:
        return None


def named_rigs(names: Sequence[str]) -> dict[str, Transmission]:
    """Return rigs by the names that settings and tables use."""
    return {name: load_transmission(name) for name in dict.fromkeys(names)}
