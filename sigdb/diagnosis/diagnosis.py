"""Diagnosis of a gear: the answer, its evidence, and what would have been seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from sigdb.core import ANSWERS, Answer, FloatArray, Kind, Note, plain
from sigdb.diagnosis.change.detectors import Detector
from sigdb.diagnosis.change.finding import Finding, HealthyLaw
from sigdb.diagnosis.change.level import LevelChange
from sigdb.diagnosis.change.location import Location
from sigdb.diagnosis.change.power import Power
from sigdb.diagnosis.change.statistics import Statistic
from sigdb.recording import NO_MESH, RecordedSignature


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """The diagnosis of a recording.

    Attributes
    ----------
    signature
        Signature of the recording; None where no mesh could be followed.
    healthy
        Signatures of the healthy recordings.
    kind
        A key of :data:`sigdb.core.ANSWERS`: ``no change``, ``level changed``, ``one tooth`` or ``several teeth``;
        without a healthy recording ``nothing stands out`` or ``one event``; or ``cannot be judged``.
    answer
        The same as a sentence.
    reference
        (n,) healthy average at the run's load and speed, turned to the run; None with ``finding``.
    finding
        Statistics of the change with their limits; None without a healthy recording, or where nothing was compared.
    law
        Limits from the healthy recordings; None with ``finding``.
    detectors
        The statistics with their limits and rates of false alarms, FM4 and NA4 of the difference among them; empty
        with ``finding`` None.
    locations
        Teeth that stand out, the strongest first.
    level
        Change of levels and sensor; None with ``finding``.
    power
        Damage that would have been seen, where no tooth stands out; None elsewhere.
    severity
        ``target``, ``estimate``, ``low`` and ``high``; None where the rig does not support it.
    assumed
        Assumptions, in sentences.
    missing
        Notes on missing information that would improve the answer.
    notes
        Other notes on the answer.
    reading
        Notes on the reading and averaging of the recordings.
    """

    signature: RecordedSignature | None
    healthy: tuple[RecordedSignature, ...]
    kind: Kind
    answer: str
    reference: FloatArray | None = None
    finding: Finding | None = None
    law: HealthyLaw | None = None
    detectors: tuple[Detector, ...] = ()
    locations: tuple[Location, ...] = ()
    level: LevelChange | None = None
    power: Power | None = None
    severity: pd.DataFrame | None = None
    assumed: tuple[str, ...] = ()
    missing: tuple[Note, ...] = ()
    notes: tuple[Note, ...] = ()
    reading: tuple[Note, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 without damage, 1 with damage, 3 without an answer."""
        return ANSWERS[self.kind].exit_code

    @property
    def absolute(self) -> bool:
        """Whether teeth are counted from the tacho's mark."""
        return self.signature is not None and self.signature.absolute

    @property
    def candidates(self) -> tuple[int, ...]:
        """Teeth of the intervals of all teeth that stand out."""
        if self.signature is None:
            return ()
        Z = self.signature.teeth
        teeth = {(t - 1) % Z + 1 for each in self.locations for t in range(each.low, each.high + 1)}
        return tuple(sorted(teeth))

    def as_json(self) -> dict[str, Any]:
        """Return the diagnosis without signals as plain values for JSON.

        Returns
        -------
        dict
            ``answer``, ``kind``, ``exit_code``, ``absolute``, ``gear``, ``channel``, ``unit``, ``teeth`` (``tooth``,
            ``low``, ``high``, ``place``), ``false_alarms`` (``rate``, ``pieces``), ``statistics`` (value and limit of
            each, and the ``score``), ``detectors`` (``name``, ``value``, ``limit``, ``pieces``, ``false_alarm_rate``,
            ``alarm``, ``simulated``, ``decides``), ``tooth_map``, ``level``, ``power``, ``repeatability``,
            ``severity``, ``assumed``, ``missing``, ``notes`` and ``reading``. Tables are lists of rows, notes have
            ``code``, ``text`` and ``values``, and what was not evaluated is None.
        """
        signature, finding, law = self.signature, self.finding, self.law
        facts = {
            "answer": self.answer,
            "kind": self.kind,
            "exit_code": self.exit_code,
            "absolute": self.absolute,
            "gear": None if signature is None else signature.gear,
            "channel": None if signature is None else signature.channel,
            "unit": None if signature is None else signature.unit,
            "teeth": [vars(location) for location in self.locations],
            "false_alarms": None if law is None else {"rate": law.false_alarms, "pieces": law.pieces},
            "statistics": None if finding is None else _statistics(finding),
            "detectors": [_detector(each) for each in self.detectors],
            "tooth_map": None if finding is None else finding.change.tooth_map,
            "level": None if self.level is None else vars(self.level),
            "power": None if self.power is None else _power(self.power),
            "repeatability": None if signature is None else signature.repeatability,
            "severity": None if self.severity is None else self.severity.to_dict("records"),
            "assumed": self.assumed,
            "missing": self.missing,
            "notes": self.notes,
            "reading": self.reading,
        }
        return {name: plain(value) for name, value in facts.items()}


def _statistics(finding: Finding) -> dict[str, Any]:
    change = finding.change
    return {
        "score": finding.score,
        "pulse": _values(finding.pulse, finding.pulse_limit),
        "template": _values(finding.template, finding.template_limit),
        "likelihood": _values(finding.likelihood, finding.likelihood_limit),
        "misfit": change.misfit,
        "middle": change.middle,
        "likeness": change.likeness,
        "turn": change.turn,
        "wider": finding.wider,
    }


def _detector(detector: Detector) -> dict[str, Any]:
    facts = {"alarm": detector.alarm, "simulated": detector.simulated, "decides": detector.decides}
    return vars(detector) | facts


def _values(statistic: Statistic | None, limit: float) -> dict[str, float] | None:
    return None if statistic is None else {"value": statistic.greatest, "limit": limit, "place": statistic.place}


def _power(power: Power) -> dict[str, Any]:
    tables = {name: getattr(power, name).to_dict("records") for name in ("exceptions", "table")}
    return vars(power) | tables


_WHICH = {(True, False): "of this recording", (False, True): "of the healthy recording"}


def unjudged(
    signature: RecordedSignature | None,
    healthy: Sequence[RecordedSignature],
    reasons: Mapping[str, str],
    *,
    teeth: int,
    reading: Sequence[Note] = (),
) -> Diagnosis:
    """Return the diagnosis of recordings in which the gear is not to be seen: there is no answer on its teeth.

    Parameters
    ----------
    signature, healthy
        Signatures of those in which a mesh could be followed.
    reasons
        Why the gear is not to be seen: of ``recording``, and of healthy recordings by other names.
    teeth
        Tooth count of the gear.
    reading
        Notes on the reading.
    """
    notes = tuple(
        Note(code=NO_MESH, text=f"{reason}.", values={"recording": name, "teeth": teeth})
        for name, reason in reasons.items()
    )
    run = "recording" in reasons
    which = _WHICH.get((run, len(reasons) > run), "of this recording, nor of the healthy one")
    answer = Answer.of("cannot be judged", reason=f"no mesh of {teeth} teeth stands out {which}")
    return Diagnosis(
        signature=signature,
        healthy=tuple(healthy),
        kind=answer.kind,
        answer=answer.sentence,
        notes=notes,
        reading=tuple(reading),
    )
