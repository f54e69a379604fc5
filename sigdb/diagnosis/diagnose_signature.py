"""Diagnosis of a signature against healthy signatures of the same machine."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sigdb.core import InputError, Note
from sigdb.diagnosis.alike import MARKS_DISAGREE, make_alike
from sigdb.diagnosis.answers import damage_answer, quiet_answer, repeating_answer
from sigdb.diagnosis.change.average_spectrum import LEAST_GROUPS, AverageSpectrum
from sigdb.diagnosis.change.finding import find, healthy_law, stands_out
from sigdb.diagnosis.change.healthy_set import HealthySet
from sigdb.diagnosis.change.level import level_change
from sigdb.diagnosis.change.location import locate
from sigdb.diagnosis.change.power import power
from sigdb.diagnosis.change.template_fit import fit_templates
from sigdb.diagnosis.change.templates import Templates
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

    Raises
    ------
    InputError
        If averages and templates have different lengths, or the recordings differ in their quantity.
    """
    present = {"recording": signature} | {f"healthy {i + 1}": each for i, each in enumerate(healthy)}
    reasons = absent_gears(present)
    reading = tuple(reading_notes(signature, healthy))
    if reasons:
        return unjudged(signature, healthy, reasons, teeth=signature.teeth, reading=reading)
    if not healthy:
        return _without_healthy(signature, reading)
    if templates is not None and templates.samples != len(signature.tsa):
        raise InputError(
            f"averages of the templates have {templates.samples} samples, those of the recording {len(signature.tsa)}; "
            "average with as many samples a tooth"
        )
    pairs = [make_alike(signature, each) for each in healthy]
    disagree = any(note.code == MARKS_DISAGREE for pair in pairs for note in pair.notes)
    signature = next((pair.signature for pair in pairs if not pair.signature.absolute), pairs[0].signature)
    healthy = [pair.healthy for pair in pairs]
    pair_notes = tuple({note.text: note for pair in pairs for note in pair.notes}.values())
    short = next((each for each in (signature, *healthy) if len(each.groups) < LEAST_GROUPS), None)
    common = Diagnosis(
        signature=signature,
        healthy=tuple(healthy),
        kind="cannot be judged",
        answer="",
        assumed=tuple(assumed),
        missing=tuple(missing_notes(signature, healthy, mark=signature.absolute or disagree)),
        reading=reading,
    )
    if short is not None:
        answer = f"Cannot be judged: {short.source} has {len(short.groups)} revolutions, fewer than {LEAST_GROUPS}."
        return replace(common, answer=answer, notes=pair_notes)
    absolute = signature.absolute and all(each.absolute for each in healthy)
    run = AverageSpectrum.of(signature)
    reference_set = HealthySet.of(healthy, healthy_torques or [None] * len(healthy))
    if not absolute:
        reference_set = replace(reference_set, absolute=False)
    reference, turn, reference_notes = reference_set.reference(run, speed_rpm=signature.speed_rpm, torque=torque)
    turned = reference.turned(turn)
    behind = None if templates is None else templates.behind(turned, absolute=absolute)
    law = healthy_law(reference_set, behind)
    finding = find(run, reference, turn=turn, law=law, templates=behind)
    if not finding.change.bands:
        answer = (
            "Cannot be judged: the recordings have no band in common in which a tooth could be seen; a sampling rate "
            f"above {2.4 * signature.teeth * signature.speed_rpm / 60:.3g} Hz is needed."
        )
        return replace(common, answer=answer, finding=finding, law=law, notes=(*pair_notes, *reference_notes))
    level = level_change(
        run,
        turned,
        reference_set,
        speeds_rpm=_nearest(signature.speed_rpm, [each.speed_rpm for each in healthy]),
        torques=_nearest(torque, healthy_torques or ()),
    )
    counted = _counted(signature.absolute and absolute, disagree)
    fit = None
    if behind is not None and behind.templates.described and finding.stands_out:
        fit = fit_templates(finding.change, behind)
    locations = locate(finding, behind, fit)
    if locations:
        kind, answer = damage_answer(locations, counted)
        seen = None
    else:
        seen = power(
            run,
            lambda each: stands_out(each, reference, turn=turn, law=law, templates=behind),
            templates=None if templates is None else templates.behind(run, absolute=absolute),
        )
        kind, answer = quiet_answer(level, seen, counted)
    return replace(
        common,
        kind=kind,
        answer=answer,
        reference=np.fft.irfft(turned.mean, turned.samples),
        finding=finding,
        law=law,
        locations=locations,
        level=level,
        power=seen,
        severity=None if fit is None else fit.severity,
        notes=(
            *pair_notes,
            *reference_notes,
            *turn_notes(finding, absolute=absolute),
            *method_notes(finding),
            *shaft_notes(signature, healthy),
            *fm4_notes(signature, healthy[0]),
        ),
    )


def _nearest(value: float | None, others: Sequence[float | None]) -> tuple[float | None, float | None]:
    """Return a speed or torque with that of the reference: the same within the range of the healthy recordings."""
    stated = [other for other in others if other is not None]
    if value is None or not stated:
        return value, None
    return value, min(max(value, min(stated)), max(stated))


def _without_healthy(signature: RecordedSignature, reading: tuple[Note, ...]) -> Diagnosis:
    """Return the diagnosis without a healthy recording: whether one event repeats in nearly every revolution."""
    kind, answer = repeating_answer(signature.repeatability)
    return Diagnosis(
        signature=signature,
        healthy=(),
        kind=kind,
        answer=answer,
        missing=tuple(missing_notes(signature, (), mark=signature.absolute)),
        notes=(*shaft_notes(signature, ()), *fm4_notes(signature, None)),
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


def _counted(absolute: bool, disagree: bool) -> str:
    """Return how teeth are counted, in words; empty where they are counted from the mark."""
    if absolute:
        return ""
    why = "the tacho marks of the two recordings do not agree" if disagree else "there is no tacho mark"
    return f", counted from where the average begins, since {why}"
