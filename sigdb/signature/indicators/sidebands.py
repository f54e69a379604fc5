"""Indicators from the amplitudes of the mesh and of its sidebands, ``(..., n) -> (...)`` in float64.

Amplitudes are one-sided peak amplitudes, ``|c|`` of :func:`sigdb.signature.order_spectrum`. A sideband at or below
order 0, or at or above n/2, is not in the spectrum and counts as 0. A quotient is nan, without a warning, where its
denominator is no more than rounding of the average: a part with ``sum d^2 <= n (64 eps s)^2``, with eps of the input's
type and s = ``max|average|``.
"""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.signature.checks import Float64Array, count, mesh_teeth, real_signal
from sigdb.signature.gear_orders import mesh_harmonic_count, sideband_orders
from sigdb.signature.indicators import moment_kernels as _moments
from sigdb.signature.spectrum import one_sided


def fm0(tsa: ArrayLike, *, teeth: int, mesh_harmonics: int | None = None) -> Float64Array:
    """Compute FM0: peak-to-peak over the sum of the peak amplitudes of mesh orders Z, 2Z, ... HZ.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.
    teeth : int
        Tooth count Z of the gear on the averaged shaft; below n/2.
    mesh_harmonics : int, optional
        Count H >= 1 of mesh harmonics; all below Nyquist by default.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without any mesh harmonic.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite, a count is too small or not an integer, or a requested order is not
        below n/2.

    References
    ----------
    .. [1] Stewart, "Some useful data analysis techniques for gearbox diagnostics", Institute of Sound and Vibration
       Research, University of Southampton, 1977.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import fm0
    >>> round(float(fm0(np.cos(2 * np.pi * 8 * np.arange(64) / 64), teeth=8)), 12)
    2.0
    """
    x, eps = real_signal("fm0", "tsa", tsa)
    n = x.shape[-1]
    z = mesh_teeth("fm0", teeth, n)
    harmonics = mesh_harmonic_count("fm0", mesh_harmonics, z, n, least=1)
    u, _ = _moments.per_peak(x)
    mesh = _amplitudes(u)[..., z : harmonics * z + 1 : z]
    return _moments.as_float(peak_to_peak_over_mesh(np.ptp(u, axis=-1), mesh, _moments.rounding_floor(eps)))


def sideband_index(tsa: ArrayLike, *, teeth: int) -> Float64Array:
    """Compute the mean peak amplitude of the two first sidebands of the mesh, orders Z - 1 and Z + 1.

    Parameters
    ----------
    tsa, teeth
        As in :func:`fm0`.

    Returns
    -------
    (...) float64, or float for one signal
        In the unit of ``tsa``.

    Raises
    ------
    InputError
        As :func:`fm0`.

    References
    ----------
    .. [1] Vecer, Kreidl, Smid, "Condition Indicators for Gearbox Condition Monitoring Systems", Acta Polytechnica
       45(6), 2005.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import sideband_index
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> modulated = (1 + 0.4 * np.cos(theta)) * np.cos(8 * theta)
    >>> round(float(sideband_index(modulated, teeth=8)), 12)
    0.2
    """
    x, _ = real_signal("sideband_index", "tsa", tsa)
    z = mesh_teeth("sideband_index", teeth, x.shape[-1])
    return _moments.as_float(sideband_sum(_amplitudes(x), z, 1, x.shape[-1]) / 2)


def sideband_level_factor(tsa: ArrayLike, *, teeth: int) -> Float64Array:
    """Compute the sum of the peak amplitudes of the two first sidebands over the average's standard deviation.

    Parameters
    ----------
    tsa, teeth
        As in :func:`fm0`.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without variance. The standard deviation is the population's.

    Raises
    ------
    InputError
        As :func:`fm0`.

    References
    ----------
    .. [1] Vecer, Kreidl, Smid, "Condition Indicators for Gearbox Condition Monitoring Systems", Acta Polytechnica
       45(6), 2005.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import sideband_level_factor
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> round(float(sideband_level_factor(np.cos(7 * theta) + np.cos(9 * theta), teeth=8)), 12)
    2.0
    """
    x, eps = real_signal("sideband_level_factor", "tsa", tsa)
    z = mesh_teeth("sideband_level_factor", teeth, x.shape[-1])
    u, _ = _moments.per_peak(x)
    pair = sideband_sum(_amplitudes(u), z, 1, x.shape[-1])
    return _moments.as_float(over_deviation(pair, _moments.variance(u), _moments.rounding_floor(eps)))


def sideband_energy_ratio(tsa: ArrayLike, *, teeth: int, pairs: int = 6) -> Float64Array:
    """Compute the sum of the peak amplitudes of the first pairs of sidebands over that of the mesh, order Z.

    Parameters
    ----------
    tsa, teeth
        As in :func:`fm0`.
    pairs : int
        Count of pairs, at least 1.

    Returns
    -------
    (...) float64, or float for one signal
        No unit (amplitudes, in spite of the name); nan without mesh.

    Raises
    ------
    InputError
        As :func:`fm0`, or if ``pairs`` is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import sideband_energy_ratio
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> modulated = (1 + 0.4 * np.cos(2 * theta)) * np.cos(8 * theta)
    >>> round(float(sideband_energy_ratio(modulated, teeth=8)), 12)
    0.4
    """
    x, eps = real_signal("sideband_energy_ratio", "tsa", tsa)
    n = x.shape[-1]
    z = mesh_teeth("sideband_energy_ratio", teeth, n)
    most = count("sideband_energy_ratio", "pairs", pairs, least=1)
    a = _amplitudes(_moments.per_peak(x)[0])
    return _moments.as_float(over_mesh(sideband_sum(a, z, most, n), a[..., z], _moments.rounding_floor(eps)))


def peak_to_peak_over_mesh(range_: Float64Array, mesh: Float64Array, floor: Float64Array) -> Float64Array:
    """Return the quotient of FM0 from a range and the amplitudes ``(..., H)`` of the mesh, mean square sum A^2 / 2."""
    return _moments.quotient(range_, np.sum(mesh, axis=-1), _moments.dot(mesh, mesh) / 2 <= floor)


def sideband_sum(amplitudes: Float64Array, teeth: int, pairs: int, n: int) -> Float64Array:
    """Return the sum of the first pairs of sidebands about order ``teeth``."""
    return np.sum(amplitudes[..., sideband_orders(teeth, 1, pairs, n)], axis=-1)


def over_deviation(pair: Float64Array, variance: Float64Array, floor: Float64Array) -> Float64Array:
    """Return a sum of amplitudes over the standard deviation."""
    return _moments.quotient(pair, np.sqrt(variance), variance <= floor)


def over_mesh(pairs: Float64Array, mesh: Float64Array, floor: Float64Array) -> Float64Array:
    """Return a sum of amplitudes over the mesh's amplitude."""
    return _moments.quotient(pairs, mesh, mesh * mesh / 2 <= floor)


def _amplitudes(x: Float64Array) -> Float64Array:
    return np.abs(np.fft.rfft(x)) * one_sided(x.shape[-1])
