"""Diagnosis of the signature of a recording: damage or none, the tooth, the severity, and the evidence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, Note, plain
from sigdb.diagnosis.alike import MARKS_DISAGREE, make_alike
from sigdb.diagnosis.bank import at_operating_point
from sigdb.diagnosis.comparison import Comparison, compare
from sigdb.diagnosis.healthy_reference import HealthyReference, healthy_references
from sigdb.diagnosis.notes import fm4_notes, missing_notes, operating_point_notes, path_notes, reading_notes
from sigdb.diagnosis.transfer_path import direct_path
from sigdb.recognition import TemplateBank
from sigdb.recording import NO_MESH, NoMeshError, RecordedSignature

Kind = Literal["none", "tooth", "not sure", "outside", "cannot be judged"]
"""Kinds of answer."""

_DOUBT = 0.1
"""Probability of no damage above which the answer is not sure, whatever the set."""


_SAME_SPEED = 0.05
"""Relative difference of two speeds up to which a mesh in one recording is that of the other."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """The diagnosis of a recording.

    Attributes
    ----------
    signature, healthy
        Signatures of the recording and of the healthy recording. The latter is None without one, and either where no
        mesh could be followed.
    kind
        ``none``, ``tooth``, ``not sure``, ``outside`` or ``cannot be judged``, where the gear is not to be seen in one
        of the recordings.
    answer
        The same as a sentence.
    comparison
        Result of the comparison with the templates; None where the gear is not to be seen.
    missing
        Notes on missing information that would improve the answer.
    notes
        Other notes on the answer.
    reading
        Notes on the reading and averaging of the recordings.
    """

    signature: RecordedSignature | None
    healthy: RecordedSignature | None
    kind: Kind
    answer: str
    comparison: Comparison | None
    missing: tuple[Note, ...]
    notes: tuple[Note, ...]
    reading: tuple[Note, ...]

    @property
    def p_damage(self) -> float:
        """Probability of damage at even prior odds, if one of the templates is true; nan if it cannot be judged."""
        if self.comparison is None:
            return np.nan
        return float(self.comparison.probability[1:].sum())

    @property
    def teeth(self) -> pd.DataFrame:
        """``tooth`` (0 for none), ``probability``, and whether it is a ``candidate``; empty if it cannot be judged."""
        if self.comparison is None:
            return pd.DataFrame(columns=["tooth", "probability", "candidate"])
        tooth = np.arange(len(self.comparison.probability))
        candidate = np.isin(tooth, self.comparison.candidates)
        return pd.DataFrame({"tooth": tooth, "probability": self.comparison.probability, "candidate": candidate})

    @property
    def severity(self) -> pd.DataFrame | None:
        """``target``, ``estimate``, ``low`` and ``high``; None where there is no damage or nothing fits."""
        return None if self.comparison is None or self.kind in ("none", "outside") else self.comparison.severity

    def as_json(self) -> dict[str, Any]:
        """Return the diagnosis without signals as plain values for JSON.

        Returns
        -------
        dict
            ``answer``, ``kind``, ``p_damage`` (None if it cannot be judged), ``absolute``, ``channel``, ``unit``,
            ``teeth``, ``severity``, ``nearest``, ``reduced_chi2``, ``limit``, ``path``, ``missing``, ``notes`` and
            ``reading``. Tables are lists of rows, and notes have ``code``, ``text`` and ``values``.
        """
        severity, signature, compared = self.severity, self.signature, self.comparison
        reference = None if compared is None else compared.reference
        facts = {
            "answer": self.answer,
            "kind": self.kind,
            "p_damage": self.p_damage,
            "absolute": signature is not None and signature.absolute,
            "channel": None if signature is None else signature.channel,
            "unit": None if signature is None else signature.unit,
            "teeth": self.teeth.to_dict("records"),
            "severity": None if severity is None else severity.to_dict("records"),
            "nearest": [] if compared is None else compared.nearest.to_dict("records"),
            "reduced_chi2": None if compared is None else compared.reduced_chi2,
            "limit": None if compared is None else compared.limit,
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
        If the averages and the templates have different lengths, if the recordings differ in their quantity, or if no
        mesh harmonic stands above the noise.
    """
    reasons = absent_gears({"recording": signature} | ({} if healthy is None else {"healthy": healthy}))
    if reasons:
        return unjudged(signature, healthy, reasons, teeth=signature.teeth)
    pair: tuple[Note, ...] = ()
    if healthy is not None:
        alike = make_alike(signature, healthy)
        signature, healthy, pair = alike.signature, alike.healthy, alike.notes
    bank = at_operating_point(bank, speed_rpm=speed_rpm, torque=torque, teeth=signature.teeth)
    (point,) = bank.points
    if healthy is None:
        path = direct_path(len(signature.tsa), highest=signature.highest_order)
        comparison = compare(bank, signature.tsa, path, noise=_noise(signature), averages=signature.averages)
    else:
        comparison = _compare_behind_path(bank, signature, healthy)
    disagree = any(note.code == MARKS_DISAGREE for note in pair)
    kind, answer = _answer(comparison, _counted(signature.absolute, disagree))
    return Diagnosis(
        signature=signature,
        healthy=healthy,
        kind=kind,
        answer=answer,
        comparison=comparison,
        missing=tuple(missing_notes(signature, healthy, mark=signature.absolute or disagree)),
        notes=(
            *pair,
            *operating_point_notes(point, speed_rpm, torque),
            *path_notes(comparison.reference),
            *fm4_notes(signature, healthy),
        ),
        reading=tuple(reading_notes(signature, healthy)),
    )


def absent_gears(signatures: Mapping[str, RecordedSignature | NoMeshError]) -> dict[str, str]:
    """Return why the gear is not to be seen, for each of the recordings where it is not.

    Where a mesh stands out in one recording, without anything that repeats once a revolution, another recording in
    which the gear is present at nearly the same speed shows that it is the same mesh.
    """
    speeds = [
        result.speed_rpm
        for result in signatures.values()
        if isinstance(result, RecordedSignature) and result.presence.present
    ]
    reasons = {}
    for name, result in signatures.items():
        if isinstance(result, NoMeshError):
            reasons[name] = str(result)
        elif not (result.presence.present or (result.presence.unverified and _any_near(result.speed_rpm, speeds))):
            reasons[name] = f"{result.source}: {result.presence.reason}"
    return reasons


def _any_near(speed_rpm: float, speeds: Sequence[float]) -> bool:
    return any(abs(other - speed_rpm) <= _SAME_SPEED * other for other in speeds)


_WHICH = {
    ("recording",): "of this recording",
    ("healthy",): "of the healthy recording",
    ("recording", "healthy"): "of this recording, nor of the healthy one",
}


def unjudged(
    signature: RecordedSignature | None, healthy: RecordedSignature | None, reasons: Mapping[str, str], *, teeth: int
) -> Diagnosis:
    """Return the diagnosis of recordings in which the gear is not to be seen: there is no answer on its teeth."""
    notes = tuple(
        Note(code=NO_MESH, text=f"{reason}.", values={"recording": name, "teeth": teeth})
        for name, reason in reasons.items()
    )
    return Diagnosis(
        signature=signature,
        healthy=healthy,
        kind="cannot be judged",
        answer=f"Cannot be judged: no mesh of {teeth} teeth stands out {_WHICH[tuple(reasons)]}.",
        comparison=None,
        missing=(),
        notes=notes,
        reading=() if signature is None else tuple(reading_notes(signature, healthy)),
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


def _counted(absolute: bool, disagree: bool) -> str:
    """Return how teeth are counted, in words; empty where they are counted from the mark."""
    if absolute:
        return ""
    why = "the tacho marks of the two recordings do not agree" if disagree else "there is no tacho mark"
    return f", counted from where the average begins, since {why}"


def _answer(comparison: Comparison, counted: str) -> tuple[Kind, str]:
    """Return the kind of the answer, and a sentence."""
    teeth = [tooth for tooth in comparison.candidates if tooth]
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
