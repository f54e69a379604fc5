"""Path from the mesh to the sensor: its gain from the mesh harmonics of a healthy recording."""

import numpy as np

from sigdb.core import ComplexArray
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum

GAIN_ERROR = 0.3
"""Deviation of the relative error of the gain between mesh harmonics; assumed."""

_ABOVE_NOISE = 5.0
"""Amplitude of a mesh harmonic, in deviations of its noise, from which on its gain is used."""

_OF_GREATEST = 1e-3
"""Share of the greatest simulated mesh harmonic below which one is too small to divide by."""


def path_gain(measured: AverageSpectrum, simulated: ComplexArray) -> ComplexArray:
    """Return the gain (n / 2 + 1,) from a simulated spectrum to a measured one of the healthy gear.

    At the mesh harmonics both are known, and their quotient is the gain. Between two harmonics the logarithm of its
    magnitude and its phase, by the shorter way, are straight lines; this holds if the structure between mesh and sensor
    changes little over one mesh harmonic. Beyond the first and last harmonic that stands out, the gain is constant, and
    beyond the record's highest order it is 0.

    Parameters
    ----------
    measured
        Healthy spectrum.
    simulated
        (n / 2 + 1,) simulated spectrum.

    Returns
    -------
    numpy.ndarray
        The gain; 0 everywhere if no mesh harmonic stands out.
    """
    k, Z = np.arange(len(simulated)), measured.teeth
    X, noise = measured.mean, np.sqrt(measured.variance)
    mesh = k[Z::Z]
    mesh = mesh[mesh < measured.highest_order]
    excited = np.abs(simulated[mesh]) > _OF_GREATEST * np.abs(simulated[mesh]).max(initial=0.0)
    mesh = mesh[excited & (np.abs(X[mesh]) > _ABOVE_NOISE * noise[mesh])]
    if not mesh.size:
        return np.zeros(len(k), complex)
    gain = X[mesh] / simulated[mesh]
    phase = np.interp(k, mesh, np.unwrap(np.angle(gain)))
    magnitude = np.exp(np.interp(k, mesh, np.log(np.abs(gain))))
    return np.where(k < measured.highest_order, magnitude * np.exp(1j * phase), 0)


def wandering(stream: np.random.Generator, spectrum: AverageSpectrum, deviation: float) -> ComplexArray:
    """Return a random relative gain (n / 2 + 1,) with errors of a deviation, independent twice a mesh harmonic."""
    k = np.arange(spectrum.groups.shape[1])
    nodes = np.arange(0, len(k) + spectrum.teeth, spectrum.teeth / 2)
    errors = stream.normal(0, deviation, (2, len(nodes)))
    return np.asarray(np.exp(np.interp(k, nodes, errors[0]) + 1j * np.interp(k, nodes, errors[1])))
