"""From a recording, its rig and what else there is, to a diagnosis."""

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

from sigdb.core import InputError
from sigdb.database import open as open_database
from sigdb.diagnosis.bank import rig_bank
from sigdb.diagnosis.diagnosis import Diagnosis, diagnose_signature
from sigdb.recognition import TemplateBank, bank_of, changed_parts, load_model, model_form
from sigdb.recording import Recording, in_unit, read_recording, recorded_signature
from sigdb.transmission import Transmission, load_transmission

_INDEX_ERROR = 2e-6
_SAMPLES_PER_TOOTH = 64


@dataclass(frozen=True, kw_only=True)
class _Templates:
    """A bank with what is to be known of where it is from."""

    bank: TemplateBank
    notes: tuple[str, ...] = ()

    @property
    def samples_per_tooth(self) -> int:
        point = self.bank.points[0]
        return point.samples // point.teeth


def diagnose(
    recording: Recording | str | PathLike[str],
    rig: Transmission | str | PathLike[str],
    *,
    healthy: Recording | str | PathLike[str] | None = None,
    model: str | PathLike[str] | None = None,
    database: str | PathLike[str] | None = None,
    gear: str | None = None,
    sensor: str | None = None,
    torque: float | None = None,
    index_error: float = _INDEX_ERROR,
    **options: Any,
) -> Diagnosis:
    """Tell from a recording whether a gear is damaged, at which tooth and how severely, or that it cannot be told.

    The averaged recording is compared with simulated templates of the rig. With a ``healthy`` recording of the same rig
    by the same channel, the path from the mesh to the sensor and the errors of these gears are taken from it; without
    one the recording is taken to be of the simulated rig itself.

    Parameters
    ----------
    recording
        From :func:`sigdb.read_recording`, or the path of a file that needs no options to be read.
    rig
        The rig, with one mesh; or its name or file.
    healthy
        A healthy recording, read like the other.
    model
        Folder or name of a trained model, whose templates are used.
    database
        A database of the rig, whose templates are used. Without model and database they are simulated now, at the
        recording's speed and torque.
    gear
        Gear on the averaged shaft; the first mesh's driving gear if left out.
    sensor
        Sensor of the rig; that of the recorded channel's name, else the first one of database or rig.
    torque
        N m, as the rig's ``operating.torque``; the recording's, else the rig's, if left out.
    index_error
        Size of the gears' index errors, m, where templates are simulated now; assumed.
    options
        Of :func:`recorded_signature`: ``channel``, ``mesh_phase``, ``speed_rpm``, ``revolutions``...

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        If a file cannot be read, the rig has several meshes, or the recording does not fit it.
    """
    rig = rig if isinstance(rig, Transmission) else load_transmission(str(rig))
    gear = _gear(rig, gear)
    one, other = _read(recording), None if healthy is None else _read(healthy)
    torque = torque if torque is not None else one.torque if one.torque is not None else rig.operating.torque
    templates = _given(rig, model=model, database=database, sensor=sensor)
    samples = templates.samples_per_tooth if templates else _SAMPLES_PER_TOOTH
    options = {"rig": rig, "gear": gear, "samples_per_tooth": samples, **options}
    signature = recorded_signature(one, **options)
    reference = None if other is None else recorded_signature(other, **options)
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
        templates = _Templates(bank=bank)
    if reference is None:
        signature = in_unit(signature, rig.sensors[templates.bank.sensor].unit)
    found = diagnose_signature(
        signature,
        templates.bank,
        speed_rpm=speed_rpm,
        torque=torque,
        healthy=reference,
    )
    return replace(found, notes=(*templates.notes, *found.notes))


def _read(recording: Recording | str | PathLike[str]) -> Recording:
    return recording if isinstance(recording, Recording) else read_recording(Path(recording))


def _given(
    rig: Transmission,
    *,
    model: str | PathLike[str] | None,
    database: str | PathLike[str] | None,
    sensor: str | None,
) -> _Templates | None:
    """Templates of a model or a database; None where neither is given."""
    if model is not None and database is not None:
        raise InputError("model and database are given together; templates are taken from one of them")
    if database is not None:
        opened = open_database(str(database))
        changed = changed_parts(model_form(opened.manifest.resolved), _form(rig))
        return _Templates(bank=TemplateBank.of(opened, sensor=sensor), notes=_of_another("database", changed))
    if model is None:
        return None
    loaded = load_model(str(model))
    bank = bank_of(loaded.estimators.get("templates"))
    if bank is None:
        raise InputError(f"{model} holds no templates; train it on a database of a rig with one mesh")
    changed = changed_parts(loaded.form, _form(rig))
    return _Templates(bank=bank, notes=_of_another("model", changed))


def _form(rig: Transmission) -> dict[str, str]:
    return model_form({"rig": rig.model_dump(mode="json", exclude_none=True)})


def _of_another(kind: str, changed: list[str]) -> tuple[str, ...]:
    return (f"The {kind} is of a rig that differs in {', '.join(changed)}.",) if changed else ()


def _gear(rig: Transmission, asked: str | None) -> str:
    """The averaged gear, on a rig whose damaged teeth are turns of each other."""
    if asked is not None and asked not in rig.gears:
        raise InputError(f"gear = {asked!r} is not a gear of {rig.name}; it has {', '.join(rig.gears)}")
    gear = asked or (next(iter(rig.meshes.values())).driving if rig.meshes else None)
    if gear is None or not rig.turns_exactly(gear):
        raise InputError(
            f"rig {rig.name} has {len(rig.meshes)} meshes; a recording is compared with templates of a rig with one: "
            "describe the gear pair of interest as a rig of its own"
        )
    return gear


def _sensor(rig: Transmission, asked: str | None, channel: str) -> str:
    """The rig's sensor: the one asked for, that of the channel's name, or the first."""
    if asked is not None and asked not in rig.sensors:
        raise InputError(f"sensor = {asked!r} is not a sensor of {rig.name}; it has {', '.join(rig.sensors)}")
    return asked or (channel if channel in rig.sensors else next(iter(rig.sensors)))
