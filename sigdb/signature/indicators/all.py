"""All indicators without history of a batch of averages."""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.signature.checks import Float64Array, real_signal
from sigdb.signature.gear_orders import GearOrders, gear_orders
from sigdb.signature.indicators import moment_kernels as _moments
from sigdb.signature.indicators.definitions import INDICATORS
from sigdb.signature.indicators.sidebands import over_deviation, over_mesh, peak_to_peak_over_mesh, sideband_sum
from sigdb.signature.separation import synthesis, without
from sigdb.signature.spectrum import one_sided

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

    Each is what the function of its name gives; those of a separated signal get ``scale = max|average|``, and
    ``sideband_energy_ratio`` takes its six pairs.

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
    n = x.shape[-1]
    # All in units of s = max|average|; rms, range and sideband index get it back.
    u, s = _moments.per_peak(x)
    floor = _moments.rounding_floor(eps)
    range_, rms, variance = np.ptp(u, axis=-1), np.sqrt(_moments.mean_square(u)), _moments.variance(u)

    U = np.fft.rfft(u)
    A = np.abs(U) * one_sided(n)
    mesh, pair, six_pairs = A[..., teeth], sideband_sum(A, teeth, 1, n), sideband_sum(A, teeth, 6, n)
    # Parseval: the regular signal's mean square needs no transform back.
    regular = _moments.dot(A[..., orders.regular], A[..., orders.regular]) / 2
    d = synthesis(without(U, orders.difference_removes), n)

    (kurtosis,) = _moments.moment_ratios(u, (4,), floor)
    (energy_operator,) = _moments.moment_ratios(_moments.teager_kaiser(u), (4,), floor)
    fm4, m6a, m8a = _moments.moment_ratios(d, (4, 6, 8), floor)
    return {
        "rms": s * rms,
        "peak_to_peak": s * range_,
        "crest_factor": _moments.quotient(_moments.peak(u), rms, variance <= floor),
        "kurtosis": kurtosis,
        "energy_operator": energy_operator,
        "fm0": peak_to_peak_over_mesh(range_, A[..., orders.mesh], floor),
        "fm4": fm4,
        "m6a": m6a,
        "m8a": m8a,
        "energy_ratio": np.sqrt(_moments.quotient(_moments.mean_square(d), regular, regular <= floor)),
        "sideband_index": s * pair / 2,
        "sideband_level_factor": over_deviation(pair, variance, floor),
        "sideband_energy_ratio": over_mesh(six_pairs, mesh, floor),
    }
