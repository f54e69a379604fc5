"""From the signature of a recording to an answer: damage or none, which tooth, how severe, or not to be told."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError
from sigdb.diagnosis.bank import at_point
from sigdb.diagnosis.comparison import Compared, compare
from sigdb.diagnosis.healthy_reference import Reference, references
from sigdb.diagnosis.transfer_path import direct_path
from sigdb.recognition import PointTemplates, TemplateBank
from sigdb.recording import SPEED_DOUBT, RecordedSignature

NONE, TOOTH, NOT_SURE, OUTSIDE = "none", "tooth", "not sure", "outside"
"""Kinds of answer."""

_CHANGED_DB = 3.0
"""Change of a mesh harmonic from which the two recordings are not of the same state of the rig."""

_DOUBT = 0.1
"""Probability of no damage from which on damage is not called found, whatever the set."""

_NUMBER = re.compile(r"[\d.]+")

_FAR = 0.02
"""Relative distance of the templates' operating point that is told."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """What can be said of a recording.

    Attributes
    ----------
    signature, healthy
        Of the recording, and of the healthy one; None without.
    kind
        ``none``, ``tooth``, ``not sure`` or ``outside``.
    answer
        The same as a sentence.
    compared
        What the templates say.
    missing
        What is lacking, and what it would tell, a sentence each.
    notes
        What else there is to know, a sentence each.
    reading
        How the recordings were read and averaged, a line each.
    """

    signature: RecordedSignature
    healthy: RecordedSignature | None
    kind: str
    answer: str
    compared: Compared
    missing: tuple[str, ...]
    notes: tuple[str, ...]
    reading: tuple[str, ...]

    @property
    def p_damage(self) -> float:
        """Probability of damage, at even odds before the recording, if one of the templates is true."""
        return float(self.compared.probability[1:].sum())

    @property
    def teeth(self) -> pd.DataFrame:
        """``tooth`` (0 for none), its ``probability``, and whether it is a ``candidate``."""
        tooth = np.arange(len(self.compared.probability))
        candidate = np.isin(tooth, self.compared.candidates)
        return pd.DataFrame({"tooth": tooth, "probability": self.compared.probability, "candidate": candidate})

    @property
    def severity(self) -> pd.DataFrame | None:
        """By target ``estimate``, ``low`` and ``high``; None where no damage was found or nothing fits."""
        return None if self.kind in (NONE, OUTSIDE) else self.compared.severity

    def as_json(self) -> dict[str, Any]:
        """All of it but signals, as numbers, text, lists and dictionaries."""
        found = self.compared
        return {
            "answer": self.answer,
            "kind": self.kind,
            "p_damage": self.p_damage,
            "absolute": self.signature.absolute,
            "channel": self.signature.channel,
            "unit": self.signature.unit,
            "teeth": _records(self.teeth),
            "severity": None if self.severity is None else _records(self.severity),
            "nearest": _records(found.nearest),
            "misfit": found.misfit,
            "limit": found.limit,
            "path": None if found.reference is None else _path_facts(found.reference),
            "missing": list(self.missing),
            "notes": list(self.notes),
            "reading": list(self.reading),
        }


def diagnose_signature(
    signature: RecordedSignature,
    bank: TemplateBank,
    *,
    speed_rpm: float,
    torque: float,
    healthy: RecordedSignature | None = None,
) -> Diagnosis:
    """Compare the signature of a recording with a bank of templates.

    With a healthy recording both its uses (:func:`~sigdb.diagnosis.healthy_reference.references`) are tried: the path
    as it was, and a changed one where no template fits the first and one fits better.

    Parameters
    ----------
    signature
        Of the recording.
    bank
        Templates of the rig; those of the nearest operating point are used.
    speed_rpm, torque
        In the recording, rpm and N m, as in the rig's ``operating``.
    healthy
        Signature of a healthy recording of the same rig, by the same channel.

    Raises
    ------
    InputError
        If the averages have other lengths than the templates, or no mesh harmonic stands above the noise.
    """
    bank = at_point(bank, speed_rpm=speed_rpm, torque=torque, teeth=signature.teeth)
    (point,) = bank.points
    if healthy is None:
        path = direct_path(len(signature.tsa), highest=signature.highest_order)
        compared = compare(bank, signature.tsa, path, noise=_noise(signature), averages=signature.averages)
    else:
        compared = _behind_path(bank, signature, healthy)
    kind, answer = _answer(compared, signature.absolute)
    return Diagnosis(
        signature=signature,
        healthy=healthy,
        kind=kind,
        answer=answer,
        compared=compared,
        missing=tuple(_missing(signature, healthy)),
        notes=(
            *_far(point, speed_rpm, torque),
            *_path_notes(compared.reference),
            *_event_notes(signature, healthy),
        ),
        reading=tuple(_reading(signature, healthy)),
    )


def _noise(signature: RecordedSignature) -> FloatArray:
    if not np.all(signature.noise > 0):
        raise InputError(
            f"{signature.source}: an average of {signature.averages} revolutions without any noise cannot be compared: "
            "how well a template fits is told by the noise; record longer"
        )
    return signature.noise


def _behind_path(bank: TemplateBank, signature: RecordedSignature, healthy: RecordedSignature) -> Compared:
    """With the path as it was; if no template fits, with a changed one where one fits better."""
    laws = bank.points[0].hypotheses
    same, changed = references(
        signature.tsa,
        healthy.tsa,
        laws.signal[laws.healthy][0],
        teeth=signature.teeth,
        noise=_noise(signature),
        healthy_noise=_noise(healthy),
        absolute=signature.absolute and healthy.absolute,
    )

    def through(one: Reference) -> Compared:
        return compare(bank, one.x, one.path, noise=one.noise, averages=signature.averages, reference=one)

    found = through(same)
    return min(found, through(changed), key=lambda one: one.misfit / one.limit) if found.outside else found


def _answer(compared: Compared, absolute: bool) -> tuple[str, str]:
    """Kind of answer, and a sentence."""
    named = [one for one in compared.candidates if one]
    counted = "" if absolute else ", counted from where the average begins, since there is no tacho mark"
    if compared.outside:
        return OUTSIDE, (
            "Outside the database: neither a healthy gear nor any simulated damage fits this recording, so nothing is "
            "said of its teeth."
        )
    if not named:
        return NONE, "No tooth damage found."
    if 0 in compared.candidates or compared.probability[0] > _DOUBT:
        return NOT_SURE, "Not sure: an undamaged gear and a damaged one would both fit this recording."
    if len(named) == 1:
        return TOOTH, f"Damage at tooth {named[0]}{counted}."
    return NOT_SURE, f"Damage, but it is not sure at which tooth: {', '.join(map(str, named))}{counted}."


def _missing(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[str]:
    if healthy is None:
        yield (
            "A healthy recording of the same rig by the same channel: without it the path from the mesh to the sensor "
            "is taken to be that of the simulated rig, and errors of these gears are not told from damage."
        )
    if not signature.absolute:
        yield "A tacho mark: without it teeth are counted from where the average begins."
    for whose, one in (("", signature), (" in the healthy recording", healthy)):
        if one is not None:
            yield from (f"A speed to be sure of{whose}: {note}." for note in one.notes if note.startswith(SPEED_DOUBT))


def _reading(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[str]:
    """What reading and averaging tell, of the healthy recording only what is more than another number."""
    yield from (one for one in signature.notes if not one.startswith(SPEED_DOUBT))
    if healthy is not None:
        known = {_NUMBER.sub("", one) for one in signature.notes}
        others = (one for one in healthy.notes if _NUMBER.sub("", one) not in known)
        yield from (f"healthy recording: {one}" for one in others if not one.startswith(SPEED_DOUBT))


def _far(point: PointTemplates, speed_rpm: float, torque: float) -> Iterator[str]:
    given = (("speed", speed_rpm, "rpm", point.speed_rpm), ("torque", torque, "N m", point.torque))
    for name, value, unit, there in given:
        if abs(value - there) > _FAR * abs(there):
            yield f"The templates have a {name} of {there:g} {unit}, the recording {value:g} {unit}."


def _path_notes(reference: Reference | None) -> Iterator[str]:
    if reference is None:
        return
    used = reference.path.harmonics
    named = f"mesh harmonic{'s' if len(used) > 1 else ''} {', '.join(map(str, used))}"
    yield f"The path from the mesh to the sensor is that of {named} of the healthy recording."
    least, most = reference.change_db.min(), reference.change_db.max()
    if reference.changed or max(-least, most) > _CHANGED_DB:
        yield (
            f"Since the healthy recording the mesh harmonics have changed by {least:+.1f} to {most:+.1f} dB: load, "
            "mounting or sensor may not be the same, and what else has changed need not be damage."
        )


def _event_notes(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[str]:
    """FM4, which needs no template."""
    fm4 = [one.indicators["fm4"] for one in (signature, healthy) if one is not None and "fm4" in one.indicators]
    if fm4:
        beside = f" ({fm4[1]:.3g} in the healthy recording)" if len(fm4) > 1 else ""
        yield f"FM4 is {fm4[0]:.3g}{beside}; one damaged tooth that stands out raises it well above 3."


def _path_facts(reference: Reference) -> dict[str, Any]:
    return {
        "harmonics": reference.path.harmonics.tolist(),
        "changed": reference.changed,
        "change_db": reference.change_db.tolist(),
        "turned": reference.turned,
    }


def _records(table: pd.DataFrame) -> list[dict[Any, Any]]:
    return table.astype(object).where(table.notna(), None).to_dict("records")
