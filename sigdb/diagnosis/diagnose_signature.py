"""Diagnosis of a signature against healthy signatures of the same machine."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from sigdb.core import Answer, InputError, Note
from sigdb.diagnosis.alike import MARKS_DISAGREE, make_alike, notes_of
from sigdb.diagnosis.answers import damage_answer, quiet_answer
from sigdb.diagnosis.change.average_spectrum import LEAST_GROUPS, AverageSpectrum
from sigdb.diagnosis.change.detectors import Detector, detectors
from sigdb.diagnosis.change.finding import Finding, HealthyLaw, find, healthy_law, stands_out
from sigdb.diagnosis.change.healthy_set import HealthySet
from sigdb.diagnosis.change.level import LevelChange, level_change
from sigdb.diagnosis.change.location import Location, locate
from sigdb.diagnosis.change.power import Power, power
from sigdb.diagnosis.change.template_fit import TemplateFit, fit_templates
from sigdb.diagnosis.change.templates import BehindPath, Templates
from sigdb.diagnosis.diagnosis import Diagnosis, unjudged
from sigdb.diagnosis.notes import fm4_notes, method_notes, missing_notes, reading_notes, shaft_notes, turn_notes
from sigdb.recording import NoMeshError, RecordedSignature

_SAME_SPEED = 0.05
"""Relative difference of two speeds up to which a mesh in one recording is that of the other."""


def diagnose_signature(
    signature: RecordedSignature,
    healthy: Sequence[RecordedSignature] = (),
    *,
    templates: Templates | None = None,
    torque: float | None = None,
    healthy_torques: Sequence[float | None] | None = None,
    assumed: Sequence[str] = (),
    named: str = "",
) -> Diagnosis:
    """Diagnose the signature of a recording.

    Parameters
    ----------
    signature
        Signature of the recording.
    healthy
        Signatures of healthy recordings of the same machine, by the same channel.
    templates
        Templates of the rig or of an ensemble, at the recording's operating point; None for none.
    torque, healthy_torques
        Torque of the recording and of each healthy recording, N m, or their loads in any one unit; None if unknown.
    assumed
        Assumptions on the templates, in sentences.
    named
        Name of the gear for the answer; empty for an answer that names none.

    Raises
    ------
    InputError
        If averages and templates have different lengths, or the recordings differ in their quantity.
    """
    reading = tuple(reading_notes(signature, healthy))
    if reasons := absent_gears({"recording": signature} | {f"healthy {i + 1}": each for i, each in enumerate(healthy)}):
        return unjudged(signature, healthy, reasons, teeth=signature.teeth, reading=reading)
    if not healthy:
        return _without_healthy(signature, reading)
    if templates is not None and templates.samples != len(signature.tsa):
        raise InputError(
            f"averages of the templates have {templates.samples} samples, those of the recording {len(signature.tsa)}; "
            "average with as many samples a tooth"
        )
    aligned = Aligned.of(signature, healthy)
    common = Diagnosis(
        signature=aligned.signature,
        healthy=aligned.healthy,
        kind="cannot be judged",
        answer="",
        assumed=tuple(assumed),
        missing=tuple(missing_notes(aligned.signature, aligned.healthy, mark=aligned.marked)),
        notes=aligned.notes,
        reading=reading,
    )
    if reason := aligned.too_short():
        return _answered(common, Answer.of("cannot be judged", reason=reason))
    torques = list(healthy_torques or [None] * len(healthy))
    compared = Comparison.of(aligned, templates, torque, torques)
    common = replace(
        common, finding=compared.finding, law=compared.law, notes=(*aligned.notes, *compared.reference_notes)
    )
    if not compared.finding.change.bands:
        return _answered(common, _no_common_band(signature))
    decided = compared.detectors()
    locations, fit = compared.located()
    level = compared.level(torque, torques)
    seen = None if locations else compared.power(templates)
    counted = _counted(aligned, named)
    answer = damage_answer(locations, counted) if seen is None else quiet_answer(level, seen, counted)
    return replace(
        _answered(common, answer),
        reference=np.fft.irfft(compared.turned.mean, compared.turned.samples),
        detectors=decided,
        locations=locations,
        level=level,
        power=seen,
        severity=None if fit is None else fit.severity,
        notes=(*common.notes, *compared.notes(decided)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Aligned:
    """A recording and its healthy recordings in one unit and band, with the notes on what was changed for that.

    ``marked`` says whether the recording has a tacho mark, ``absolute`` whether the marks of all stand for one angle.
    """

    signature: RecordedSignature
    healthy: tuple[RecordedSignature, ...]
    notes: tuple[Note, ...]
    marked: bool
    marks_disagree: bool

    @classmethod
    def of(cls, signature: RecordedSignature, healthy: Sequence[RecordedSignature]) -> Self:
        pairs = [make_alike(signature, each) for each in healthy]
        disagree = any(note.code == MARKS_DISAGREE for pair in pairs for note in pair.notes)
        signature = next((pair.signature for pair in pairs if not pair.signature.absolute), pairs[0].signature)
        return cls(
            signature=signature,
            healthy=tuple(pair.healthy for pair in pairs),
            notes=notes_of(pairs),
            marked=signature.absolute or disagree,
            marks_disagree=disagree,
        )

    @property
    def absolute(self) -> bool:
        return all(each.absolute for each in (self.signature, *self.healthy))

    def too_short(self) -> str:
        """Return which of the recordings has too few revolutions; empty if none has."""
        for each in (self.signature, *self.healthy):
            if len(each.groups) < LEAST_GROUPS:
                return f"{each.source} has {len(each.groups)} revolutions, fewer than {LEAST_GROUPS}"
        return ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """A recording with its healthy reference, turned to it, and the statistics of their difference."""

    aligned: Aligned
    run: AverageSpectrum
    healthy: HealthySet
    reference: AverageSpectrum
    turn: float
    reference_notes: tuple[Note, ...]
    behind: BehindPath | None
    law: HealthyLaw
    finding: Finding

    @classmethod
    def of(
        cls, aligned: Aligned, templates: Templates | None, torque: float | None, torques: Sequence[float | None]
    ) -> Self:
        """Compare a recording with its healthy recordings, by pulses alone where there are no templates."""
        absolute, run = aligned.absolute, AverageSpectrum.of(aligned.signature)
        healthy = replace(HealthySet.of(aligned.healthy, torques), absolute=absolute)
        reference, turn, notes = healthy.reference(run, speed_rpm=aligned.signature.speed_rpm, torque=torque)
        behind = None if templates is None else templates.behind(reference.turned(turn), absolute=absolute)
        law = healthy_law(healthy, behind)
        return cls(
            aligned=aligned,
            run=run,
            healthy=healthy,
            reference=reference,
            turn=turn,
            reference_notes=notes,
            behind=behind,
            law=law,
            finding=find(run, reference, turn=turn, law=law, templates=behind),
        )

    @cached_property
    def turned(self) -> AverageSpectrum:
        """The reference, turned to the recording."""
        return self.reference.turned(self.turn)

    def located(self) -> tuple[tuple[Location, ...], TemplateFit | None]:
        """Return the teeth that stand out, and the templates that fit where the rig is described."""
        fit = None
        if self.behind is not None and self.behind.templates.described and self.finding.stands_out:
            fit = fit_templates(self.finding.change, self.behind)
        return locate(self.finding, self.behind, fit), fit

    def level(self, torque: float | None, torques: Sequence[float | None]) -> LevelChange:
        """Return the change of levels and sensor."""
        signature, healthy = self.aligned.signature, self.aligned.healthy
        return level_change(
            self.run,
            self.turned,
            self.healthy,
            speeds_rpm=_nearest(signature.speed_rpm, [each.speed_rpm for each in healthy]),
            torques=_nearest(torque, torques),
        )

    def power(self, templates: Templates | None = None) -> Power:
        """Return the damage that the recording would have shown."""

        def decide(run: AverageSpectrum) -> bool:
            return stands_out(run, self.reference, turn=self.turn, law=self.law, templates=self.behind)

        return power(
            self.run,
            decide,
            templates=None if templates is None else templates.behind(self.run, absolute=self.aligned.absolute),
        )

    def detectors(self) -> tuple[Detector, ...]:
        """Return the statistics with their limits and rates of false alarms."""
        return detectors(self.finding, self.law, self.healthy)

    def notes(self, decided: Sequence[Detector]) -> Iterator[Note]:
        """Yield the notes on the comparison."""
        signature, healthy = self.aligned.signature, self.aligned.healthy
        yield from turn_notes(self.finding, absolute=self.aligned.absolute)
        yield from method_notes(decided)
        yield from shaft_notes(signature, healthy)


def _answered(diagnosis: Diagnosis, answer: Answer) -> Diagnosis:
    return replace(diagnosis, kind=answer.kind, answer=answer.sentence)


def _no_common_band(signature: RecordedSignature) -> Answer:
    rate = 2.4 * signature.teeth * signature.speed_rpm / 60
    reason = (
        "the recordings have no band in common in which a tooth could be seen; a sampling rate above "
        f"{rate:.3g} Hz is needed"
    )
    return Answer.of("cannot be judged", reason=reason)


def _nearest(value: float | None, others: Sequence[float | None]) -> tuple[float | None, float | None]:
    """Return a speed or torque with that of the reference: the same within the range of the healthy recordings."""
    stated = [other for other in others if other is not None]
    if value is None or not stated:
        return value, None
    return value, min(max(value, min(stated)), max(stated))


def _without_healthy(signature: RecordedSignature, reading: tuple[Note, ...]) -> Diagnosis:
    """Return the diagnosis without a healthy recording: whether one event repeats in nearly every revolution."""
    repeats = signature.repeatability
    if repeats is None:
        raise InputError(f"{signature.source}: no healthy recording is given; give one with healthy")
    return Diagnosis(
        signature=signature,
        healthy=(),
        kind=repeats.kind,
        answer=repeats.answer,
        missing=tuple(missing_notes(signature, (), mark=signature.absolute)),
        notes=(*shaft_notes(signature, ()), *fm4_notes(signature)),
        reading=reading,
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


def _counted(aligned: Aligned, named: str) -> str:
    """Return the gear, where it is named, and how teeth are counted, in words; not where they are from the mark."""
    of = f" of {named}" if named else ""
    if aligned.absolute:
        return of
    disagree = aligned.marks_disagree
    why = "the tacho marks of the two recordings do not agree" if disagree else f"there is no tacho mark{of}"
    return f"{of}, counted from where the average begins, since {why}"
