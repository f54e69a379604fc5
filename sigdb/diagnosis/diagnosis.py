"""Diagnosis of the signature of a recording: damage or none, the tooth, the severity, and the evidence."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, Note, plain
from sigdb.diagnosis.bank import at_operating_point
from sigdb.diagnosis.comparison import Comparison, compare
from sigdb.diagnosis.healthy_reference import HealthyReference, healthy_references
from sigdb.diagnosis.notes import fm4_notes, missing_notes, operating_point_notes, path_notes, reading_notes
from sigdb.diagnosis.transfer_path import direct_path
from sigdb.recognition import TemplateBank
from sigdb.recording import RecordedSignature

Kind = Literal["none", "tooth", "not sure", "outside"]
"""Kinds of answer."""

_DOUBT = 0.1
"""Probability of no damage above which the answer is not sure, whatever the set."""


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
        missing=tuple(missing_notes(signature, healthy)),
        notes=(
            *operating_point_notes(point, speed_rpm, torque),
            *path_notes(comparison.reference),
            *fm4_notes(signature, healthy),
        ),
        reading=tuple(reading_notes(signature, healthy)),
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
            "Outside the database: neither a healthy gear nor any simulated damage fits this recording, so it gives "
            "no information on its teeth."
        )
    if not teeth:
        return "none", "No tooth damage found."
    if 0 in comparison.candidates or comparison.probability[0] > _DOUBT:
        return "not sure", "Not sure: an undamaged gear and a damaged one would both fit this recording."
    if len(teeth) == 1:
        return "tooth", f"Damage at tooth {teeth[0]}{counted}."
    return "not sure", f"Damage, but it is not sure at which tooth: {', '.join(map(str, teeth))}{counted}."


def _path_facts(reference: HealthyReference) -> dict[str, Any]:
    return {
        "harmonics": reference.path.harmonics,
        "changed": reference.changed,
        "change_db": reference.change_db,
        "turned": reference.turned,
    }
