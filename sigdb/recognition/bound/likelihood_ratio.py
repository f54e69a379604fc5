"""Detection by the likelihood ratio, the most powerful test at any rate of false alarms (Neyman, Pearson)."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import log_softmax, logsumexp, ndtri

from sigdb.core import FloatArray, InputError, IntArray, plain_array
from sigdb.database import QUANTITIES
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.metrics.detection import RATES

DETECTED = 0.9
"""Probability of detection that defines a90."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OptimalRoc:
    """The receiver operating characteristic of the likelihood ratio L = p(x | damage) / p(x | healthy).

    Damaged averages suffice: an average that is drawn under damage counts with the weight 1 / L as a healthy one, so
    the rate of false alarms above a threshold c is ``E[1{L > c} / L]`` under damage. Rates of 1e-4 and less need no
    more draws than greater ones.

    Attributes
    ----------
    log_ratio
        (draws,) log L of averages drawn under damage, in descending order.
    """

    log_ratio: FloatArray

    @property
    def p_detected(self) -> FloatArray:
        """(draws,) probability of detection where each value of the ratio is the threshold."""
        return np.arange(1, len(self.log_ratio) + 1) / len(self.log_ratio)

    @property
    def false_alarm_rate(self) -> FloatArray:
        """(draws,) rate of false alarms there."""
        return np.exp(np.logaddexp.accumulate(-self.log_ratio)) / len(self.log_ratio)

    def at(self, rate: float) -> tuple[float, float]:
        """Return the probability of detection at a rate of false alarms, and its standard error.

        The slope of the characteristic is the threshold c, so to first order the error is that of the mean of
        ``1{L > c} (1 - c / L)``. Where all draws are detected, or none, it is 0.
        """
        above = int(np.searchsorted(self.false_alarm_rate, rate, side="right"))
        if above in (0, len(self.log_ratio)):
            return float(above > 0), 0.0
        excess = np.zeros(len(self.log_ratio))
        excess[:above] = -np.expm1(self.log_ratio[above] - self.log_ratio[:above])
        return above / len(excess), float(excess.std() / np.sqrt(len(excess)))


def optimal_roc(
    point: OperatingPoint, places: IntArray, *, draws: int = 2000, seed: int = 0, specimens: bool = True
) -> OptimalRoc:
    """Compute the characteristic of the test for damage of some templates, averaged over teeth, against healthy gears.

    Parameters
    ----------
    point
        An operating point with healthy and damaged rows.
    places
        (k,) places of damaged templates among the hypotheses: one for a test of one severity. The test weighs several
        as the rows do.
    draws
        Number of damaged averages to draw, with the cases, noise and index errors of the rows of these templates.
    seed
        Seed of the draws.
    specimens
        Whether gears have index errors (tier B2), or are nominal (B0).

    Returns
    -------
    OptimalRoc
        The characteristic.

    Raises
    ------
    InputError
        If there are no healthy rows, or none of these templates.
    """
    healthy = np.flatnonzero(np.isfinite(point.log_prior).any(axis=1) & point.hypotheses.healthy)
    rows = point.rows[point.rows["place"].isin(places)]
    if not len(healthy) or rows.empty:
        raise InputError("detection needs both healthy and damaged rows at an operating point; add the missing kind")
    two = point.hypotheses.only(np.concatenate([healthy, places]))
    prior = [_normalised(point.log_prior[some]) for some in (healthy, places)]
    local = rows.assign(place=len(healthy) + pd.Index(places).get_indexer(pd.Index(rows["place"])))
    narrowed = OperatingPoint(hypotheses=two, rows=local, colours=point.colours)
    ratios = []
    for drawn, x in narrowed.redrawn(np.random.default_rng(seed), draws, specimens=specimens):
        likelihood = narrowed.log_likelihood(x, drawn)
        none, some = likelihood[:, : len(healthy)], likelihood[:, len(healthy) :]
        ratios.append(logsumexp(some + prior[1], axis=(1, 2)) - logsumexp(none + prior[0], axis=(1, 2)))
    return OptimalRoc(log_ratio=-np.sort(-np.concatenate(ratios)))


def detection_table(point: OperatingPoint, *, draws: int = 2000, seed: int = 0, specimens: bool = True) -> pd.DataFrame:
    """Compute the probability of detection of each damaged template by the likelihood ratio of its severity.

    Parameters
    ----------
    point, draws, seed, specimens
        As in :func:`optimal_roc`; the draws are for each template.

    Returns
    -------
    pandas.DataFrame
        ``template``, the severities, and for each of :data:`RATES` ``p_detected_RATE`` and ``standard_error_RATE``.
    """
    cases = point.hypotheses.cases
    rows = []
    for place in np.unique(point.rows["place"][point.rows["tooth"] > 0]):
        roc = optimal_roc(point, np.array([place]), draws=draws, seed=seed, specimens=specimens)
        row = {name: cases[name].iloc[place] for name in ("template", *QUANTITIES)}
        for rate in RATES:
            row[f"p_detected_{rate:g}"], row[f"standard_error_{rate:g}"] = roc.at(rate)
        rows.append(row)
    return pd.DataFrame(rows)


def smallest_detected_loss(
    stiffness_loss: FloatArray, p_detected: FloatArray, *, rate: float = 1e-3, draws: int
) -> float:
    """Compute a90: the smallest stiffness loss that is detected with probability 0.9.

    Between the losses of the grid the probit of the probability is interpolated linearly, as is exact where the signal
    grows in proportion to the loss: ``p = Phi(d - z)``. Without loss the probability is the rate of false alarms. A
    probability that ``draws`` draws do not distinguish from 1 counts as 1 - 1 / (2 draws), so that a90 is rather too
    great.

    Parameters
    ----------
    stiffness_loss, p_detected
        (levels,) losses above 0, and the probability of detection at each.
    rate
        Rate of false alarms of these probabilities.
    draws
        Number of draws that they come from.

    Returns
    -------
    float
        NaN if no loss of the grid reaches the probability.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.special import ndtr, ndtri
    >>> loss = np.array([0.2, 0.4])
    >>> p = ndtr(20 * loss + ndtri(1e-3))
    >>> round(smallest_detected_loss(loss, p, draws=10**9), 4), round(float(ndtri(0.9) - ndtri(1e-3)) / 20, 4)
    (0.2186, 0.2186)
    """
    losses = plain_array("smallest_detected_loss", "stiffness_loss", stiffness_loss, float)
    detected = plain_array("smallest_detected_loss", "p_detected", p_detected, float)
    order = np.argsort(losses)
    loss, p = np.concatenate([[0.0], losses[order]]), np.concatenate([[rate], detected[order]])
    probit = np.maximum.accumulate(ndtri(np.clip(p, 0.5 / draws, 1 - 0.5 / draws)))
    above = np.flatnonzero(probit >= ndtri(DETECTED))
    if not above.size:
        return np.nan
    some = slice(above[0] - 1, above[0] + 1)
    return float(np.interp(ndtri(DETECTED), probit[some], loss[some]))


def _normalised(log_prior: FloatArray) -> FloatArray:
    """Return shares (templates, teeth) that add up to 1."""
    return np.asarray(log_softmax(log_prior, axis=None))
