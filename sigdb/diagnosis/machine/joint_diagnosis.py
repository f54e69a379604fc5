"""One answer from recordings of a machine by several channels, at several speeds and loads."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, Unpack

import numpy as np

from sigdb.core import ANSWERS, Answer, FloatArray, InputError, Kind, Note, plain
from sigdb.diagnosis.answers import quiet_answer
from sigdb.diagnosis.diagnosis import Diagnosis
from sigdb.diagnosis.joined_signature import SAME_LOAD, SAME_SPEED, Candidate
from sigdb.diagnosis.machine.joint_posterior import CREDIBILITY, JointPosterior
from sigdb.diagnosis.machine.machine_recordings import AnyRecording, DiagnosisOptions, MachineRecordings
from sigdb.recording import RecordedSignature
from sigdb.transmission import Transmission

CONTRADICTION = "averages-contradict"
"""Code of the note that an average, alone, has another answer than all together."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JointPart:
    """The average of one channel at one operating point, and its evidence for a joint answer.

    Attributes
    ----------
    channel
        Its channel.
    recordings
        Numbers of its recordings, from 0.
    diagnosis
        Its diagnosis alone.
    contribution
        (Z,) logarithm of the density with damage at each tooth over that without, by it alone; None where it takes no
        part.
    """

    channel: str
    recordings: tuple[int, ...]
    diagnosis: Diagnosis
    contribution: FloatArray | None = None

    @property
    def speed_rpm(self) -> float:
        """Speed, rpm; nan where no mesh could be followed."""
        return np.nan if self.diagnosis.signature is None else self.diagnosis.signature.speed_rpm


@dataclass(frozen=True, kw_only=True, eq=False)
class JointDiagnosis:
    """The diagnosis of a machine from several averages.

    Attributes
    ----------
    kind, answer
        As of :class:`Diagnosis`.
    gear
        Gear that the answer is on; None with a tooth count alone.
    parts
        The averages.
    posterior
        Probabilities of no damage and of damage at each tooth; None where none of the averages takes part.
    candidates
        Teeth that stand out; empty where none does.
    notes
        Notes on the joint answer.
    """

    kind: Kind
    answer: str
    gear: str | None
    parts: tuple[JointPart, ...]
    posterior: JointPosterior | None = None
    candidates: tuple[int, ...] = ()
    notes: tuple[Note, ...] = field(default=())

    @property
    def exit_code(self) -> int:
        """0 without damage, 1 with damage, 3 without an answer."""
        return ANSWERS[self.kind].exit_code

    def as_json(self) -> dict[str, Any]:
        """Return the diagnosis as plain values for JSON.

        Returns
        -------
        dict
            ``answer``, ``kind``, ``exit_code``, ``gear``, ``candidates``, ``none`` (probability of no damage),
            ``teeth`` (that of damage at each), ``evidence``, ``notes``, and ``parts``: ``channel``, ``recordings``,
            ``speed_rpm``, ``contribution`` and ``diagnosis`` of each. Numbers without a value are None.
        """
        posterior = self.posterior
        facts = {
            "answer": self.answer,
            "kind": self.kind,
            "exit_code": self.exit_code,
            "gear": self.gear,
            "candidates": self.candidates,
            "none": None if posterior is None else posterior.none,
            "teeth": None if posterior is None else posterior.teeth,
            "evidence": None if posterior is None else posterior.evidence,
            "notes": self.notes,
            "parts": [
                {
                    "channel": part.channel,
                    "recordings": part.recordings,
                    "speed_rpm": part.speed_rpm,
                    "contribution": part.contribution,
                    "diagnosis": part.diagnosis.as_json(),
                }
                for part in self.parts
            ],
        }
        return {name: plain(value) for name, value in facts.items()}


def diagnose_jointly(
    recording: AnyRecording | Sequence[AnyRecording],
    rig: Transmission | str | PathLike[str] | None = None,
    *,
    healthy: AnyRecording | Sequence[AnyRecording],
    teeth: str | int | None = None,
    module: float | str | None = None,
    model: str | PathLike[str] | None = None,
    database: str | PathLike[str] | None = None,
    gear: str | None = None,
    sensor: str | None = None,
    torque: float | None = None,
    healthy_torque: Sequence[float] = (),
    load: float | None = None,
    healthy_load: Sequence[float] = (),
    of_channels: Sequence[str] = (),
    where: str | None = None,
    **options: Unpack[DiagnosisOptions],
) -> JointDiagnosis:
    """Diagnose a gear from recordings by several channels, at several speeds and loads, with one answer.

    Recordings at one speed and load are joined into one average of each channel. Each average is diagnosed with the
    healthy recordings by its channel, near its speed and load. Their evidence then gives one posterior,
    :class:`JointPosterior`. A tooth stands out where damage has a probability of 0.9 or more, and its evidence is above
    the number of healthy pieces, so that noise exceeds it once in as many machines or more seldom. It also does where
    more than half of the averages show it alone.

    Parameters
    ----------
    recording, rig, healthy, teeth, module, model, database, gear, sensor, torque, healthy_torque, load, healthy_load
        As of :func:`diagnose`. Recordings at several speeds or loads begin at one tacho mark; their torques or loads
        are those that they state.
    of_channels
        Names of the channels whose averages take part; with none, the first one of the recordings.
    where, **options
        As of :func:`diagnose`, without ``channel``.

    Returns
    -------
    JointDiagnosis
        The answer, the posterior, and what each average adds.

    Raises
    ------
    InputError
        As of :func:`diagnose`; or if a channel is given twice, or recordings at several speeds or loads have no tacho
        mark.
    """
    if isinstance(healthy, Sequence) and not isinstance(healthy, str) and not healthy:
        raise InputError("several averages are joined to be compared with healthy recordings; give healthy")
    twice = [name for name, count in Counter(of_channels).items() if count > 1]
    if twice:
        raise InputError(f"channel {twice[0]!r} is given twice; give each channel once")
    first = MachineRecordings.of(
        recording, rig, healthy=healthy, teeth=teeth, module=module, model=model, database=database, gear=gear,
        sensor=sensor, torque=torque, where=where, **options,
    )  # fmt: skip
    machines = [first.by(name) for name in of_channels] or [first]
    groups = _points(machines[0].candidates[: first.count])
    if len(groups) > 1:
        _check_marks(machines[0].candidates[: first.count])
    parts = [
        JointPart(
            channel=machine.settings.channel or "",
            recordings=group,
            diagnosis=machine.diagnosis(
                group,
                sensor=sensor,
                torque=torque,
                healthy_torque=healthy_torque,
                load=load,
                healthy_load=healthy_load,
            ),
        )
        for machine in machines
        for group in groups
    ]
    return joint_answer(parts)


def joint_answer(parts: Sequence[JointPart]) -> JointDiagnosis:
    """Return the joint answer of averages of one machine, from the diagnosis of each.

    Averages without a common band, or without the gear, take no part. Where the change of some repeats with the turn of
    the mate, those of the gear that most are on take part.

    Parameters
    ----------
    parts : sequence of JointPart
        The averages.

    Returns
    -------
    JointDiagnosis
        The same averages, with what each adds.
    """
    seen = [part for part in parts if part.diagnosis.finding is not None and part.diagnosis.finding.change.bands]
    if not seen:
        reason = "the gear is not seen in any average: " + "; ".join(dict.fromkeys(_reason(part) for part in parts))
        answer = Answer.of("cannot be judged", reason=reason)
        return JointDiagnosis(kind=answer.kind, answer=answer.sentence, gear=None, parts=tuple(parts))
    ((gear, _),) = Counter(_gear(part) for part in seen).most_common(1)
    used = [part for part in seen if _gear(part) == gear]
    findings = [part.diagnosis.finding for part in used if part.diagnosis.finding is not None]
    posterior = JointPosterior.of(findings)
    added = dict(zip(map(id, used), posterior.contributions, strict=True))
    answer, candidates = _answer(used, posterior)
    return JointDiagnosis(
        kind=answer.kind,
        answer=answer.sentence,
        gear=gear,
        parts=tuple(
            JointPart(
                channel=part.channel,
                recordings=part.recordings,
                diagnosis=part.diagnosis,
                contribution=added.get(id(part)),
            )
            for part in parts
        ),
        posterior=posterior,
        candidates=candidates,
        notes=tuple(_notes(parts, used, posterior, gear)),
    )


def _answer(used: Sequence[JointPart], posterior: JointPosterior) -> tuple[Answer, tuple[int, ...]]:
    """Return the answer, and the teeth that stand out."""
    pieces = max(part.diagnosis.law.pieces for part in used if part.diagnosis.law is not None)
    teeth = posterior.candidates
    sure = posterior.none <= 1 - CREDIBILITY and posterior.evidence >= np.log(pieces + 1)
    if sure or _most_show(used, teeth):
        return Answer.of_teeth(teeth), teeth
    quiet = [part.diagnosis for part in used if part.diagnosis.power is not None]
    if posterior.none < 0.5 or not quiet:
        return Answer.of_teeth((0, *teeth)), ()
    best = min(quiet, key=lambda each: np.inf if each.power is None else each.power.smallest or np.inf)
    if best.level is None or best.power is None:
        return Answer.of_teeth((0, *teeth)), ()
    return quiet_answer(best.level, best.power, ""), ()


def _most_show(used: Sequence[JointPart], teeth: Sequence[int]) -> bool:
    """Return whether more than half of the averages show one of some teeth alone."""
    shown = Counter(tooth for part in used for tooth in part.diagnosis.candidates)
    return max(shown[tooth] for tooth in teeth) > len(used) / 2


def _notes(
    parts: Sequence[JointPart], used: Sequence[JointPart], posterior: JointPosterior, gear: str | None
) -> Iterator[Note]:
    """Yield notes on averages that take no part, and on those that contradict the joint answer."""
    for part in parts:
        name = part_name(part)
        if part not in used:
            text = f"{name} takes no part: {_reason(part)}."
            yield Note(code="average-left-out", text=text, values={"average": name})
    sure = posterior.none <= 1 - CREDIBILITY
    for part in used:
        assert part.diagnosis.finding is not None
        alone = JointPosterior.of([part.diagnosis.finding])
        name = part_name(part)
        if alone.none > 1 - CREDIBILITY:
            continue
        if not sure:
            says, all_say = f"damage at tooth {1 + int(alone.teeth.argmax())}", "no sure damage"
        elif not set(alone.candidates) & set(posterior.candidates):
            says, all_say = (f"tooth {1 + int(each.teeth.argmax())}" for each in (alone, posterior))
        else:
            continue
        text = (
            f"The averages contradict each other: {name} alone shows {says}, all together {all_say}. Check that the "
            "channels are not swapped, and that marks and sensors are those of the healthy recordings."
        )
        yield Note(code=CONTRADICTION, text=text, values={"average": name})


def part_name(part: JointPart) -> str:
    """Return the name of an average: its channel and speed."""
    speed = "" if np.isnan(part.speed_rpm) else f" at {part.speed_rpm:.5g} rpm"
    return f"channel {part.channel}{speed}" if part.channel else f"the first channel{speed}"


def _gear(part: JointPart) -> str | None:
    return None if part.diagnosis.signature is None else part.diagnosis.signature.gear


def _reason(part: JointPart) -> str:
    if part.diagnosis.kind == "cannot be judged":
        return part.diagnosis.answer.removeprefix("Cannot be judged: ").removesuffix(".")
    return f"its change repeats with the turn of {_gear(part)}"


def _points(candidates: Sequence[Candidate]) -> list[tuple[int, ...]]:
    """Return the numbers of recordings at each operating point; one in which no mesh is seen is a point of its own."""
    points: list[list[int]] = []
    for number, each in enumerate(candidates):
        for point in points:
            if _alike(candidates[point[0]], each):
                point.append(number)
                break
        else:
            points.append([number])
    return [tuple(point) for point in points]


def _alike(first: Candidate, other: Candidate) -> bool:
    if not isinstance(first.result, RecordedSignature) or not isinstance(other.result, RecordedSignature):
        return False
    near = [(first.result.speed_rpm, other.result.speed_rpm, SAME_SPEED)]
    near += [
        (a, b, SAME_LOAD)
        for a, b in ((first.torque, other.torque), (first.load, other.load))
        if a is not None and b is not None
    ]
    return all(abs(a - b) <= share * max(abs(a), abs(b)) for a, b, share in near)


def _check_marks(candidates: Sequence[Candidate]) -> None:
    for each in candidates:
        if isinstance(each.result, RecordedSignature) and not each.result.absolute:
            raise InputError(
                f"{each.result.source} has no tacho mark; recordings at several speeds or loads are joined by the "
                "mark: give tacho, or diagnose each alone"
            )
