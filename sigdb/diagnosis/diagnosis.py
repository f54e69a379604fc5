"""Diagnosis of the signature of a recording: damage or none, the tooth, the severity, and the evidence."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, Note, plain
from sigdb.diagnosis.bank import at_operating_point
from sigdb.diagnosis.comparison import Comparison, compare
from sigdb.diagnosis.healthy_reference import HealthyReference, healthy_references
from sigdb.diagnosis.transfer_path import direct_path
from sigdb.recognition import PointTemplates, TemplateBank
from sigdb.recording import SPEED_DOUBT, RecordedSignature

Kind = Literal["none", "tooth", "not sure", "outside"]
"""Kinds of answer."""

_CHANGED_DB = 3.0
"""Change of a mesh harmonic, dB, above which the two recordings are not of the same state of the rig."""

_DOUBT = 0.1
"""Probability of no damage above which the answer is not sure, whatever the set."""

_FAR = 0.02
"""Relative distance from the templates' operating point above which a note reports it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """The diagnosis of a recording.

    Attributes
    ----------
    signature, healthy
        Signatures of the recording and of the healthy recording; the latter is None without one.
    kind
        ``none``, ``tooth``, ``not sure`` or ``outside``.
    answer
        The same as a sentence.
    comparison
        Result of the comparison with the templates.
    missing
        Notes on missing information that would improve the answer.
    notes
        Other notes on the answer.
    reading
        Notes on the reading and averaging of the recordings.
    """

    signature: RecordedSignature
    healthy: RecordedSignature | None
    kind: Kind
    answer: str
    comparison: Comparison
    missing: tuple[Note, ...]
    notes: tuple[Note, ...]
    reading: tuple[Note, ...]

    @property
    def p_damage(self) -> float:
        """Probability of damage at even prior odds, if one of the templates is true."""
        return float(self.comparison.probability[1:].sum())

    @property
    def teeth(self) -> pd.DataFrame:
        """``tooth`` (0 for none), its ``probability``, and whether it is a ``candidate``."""
        tooth = np.arange(len(self.comparison.probability))
        candidate = np.isin(tooth, self.comparison.candidates)
        return pd.DataFrame({"tooth": tooth, "probability": self.comparison.probability, "candidate": candidate})

    @property
    def severity(self) -> pd.DataFrame | None:
        """``target``, ``estimate``, ``low`` and ``high``; None where there is no damage or nothing fits."""
        return None if self.kind in ("none", "outside") else self.comparison.severity

    def as_json(self) -> dict[str, Any]:
        """Return the diagnosis without signals as plain values for JSON.

        Returns
        -------
        dict
            ``answer``, ``kind``, ``p_damage``, ``absolute``, ``channel``, ``unit``, ``teeth``, ``severity``,
            ``nearest``, ``reduced_chi2``, ``limit``, ``path``, ``missing``, ``notes`` and ``reading``. Tables are lists
            of rows, and notes have ``code``, ``text`` and ``values``.
        """
        severity, reference = self.severity, self.comparison.reference
        facts = {
            "answer": self.answer,
            "kind": self.kind,
            "p_damage": self.p_damage,
            "absolute": self.signature.absolute,
            "channel": self.signature.channel,
            "unit": self.signature.unit,
            "teeth": self.teeth.to_dict("records"),
            "severity": None if severity is None else severity.to_dict("records"),
            "nearest": self.comparison.nearest.to_dict("records"),
            "reduced_chi2": self.comparison.reduced_chi2,
            "limit": self.comparison.limit,
            "path": None if reference is None else _path_facts(reference),
            "missing": self.missing,
            "notes": self.notes,
            "reading": self.reading,
        }
        return {name: plain(value) for name, value in facts.items()}


def diagnose_signature(
    signature: RecordedSignature,
    bank: TemplateBank,
    *,
    speed_rpm: float,
    torque: float,
    healthy: RecordedSignature | None = None,
) -> Diagnosis:
    """Compare the signature of a recording with a bank of templates.

    With a healthy recording both references (:func:`~sigdb.diagnosis.healthy_reference.healthy_references`) may be
    used: first the unchanged path, and the changed path where no template fits behind the first and the fit is better.

    Parameters
    ----------
    signature
        Signature of the recording.
    bank
        Templates of the rig; only those of the nearest operating point are used.
    speed_rpm, torque
        Speed and torque in the recording, rpm and N m, as in the rig's ``operating``.
    healthy
        Signature of a healthy recording of the same rig, by the same channel.

    Raises
    ------
    InputError
        If the averages and the templates have different lengths, or no mesh harmonic stands above the noise.
    """
    bank = at_operating_point(bank, speed_rpm=speed_rpm, torque=torque, teeth=signature.teeth)
    (point,) = bank.points
    if healthy is None:
        path = direct_path(len(signature.tsa), highest=signature.highest_order)
        comparison = compare(bank, signature.tsa, path, noise=_noise(signature), averages=signature.averages)
    else:
        comparison = _compare_behind_path(bank, signature, healthy)
    kind, answer = _answer(comparison, signature.absolute)
    return Diagnosis(
        signature=signature,
        healthy=healthy,
        kind=kind,
        answer=answer,
        comparison=comparison,
        missing=tuple(_missing(signature, healthy)),
        notes=(
            *_operating_point_notes(point, speed_rpm, torque),
            *_path_notes(comparison.reference),
            *_fm4_notes(signature, healthy),
        ),
        reading=tuple(_reading(signature, healthy)),
    )


def _noise(signature: RecordedSignature) -> FloatArray:
    if not np.all(signature.noise > 0):
        raise InputError(
            f"{signature.source}: an average of {signature.averages} revolutions without any noise cannot be compared: "
            "the noise is needed to evaluate the fit of a template; record longer"
        )
    return signature.noise


def _compare_behind_path(bank: TemplateBank, signature: RecordedSignature, healthy: RecordedSignature) -> Comparison:
    """Compare behind the unchanged path; if no template fits, behind the changed path where the fit is better."""
    laws = bank.points[0].hypotheses
    same, changed = healthy_references(
        signature.tsa,
        healthy.tsa,
        laws.signal[laws.healthy][0],
        teeth=signature.teeth,
        noise=_noise(signature),
        healthy_noise=_noise(healthy),
        absolute=signature.absolute and healthy.absolute,
    )

    def compare_with(reference: HealthyReference) -> Comparison:
        x, path, noise = reference.x, reference.path, reference.noise
        return compare(bank, x, path, noise=noise, averages=signature.averages, reference=reference)

    first = compare_with(same)
    if not first.outside:
        return first
    return min(first, compare_with(changed), key=lambda comparison: comparison.reduced_chi2 / comparison.limit)


def _answer(comparison: Comparison, absolute: bool) -> tuple[Kind, str]:
    """Return the kind of the answer, and a sentence."""
    teeth = [tooth for tooth in comparison.candidates if tooth]
    counted = "" if absolute else ", counted from where the average begins, since there is no tacho mark"
    if comparison.outside:
        return "outside", (
            "Outside the database: neither a healthy gear nor any simulated damage fits this recording, so nothing is "
            "said of its teeth."
        )
    if not teeth:
        return "none", "No tooth damage found."
    if 0 in comparison.candidates or comparison.probability[0] > _DOUBT:
        return "not sure", "Not sure: an undamaged gear and a damaged one would both fit this recording."
    if len(teeth) == 1:
        return "tooth", f"Damage at tooth {teeth[0]}{counted}."
    return "not sure", f"Damage, but it is not sure at which tooth: {', '.join(map(str, teeth))}{counted}."


def _missing(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[Note]:
    if healthy is None:
        yield Note(
            code="no-healthy-recording",
            text="A healthy recording of the same rig by the same channel: without it the path from the mesh to the "
            "sensor is taken to be that of the simulated rig, and errors of these gears cannot be separated from "
            "damage.",
        )
    if not signature.absolute:
        text = "A tacho mark: without it teeth are counted from where the average begins."
        yield Note(code="no-tacho-mark", text=text)
    for where, recording in (("", signature), (" in the healthy recording", healthy)):
        for note in () if recording is None else recording.notes:
            if note.code == SPEED_DOUBT:
                yield replace(note, text=f"A reliable speed{where}: {note.text}.")


def _reading(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[Note]:
    """Yield the notes on reading and averaging; of the healthy recording those that differ in more than numbers."""
    yield from (note for note in signature.notes if note.code != SPEED_DOUBT)
    subjects = [_subject(note) for note in signature.notes]
    for note in () if healthy is None else healthy.notes:
        if note.code != SPEED_DOUBT and _subject(note) not in subjects:
            values = {**note.values, "recording": "healthy"}
            yield replace(note, text=f"healthy recording: {note.text}", values=values)


def _subject(note: Note) -> tuple[str, dict[str, str]]:
    """Return the code of a note with those of its values that are no numbers."""
    return note.code, {name: value for name, value in note.values.items() if isinstance(value, str)}


def _operating_point_notes(point: PointTemplates, speed_rpm: float, torque: float) -> Iterator[Note]:
    quantities = (("speed", speed_rpm, "rpm", point.speed_rpm), ("torque", torque, "N m", point.torque))
    for name, value, unit, simulated in quantities:
        if abs(value - simulated) > _FAR * abs(simulated):
            yield Note(
                code=f"other-{name}",
                text=f"The templates have a {name} of {simulated:g} {unit}, the recording {value:g} {unit}.",
                values={"templates": simulated, "recording": value},
            )


def _path_notes(reference: HealthyReference | None) -> Iterator[Note]:
    if reference is None:
        return
    used = reference.path.harmonics
    harmonics = f"mesh harmonic{'s' if len(used) > 1 else ''} {', '.join(map(str, used))}"
    text = f"The path from the mesh to the sensor is that of {harmonics} of the healthy recording."
    yield Note(code="path", text=text, values={"harmonics": len(used)})
    least, most = float(reference.change_db.min()), float(reference.change_db.max())
    if reference.changed or max(-least, most) > _CHANGED_DB:
        yield Note(
            code="changed-path",
            text=f"Since the healthy recording the mesh harmonics have changed by {least:+.1f} to {most:+.1f} dB: "
            "load, mounting or sensor may not be the same, and other changes need not be damage.",
            values={"least_db": least, "most_db": most},
        )


def _fm4_notes(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[Note]:
    """Yield a note on FM4, which needs no template."""
    recordings = {"recording": signature} | ({} if healthy is None else {"healthy": healthy})
    fm4 = {name: recording.indicators["fm4"] for name, recording in recordings.items() if "fm4" in recording.indicators}
    if "recording" in fm4:
        healthy_value = f" ({fm4['healthy']:.3g} in the healthy recording)" if "healthy" in fm4 else ""
        yield Note(
            code="fm4",
            text=f"FM4 is {fm4['recording']:.3g}{healthy_value}; one damaged tooth that stands out raises it well "
            "above 3.",
            values=fm4,
        )


def _path_facts(reference: HealthyReference) -> dict[str, Any]:
    return {
        "harmonics": reference.path.harmonics,
        "changed": reference.changed,
        "change_db": reference.change_db,
        "turned": reference.turned,
    }
