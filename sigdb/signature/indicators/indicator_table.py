"""The table of indicators without history: name, unit, help, formula and computation of each, declared once.

Columns of a database, documentation and code follow from this table. A new indicator is a function in its family's
module and an entry here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import SIGNALS_AT_ONCE, blocks
from sigdb.signature.checks import Float64Array, real_signal
from sigdb.signature.gear_orders import GearOrders, gear_orders
from sigdb.signature.indicators.average_terms import AverageTerms
from sigdb.signature.indicators.moment_kernels import (
    as_float,
    mean_square,
    moment_ratios,
    peak,
    quotient,
    teager_kaiser,
)
from sigdb.signature.indicators.sidebands import over_deviation, over_mesh, peak_to_peak_over_mesh, sideband_sum


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """An indicator of a single average, as columns of a database and the documentation describe it.

    Attributes
    ----------
    name
        The function's and the column's name.
    unit
        ``"signal"`` for the unit of the average, ``"-"`` for none.
    help
        Description in one sentence.
    formula
        The definition in one line of text: x the average, d the difference, r the regular signal (both without mean),
        A(o) the peak amplitude of order o, Z teeth, n samples. Sums are over the samples unless stated otherwise.
    compute
        The value ``(m,)`` of each average in a batch, from the batch's shared terms.
    """

    name: str
    unit: str
    help: str
    formula: str
    compute: Callable[[AverageTerms], Float64Array]


_TABLE = (
    Indicator(
        name="rms",
        unit="signal",
        help="Root mean square of the average, its mean included.",
        formula="sqrt(sum x^2 / n)",
        compute=lambda a: a.scale * a.rms,
    ),
    Indicator(
        name="peak_to_peak",
        unit="signal",
        help="Largest minus smallest sample of the average.",
        formula="max x - min x",
        compute=lambda a: a.scale * a.peak_to_peak,
    ),
    Indicator(
        name="crest_factor",
        unit="-",
        help="Largest modulus of the average over its rms, the mean included in both.",
        formula="max|x| / sqrt(sum x^2 / n)",
        compute=lambda a: quotient(peak(a.average), a.rms, a.variance <= a.floor),
    ),
    Indicator(
        name="kurtosis",
        unit="-",
        help="Fourth moment of the average over its squared variance; 3 for Gaussian noise.",
        formula="n sum (x - mean x)^4 / (sum (x - mean x)^2)^2",
        compute=lambda a: moment_ratios(a.average, (4,), a.floor)[0],
    ),
    Indicator(
        name="energy_operator",
        unit="-",
        help="Kurtosis of the circular Teager-Kaiser energy of the average with its mean.",
        formula="kurtosis of x_i^2 - x_(i-1) x_(i+1)",
        compute=lambda a: moment_ratios(teager_kaiser(a.average), (4,), a.floor)[0],
    ),
    Indicator(
        name="fm0",
        unit="-",
        help="Peak-to-peak of the average over the sum of the amplitudes of the mesh harmonics.",
        formula="(max x - min x) / sum over h = 1..H of A(h Z)",
        compute=lambda a: peak_to_peak_over_mesh(a.peak_to_peak, a.amplitudes[..., a.orders.mesh], a.floor),
    ),
    Indicator(
        name="fm4",
        unit="-",
        help="Kurtosis of the difference signal; 1.5 for a sine, 3 for Gaussian noise.",
        formula="n sum d^4 / (sum d^2)^2",
        compute=lambda a: a.difference_moments[0],
    ),
    Indicator(
        name="m6a",
        unit="-",
        help="Normalised sixth moment of the difference signal; 2.5 for a sine, 15 for Gaussian noise.",
        formula="n^2 sum d^6 / (sum d^2)^3",
        compute=lambda a: a.difference_moments[1],
    ),
    Indicator(
        name="m8a",
        unit="-",
        help="Normalised eighth moment of the difference signal; 4.375 for a sine, 105 for Gaussian noise.",
        formula="n^3 sum d^8 / (sum d^2)^4",
        compute=lambda a: a.difference_moments[2],
    ),
    Indicator(
        name="energy_ratio",
        unit="-",
        help="rms of the difference signal over rms of the regular signal.",
        formula="sqrt(sum d^2 / sum r^2)",
        compute=lambda a: np.sqrt(
            quotient(mean_square(a.difference), a.regular_mean_square, a.regular_mean_square <= a.floor)
        ),
    ),
    Indicator(
        name="sideband_index",
        unit="signal",
        help="Mean peak amplitude of the two first sidebands of the mesh.",
        formula="(A(Z - 1) + A(Z + 1)) / 2",
        compute=lambda a: a.scale * sideband_sum(a.amplitudes, a.teeth, 1, a.n) / 2,
    ),
    Indicator(
        name="sideband_level_factor",
        unit="-",
        help="Sum of the two first sidebands' peak amplitudes over the average's population standard deviation.",
        formula="(A(Z - 1) + A(Z + 1)) / sqrt(sum (x - mean x)^2 / n)",
        compute=lambda a: over_deviation(sideband_sum(a.amplitudes, a.teeth, 1, a.n), a.variance, a.floor),
    ),
    Indicator(
        name="sideband_energy_ratio",
        unit="-",
        help="Sum of the first six pairs of sidebands' peak amplitudes over the mesh's.",
        formula="sum over j = 1..6 of (A(Z - j) + A(Z + j)) / A(Z)",
        compute=lambda a: over_mesh(sideband_sum(a.amplitudes, a.teeth, 6, a.n), a.amplitudes[..., a.teeth], a.floor),
    ),
)

INDICATORS: Mapping[str, Indicator] = MappingProxyType({indicator.name: indicator for indicator in _TABLE})
"""Every indicator without history by its name, in the order of :func:`indicators`."""


def indicators(
    tsa: ArrayLike,
    *,
    teeth: int,
    mesh_harmonics: int | None = None,
    shaft_harmonics: int = 2,
    sidebands: int = 1,
) -> dict[str, Float64Array]:
    """Compute all of :data:`sigdb.signature.INDICATORS`, from one spectrum and one separation.

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
    dict of (...) float64, or of floats for one signal
        By name, in the order of ``INDICATORS``; quotients without variance are nan.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite, a count is too small or not an integer, or a requested order is not
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
    # A batch of 256 signals at once takes three times as long.
    parts = [indicators_of(signals[some], teeth, orders, eps) for some in blocks(max(len(signals), 1), SIGNALS_AT_ONCE)]
    values = {name: np.concatenate([part[name] for part in parts]).reshape(x.shape[:-1]) for name in INDICATORS}
    return {name: as_float(each) for name, each in values.items()}


def indicators_of(x: Float64Array, teeth: int, orders: GearOrders, eps: float) -> dict[str, Float64Array]:
    """Return the indicators of a batch of averages (m, n); see :class:`AverageTerms`."""
    terms = AverageTerms(x, teeth, orders, eps)
    return {name: indicator.compute(terms) for name, indicator in INDICATORS.items()}
