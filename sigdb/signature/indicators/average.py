"""Indicators of the average itself, ``(..., n) -> (...)`` in float64.

Moments are population moments with the mean removed, except that rms and crest factor keep it. A quotient of a signal
without variance is nan, without a warning: when, the mean removed, ``sum d^2 <= n (64 eps s)^2``, with eps of the
input's type and s = ``max|average|``.
"""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.signature.checks import Float64Array, real_signal
from sigdb.signature.indicators import moment_kernels as _moments


def rms(tsa: ArrayLike) -> Float64Array:
    """Compute the root mean square, the mean included: ``sqrt(1/n sum x^2)``.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real signals in any unit.

    Returns
    -------
    (...) float64, or float for one signal
        In the unit of ``tsa``; a number also without variance.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite.

    Examples
    --------
    >>> from sigdb.signature import rms
    >>> float(rms([3.0, -3.0, 3.0, -3.0]))
    3.0
    """
    x, _ = real_signal("rms", "tsa", tsa)
    u, s = _moments.per_peak(x)
    return _moments.as_float(s * np.sqrt(_moments.mean_square(u)))


def peak_to_peak(tsa: ArrayLike) -> Float64Array:
    """Compute the largest minus the smallest sample.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real signals in any unit.

    Returns
    -------
    (...) float64, or float for one signal
        In the unit of ``tsa``; 0 without variance.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite.

    Examples
    --------
    >>> from sigdb.signature import peak_to_peak
    >>> float(peak_to_peak([1.0, -2.0, 0.5]))
    3.0
    """
    x, _ = real_signal("peak_to_peak", "tsa", tsa)
    return _moments.as_float(np.ptp(x, axis=-1))


def crest_factor(tsa: ArrayLike) -> Float64Array:
    """Compute the largest modulus over rms, ``max|x| / rms(x)``, the mean kept in both; sqrt(2) for a sine.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real signals in any unit.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without variance.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite.

    Examples
    --------
    >>> from sigdb.signature import crest_factor
    >>> float(crest_factor([1.0, -1.0, 1.0, -1.0]))
    1.0
    """
    x, eps = real_signal("crest_factor", "tsa", tsa)
    u, _ = _moments.per_peak(x)
    undefined = _moments.variance(u) <= _moments.rounding_floor(eps)
    return _moments.as_float(_moments.quotient(_moments.peak(u), np.sqrt(_moments.mean_square(u)), undefined))


def kurtosis(tsa: ArrayLike) -> Float64Array:
    """Compute the fourth moment over the squared variance; 3 for Gaussian noise.

    It is ``n sum d^4 / (sum d^2)^2`` with ``d = x - mean``.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real signals in any unit.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without variance.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite.

    Examples
    --------
    >>> from sigdb.signature import kurtosis
    >>> float(kurtosis([1.0, -1.0, 1.0, -1.0]))
    1.0
    """
    x, eps = real_signal("kurtosis", "tsa", tsa)
    u, _ = _moments.per_peak(x)
    return _moments.as_float(_moments.moment_ratios(u, (4,), _moments.rounding_floor(eps))[0])


def energy_operator(tsa: ArrayLike) -> Float64Array:
    """Compute the kurtosis of the Teager-Kaiser energy of the average with its mean.

    The energy is ``x_n^2 - x_(n-1) x_(n+1)``, circular. The energy of ``A cos(w n)`` is the constant ``A^2 sin^2 w``,
    so a pure tone gives nan.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan where the energy has no variance, its scale the square of the average's.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite.

    References
    ----------
    .. [1] Kaiser, "On a simple algorithm to calculate the 'energy' of a signal", ICASSP 1990,
       doi:10.1109/ICASSP.1990.115702.

    Examples
    --------
    An impulse among n samples has one nonzero energy, whose kurtosis is ``n - 2 + 1/(n - 1)``:

    >>> from sigdb.signature import energy_operator
    >>> round(float(energy_operator([0.0, 0.0, 2.0, 0.0, 0.0])), 12)
    3.25
    """
    x, eps = real_signal("energy_operator", "tsa", tsa)
    u, _ = _moments.per_peak(x)
    return _moments.as_float(_moments.moment_ratios(_moments.teager_kaiser(u), (4,), _moments.rounding_floor(eps))[0])
