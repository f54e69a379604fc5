"""Checks at the public boundary; each message names function, argument, rule, value and remedy."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError, plain_array, shown

Float64Array = NDArray[np.float64]

GREATEST_COUNT = 2**24
"""Greatest count of samples, bins, teeth or records: more would not fit into memory."""

_GREATEST = 1e300
"""Greatest sample: sums of a signal's samples stay below the greatest float."""


def real_signal(owner: str, name: str, x: ArrayLike) -> tuple[Float64Array, float]:
    """The signal in float64, and the relative precision of the type that it came in."""
    a = plain_array(owner, name, x)
    if a.dtype.kind == "c":
        raise InputError(f"{owner}: {name} must be real, not {a.dtype}; pass its real part")
    _check_samples(owner, name, a)
    return a.astype(np.float64, copy=False), _precision(a.dtype)


def real_or_complex_signal(owner: str, name: str, x: ArrayLike) -> Float64Array | NDArray[np.complex128]:
    """The signal in float64 or complex128."""
    a = plain_array(owner, name, x)
    _check_samples(owner, name, a)
    return a.astype(np.complex128, copy=False) if a.dtype.kind == "c" else a.astype(np.float64, copy=False)


def _check_samples(owner: str, name: str, a: NDArray[np.generic]) -> None:
    if a.dtype.kind not in "iufc":
        raise InputError(f"{owner}: {name} must hold numbers, not {a.dtype}; convert it to float64 or float32")
    if a.ndim == 0 or a.shape[-1] == 0:
        raise InputError(
            f"{owner}: {name} of shape {a.shape} must have samples on its last axis; pass (..., n), n >= 1"
        )
    bad = a.size - int(np.count_nonzero(np.isfinite(a)))
    if bad:
        raise InputError(
            f"{owner}: {name} must be finite, but {bad} of {a.size} samples are nan or inf; leave those signals out"
        )
    parts = (a.real, a.imag) if a.dtype.kind == "c" else (a,)
    most = max(max(float(part.max(initial=0)), -float(part.min(initial=0))) for part in parts)
    if most > _GREATEST:
        raise InputError(
            f"{owner}: {name} has a sample of {most:g}; give it in a unit in which it is below {_GREATEST:g}"
        )


def _precision(dtype: np.dtype[np.generic]) -> float:
    coarse = float(np.finfo(dtype.type).eps) if issubclass(dtype.type, np.floating) else 0.0
    return max(coarse, float(np.finfo(np.float64).eps))


def finite(owner: str, name: str, value: object) -> float:
    """A finite number."""
    number = plain_array(owner, name, value)
    if number.ndim or number.dtype.kind not in "iuf" or not np.isfinite(number):
        raise InputError(f"{owner}: {name} = {shown(value)} must be a finite number; pass one float")
    return float(number)


def positive(owner: str, name: str, value: object) -> float:
    """A finite number above 0."""
    number = finite(owner, name, value)
    if number <= 0:
        raise InputError(f"{owner}: {name} = {shown(value)} must be above 0; check its sign and unit")
    return number


def increasing_times(owner: str, name: str, times: ArrayLike, *, after: float) -> Float64Array:
    """Finite, increasing times, all later than ``after``; there may be none."""
    t = plain_array(owner, name, times)
    if t.ndim != 1 or (t.size and t.dtype.kind not in "iuf"):
        raise InputError(f"{owner}: {name} of shape {t.shape} must be a one-dimensional array of times, s")
    t = t.astype(np.float64)
    if not np.all(np.isfinite(t)):
        raise InputError(f"{owner}: {name} must be finite; leave out those that are nan or inf")
    wrong = np.flatnonzero(np.diff(t, prepend=after) <= 0)
    if wrong.size:
        i = int(wrong[0])
        raise InputError(
            f"{owner}: {name} must increase, but entry {i}, {t[i]:g} s, is not after {t[i - 1] if i else after:g} s;"
            " sort them and drop repeated ones, or detect them with more hysteresis"
        )
    return t


def count(owner: str, name: str, value: object, *, least: int, most: int | None = None) -> int:
    """A whole number from ``least`` to ``most``, if there is one; a float or a bool is refused even if whole."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{owner}: {name} = {shown(value)} must be an integer >= {least}; pass such a count as int")
    if most is not None and value > most:
        raise InputError(f"{owner}: {name} = {shown(value)} must be at most {most}; pass a smaller count")
    return int(value)


def mesh_teeth(owner: str, teeth: object, n: int) -> int:
    """A tooth count whose mesh order, ``teeth``, lies below Nyquist, n/2."""
    z = count(owner, "teeth", teeth, least=1)
    if 2 * z >= n:
        raise InputError(
            f"{owner}: teeth = {z} must be below n/2 = {n / 2:g}, else the mesh order does not fit a spectrum of"
            f" n = {n} samples a revolution; average with more samples a revolution"
        )
    return z


def harmonics_below_nyquist(owner: str, name: str, value: object, *, spacing: int, n: int, least: int) -> int:
    """A count of harmonics of order ``spacing`` that all lie below Nyquist."""
    most = (n - 1) // 2 // spacing
    harmonics = count(owner, name, value, least=least)
    if harmonics > most:
        raise InputError(
            f"{owner}: {name} = {harmonics} must be at most {most}, the harmonics of order {spacing} below"
            f" n/2 = {n / 2:g}; ask for fewer or average with more samples a revolution"
        )
    return harmonics


def signal_scale(owner: str, scale: ArrayLike | None, default: Float64Array) -> Float64Array:
    """The scale s of each signal, ``default`` where none is given."""
    if scale is None:
        return default
    s = plain_array(owner, "scale", scale)
    if s.dtype.kind not in "iuf" or not np.all(np.isfinite(s)) or np.any(s < 0):
        raise InputError(f"{owner}: scale = {shown(scale)} must be finite and >= 0; pass max|average| or leave it out")
    try:
        return np.broadcast_to(s.astype(np.float64), default.shape)
    except ValueError:
        raise InputError(
            f"{owner}: scale of shape {s.shape} must broadcast to {default.shape}; pass one number, or one a signal"
        ) from None


def band_edges(owner: str, bands: ArrayLike, n: int) -> Float64Array:
    """Increasing edges of at least one band, in orders from 0 to n/2."""
    edges = plain_array(owner, "bands", bands)
    if edges.dtype.kind not in "iuf" or edges.ndim != 1 or edges.size < 2:
        raise InputError(f"{owner}: bands = {shown(bands)} must be a one-dimensional array of edges in orders")
    e = edges.astype(np.float64)
    if not np.all(np.isfinite(e)) or np.any(np.diff(e) <= 0):
        raise InputError(
            f"{owner}: bands = {shown(bands)} must be finite and increasing; sort the edges, drop repeated ones"
        )
    # Edges computed as multiples of a mesh order may pass n/2 by rounding.
    if e[0] < 0 or e[-1] > n / 2 * (1 + 1e-12):
        raise InputError(
            f"{owner}: bands from {e[0]:g} to {e[-1]:g} must lie within orders 0 to n/2 = {n / 2:g};"
            " leave out the bands beyond, or average with more samples a revolution"
        )
    return e
