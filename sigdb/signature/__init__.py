"""Pure functions on signals ``(..., n)``, time on the last axis, the same for simulated and measured ones.

A time-synchronous average (TSA) is one revolution of a shaft in n samples, so bin o of its spectrum is order o (cycles
per revolution). The mesh of a gear with Z teeth is at order Z, tooth j passes during samples (j-1) n/Z ... j n/Z - 1.
"""

from sigdb.signature.averaging.average import synchronous_average
from sigdb.signature.averaging.averager import SynchronousAverage, SynchronousAverager
from sigdb.signature.averaging.mesh_pulses import MeshPhase, mesh_pulses
from sigdb.signature.averaging.tacho import TachoDetector, tacho_pulses
from sigdb.signature.demodulation import demodulate
from sigdb.signature.features import FEATURES, Feature, features
from sigdb.signature.indicators.average import crest_factor, energy_operator, kurtosis, peak_to_peak, rms
from sigdb.signature.indicators.difference import energy_ratio, fm4, m6a, m8a
from sigdb.signature.indicators.histories import na4, na4_star, nb4, nb4_star
from sigdb.signature.indicators.indicator_table import INDICATORS, Indicator, indicators
from sigdb.signature.indicators.sidebands import fm0, sideband_energy_ratio, sideband_index, sideband_level_factor
from sigdb.signature.separation import difference_signal, regular_signal, residual_signal
from sigdb.signature.settings import SignatureSettings as SignatureSettings
from sigdb.signature.spectrum import order_spectrum
from sigdb.signature.wigner_ville.distribution import wigner_ville
from sigdb.signature.wigner_ville.pooled import mesh_bands, pooled_wigner_ville

__all__ = [
    "FEATURES",
    "INDICATORS",
    "Feature",
    "Indicator",
    "MeshPhase",
    "SynchronousAverage",
    "SynchronousAverager",
    "TachoDetector",
    "crest_factor",
    "demodulate",
    "difference_signal",
    "energy_operator",
    "energy_ratio",
    "features",
    "fm0",
    "fm4",
    "indicators",
    "kurtosis",
    "m6a",
    "m8a",
    "mesh_bands",
    "mesh_pulses",
    "na4",
    "na4_star",
    "nb4",
    "nb4_star",
    "order_spectrum",
    "peak_to_peak",
    "pooled_wigner_ville",
    "regular_signal",
    "residual_signal",
    "rms",
    "sideband_energy_ratio",
    "sideband_index",
    "sideband_level_factor",
    "synchronous_average",
    "tacho_pulses",
    "wigner_ville",
]
