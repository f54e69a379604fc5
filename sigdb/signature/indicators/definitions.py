"""The table of indicators: name, unit, help, formula and computation of each, declared once.

Columns of a database, documentation and code follow from this table. A new indicator is a function in its family's
module and an entry here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from sigdb.signature.checks import Float64Array
from sigdb.signature.indicators.average_terms import AverageTerms
from sigdb.signature.indicators.moment_kernels import mean_square, moment_ratios, peak, quotient, teager_kaiser
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
