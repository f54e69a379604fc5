"""Reference of a machine in a file: what a diagnosis needs of healthy recordings, and templates that were simulated."""

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from sigdb.core import InputError, Note, publish
from sigdb.diagnosis.change.templates import Templates
from sigdb.recording import EnvelopeSpectrum, MeshPresence, RecordedSignature

_MEMBER = "sigdb_reference.json"
"""Member of the file that makes it a reference."""

_VERSION = 1
_LARGEST = 2**30
"""Largest size of a reference, unpacked, bytes."""

_SAME_SPEED, _SAME_TORQUE = 0.02, 0.05
"""Relative differences of speed and torque up to which simulated templates are used again."""

_FACTS = (
    *("source", "channel", "unit", "gear", "shaft", "teeth", "angle", "absolute", "scatter", "averages", "dropped"),
    *("cycle", "speed_rpm", "kept", "highest_order", "indicators"),
)
_ARRAYS = ("tsa", "noise", "groups")
_TEMPLATES = ("healthy", "spectra", "member", "last")
NOTHING = EnvelopeSpectrum(
    band=(0.0, 0.0), chosen="not stored", kurtosis=0.0, spectrum=pd.DataFrame(), lines=pd.DataFrame()
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Healthy:
    """A healthy recording by its signature, with its torque (N m) or its load in any one unit, where known."""

    signature: RecordedSignature
    torque: float | None = None
    load: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class SimulatedTemplates:
    """Templates with the rig and the operating point that they were simulated for.

    Attributes
    ----------
    templates
        The templates.
    assumed
        Assumptions on them, in sentences.
    machine
        Hash of the rig, its gear and its sensor, without the operating point.
    speed_rpm, torque
        Operating point of the rig, rpm and N m.
    """

    templates: Templates
    assumed: tuple[str, ...]
    machine: str
    speed_rpm: float
    torque: float

    def holds_for(self, machine: str, *, speed_rpm: float, torque: float) -> bool:
        """Return whether the templates are those of a machine at nearly the same speed and torque."""
        return (
            self.machine == machine
            and abs(speed_rpm - self.speed_rpm) <= _SAME_SPEED * abs(self.speed_rpm)
            and abs(torque - self.torque) <= _SAME_TORQUE * abs(self.torque)
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class StoredReference:
    """Healthy recordings of a machine as a file holds them: a NumPy archive with a checksum.

    Attributes
    ----------
    healthy
        The healthy recordings.
    simulated
        Templates of the rig; None without.
    """

    healthy: tuple[Healthy, ...]
    simulated: SimulatedTemplates | None = None

    def save(self, path: str | PathLike[str]) -> None:
        """Write the reference; the file is whole or is not there."""
        arrays: dict[str, np.ndarray] = {}
        for number, each in enumerate(self.healthy):
            arrays |= {f"healthy{number}_{name}": getattr(each.signature, name) for name in _ARRAYS}
        document: dict[str, object] = {"version": _VERSION, "healthy": [_facts(each) for each in self.healthy]}
        if self.simulated is not None:
            templates = self.simulated.templates
            arrays |= {f"templates_{name}": getattr(templates, name) for name in _TEMPLATES}
            arrays["templates_severity"] = templates.severity.to_numpy(float)
            document["simulated"] = {
                **{name: getattr(self.simulated, name) for name in ("assumed", "machine", "speed_rpm", "torque")},
                **{name: getattr(templates, name) for name in ("teeth", "samples", "described")},
                "severity": list(templates.severity),
            }
        document["sha256"] = _checksum(document, arrays)
        target = io.BytesIO()
        with zipfile.ZipFile(target, "w") as archive:
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w") as member:
                    np.lib.format.write_array(member, array, allow_pickle=False)
            archive.writestr(_MEMBER, _text(document))
        publish(Path(path), target.getvalue())

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a reference.

        Raises
        ------
        InputError
            If the file is none, was changed, or was written by a later version.
        """
        try:
            with zipfile.ZipFile(path) as archive:
                if sum(member.file_size for member in archive.infolist()) > _LARGEST:
                    raise InputError(f"{path}: larger than {_LARGEST} bytes, so no reference of a machine")
                document = json.loads(archive.read(_MEMBER))
                arrays = {
                    member.filename.removesuffix(".npy"): np.load(io.BytesIO(archive.read(member)), allow_pickle=False)
                    for member in archive.infolist()
                    if member.filename != _MEMBER
                }
            if document["version"] > _VERSION:
                raise InputError(f"{path}: written by a later version of sigdb; update sigdb")
            checksum = document.pop("sha256")
            if checksum != _checksum(document, arrays):
                raise InputError(f"{path}: the checksum is wrong: the reference was changed; make it again")
            healthy = tuple(_healthy(facts, number, arrays) for number, facts in enumerate(document["healthy"]))
            return cls(healthy=healthy, simulated=_simulated(document.get("simulated"), arrays))
        except InputError:
            raise
        except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, RecursionError) as error:
            raise InputError(f"{path}: no reference of a machine ({type(error).__name__}); make it again") from None


def is_reference(path: str | PathLike[str]) -> bool:
    """Return whether a file is the reference of a machine, by its members."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _MEMBER in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def _checksum(document: Mapping[str, object], arrays: Mapping[str, np.ndarray]) -> str:
    """Return the SHA-256 of a document and of arrays with their names, types and shapes."""
    digest = hashlib.sha256(_text(document).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _text(document: Mapping[str, object]) -> str:
    """Return a document as JSON, in which numbers of NumPy are plain ones and nan stays nan."""
    return json.dumps(document, sort_keys=True, default=lambda value: value.item())


def _facts(healthy: Healthy) -> dict[str, object]:
    signature = healthy.signature
    return {
        **{name: getattr(signature, name) for name in _FACTS},
        "presence": {field.name: getattr(signature.presence, field.name) for field in fields(signature.presence)},
        "notes": [{"code": note.code, "text": note.text, "values": dict(note.values)} for note in signature.notes],
        "shafts": signature.shafts.to_dict("records"),
        "torque": healthy.torque,
        "load": healthy.load,
    }


def _healthy(facts: Mapping[str, Any], number: int, arrays: Mapping[str, np.ndarray]) -> Healthy:
    empty = pd.DataFrame()
    named: dict[str, Any] = {name: facts[name] for name in _FACTS}
    named |= {name: arrays[f"healthy{number}_{name}"] for name in _ARRAYS}
    signature = RecordedSignature(
        **named,
        presence=MeshPresence(**facts["presence"]),
        notes=tuple(Note(**note) for note in facts["notes"]),
        shafts=pd.DataFrame(facts["shafts"]),
        speed_track=empty,
        order_spectrum=empty,
        record_spectrum=empty,
        lines=empty,
        intervals=empty,
        envelope=NOTHING,
        order_map=None,
    )
    return Healthy(signature=signature, torque=facts["torque"], load=facts["load"])


def _simulated(facts: Mapping[str, Any] | None, arrays: Mapping[str, np.ndarray]) -> SimulatedTemplates | None:
    if facts is None:
        return None
    named: dict[str, Any] = {name: facts[name] for name in ("teeth", "samples", "described")}
    named |= {name: arrays[f"templates_{name}"] for name in _TEMPLATES}
    severity = pd.DataFrame(arrays["templates_severity"], columns=facts["severity"])
    templates = Templates(**named, severity=severity)
    return SimulatedTemplates(
        templates=templates,
        assumed=tuple(facts["assumed"]),
        machine=facts["machine"],
        speed_rpm=facts["speed_rpm"],
        torque=facts["torque"],
    )
