"""Curves of the probability of detection, fitted to hits and misses, with likelihood-ratio bounds."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar
from scipy.special import expit, log_expit, log_ndtr, logit, ndtr, ndtri

from sigdb.core import FloatArray

_STEPS = 100
_LEAST_INFORMATION = 1e-3
"""Least information on the slope. With less, hits and misses are apart in severity: the likelihood has no maximum."""
_LEAST = 1e-12
"""Least probability of a hit or of a miss."""
_FARTHEST = 1e3
"""Ranges of severities within which a bound is looked for."""
_PROBABILITIES = expit(np.linspace(logit(1e-3), logit(1 - 1e-3), 61))
"""Probabilities at which the lower bound of a curve is computed; between them it is interpolated."""


@dataclass(frozen=True)
class Link:
    """A link: the probability of a hit as a function of ``intercept + slope a``, its inverse and its slope."""

    name: str

    def probability(self, eta: ArrayLike) -> FloatArray:
        """Return the probability."""
        return np.asarray(expit(eta) if self.name == "logit" else ndtr(eta))

    def logarithm(self, eta: ArrayLike) -> FloatArray:
        """Return the logarithm of the probability; that of a miss is the one of -eta."""
        return np.asarray(log_expit(eta) if self.name == "logit" else log_ndtr(eta))

    def inverse(self, probability: float) -> float:
        """Return where the probability is reached."""
        return float(logit(probability) if self.name == "logit" else ndtri(probability))

    def slope(self, eta: FloatArray) -> FloatArray:
        """Return the derivative of the probability."""
        if self.name == "logit":
            return np.asarray(expit(eta) * expit(-eta))
        return np.asarray(np.exp(-(eta**2) / 2) / np.sqrt(2 * np.pi))


LINKS: Mapping[str, Link] = {name: Link(name) for name in ("logit", "probit")}
"""Links by name."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PodCurve:
    """A curve of the probability of detection, ``POD(a) = F(intercept + slope a)``.

    Attributes
    ----------
    link
        F: the logistic function, or the normal distribution (probit).
    intercept, slope
        Its most likely coefficients over the severity a.
    covariance
        (2, 2) covariance of the two. Rows of a specimen count as dependent: it is the sandwich over specimens.
    inflation
        How many times this covariance is that of independent rows, as a mean over both coefficients; at least 1.
        Likelihood ratios are divided by it [2]_.
    a, hits, rows
        (levels,) severities, number of detected rows, and number of rows.

    References
    ----------
    .. [1] MIL-HDBK-1823A, Nondestructive evaluation system reliability assessment, U.S. Department of Defense (2009),
       appendix G: hit/miss data, links, likelihood-ratio bounds, a90 and a90/95.
    .. [2] J. N. K. Rao, A. J. Scott, "On chi-squared tests for multiway contingency tables with cell proportions
       estimated from survey data", Annals of Statistics 12 (1984) 46-60, doi:10.1214/aos/1176346391.
    """

    link: Link
    intercept: float
    slope: float
    covariance: FloatArray
    inflation: float
    a: FloatArray
    hits: FloatArray
    rows: FloatArray

    def probability(self, a: ArrayLike) -> FloatArray:
        """Return the probability of detection at severities a."""
        return self.link.probability(self.intercept + self.slope * np.asarray(a, float))

    def severity(self, probability: float = 0.9) -> float:
        """Return the severity that is detected with this probability: a90."""
        return (self.link.inverse(probability) - self.intercept) / self.slope

    def severity_bound(self, probability: float = 0.9, *, confidence: float = 0.95) -> float:
        """Return the greatest severity at which the curve may have this probability: a90/95; NaN if there is none.

        It is where ``2 (l_max - l) / inflation`` reaches the square of the normal quantile of the confidence, with l
        the greatest log likelihood of all curves that have the probability there.
        """
        limit = self.inflation * float(ndtri(confidence)) ** 2
        best, q = self._likelihood(self.intercept, self.slope), self.link.inverse(probability)
        begin, reach = self.severity(probability), float(np.ptp(self.a))
        if abs(begin - self.a[-1]) > _FARTHEST * reach:  # of a curve that hardly rises
            return np.nan

        def excess(a: float) -> float:
            def unlikely(slope: float) -> float:
                return -self._likelihood(q - slope * a, slope)

            # A search of all slopes at once may miss a narrow maximum.
            ends = ((0.0, self.slope), (self.slope, 50 * self.slope))
            least = min(float(minimize_scalar(unlikely, bounds=some, method="bounded").fun) for some in ends)
            return 2 * (best + min(least, unlikely(self.slope))) - limit

        far = begin + 0.1 * reach
        while excess(far) < 0:
            far = begin + 2 * (far - begin)
            if far - begin > _FARTHEST * reach:
                return np.nan
        return float(brentq(excess, begin, far, xtol=1e-6 * reach))

    def bound(self, a: ArrayLike, *, confidence: float = 0.95) -> FloatArray:
        """Return the lower bound of the probability of detection at severities a; 0 below all that it reaches."""
        ends = np.array([self.severity_bound(p, confidence=confidence) for p in _PROBABILITIES])
        finite = np.isfinite(ends)
        if not finite.any():
            return np.zeros_like(np.asarray(a, float))
        return np.asarray(np.interp(np.asarray(a, float), ends[finite], _PROBABILITIES[finite], left=0.0))

    def _likelihood(self, intercept: float, slope: float) -> float:
        eta = intercept + slope * self.a
        return float(self.hits @ self.link.logarithm(eta) + (self.rows - self.hits) @ self.link.logarithm(-eta))


def pod_curve(a: FloatArray, hits: FloatArray, rows: FloatArray) -> PodCurve | None:
    """Fit the most likely curve, of the link that is more likely, and its covariance.

    Parameters
    ----------
    a
        (levels,) severities.
    hits, rows
        (specimens, levels) number of detected rows, and number of rows.

    Returns
    -------
    PodCurve or None
        None where the likelihood has no maximum: all rows are detected, none, or detected and missed rows are apart in
        severity. Also None where detection does not grow with severity.
    """
    curves = [curve for link in LINKS.values() if (curve := curve_of_link(link, a, hits, rows)) is not None]
    return max(curves, key=lambda curve: curve._likelihood(curve.intercept, curve.slope), default=None)


def curve_of_link(link: Link, a: FloatArray, hits: FloatArray, rows: FloatArray) -> PodCurve | None:
    """Return the most likely curve of a link; None where there is none."""
    hit, of = hits.sum(axis=0), rows.sum(axis=0)
    intercept, slope = (float(fitted[0]) for fitted in fit_curves(link, a, hit[None], of[None]))
    if not slope > 0:
        return None
    x, eta = np.column_stack([np.ones_like(a), a]), intercept + slope * a
    p = np.clip(link.probability(eta), _LEAST, 1 - _LEAST)
    per_row = link.slope(eta) / (p * (1 - p))
    information = np.einsum("l,li,lj", of * link.slope(eta) * per_row, x, x)
    score = ((hits - rows * p) * per_row) @ x
    naive = np.linalg.inv(information)
    covariance = len(hits) / max(1, len(hits) - 1) * naive @ (score.T @ score) @ naive
    return PodCurve(
        link=link,
        intercept=intercept,
        slope=slope,
        covariance=covariance,
        inflation=max(1.0, float(np.trace(information @ covariance)) / 2),
        a=a,
        hits=hit,
        rows=of,
    )


def fit_curves(link: Link, a: FloatArray, hits: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit intercepts and slopes (resamples,) to hits and rows (resamples, levels) by scoring; NaN without a maximum."""
    with np.errstate(divide="ignore", invalid="ignore"):
        centre, scale = a.mean(), a.std()
        x = np.column_stack([np.ones_like(a), (a - centre) / scale])
        b = np.zeros((len(hits), 2))
        for _ in range(_STEPS):
            eta = b @ x.T
            p = np.clip(link.probability(eta), _LEAST, 1 - _LEAST)
            per_row = link.slope(eta) / (p * (1 - p))
            u, v, w = ((rows * link.slope(eta) * per_row) @ x[:, 1] ** k for k in range(3))
            g = ((hits - rows * p) * per_row) @ x
            step = np.column_stack([w * g[:, 0] - v * g[:, 1], u * g[:, 1] - v * g[:, 0]]) / (u * w - v**2)[:, None]
            b = b + np.clip(step, -2, 2)
            if not (np.abs(step) >= 1e-9).any():
                break
        b[~((np.abs(step).max(axis=1) < 1e-8) & (w - v**2 / u > _LEAST_INFORMATION))] = np.nan
    slope = b[:, 1] / scale
    return b[:, 0] - slope * centre, slope
