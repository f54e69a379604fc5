"""Finding: the statistics of a change with the limits that healthy recordings give them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import Change, change_from
from sigdb.diagnosis.change.healthy_set import HealthySet
from sigdb.diagnosis.change.statistics import (
    INDEPENDENT,
    NOISE_ALARMS,
    Statistic,
    pulse_evidence,
    pulse_statistic,
    template_statistic,
)
from sigdb.diagnosis.change.template_fit import likelihood_statistic
from sigdb.diagnosis.change.templates import BehindPath

_PIECES = (24, 8, 4, 2)
"""Numbers of pieces into which a healthy recording is cut."""

_WIDER = 1.5
"""Ratio of a change's median energy to the greatest of pieces of one recording above which it is of another kind."""

_ENOUGH = 5
"""Number of healthy recordings from which on their differences say what other loads and mountings do."""

_CAUTION = 1.25
"""Factor of every limit; assumed. The greatest of n pieces alone would be exceeded once in n + 1."""

_WIDE = 1.5
"""Least limit, but for that factor, of a change that is wider than within healthy recordings, unless five or more were
compared. Fitted: in 32 pairs of public recordings of one undamaged gearbox, at other loads or with moved sensors, the
greatest statistics were 1.6 times those of noise. It does not multiply the greatest of the pieces: those show tails of
the noise, and a wide change is hardly noise."""


@dataclass(frozen=True, kw_only=True)
class HealthyLaw:
    """Limits of the statistics, counted on healthy recordings.

    Attributes
    ----------
    pieces
        Number n of independent healthy pieces.
    pulse, template, likelihood
        Greatest statistic of the pieces; 0 for one that is not used.
    evidence
        Greatest evidence of a pulse in the pieces, over that which noise has once in 1000.
    widest
        Greatest median energy of pieces of one recording.
    recordings
        Number of healthy recordings.
    """

    pieces: int
    pulse: float
    template: float
    likelihood: float
    evidence: float
    widest: float
    recordings: int

    @property
    def false_alarms(self) -> float:
        """Rate of false alarms that the pieces support: 1 / (n + 1), at least that of noise alone."""
        return max(1 / (self.pieces + 1), NOISE_ALARMS)


@dataclass(frozen=True, kw_only=True, eq=False)
class Finding:
    """Statistics of the change of a run, with their limits.

    Attributes
    ----------
    change
        The change.
    pulse, template, likelihood
        The statistics; ``template`` is None without templates, ``likelihood`` without a described rig.
    pulse_limit, template_limit, likelihood_limit
        Limits above which they are an alarm.
    wider
        Whether the change is wider than within healthy recordings, for which limits are raised.
    evidence
        (8 Z,) logarithm of the density of the change with a pulse at each place over that without, and over its limit
        from the healthy pieces.
    """

    change: Change
    pulse: Statistic
    template: Statistic | None
    likelihood: Statistic | None
    pulse_limit: float
    template_limit: float
    likelihood_limit: float
    wider: bool
    evidence: FloatArray

    @property
    def template_evidence(self) -> FloatArray | None:
        """The same of the templates of a described rig, (8 Z,) at each place of the first contact; None without."""
        if self.likelihood is None:
            return None
        # The statistic is that of the mean over independent places; at one of them the evidence is greater.
        return np.asarray((self.likelihood.ratio + np.log(INDEPENDENT * self.change.teeth)) / self.likelihood_limit)

    @property
    def score(self) -> float:
        """Greatest ratio of a statistic to its limit; above 1 a tooth stands out."""
        pairs = (
            (self.pulse, self.pulse_limit),
            (self.template, self.template_limit),
            (self.likelihood, self.likelihood_limit),
        )
        return max(statistic.greatest / limit for statistic, limit in pairs if statistic is not None)

    @property
    def stands_out(self) -> bool:
        """Whether a tooth stands out."""
        return self.score > 1


def healthy_law(healthy: HealthySet, templates: BehindPath | None) -> HealthyLaw:
    """Count the statistics on pieces of healthy recordings.

    Each recording is cut into 24, 8, 4 and 2 pieces, and each piece is compared with the rest of its recording. Each of
    several recordings is compared with the reference that the others give. The 24 pieces and the further recordings are
    independent.
    """
    within = list(changes_within(healthy))
    every = [*within, *changes_between(healthy)]
    statistics = [_statistics(change, templates) for change in every]
    pulse, template, likelihood = (
        max(0.0 if each is None else each.greatest for each in some) for some in zip(*statistics, strict=True)
    )
    return HealthyLaw(
        pieces=sum(len(each.spectrum.groups) for each in healthy.recordings) + len(healthy) - 1,
        pulse=pulse,
        template=template,
        likelihood=likelihood,
        evidence=max(float(pulse_evidence(change).max()) for change in every) / -np.log(NOISE_ALARMS),
        widest=max(change.middle for change in within),
        recordings=len(healthy),
    )


def _statistics(change: Change, templates: BehindPath | None) -> tuple[Statistic, Statistic | None, Statistic | None]:
    """Return the statistics of pulses, of templates, and of templates behind the path of a described rig."""
    pulse = pulse_statistic(change)
    if templates is None:
        return pulse, None, None
    template = template_statistic(change, templates)
    return pulse, template, likelihood_statistic(change, templates) if templates.templates.described else None


def changes_within(healthy: HealthySet) -> Iterator[Change]:
    for each in healthy.recordings:
        spectrum, G = each.spectrum, len(each.spectrum.groups)
        for count in _PIECES:
            if count > G:
                continue
            for piece in np.array_split(np.arange(G), count):
                rest = np.setdiff1d(np.arange(G), piece)
                yield change_from(spectrum.part(piece), spectrum.part(rest), turn=0.0)


def changes_between(healthy: HealthySet) -> Iterator[Change]:
    for number, each in enumerate(healthy.recordings if len(healthy) > 1 else ()):
        others = healthy.without(number)
        speed = each.signature.speed_rpm
        reference, turn, _ = others.reference(each.spectrum, speed_rpm=speed, torque=each.torque)
        yield change_from(each.spectrum, reference, turn=turn)


def find(
    run: AverageSpectrum, reference: AverageSpectrum, *, turn: float, law: HealthyLaw, templates: BehindPath | None
) -> Finding:
    """Return the finding of a run against its healthy reference.

    Parameters
    ----------
    run, reference
        Spectra of the run and of its healthy reference.
    turn
        Turn of the reference to the run.
    law
        Limits from the healthy recordings.
    templates
        Templates of the rig or its ensemble; None for pulses alone.
    """
    change = change_from(run, reference, turn=turn)
    wider = law.recordings < _ENOUGH and change.middle > _WIDER * law.widest
    pulse, template, likelihood = _statistics(change, templates)
    return Finding(
        change=change,
        pulse=pulse,
        template=template,
        likelihood=likelihood,
        pulse_limit=_limit(law.pulse, wider),
        template_limit=_limit(law.template, wider),
        likelihood_limit=_limit(law.likelihood, wider),
        wider=wider,
        evidence=pulse_evidence(change) / _limit(law.evidence, wider),
    )


def stands_out(
    run: AverageSpectrum, reference: AverageSpectrum, *, turn: float, law: HealthyLaw, templates: BehindPath | None
) -> bool:
    """Return whether a tooth stands out, as :func:`find` finds it, without what is not needed for that."""
    change = change_from(run, reference, turn=turn)
    wider = law.recordings < _ENOUGH and change.middle > _WIDER * law.widest
    if pulse_statistic(change).greatest > _limit(law.pulse, wider):
        return True
    if templates is None:
        return False
    if template_statistic(change, templates).greatest > _limit(law.template, wider):
        return True
    described = templates.templates.described
    return described and likelihood_statistic(change, templates).greatest > _limit(law.likelihood, wider)


def _limit(greatest: float, wider: bool) -> float:
    """Return the limit of a statistic whose greatest value of healthy pieces is known."""
    return _CAUTION * max(_WIDE if wider else 1.0, greatest)
