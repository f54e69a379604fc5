"""The continuous ranked probability score: how far a predicted distribution is from what came true."""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core.typing import FloatArray


def crps_sample(values: ArrayLike, y: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """CRPS of a distribution that is a weighted sample.

    ``CRPS = E|X - y| - E|X - X'| / 2`` with X and X' drawn independently from the sample; in the unit of y, 0 at best.
    A sample of one value gives the absolute error.

    Parameters
    ----------
    values
        (..., k) sample.
    y
        (...) what came true.
    weights
        (..., k) weights, of any positive sum; all equal if left out.

    Returns
    -------
    (...) float64

    References
    ----------
    Gneiting and Raftery, Strictly proper scoring rules, prediction, and estimation, J. Am. Stat. Assoc. 102 (2007),
    eq. 21, doi:10.1198/016214506000001437.

    Examples
    --------
    >>> float(crps_sample([0.0, 1.0], 0.0))
    0.25
    """
    x, y = np.asarray(values, float), np.asarray(y, float)
    w = np.ones(x.shape) if weights is None else np.broadcast_to(np.asarray(weights, float), x.shape)
    order = np.argsort(x, axis=-1)
    x, w = np.take_along_axis(x, order, axis=-1), np.take_along_axis(w, order, axis=-1)
    w = w / w.sum(axis=-1, keepdims=True)
    # The integral of F (1 - F), piece by piece between sorted values, is E|X - X'| / 2.
    F = np.cumsum(w, axis=-1)[..., :-1]
    spread = (F * (1 - F) * np.diff(x, axis=-1)).sum(axis=-1)
    return (w * np.abs(x - y[..., None])).sum(axis=-1) - spread


def crps_quantiles(quantiles: ArrayLike, levels: ArrayLike, y: ArrayLike) -> FloatArray:
    """CRPS of a distribution of which some quantiles are known: twice the mean pinball loss.

    ``CRPS = 2 int_0^1 pinball_p(y - q_p) dp``, the integral taken as the mean over the levels: with the median and the
    ends of central intervals that is the weighted interval score, and of the median alone the absolute error.

    Parameters
    ----------
    quantiles
        (..., k) quantiles.
    levels
        (k,) their levels, between 0 and 1.
    y
        (...) what came true.

    References
    ----------
    Bracher et al., Evaluating epidemic forecasts in an interval format, PLoS Comput. Biol. 17 (2021),
    doi:10.1371/journal.pcbi.1008618.

    Examples
    --------
    >>> float(crps_quantiles([2.0], [0.5], 5.0))
    3.0
    """
    p = np.asarray(levels, float)
    short = np.asarray(y, float)[..., None] - np.asarray(quantiles, float)
    return 2 * np.maximum(p * short, (p - 1) * short).mean(axis=-1)
