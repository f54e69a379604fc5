"""Indicators that compare a record with its history, ``(..., records, n) -> (..., records)`` in float64.

Each indicator is the fourth moment of a record over the square of a mean second moment. That mean goes over the records
up to this one (NA4, NB4), or over the first, healthy ones (NA4*, NB4*). Means are removed, and moments are those of the
population. A quotient is nan, without a warning, where its denominator is no more than rounding. The rule
compares means over those records: that of ``sum d^2`` is at most that of ``n (64 eps s)^2``, with eps of the input's
type and s the scale of each.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError, IntArray
from sigdb.signature.checks import Float64Array, count, mesh_teeth, real_signal, signal_scale
from sigdb.signature.demodulation import baseband, default_half_width
from sigdb.signature.indicators import moment_kernels as _moments


def na4(residuals: ArrayLike, *, scale: ArrayLike | None = None) -> Float64Array:
    """Compute NA4: the residual's fourth moment over the squared mean second moment of the records up to now.

    ``n sum r_m^4 / (1/m sum_{j<=m} sum r_j^2)^2`` for record m, which is included in the mean.

    Parameters
    ----------
    residuals : array_like, (..., records, n)
        From :func:`residual_signal`, oldest first, in any one unit; the mean of each is removed.
    scale : array_like, (..., records), optional
        ``max|average|``, in the same unit, for the rule on variance; ``max|residual|`` by default.

    Returns
    -------
    (..., records) float64
        No unit; 3 for steady Gaussian noise. The first record's is its kurtosis.

    Raises
    ------
    InputError
        If ``residuals`` is empty, complex, not finite or has a single axis, or ``scale`` is negative, not finite or of
        another shape.

    References
    ----------
    .. [1] Zakrajsek, Townsend, Decker, "An Analysis of Gear Fault Detection Methods as Applied to Pitting Fatigue
       Failure Data", NASA TM-105950, 1993.

    Examples
    --------
    Twice the amplitude against a mean that it is part of: 1.5 times 16 over the square of (1 + 4) / 2.

    >>> import numpy as np
    >>> from sigdb.signature import na4
    >>> tone = np.sin(2 * np.pi * 5 * np.arange(64) / 64)
    >>> na4([tone, 2 * tone]).round(12).tolist()
    [1.5, 3.84]
    """
    return _of_residuals("na4", residuals, scale, None)


def na4_star(residuals: ArrayLike, *, baseline: int, scale: ArrayLike | None = None) -> Float64Array:
    """Compute NA4*: the residual's fourth moment over the squared mean second moment of the first, healthy records.

    ``n sum r_m^4 / (1/b sum_{j<=b} sum r_j^2)^2``. Where there is no history in time, put at least 8 noisy healthy
    records of the same operating point first.

    Parameters
    ----------
    residuals : array_like, (..., records, n)
        As in :func:`na4`; the first ``baseline`` are of the healthy gear.
    baseline : int
        Count b of healthy records.
    scale : array_like, (..., records), optional
        As in :func:`na4`.

    Returns
    -------
    (..., records) float64
        No unit; it grows with the fourth power of the residual.

    Raises
    ------
    InputError
        As :func:`na4`, or if ``baseline`` is not an integer from 1 to the count of records.

    References
    ----------
    .. [1] Decker, Handschuh, Zakrajsek, "An Enhancement to the NA4 Gear Vibration Diagnostic Parameter", NASA
       TM-106553, 1994.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import na4_star
    >>> tone = np.sin(2 * np.pi * 5 * np.arange(64) / 64)
    >>> na4_star([tone, 2 * tone], baseline=1).round(12).tolist()
    [1.5, 24.0]
    """
    return _of_residuals("na4_star", residuals, scale, count("na4_star", "baseline", baseline, least=1))


def nb4(averages: ArrayLike, *, teeth: int) -> Float64Array:
    """Compute NB4: the quotient of NA4 on the envelope of the band about the dominant harmonic of the mesh.

    The harmonic is chosen once: the one with the largest mean amplitude over all the records. Its band reaches
    ``(teeth - 1) // 2`` orders to either side. The mean of the envelope is removed.

    Parameters
    ----------
    averages : array_like, (..., records, n)
        Real averages of one revolution, oldest first, in any one unit.
    teeth : int
        Tooth count of the gear on the averaged shaft; below n/2.

    Returns
    -------
    (..., records) float64
        No unit; nan where the envelope has no variance, its scale being ``max|average|``.

    Raises
    ------
    InputError
        If ``averages`` is empty, complex, not finite or has a single axis, or ``teeth`` is not an integer from 1 to
        below n/2.

    References
    ----------
    .. [1] Zakrajsek, Handschuh, Decker, "Application of Fault Detection Techniques to Spiral Bevel Gear Fatigue Data",
       NASA TM-106467, 1994.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import nb4
    >>> theta = 2 * np.pi * np.arange(256) / 256
    >>> records = [(1 + a * np.cos(2 * theta)) * np.cos(16 * theta) for a in (0.1, 0.2)]
    >>> nb4(records, teeth=16).round(12).tolist()
    [1.5, 3.84]
    """
    return _of_envelopes("nb4", averages, teeth, None)


def nb4_star(averages: ArrayLike, *, teeth: int, baseline: int) -> Float64Array:
    """Compute NB4*: the quotient of NA4* on the envelope of the band about the dominant harmonic of the mesh.

    Parameters
    ----------
    averages, teeth
        As in :func:`nb4`; the first ``baseline`` averages are of the healthy gear.
    baseline : int
        Count of healthy records.

    Returns
    -------
    (..., records) float64
        No unit; nan where the envelopes of the healthy records have no variance.

    Raises
    ------
    InputError
        As :func:`nb4`, or if ``baseline`` is not an integer from 1 to the count of records.

    References
    ----------
    .. [1] Zakrajsek, Handschuh, Decker, NASA TM-106467, 1994, and Decker, Handschuh, Zakrajsek, NASA TM-106553, 1994.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import nb4_star
    >>> theta = 2 * np.pi * np.arange(256) / 256
    >>> records = [(1 + a * np.cos(2 * theta)) * np.cos(16 * theta) for a in (0.1, 0.2)]
    >>> nb4_star(records, teeth=16, baseline=1).round(12).tolist()
    [1.5, 24.0]
    """
    return _of_envelopes("nb4_star", averages, teeth, count("nb4_star", "baseline", baseline, least=1))


def _of_residuals(owner: str, residuals: ArrayLike, scale: ArrayLike | None, baseline: int | None) -> Float64Array:
    r, eps = _history(owner, "residuals", residuals, baseline)
    peaks = _moments.peak(r)
    s = signal_scale(owner, scale, peaks)
    unit = _unit(peaks)
    return _quotients(r / unit[..., None], s / unit, eps, baseline)


def _of_envelopes(owner: str, averages: ArrayLike, teeth: int, baseline: int | None) -> Float64Array:
    x, eps = _history(owner, "averages", averages, baseline)
    n = x.shape[-1]
    z = mesh_teeth(owner, teeth, n)
    peaks = _moments.peak(x)
    unit = _unit(peaks)
    X = np.fft.rfft(x / unit[..., None])
    c = baseband(X, n, _dominant(X, z, n)[..., None], default_half_width(z))
    return _quotients(np.abs(c), peaks / unit, eps, baseline)


def _history(owner: str, name: str, x: ArrayLike, baseline: int | None) -> tuple[Float64Array, float]:
    a, eps = real_signal(owner, name, x)
    if a.ndim < 2:
        raise InputError(f"{owner}: {name} of shape {a.shape} must be (..., records, n); pass a history of records")
    if baseline is not None and baseline > a.shape[-2]:
        raise InputError(
            f"{owner}: baseline = {baseline} must be at most {a.shape[-2]}, the count of records; pass the healthy"
            " records first"
        )
    return a, eps


def _unit(peaks: Float64Array) -> Float64Array:
    """Return the largest modulus of each history, ``(..., 1)``: in this unit, fourth powers stay within range."""
    return _moments.nonzero(np.max(peaks, axis=-1, keepdims=True, initial=0.0))


def _dominant(X: NDArray[np.complex128], teeth: int, n: int) -> IntArray:
    """Order of the mesh harmonic with the largest mean amplitude over the records."""
    mesh = teeth * np.arange(1, (n - 1) // 2 // teeth + 1)
    return mesh[np.argmax(np.sum(np.abs(X[..., mesh]), axis=-2), axis=-1)]


def _quotients(u: Float64Array, scale: Float64Array, eps: float, baseline: int | None) -> Float64Array:
    d = u - np.mean(u, axis=-1, keepdims=True)
    v = d * d
    reference = _mean_over_records(np.mean(v, axis=-1), baseline)
    floor = _mean_over_records(_moments.rounding_floor(eps, scale), baseline)
    square = np.square(reference)  # 0 where a record is smaller than a later one by 150 powers of ten
    return _moments.quotient(_moments.mean_square(v), square, (reference <= floor) | (square == 0))


def _mean_over_records(a: Float64Array, baseline: int | None) -> Float64Array:
    """Mean over the records up to each, or over the first ones."""
    if baseline is None:
        return np.cumsum(a, axis=-1) / np.arange(1, a.shape[-1] + 1)
    return np.broadcast_to(np.mean(a[..., :baseline], axis=-1, keepdims=True), a.shape)
