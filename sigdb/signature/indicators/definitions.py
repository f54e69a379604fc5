"""What each indicator is: name, unit, help and formula, declared once for columns, documentation and code."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """One indicator as the database's columns and the documentation describe it.

    Attributes
    ----------
    name
        The function's and the column's name.
    unit
        ``"signal"`` for the unit of the average, ``"-"`` for none.
    help
        What it is, one sentence.
    formula
        The definition in one line of text: x the average, d the difference, r the regular signal (both without mean),
        A(o) the peak amplitude of order o, Z teeth, n samples, sums over the samples unless said.
    """

    name: str
    unit: str
    help: str
    formula: str


_TABLE = (
    Indicator(
        name="rms",
        unit="signal",
        help="Root mean square of the average, its mean included.",
        formula="sqrt(sum x^2 / n)",
    ),
    Indicator(
        name="peak_to_peak",
        unit="signal",
        help="Largest minus smallest sample of the average.",
        formula="max x - min x",
    ),
    Indicator(
        name="crest_factor",
        unit="-",
        help="Largest modulus of the average over its rms, the mean included in both.",
        formula="max|x| / sqrt(sum x^2 / n)",
    ),
    Indicator(
        name="kurtosis",
        unit="-",
        help="Fourth moment of the average over its squared variance; 3 for Gaussian noise.",
        formula="n sum (x - mean x)^4 / (sum (x - mean x)^2)^2",
    ),
    Indicator(
        name="energy_operator",
        unit="-",
        help="Kurtosis of the circular Teager-Kaiser energy of the average with its mean.",
        formula="kurtosis of x_i^2 - x_(i-1) x_(i+1)",
    ),
    Indicator(
        name="fm0",
        unit="-",
        help="Peak-to-peak of the average over the sum of the amplitudes of the mesh harmonics.",
        formula="(max x - min x) / sum over h = 1..H of A(h Z)",
    ),
    Indicator(
        name="fm4",
        unit="-",
        help="Kurtosis of the difference signal; 1.5 for a sine, 3 for Gaussian noise.",
        formula="n sum d^4 / (sum d^2)^2",
    ),
    Indicator(
        name="m6a",
        unit="-",
        help="Normalised sixth moment of the difference signal; 2.5 for a sine, 15 for Gaussian noise.",
        formula="n^2 sum d^6 / (sum d^2)^3",
    ),
    Indicator(
        name="m8a",
        unit="-",
        help="Normalised eighth moment of the difference signal; 4.375 for a sine, 105 for Gaussian noise.",
        formula="n^3 sum d^8 / (sum d^2)^4",
    ),
    Indicator(
        name="energy_ratio",
        unit="-",
        help="rms of the difference signal over rms of the regular signal.",
        formula="sqrt(sum d^2 / sum r^2)",
    ),
    Indicator(
        name="sideband_index",
        unit="signal",
        help="Mean peak amplitude of the two first sidebands of the mesh.",
        formula="(A(Z - 1) + A(Z + 1)) / 2",
    ),
    Indicator(
        name="sideband_level_factor",
        unit="-",
        help="Sum of the two first sidebands' peak amplitudes over the average's population standard deviation.",
        formula="(A(Z - 1) + A(Z + 1)) / sqrt(sum (x - mean x)^2 / n)",
    ),
    Indicator(
        name="sideband_energy_ratio",
        unit="-",
        help="Sum of the first six pairs of sidebands' peak amplitudes over the mesh's.",
        formula="sum over j = 1..6 of (A(Z - j) + A(Z + j)) / A(Z)",
    ),
)

INDICATORS: Mapping[str, Indicator] = MappingProxyType({indicator.name: indicator for indicator in _TABLE})
"""Every indicator without history by its name, in the order of :func:`indicators`."""
