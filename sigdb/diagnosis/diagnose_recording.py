"""Diagnosis of a recording with healthy recordings, and a rig, its tooth counts, a model or a database."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import TypedDict, Unpack, cast

from sigdb.core import InputError, Note, validated
from sigdb.diagnosis.change.templates import Templates
from sigdb.diagnosis.diagnose_signature import absent_gears, diagnose_signature
from sigdb.diagnosis.diagnosis import Diagnosis, unjudged
from sigdb.diagnosis.notes import reading_notes, rig_speed_notes
from sigdb.diagnosis.rig_templates import Source, averaged_gear_of, stored_bank
from sigdb.recording import (
    AngleOptions,
    AveragingSettings,
    FileOptions,
    NoMeshError,
    RecordedSignature,
    Recording,
    RecordingBlocks,
    RecordingSettings,
    read_of_any_size,
    recorded_signature,
)
from sigdb.transmission import Transmission, load_transmission, new_rig

AnyRecording = Recording | RecordingBlocks | str | PathLike[str]
"""A recording, its blocks, or the path of a file."""

_SAMPLES_PER_TOOTH = 64
_READING = set(RecordingSettings.model_fields) - set(AveragingSettings.model_fields) - {"torque", "load"}
"""Options of reading a recording that are not options of its average too."""

_ASSUMED_TORQUE = 50.0
"""Torque, N m, for which a rig of tooth counts is sized where none is given; assumed."""

_ASSUMED_RPM = 1500.0
"""Speed, rpm, of a rig of tooth counts before the recording's speed is known."""


class _Stored(TypedDict):
    """Model or database whose templates are used, and the sensor."""

    model: str | PathLike[str] | None
    database: str | PathLike[str] | None
    sensor: str | None


class DiagnosisOptions(FileOptions, AngleOptions, total=False):
    """Options of reading and averaging a recording as keyword arguments of :func:`diagnose`."""

    samples_per_tooth: int


def diagnose(
    recording: AnyRecording,
    rig: Transmission | str | PathLike[str] | None = None,
    *,
    healthy: AnyRecording | Sequence[AnyRecording] = (),
    teeth: str | int | None = None,
    module: float | str | None = None,
    model: str | PathLike[str] | None = None,
    database: str | PathLike[str] | None = None,
    gear: str | None = None,
    sensor: str | None = None,
    torque: float | None = None,
    healthy_torque: Sequence[float] = (),
    load: float | None = None,
    healthy_load: Sequence[float] = (),
    **options: Unpack[DiagnosisOptions],
) -> Diagnosis:
    """Diagnose a gear from a recording: whether a tooth stands out, which, how severely, and what would have been seen.

    The average of the recording is compared with that of healthy recordings of the same machine by the same channel. A
    tooth stands out where the difference between the mesh harmonics is a short pulse, or has the shape of simulated
    damage, more than healthy recordings show. Where none does, damage is added to the recording itself, and the same
    decision says how much of it would have been seen.

    Parameters
    ----------
    recording : Recording, RecordingBlocks, str or path-like
        From :func:`sigdb.read_recording` or :func:`sigdb.recording.read_in_blocks`, or the path of a file.
    rig : Transmission, str or path-like, optional
        The rig, with one mesh; or its name or file. Severity needs it.
    healthy : recording or sequence of recordings
        Healthy recordings, read and averaged like the other. Several, at other loads or speeds, give better limits.
    teeth : str or int, optional
        Instead of a rig, the tooth counts of the averaged gear and its mate, ``"32/80"``, or of that gear alone.
    module : float or str, optional
        Module of the pair of ``teeth``, m or with a unit; by default a usual range.
    model : str or path-like, optional
        Folder or name of a trained model whose templates are used. It needs the rig.
    database : str or path-like, optional
        A database of the rig whose templates are used. Without model and database the templates are simulated, at the
        recording's speed and torque.
    gear : str, optional
        Gear on the averaged shaft; the first mesh's driving gear if left out.
    sensor : str, optional
        Sensor of the rig. By default it is the sensor with the channel's name, otherwise the rig's last.
    torque : float, optional
        Torque in N m, as the rig's ``operating.torque``. By default it is the recording's, otherwise the rig's.
    healthy_torque : sequence of float, optional
        Torque of each healthy recording, N m; by default those that the recordings state.
    load, healthy_load : float and sequence of float, optional
        Instead of torques, the load of the recording and of each healthy recording in any one unit, such as per cent;
        by default those that the recordings state.
    **options
        Fields of :class:`sigdb.recording.AveragingSettings`: ``channel``, ``mesh_phase``, ``speed_rpm``,
        ``revolutions`` and others. For the path of a file also fields of :class:`sigdb.recording.RecordingSettings`:
        ``tacho``, ``sampling_rate``, ``units`` and others.

    Returns
    -------
    Diagnosis
        The answer with its evidence. It is ``cannot be judged`` where the gear is not to be seen in one of the
        recordings, or where no damage of the range would have been seen.

    Raises
    ------
    InputError
        If a file cannot be read, the rig has several meshes, or the recording does not fit it.
    """
    references = _listed(healthy)
    source, gear, count = _source(
        rig, teeth, module, gear, model=model, database=database, sensor=sensor, torque=torque
    )
    reading, averaging = _split_options(options, [recording, *references])
    run, others = _read(recording, reading), [_read(each, reading) for each in references]
    samples = source.samples_per_tooth or _SAMPLES_PER_TOOTH
    defaults: dict[str, object] = {"gear": gear, "samples_per_tooth": samples}
    if gear is None:
        defaults = {"teeth": count, "samples_per_tooth": samples}
    if not source.described and "speed_rpm" not in averaging:
        defaults["speed_range_rpm"] = _ANY_RPM
    settings = validated(AveragingSettings, defaults | averaging, owner="diagnose")
    signatures = {"recording": _signature(run, settings, source.rig)}
    signatures |= {f"healthy {i + 1}": _signature(each, settings, source.rig) for i, each in enumerate(others)}
    present = [each for each in signatures.values() if isinstance(each, RecordedSignature)]
    reasons = absent_gears(signatures)
    if reasons:
        results = signatures["recording"]
        signature = results if isinstance(results, RecordedSignature) else None
        healthies = [each for each in present if each is not signature]
        notes = tuple(reading_notes(present[0], present[1:])) if present else ()
        return unjudged(signature, healthies, reasons, teeth=count, reading=notes)
    signature, *healthy_signatures = present
    loads, healthy_loads, load_notes = _loads(
        run, others, torque=torque, healthy_torque=healthy_torque, load=load, healthy_load=healthy_load
    )
    templates: Templates | None = None
    assumed: tuple[str, ...] = ()
    notes = (*source.notes, *load_notes)
    if healthy_signatures and source.rig is not None and gear is not None:
        speed_rpm = signature.speed_rpm / abs(source.rig.ratio(source.rig.gears[gear].shaft))
        at = next((value for value in (torque, run.torque) if value is not None), source.rig.operating.torque)
        if source.described and source.bank is None:
            notes = (*notes, *rig_speed_notes(source.rig.operating.speed_rpm, speed_rpm))
        templates, assumed = source.templates(
            gear=gear,
            sensor=sensor,
            channel=signature.channel,
            speed_rpm=speed_rpm,
            torque=at,
            samples_per_tooth=samples,
        )
    diagnosis = diagnose_signature(
        signature,
        healthy_signatures,
        templates=templates,
        torque=loads,
        healthy_torques=healthy_loads,
        assumed=assumed,
    )
    return replace(diagnosis, notes=(*notes, *diagnosis.notes))


_ANY_RPM = (300.0, 6000.0)
"""Range in which an unknown speed is searched, rev/min."""


def _listed(healthy: AnyRecording | Sequence[AnyRecording]) -> list[AnyRecording]:
    return [healthy] if isinstance(healthy, Recording | RecordingBlocks | str | PathLike) else list(healthy)


def _source(
    rig: Transmission | str | PathLike[str] | None,
    teeth: str | int | None,
    module: float | str | None,
    gear: str | None,
    *,
    torque: float | None,
    **stored: Unpack[_Stored],
) -> tuple[Source, str | None, int]:
    """Return the source of the templates, the averaged gear, and its tooth count."""
    if rig is not None and teeth is not None:
        raise InputError("rig and teeth are given together; the rig has the tooth counts")
    if rig is not None:
        machine = rig if isinstance(rig, Transmission) else load_transmission(str(rig))
        bank, notes = stored_bank(machine, **stored)
        named = averaged_gear_of(machine, gear)
        return Source(rig=machine, described=True, bank=bank, notes=notes), named, machine.gears[named].teeth
    if stored["model"] is not None or stored["database"] is not None:
        raise InputError("model or database is given without the rig of its templates; give the rig")
    if teeth is None:
        raise InputError("neither a rig nor tooth counts are given; give a rig, or teeth such as 32/80")
    text = str(teeth)
    if text.strip().isdigit():
        if gear is not None:
            raise InputError(f"gear = {gear!r} is given with one tooth count; give both counts, such as {text}/80")
        return Source(rig=None, described=False), None, int(text)
    pair = new_rig(
        teeth=text,
        speed=_ASSUMED_RPM,
        torque=_ASSUMED_TORQUE if torque is None else torque,
        module=module,
        name="assumed-rig",
    )
    named = averaged_gear_of(pair, gear)
    return Source(rig=pair, described=False), named, pair.gears[named].teeth


def _loads(
    run: Recording | RecordingBlocks,
    others: Sequence[Recording | RecordingBlocks],
    *,
    torque: float | None,
    healthy_torque: Sequence[float],
    load: float | None,
    healthy_load: Sequence[float],
) -> tuple[float | None, list[float | None], tuple[Note, ...]]:
    """Return the torque, or the load, of the recording and of each healthy one, and a note where some are unknown.

    Options win over what the recordings state in their side files. Torques are taken where all are known, otherwise
    loads; where neither are, the load of the recording cannot be compared with those of the healthy recordings.
    """
    for name, values in (("healthy_torque", healthy_torque), ("healthy_load", healthy_load)):
        if values and len(values) != len(others):
            raise InputError(f"{name} has {len(values)} values for {len(others)} healthy recordings; give one of each")
    torques: list[float | None] = [run.torque if torque is None else torque]
    torques += healthy_torque or [each.torque for each in others]
    loads: list[float | None] = [run.load if load is None else load]
    loads += healthy_load or [each.load for each in others]
    if not all(isfinite(value) for value in (*torques, *loads) if value is not None):
        raise InputError("a torque or a load is no finite number; give numbers")
    for known in (loads, torques) if load is not None or healthy_load else (torques, loads):
        if all(value is not None for value in known):
            return known[0], known[1:], ()
    stated = [value for value in (*torques, *loads) if value is not None]
    notes = [_SOME_LOADS] if others and stated else []
    return None, [None] * len(others), tuple(notes)


_SOME_LOADS = Note(
    code="some-loads-unknown",
    text="The torque or the load of some of the recordings is stated, but not of all in one of the two, so the "
    "reference is not interpolated in load. State it of each, as an option or as torque or load in a side file.",
)


def _split_options(
    options: Mapping[str, object], recordings: Sequence[AnyRecording]
) -> tuple[FileOptions, dict[str, object]]:
    """Return the options of reading and those of averaging; a field of both is an option of averaging."""
    averaging = {name: value for name, value in options.items() if name not in _READING}
    reading = {name: value for name, value in options.items() if name in _READING}
    if reading and all(isinstance(source, Recording | RecordingBlocks) for source in recordings):
        raise InputError(
            f"{', '.join(reading)}: options of reading a file, and no recording is a path; give them to read_recording"
        )
    return cast(FileOptions, reading), averaging


def _read(recording: AnyRecording, options: FileOptions) -> Recording | RecordingBlocks:
    if isinstance(recording, Recording | RecordingBlocks):
        return recording
    return read_of_any_size(Path(recording), **options)


def _signature(
    recording: Recording | RecordingBlocks, settings: AveragingSettings, rig: Transmission | None
) -> RecordedSignature | NoMeshError:
    try:
        return recorded_signature(recording, settings, rig=rig)
    except NoMeshError as error:
        return error
