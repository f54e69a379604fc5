"""All indicators without history of a batch of averages."""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.signature.checks import Float64Array, real_signal
from sigdb.signature.gear_orders import GearOrders, gear_orders
from sigdb.signature.indicators.average_terms import AverageTerms
from sigdb.signature.indicators.definitions import INDICATORS

_SIGNALS_AT_ONCE = 32
"""Keeps a block's intermediate arrays in the cache: a batch of 256 at once takes three times as long."""


def indicators(
    tsa: ArrayLike,
    *,
    teeth: int,
    mesh_harmonics: int | None = None,
    shaft_harmonics: int = 2,
    sidebands: int = 1,
) -> dict[str, Float64Array]:
    """All of :data:`sigdb.signature.INDICATORS`, from one spectrum and one separation.

    Each equals the result of the function of its name. Indicators of a separated signal get ``scale = max|average|``,
    and ``sideband_energy_ratio`` takes six pairs.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.
    teeth : int
        Tooth count of the gear on the averaged shaft; below n/2.
    mesh_harmonics : int, optional
        Count of mesh harmonics, at least 1, for separation and FM0; all below Nyquist by default.
    shaft_harmonics : int
        Count of shaft orders in the regular signal.
    sidebands : int
        Pairs of sidebands that the difference signal is without.

    Returns
    -------
    dict of (...) float64
        By name, in the order of ``INDICATORS``; quotients without variance are nan.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite, a count is too small or not an integer, or an order asked for is not
        below n/2.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import indicators
    >>> theta = 2 * np.pi * np.arange(128) / 128
    >>> x = np.cos(8 * theta) + 0.1 * np.cos(5 * theta)
    >>> values = indicators(x, teeth=8)
    >>> round(float(values["fm4"]), 12), round(float(values["energy_ratio"]), 12)
    (1.5, 0.1)
    """
    x, eps = real_signal("indicators", "tsa", tsa)
    n = x.shape[-1]
    orders = gear_orders("indicators", n, teeth, mesh_harmonics, shaft_harmonics, sidebands, least_mesh=1)
    signals = x.reshape(-1, n)
    starts = range(0, max(len(signals), 1), _SIGNALS_AT_ONCE)
    blocks = [_indicators(signals[i : i + _SIGNALS_AT_ONCE], teeth, orders, eps) for i in starts]
    return {name: np.concatenate([b[name] for b in blocks]).reshape(x.shape[:-1])[()] for name in INDICATORS}


def _indicators(x: Float64Array, teeth: int, orders: GearOrders, eps: float) -> dict[str, Float64Array]:
    terms = AverageTerms(x, teeth, orders, eps)
    return {name: indicator.compute(terms) for name, indicator in INDICATORS.items()}
