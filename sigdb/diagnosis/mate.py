"""The gear that meshes with the diagnosed one: whether the damaged tooth is one of its teeth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

from sigdb.core import InputError, Note, validated
from sigdb.diagnosis.answers import power_sentence
from sigdb.diagnosis.diagnose_signature import Aligned, Comparison, diagnose_signature
from sigdb.diagnosis.diagnosis import Diagnosis
from sigdb.diagnosis.joined_signature import joined_signature
from sigdb.diagnosis.notes import OTHER_SHAFT
from sigdb.recording import (
    AveragingSettings,
    NoMeshError,
    RecordedSignature,
    Recording,
    RecordingBlocks,
    recorded_signature,
)
from sigdb.transmission import Transmission

_ALONE = 2.0
"""Least pulse of a tooth of the mate relative to the greatest of its other teeth. Errors of the teeth that change with
the load make teeth differ; of 80 independent energies of noise the greatest is twice the next one in 2.5 % of cases."""

OTHER_GEAR = "other-gear"
"""Code of the note that the damaged tooth is one of the mate."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mate:
    """A gear that meshes with the diagnosed one, by its averages of the same recordings.

    Attributes
    ----------
    signature, healthy
        Signatures of the mate in the recording and in the healthy recordings.
    torque, healthy_torques
        As of :func:`sigdb.diagnosis.diagnose_signature.diagnose_signature`.
    """

    signature: RecordedSignature
    healthy: tuple[RecordedSignature, ...]
    torque: float | None
    healthy_torques: Sequence[float | None]

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording | RecordingBlocks],
        signatures: Sequence[RecordedSignature],
        rig: Transmission,
        settings: AveragingSettings,
        *,
        runs: int = 1,
        torque: float | None,
        healthy_torques: Sequence[float | None],
    ) -> Self:
        """Average the recordings over the turn of the mate, and the healthy ones after them.

        Parameters
        ----------
        recordings, signatures
            The recordings and the healthy recordings, with their signatures of the diagnosed gear.
        rig
            The rig, in which the diagnosed gear has one mate.
        settings
            Settings of the averages of the diagnosed gear.
        runs
            Number of the recordings that are no healthy ones; several are joined.
        torque, healthy_torques
            As above.

        Raises
        ------
        InputError
            If there are several mates, the mate turns equally fast, or it cannot be averaged or seen in one of the
            recordings.
        """
        gear = signatures[0].gear
        pairs = [(mesh.driving, mesh.driven) for mesh in rig.meshes.values()]
        mates = sorted({name for pair in pairs if gear in pair for name in pair if name != gear})
        if len(mates) != 1:
            raise InputError(f"{gear} meshes with {', '.join(mates)}, and only one mate can be compared")
        (mate,) = mates
        ratio = signatures[0].teeth / rig.gears[mate].teeth
        if ratio == 1:
            raise InputError(f"{gear} and {mate} turn equally fast, so that their averages are alike")
        averaged = []
        for recording, signature in zip(recordings, signatures, strict=True):
            facts = settings.model_dump(exclude={"teeth", "speed_range_rpm", "revolutions", "envelope_band"})
            facts |= {"gear": mate, "speed_rpm": ratio * signature.speed_rpm}
            of_mate = validated(AveragingSettings, facts, owner="the mate's average")
            result = recorded_signature(_about(recording, ratio), of_mate, rig=rig)
            if not result.presence.present:
                raise NoMeshError(f"{result.source}: {result.presence.reason}")
            averaged.append(result)
        run = joined_signature(averaged[:runs])
        return cls(signature=run, healthy=tuple(averaged[runs:]), torque=torque, healthy_torques=healthy_torques)

    @cached_property
    def comparison(self) -> Comparison:
        """The comparison with the healthy recordings, by pulses alone."""
        aligned = Aligned.of(self.signature, self.healthy)
        return Comparison.of(aligned, None, self.torque, self.healthy_torques)

    @property
    def one_tooth(self) -> bool:
        """Whether one tooth of the mate stands out, of healthy recordings and of its other teeth."""
        finding = self.comparison.finding
        others = finding.pulse.value[finding.change.others].max(initial=0.0)
        return finding.stands_out and finding.pulse.greatest >= _ALONE * float(others)

    def diagnosis(self) -> Diagnosis:
        """Return the mate's own diagnosis, by pulses alone."""
        return diagnose_signature(
            self.signature,
            self.healthy,
            torque=self.torque,
            healthy_torques=self.healthy_torques,
            named=str(self.signature.gear),
        )


def diagnosis_of_pair(diagnosis: Diagnosis, mate: Mate) -> Diagnosis:
    """Return the diagnosis of the gear with whose turn a change repeats: the diagnosed one, or its mate.

    A damaged tooth of the mate meets several teeth of this gear, and stands out of its average too, with a part of its
    size. So the event of a tooth is greater in the average of its own gear. Pulses are compared, each relative to what
    noise alone exceeds in one of 1000 averages.

    Parameters
    ----------
    diagnosis
        Diagnosis of a gear.
    mate
        The gear that meshes with it.
    """
    finding = diagnosis.finding
    if finding is None or diagnosis.signature is None or not mate.comparison.finding.change.bands:
        return diagnosis
    ours, theirs = finding.pulse.greatest, mate.comparison.finding.pulse.greatest
    gear, other = str(diagnosis.signature.gear), str(mate.signature.gear)
    values: dict[str, float | str] = {"gear": gear, "gear_pulse": ours, "mate": other, "mate_pulse": theirs}
    stronger = (
        f"The change repeats with the turn of {{}} more than with that of {{}}: pulses are {theirs:.3g} times those of "
        f"noise over the turn of {other}, {ours:.3g} times over that of {gear}."
    )
    if mate.one_tooth and theirs > ours:
        note = Note(code=OTHER_GEAR, text=stronger.format(other, gear), values=values)
        theirs_alone = mate.diagnosis()
        return replace(theirs_alone, notes=(note, *_without_shaft(theirs_alone, diagnosis.signature)))
    if mate.comparison.finding.stands_out and theirs > ours:
        text = (
            f"Teeth of {other} differ from the healthy recordings, by pulses of {theirs:.3g} times those of noise, but "
            "none of them alone: load and wear change teeth so, and damage of several."
        )
        note = Note(code="mate-differs", text=text, values=values)
    elif finding.stands_out:
        note = Note(code="this-gear", text=stronger.format(gear, other), values=values)
    else:
        seen = mate.comparison.power()
        values |= {} if seen.smallest is None else {"smallest_pulse": seen.smallest}
        text = f"No tooth of {other} stands out either, by pulses alone; {power_sentence(seen)}."
        note = Note(code="mate-unchanged", text=text, values=values)
    return replace(diagnosis, notes=(*_without_shaft(diagnosis, mate.signature), note))


def mate_note(error: InputError) -> Note:
    """Return the note that the mate was not compared, and why."""
    text = f"The gear that meshes with this one was not compared: {error}. So a damaged tooth may be one of that gear."
    return Note(code="mate-not-compared", text=text)


def _about(recording: Recording | RecordingBlocks, ratio: float) -> Recording | RecordingBlocks:
    """Return a recording whose shaft of interest is another one, which turns ``ratio`` times as fast."""
    whole = recording.whole if isinstance(recording, RecordingBlocks) else recording
    speed = None if whole.speed_rpm is None else ratio * whole.speed_rpm
    whole = replace(whole, ratio=ratio * whole.ratio, speed_rpm=speed, teeth=None)
    if not isinstance(recording, RecordingBlocks):
        return whole
    settings = recording.settings.model_copy(update={"ratio": whole.ratio, "speed_rpm": speed, "teeth": None})
    return replace(recording, whole=whole, settings=settings)


def _without_shaft(diagnosis: Diagnosis, signature: RecordedSignature) -> tuple[Note, ...]:
    """Return the notes but those that something turns with the shaft of a gear that was compared itself."""
    shaft = f"shaft {signature.shaft}"
    return tuple(
        note
        for note in diagnosis.notes
        if note.code != OTHER_SHAFT or str(note.values["shaft"]).removesuffix(" x2") != shaft
    )
