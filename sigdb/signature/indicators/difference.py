"""Indicators of the difference signal, ``(..., n) -> (...)`` in float64.

A difference that is only rounding does not show its scale, so these functions take the scale of the average. A quotient
is nan, without a warning, where the signal of its denominator is no more than rounding. The rule, with the mean
removed, is ``sum d^2 <= n (64 eps s)^2``, with eps of the input's type and s the scale, ``max|average|``.
"""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import InputError
from sigdb.signature.checks import Float64Array, real_signal, signal_scale
from sigdb.signature.indicators import moment_kernels as _moments


def fm4(difference: ArrayLike, *, scale: ArrayLike | None = None) -> Float64Array:
    """Compute the kurtosis of the difference signal, ``n sum d^4 / (sum d^2)^2``; 1.5 for a sine, 3 for Gaussian noise.

    Parameters
    ----------
    difference : array_like, (..., n)
        From :func:`difference_signal`, in any unit; its mean is removed.
    scale : array_like, (...), optional
        ``max|average|``, in the same unit, for the rule on variance; ``max|difference|`` by default.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without variance.

    Raises
    ------
    InputError
        If ``difference`` is empty, complex or not finite, or ``scale`` is negative, not finite or of another shape.

    References
    ----------
    .. [1] Stewart, "Some useful data analysis techniques for gearbox diagnostics", Institute of Sound and Vibration
       Research, University of Southampton, 1977.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import fm4
    >>> round(float(fm4(np.sin(2 * np.pi * 5 * np.arange(64) / 64))), 12)
    1.5
    """
    return _moments.as_float(_difference_moment("fm4", difference, 4, scale))


def m6a(difference: ArrayLike, *, scale: ArrayLike | None = None) -> Float64Array:
    """Compute the sixth moment of the difference signal; 2.5 for a sine, 15 for Gaussian noise.

    It is normalised: ``n^2 sum d^6 / (sum d^2)^3``.

    Parameters
    ----------
    difference, scale
        As in :func:`fm4`.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without variance.

    Raises
    ------
    InputError
        As :func:`fm4`.

    References
    ----------
    .. [1] Martin, "Statistical moment analysis as a means of surface damage detection", 7th International Modal
       Analysis Conference, 1989.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import m6a
    >>> round(float(m6a(np.sin(2 * np.pi * 5 * np.arange(64) / 64))), 12)
    2.5
    """
    return _moments.as_float(_difference_moment("m6a", difference, 6, scale))


def m8a(difference: ArrayLike, *, scale: ArrayLike | None = None) -> Float64Array:
    """Compute the eighth moment of the difference signal; 4.375 for a sine, 105 for Gaussian noise.

    It is normalised: ``n^3 sum d^8 / (sum d^2)^4``.

    Parameters
    ----------
    difference, scale
        As in :func:`fm4`.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan without variance.

    Raises
    ------
    InputError
        As :func:`fm4`.

    References
    ----------
    .. [1] Martin, "Statistical moment analysis as a means of surface damage detection", 7th International Modal
       Analysis Conference, 1989.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import m8a
    >>> round(float(m8a(np.sin(2 * np.pi * 5 * np.arange(64) / 64))), 12)
    4.375
    """
    return _moments.as_float(_difference_moment("m8a", difference, 8, scale))


def energy_ratio(difference: ArrayLike, regular: ArrayLike, *, scale: ArrayLike | None = None) -> Float64Array:
    """Compute ``rms(difference) / rms(regular)``.

    Parameters
    ----------
    difference, regular : array_like, (..., n)
        From :func:`difference_signal` and :func:`regular_signal` of the same averages.
    scale : array_like, (...), optional
        ``max|average|``, in the same unit, for the rule on variance; the larger of ``max|difference|`` and
        ``max|regular|`` by default.

    Returns
    -------
    (...) float64, or float for one signal
        No unit; nan where the regular signal has no variance. A difference without variance gives about 0.

    Raises
    ------
    InputError
        As :func:`fm4`, or if the two shapes differ.

    References
    ----------
    .. [1] Zakrajsek, Townsend, Decker, "An Analysis of Gear Fault Detection Methods as Applied to Pitting Fatigue
       Failure Data", NASA TM-105950, 1993.

    Examples
    --------
    >>> from sigdb.signature import energy_ratio
    >>> float(energy_ratio([1.0, -1.0, 1.0, -1.0], [2.0, 2.0, -2.0, -2.0]))
    0.5
    """
    d, eps_d = real_signal("energy_ratio", "difference", difference)
    r, eps_r = real_signal("energy_ratio", "regular", regular)
    if d.shape != r.shape:
        raise InputError(
            f"energy_ratio: difference of shape {d.shape} must have the shape of regular, {r.shape};"
            " pass both from the same averages"
        )
    p = np.maximum(_moments.peak(d), _moments.peak(r))
    s, unit = signal_scale("energy_ratio", scale, p), _moments.nonzero(p)
    u, v = d / unit[..., None], r / unit[..., None]
    undefined = _moments.variance(v) <= _moments.rounding_floor(max(eps_d, eps_r), s / unit)
    return _moments.as_float(np.sqrt(_moments.quotient(_moments.mean_square(u), _moments.mean_square(v), undefined)))


def _difference_moment(owner: str, difference: ArrayLike, power: int, scale: ArrayLike | None) -> Float64Array:
    d, eps = real_signal(owner, "difference", difference)
    u, p = _moments.per_peak(d)
    s = signal_scale(owner, scale, p)
    return _moments.moment_ratios(u, (power,), _moments.rounding_floor(eps, s / _moments.nonzero(p)))[0]
