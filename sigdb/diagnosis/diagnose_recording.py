"""Diagnosis of a recording with its rig, a healthy recording, and a model or a database."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Unpack, cast

from sigdb.core import InputError, Note, validated
from sigdb.database import open as open_database
from sigdb.diagnosis.bank import rig_bank
from sigdb.diagnosis.diagnosis import Diagnosis, absent_gears, diagnose_signature, unjudged
from sigdb.diagnosis.notes import rig_speed_notes
from sigdb.recognition import TemplateBank, changed_parts, load_model, model_form
from sigdb.recording import (
    AngleOptions,
    AveragingSettings,
    FileOptions,
    NoMeshError,
    RecordedSignature,
    Recording,
    RecordingBlocks,
    RecordingSettings,
    in_unit,
    read_of_any_size,
    recorded_signature,
)
from sigdb.transmission import Transmission, load_transmission

_INDEX_ERROR = 2e-6
_SAMPLES_PER_TOOTH = 64
_READING = set(RecordingSettings.model_fields) - set(AveragingSettings.model_fields) - {"torque"}
"""Options of reading a recording that are not options of its average too."""


@dataclass(frozen=True, kw_only=True)
class _Templates:
    """A template bank and notes on its source."""

    bank: TemplateBank
    notes: tuple[Note, ...] = ()

    @property
    def samples_per_tooth(self) -> int:
        point = self.bank.points[0]
        return point.samples // point.teeth


class DiagnosisOptions(FileOptions, AngleOptions, total=False):
    """Options of reading and averaging a recording as keyword arguments of :func:`diagnose`."""

    samples_per_tooth: int


def diagnose(
    recording: Recording | RecordingBlocks | str | PathLike[str],
    rig: Transmission | str | PathLike[str],
    *,
    healthy: Recording | RecordingBlocks | str | PathLike[str] | None = None,
    model: str | PathLike[str] | None = None,
    database: str | PathLike[str] | None = None,
    gear: str | None = None,
    sensor: str | None = None,
    torque: float | None = None,
    index_error: float = _INDEX_ERROR,
    **options: Unpack[DiagnosisOptions],
) -> Diagnosis:
    """Diagnose a gear from a recording: whether it is damaged, at which tooth and how severely.

    The averaged recording is compared with simulated templates of the rig. A ``healthy`` recording of the same rig by
    the same channel gives the path from the mesh to the sensor and the errors of these gears. Without it, the recording
    is taken to be of the simulated rig itself.

    Parameters
    ----------
    recording : Recording, RecordingBlocks, str or path-like
        From :func:`sigdb.read_recording` or :func:`sigdb.recording.read_in_blocks`, or the path of a file.
    rig : Transmission, str or path-like
        The rig, with one mesh; or its name or file.
    healthy : Recording, RecordingBlocks, str or path-like, optional
        A healthy recording, read and averaged like the other.
    model : str or path-like, optional
        Folder or name of a trained model whose templates are used.
    database : str or path-like, optional
        A database of the rig whose templates are used. Without model and database the templates are simulated, at the
        recording's speed and torque.
    gear : str, optional
        Gear on the averaged shaft; the first mesh's driving gear if left out.
    sensor : str, optional
        Sensor of the rig. By default it is the sensor with the channel's name, otherwise the first of database or rig.
    torque : float, optional
        Torque in N m, as the rig's ``operating.torque``. By default it is the recording's, otherwise the rig's.
    index_error : float
        Size of the gears' index errors, m, where templates are simulated; assumed.
    **options
        Fields of :class:`sigdb.recording.AveragingSettings`: ``channel``, ``mesh_phase``, ``speed_rpm``,
        ``revolutions`` and others. For the path of a file also fields of :class:`sigdb.recording.RecordingSettings`:
        ``tacho``, ``sampling_rate``, ``units`` and others.

    Returns
    -------
    Diagnosis
        The answer with its evidence. It is ``cannot be judged`` where the gear is not to be seen in one of the
        recordings.

    Raises
    ------
    InputError
        If a file cannot be read, the rig has several meshes, or the recording does not fit it.
    """
    rig = rig if isinstance(rig, Transmission) else load_transmission(str(rig))
    gear = _gear(rig, gear)
    reading, averaging = _split_options(options, recording, healthy)
    damaged, reference = _read(recording, reading), None if healthy is None else _read(healthy, reading)
    torque = torque if torque is not None else damaged.torque if damaged.torque is not None else rig.operating.torque
    templates = _stored_templates(rig, model=model, database=database, sensor=sensor)
    samples = templates.samples_per_tooth if templates else _SAMPLES_PER_TOOTH
    defaults: dict[str, object] = {"gear": gear, "samples_per_tooth": samples}
    settings = validated(AveragingSettings, defaults | averaging, owner="diagnose")
    signatures = {"recording": _signature(damaged, settings, rig)}
    if reference is not None:
        signatures["healthy"] = _signature(reference, settings, rig)
    present = {name: each for name, each in signatures.items() if isinstance(each, RecordedSignature)}
    reasons = absent_gears(signatures)
    if reasons:
        return unjudged(present.get("recording"), present.get("healthy"), reasons, teeth=rig.gears[gear].teeth)
    signature, healthy_signature = present["recording"], present.get("healthy")
    speed_rpm = signature.speed_rpm / abs(rig.ratio(rig.gears[gear].shaft))
    if templates is None:
        bank = rig_bank(
            rig,
            gear=gear,
            sensor=_sensor(rig, sensor, signature.channel),
            speed_rpm=speed_rpm,
            torque=torque,
            samples_per_tooth=samples,
            index_error=index_error,
        )
        templates = _Templates(bank=bank, notes=tuple(rig_speed_notes(rig.operating.speed_rpm, speed_rpm)))
    if healthy_signature is None:
        signature = in_unit(signature, rig.sensors[templates.bank.sensor].unit)
    diagnosis = diagnose_signature(
        signature,
        templates.bank,
        speed_rpm=speed_rpm,
        torque=torque,
        healthy=healthy_signature,
    )
    return replace(diagnosis, notes=(*templates.notes, *diagnosis.notes))


def _split_options(
    options: Mapping[str, object],
    recording: Recording | RecordingBlocks | str | PathLike[str],
    healthy: Recording | RecordingBlocks | str | PathLike[str] | None,
) -> tuple[FileOptions, dict[str, object]]:
    """Return the options of reading and those of averaging; a field of both is an option of averaging."""
    averaging = {name: value for name, value in options.items() if name not in _READING}
    reading = {name: value for name, value in options.items() if name in _READING}
    if reading and all(isinstance(source, Recording | RecordingBlocks | None) for source in (recording, healthy)):
        raise InputError(
            f"{', '.join(reading)}: options of reading a file, and no recording is a path; give them to read_recording"
        )
    return cast(FileOptions, reading), averaging


def _read(
    recording: Recording | RecordingBlocks | str | PathLike[str], options: FileOptions
) -> Recording | RecordingBlocks:
    if isinstance(recording, Recording | RecordingBlocks):
        return recording
    return read_of_any_size(Path(recording), **options)


def _signature(
    recording: Recording | RecordingBlocks, settings: AveragingSettings, rig: Transmission
) -> RecordedSignature | NoMeshError:
    try:
        return recorded_signature(recording, settings, rig=rig)
    except NoMeshError as error:
        return error


def _stored_templates(
    rig: Transmission,
    *,
    model: str | PathLike[str] | None,
    database: str | PathLike[str] | None,
    sensor: str | None,
) -> _Templates | None:
    """Return the templates of a model or a database; None without both."""
    if model is not None and database is not None:
        raise InputError("model and database are given together; templates are taken from one of them")
    if database is not None:
        opened = open_database(str(database))
        changed = changed_parts(model_form(opened.manifest.resolved), _description(rig))
        return _Templates(bank=TemplateBank.of(opened, sensor=sensor), notes=_rig_notes("database", changed))
    if model is None:
        return None
    loaded = load_model(str(model))
    templates = loaded.estimators.get("templates")
    bank = None if templates is None else templates.template_bank
    if bank is None:
        raise InputError(f"{model} holds no templates; train it on a database of a rig with one mesh")
    changed = changed_parts(loaded.form, _description(rig))
    return _Templates(bank=bank, notes=_rig_notes("model", changed))


def _description(rig: Transmission) -> dict[str, Any]:
    """Return a rig as the description of a database has it."""
    return {"rig": rig.model_dump(mode="json", exclude_none=True)}


def _rig_notes(source: str, changed: list[str]) -> tuple[Note, ...]:
    """Return a note on the parts in which the rig of the templates differs from the rig of the recording."""
    parts = ", ".join(changed)
    text = f"The {source} is of a rig that differs in {parts}."
    return (Note(code="other-rig", text=text, values={"source": source, "parts": parts}),) if changed else ()


def _gear(rig: Transmission, requested: str | None) -> str:
    """Return the averaged gear; templates of its teeth must be turns of each other."""
    if requested is not None and requested not in rig.gears:
        raise InputError(f"gear = {requested!r} is not a gear of {rig.name}; it has {', '.join(rig.gears)}")
    gear = requested or (next(iter(rig.meshes.values())).driving if rig.meshes else None)
    if gear is None or not rig.turns_exactly(gear):
        raise InputError(
            f"rig {rig.name} has {len(rig.meshes)} meshes; a recording is compared with templates of a rig with one: "
            "describe the gear pair of interest as a rig of its own"
        )
    return gear


def _sensor(rig: Transmission, requested: str | None, channel: str) -> str:
    """Return the requested sensor of the rig, the sensor with the channel's name, or the first."""
    if requested is not None and requested not in rig.sensors:
        raise InputError(f"sensor = {requested!r} is not a sensor of {rig.name}; it has {', '.join(rig.sensors)}")
    return requested or (channel if channel in rig.sensors else next(iter(rig.sensors)))
