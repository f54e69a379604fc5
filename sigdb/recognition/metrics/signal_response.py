"""Signal response against size: log-linear regression with censored signals, and the probability of detection by it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize
from scipy.special import log_ndtr, ndtr, ndtri

from sigdb.core import FloatArray, InputError, plain_array

_LEAST_ROWS = 5
"""Signals that are not censored, at least."""

_FARTHEST = 20.0
"""Range of log sizes in which a bound is looked for."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SignalResponse:
    """The regression of signals on sizes, ``log signal = intercept + slope log size + deviation z``, z normal.

    With a decision threshold it gives the probability of detection ``POD(a) = Phi((log a - mu) / sigma)``,
    ``mu = (log threshold - intercept) / slope``, ``sigma = deviation / slope`` [1]_. It uses how strong a signal is,
    and so needs fewer sizes than hits and misses.

    Attributes
    ----------
    intercept, slope, deviation
        Most likely parameters.
    threshold
        Signal above which damage is called.
    x, y
        (rows,) log sizes, and log signals; the limits where they are censored.
    below, above
        (rows,) whether a signal is below the least, or above the greatest, that can be measured.

    References
    ----------
    .. [1] MIL-HDBK-1823A, Nondestructive evaluation system reliability assessment, U.S. Department of Defense (2009),
       section 4.5.2 and appendix G.3: signal response, censored signals, likelihood-ratio bounds.
    """

    intercept: float
    slope: float
    deviation: float
    threshold: float
    x: FloatArray
    y: FloatArray
    below: FloatArray
    above: FloatArray

    def probability(self, a: ArrayLike) -> FloatArray:
        """Return the probability of detection of sizes a."""
        mean = self.intercept + self.slope * np.log(np.asarray(a, float))
        return np.asarray(ndtr((mean - np.log(self.threshold)) / self.deviation))

    def severity(self, probability: float = 0.9) -> float:
        """Return the size that is detected with this probability: a90."""
        away = float(ndtri(probability)) * self.deviation
        return float(np.exp((np.log(self.threshold) + away - self.intercept) / self.slope))

    def severity_bound(self, probability: float = 0.9, *, confidence: float = 0.95) -> float:
        """Return the greatest size that may have this probability, by likelihood ratio: a90/95; NaN without one."""
        best, begin = self._greatest(None, probability), np.log(self.severity(probability))
        limit = float(ndtri(confidence)) ** 2

        def excess(log_a: float) -> float:
            return 2 * (best - self._greatest(log_a, probability)) - limit

        far = begin + 0.1
        while excess(far) < 0:
            far = begin + 2 * (far - begin)
            if far - begin > _FARTHEST:
                return np.nan
        return float(np.exp(brentq(excess, begin, far, xtol=1e-6)))

    def _greatest(self, log_a: float | None, probability: float) -> float:
        """Return the greatest log likelihood, of all regressions or of those with a probability at a log size."""
        quantile, level = float(ndtri(probability)), float(np.log(self.threshold))

        def loss(parameters: FloatArray) -> float:
            slope, deviation = parameters[0], np.exp(parameters[1])
            intercept = parameters[2] if log_a is None else level + quantile * deviation - slope * log_a
            return -_log_likelihood(self.x, self.y, self.below, self.above, intercept, slope, deviation)

        start = [self.slope, np.log(self.deviation), *([self.intercept] if log_a is None else [])]
        return -float(minimize(loss, start, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9}).fun)


def signal_response(
    size: ArrayLike, signal: ArrayLike, *, threshold: float, least: float = 0.0, greatest: float = np.inf
) -> SignalResponse:
    """Fit the regression of signals on sizes by the greatest likelihood, with censored signals (Tobit).

    Parameters
    ----------
    size
        (rows,) sizes above 0, such as stiffness losses.
    signal
        (rows,) signals, in any unit.
    threshold
        Signal above 0 from which damage is called.
    least, greatest
        Signals at or below the first, or at or above the second, count only as such: there noise hides them, or the
        scale ends.

    Returns
    -------
    SignalResponse
        Its :meth:`~SignalResponse.severity` is a90.

    Raises
    ------
    InputError
        If sizes, signals or limits do not fit each other, too few signals are inside the limits, or signals do not grow
        with size.

    Examples
    --------
    >>> import numpy as np
    >>> size = np.linspace(0.05, 0.4, 30)
    >>> signal = 20 * size * np.exp(0.1 * np.sin(40 * np.arange(30)))
    >>> found = signal_response(size, signal, threshold=3.0, least=1.5)
    >>> bool(0.15 < found.severity(0.5) < found.severity() < found.severity_bound() < 0.19)
    True
    """
    a, y = (
        plain_array("signal_response", name, values, float) for name, values in (("size", size), ("signal", signal))
    )
    if a.ndim != 1 or a.shape != y.shape:
        raise InputError(f"size has the shape {a.shape}, and signal {y.shape}; give one signal for each size")
    if not ((a > 0).all() and np.isfinite(a).all() and np.isfinite(y).all()):
        raise InputError("sizes must be above 0, and signals finite; leave out undamaged rows")
    if not (threshold > 0 and 0 <= least < greatest):
        raise InputError(
            f"threshold = {threshold:g} must be above 0, and least = {least:g} at least 0 and below greatest"
        )
    below, above = (y <= least).astype(float), (y >= greatest).astype(float)
    inside = (below + above) == 0
    if inside.sum() < _LEAST_ROWS or np.ptp(a[inside]) == 0:
        raise InputError(
            f"{int(inside.sum())} signals are inside the limits; {_LEAST_ROWS} of different sizes are needed"
        )
    x = np.log(a)
    log_y = np.log(np.clip(y, max(least, np.finfo(float).tiny), greatest))
    slope, intercept = np.polyfit(x[inside], log_y[inside], 1)
    spread = max(float(np.std(log_y[inside] - intercept - slope * x[inside])), 1e-6)

    def loss(parameters: FloatArray) -> float:
        return -_log_likelihood(x, log_y, below, above, parameters[0], parameters[1], float(np.exp(parameters[2])))

    best = minimize(loss, [intercept, slope, np.log(spread)], method="Nelder-Mead", options=_CLOSE).x
    if best[1] <= 0:
        raise InputError("the signals do not grow with size, so that no size is detected with a stated probability")
    return SignalResponse(
        intercept=float(best[0]),
        slope=float(best[1]),
        deviation=float(np.exp(best[2])),
        threshold=float(threshold),
        x=x,
        y=log_y,
        below=below,
        above=above,
    )


_CLOSE = {"xatol": 1e-8, "fatol": 1e-10, "maxiter": 4000, "maxfev": 4000}


def _log_likelihood(
    x: FloatArray, y: FloatArray, below: FloatArray, above: FloatArray, intercept: float, slope: float, deviation: float
) -> float:
    z = (y - intercept - slope * x) / deviation
    seen = -0.5 * z**2 - np.log(deviation)
    return float(np.where(below > 0, log_ndtr(z), np.where(above > 0, log_ndtr(-z), seen)).sum())
