"""Moments along the last axis, and the rule by which a signal has no variance. Kernels: they assume checked input.

They take signals in units of their largest modulus, so that neither nm nor m/s^2 run out of floating-point range at
the eighth power.
"""

from typing import cast

import numpy as np
from numpy.typing import NDArray

from sigdb.signature.checks import Float64Array


def peak(x: Float64Array) -> Float64Array:
    """Largest modulus, ``(..., n) -> (...)``."""
    return np.maximum(np.max(x, axis=-1), -np.min(x, axis=-1)) + 0.0  # never -0


def as_float(values: Float64Array) -> Float64Array:
    """Values as they are, or as a float, which prints as a number, where there is one signal only."""
    return values if np.ndim(values) else cast(Float64Array, np.asarray(values).item())


def nonzero(p: Float64Array) -> Float64Array:
    """A divisor: the peak, or 1 where the signal is zeros."""
    return np.where(p > 0, p, 1.0)


def per_peak(x: Float64Array) -> tuple[Float64Array, Float64Array]:
    """The signal in units of its largest modulus, and that modulus; a signal of zeros stays."""
    p = peak(x)
    return x / nonzero(p)[..., None], p


def dot(a: Float64Array, b: Float64Array) -> Float64Array:
    """Sum of products over the last axis."""
    return np.einsum("...i,...i->...", a, b)


def mean_square(u: Float64Array) -> Float64Array:
    """Mean of squares, the mean kept."""
    return dot(u, u) / u.shape[-1]


def variance(u: Float64Array) -> Float64Array:
    """Population variance."""
    return mean_square(u - np.mean(u, axis=-1, keepdims=True))


def rounding_floor(eps: float, scale: Float64Array | float = 1.0) -> Float64Array:
    """The mean square, (64 eps s)^2, up to which a part of a signal of scale s is no more than its rounding."""
    return np.square(64 * eps * scale)


def quotient(a: Float64Array, b: Float64Array, undefined: NDArray[np.bool_]) -> Float64Array:
    """a / b, nan where undefined."""
    # The empty index turns the array without axes of a single signal into a number.
    return np.divide(a, b, out=np.full(np.shape(a), np.nan), where=~undefined)[()]


def moment_ratios(u: Float64Array, powers: tuple[int, ...], floor: Float64Array) -> tuple[Float64Array, ...]:
    """n^(q/2-1) sum d^q / (sum d^2)^(q/2) of d = u - mean, for increasing even q; nan without variance."""
    n = u.shape[-1]
    d = u - np.mean(u, axis=-1, keepdims=True)
    v = d * d
    variance = np.mean(v, axis=-1)
    ratios, power, w = [], 4, v
    for q in powers:
        while power < q:
            w, power = w * v, power + 2
        ratios.append(quotient(dot(w, v) / n, variance ** (q // 2), variance <= floor))
    return tuple(ratios)


def teager_kaiser(u: Float64Array) -> Float64Array:
    """u_n^2 - u_(n-1) u_(n+1), circular."""
    return u * u - np.roll(u, 1, axis=-1) * np.roll(u, -1, axis=-1)
