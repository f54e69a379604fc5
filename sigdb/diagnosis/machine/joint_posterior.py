"""The posterior of the damaged tooth of a machine from what several averages show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, softmax
from scipy.stats import norm

from sigdb.core import BoolArray, FloatArray
from sigdb.diagnosis.change.change import PLACES
from sigdb.diagnosis.change.finding import Finding
from sigdb.diagnosis.change.location import EARLY, LATE, PLACE_ERROR, USUAL_LAG

CREDIBILITY = 0.9
"""Probability that the candidates of an answer hold together."""

_FAILED = 0.05
"""Probability that an average says nothing, since its sensor is dead, loose or another one; assumed."""

_SCATTER = 0.25
"""Standard deviation of the place of an event among averages of one machine, in tooth passes; assumed."""

_LEAST = 1e-16
"""Least density relative to the greatest, below which a circular sum is rounding."""

_TAIL = 1.96
"""Standard deviations within which a normal law has 95 %."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JointPosterior:
    """Probabilities of no damage and of damage at each tooth.

    Attributes
    ----------
    none
        Probability of no damage.
    teeth
        (Z,) probability that each tooth is the damaged one.
    evidence
        Logarithm of the density of all averages with damage, over that without.
    contributions
        (averages, Z) logarithm of the density with damage at each tooth over that without, by each average alone.
    """

    none: float
    teeth: FloatArray
    evidence: float
    contributions: FloatArray

    @classmethod
    def of(cls, findings: Sequence[Finding]) -> "JointPosterior":
        """Return the posterior of findings on one gear.

        The noise of averages is independent, so their evidence at one place of the turn adds up. Index errors are those
        of one pair of gears: a healthy average takes them out, but for what speed, load or mounting change. That is
        common to averages, so those whose change is wider than within healthy recordings count as one, with the mean of
        their evidence. An average may also say nothing, with a probability of 0.05.

        A pulse lies a lag after the first contact of its tooth. The lag is that of the damage and common to averages;
        its law has the median and the ends of the interval of a single diagnosis, with normal flanks. Places of
        averages scatter about it. Templates of a described rig lie at the first contact but for an error. Where there
        are some, the density is the mean of that by pulses and by templates. Damage and none are equally likely before,
        and so are all teeth.

        Parameters
        ----------
        findings
            Findings of averages from one tacho mark, of one gear.
        """
        total = _by_tooth(findings)
        share = softmax(np.append(0.0, total - np.log(len(total))))
        return cls(
            none=float(share[0]),
            teeth=np.asarray(share[1:]),
            evidence=float(logsumexp(total) - np.log(len(total))),
            contributions=np.array([_by_tooth([finding]) for finding in findings]),
        )

    @property
    def candidates(self) -> tuple[int, ...]:
        """The most probable teeth that hold 0.9 of the damage together, in rising order."""
        order = np.argsort(-self.teeth, kind="stable")
        enough = int(np.searchsorted(np.cumsum(self.teeth[order]), CREDIBILITY * self.teeth.sum())) + 1
        return tuple(sorted((order[:enough] + 1).tolist()))


def _by_tooth(findings: Sequence[Finding]) -> FloatArray:
    """Return the logarithm (Z,) of the density of changes with damage at each tooth, over that without."""
    wider = np.array([finding.wider for finding in findings])
    pulse = _along([finding.evidence for finding in findings], wider, lag=USUAL_LAG, early=EARLY, late=LATE)
    fits = [finding.template_evidence for finding in findings]
    templates = [each for each in fits if each is not None]
    if len(templates) < len(findings):
        return pulse
    fitted = _along(templates, wider, lag=0.0, early=PLACE_ERROR, late=PLACE_ERROR)
    return np.asarray(np.logaddexp(pulse, fitted) - np.log(2))


def _along(places: Sequence[FloatArray], wider: BoolArray, *, lag: float, early: float, late: float) -> FloatArray:
    """Return the logarithm (Z,) of the mean of densities over the law of a lag, from early to late about it.

    Parameters
    ----------
    places
        Logarithm (8 Z,) of the density of each average at each place.
    wider
        (averages,) whether the change of each is wider than within healthy recordings.
    lag, early, late
        In tooth passes.
    """
    near = np.array([_mean_near(each) for each in places])
    robust = np.logaddexp(np.log1p(-_FAILED) + near, np.log(_FAILED))
    total = (robust / np.where(wider, max(wider.sum(), 1), 1)[:, None]).sum(axis=0)
    off = _off(total.size, lag)
    weight = norm.logpdf(off, scale=np.where(off < 0, early, late) / _TAIL)
    weight -= logsumexp(weight)
    turned = [np.roll(weight, PLACES * tooth) + total for tooth in range(total.size // PLACES)]
    return np.asarray(logsumexp(turned, axis=1))


def _mean_near(places: FloatArray) -> FloatArray:
    """Return the logarithm of the mean of densities over the scatter of a place."""
    weight = norm.pdf(_off(places.size, 0.0), scale=_SCATTER)
    greatest = float(places.max())
    density = np.fft.irfft(np.fft.rfft(np.exp(places - greatest)) * np.fft.rfft(weight / weight.sum()), places.size)
    return np.asarray(greatest + np.log(np.maximum(density, _LEAST)))


def _off(size: int, lag: float) -> FloatArray:
    """Return the distances (size,) of places from a lag, in tooth passes around the turn."""
    teeth = size / PLACES
    return np.asarray((np.arange(size) / PLACES - lag + teeth / 2) % teeth - teeth / 2)
