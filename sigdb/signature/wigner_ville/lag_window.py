"""Weights of the lags m = 0 ... L of a Wigner-Ville distribution; the other half is their mirror."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError, plain_array
from sigdb.signature.checks import Float64Array, count

LagWindow = int | str | ArrayLike
"""A half-length L (Hamming), the weights h[0..L] themselves, or ``"full"``."""

_MOST_BINS = 64
"""Greatest number of bins for each sample of the signal: more interpolate nothing that can be seen."""


def lag_weights(
    owner: str, lag_window: LagWindow, n: int, n_bins: int | None, *, circular: bool
) -> tuple[Float64Array, int]:
    """Return the weights h[0..L] and the count K of bins, n by default; ``owner`` is named in messages."""
    K = n if n_bins is None else count(owner, "n_bins", n_bins, least=1, most=_MOST_BINS * n)
    if isinstance(lag_window, str):
        h = _full(owner, lag_window, n, circular=circular)
        # The lag of half a period is one lag, so n lags fit n bins although 2L + 1 = n + 1.
        least = n if circular else 2 * h.size - 1
    else:
        h = half_window(owner, "lag_window", lag_window, n)
        least = 2 * h.size - 1
    if least > K:
        raise InputError(
            f"{owner}: n_bins = {K} must be at least {least} for the lags of this window, else they alias;"
            " ask for more bins or shorten lag_window"
        )
    return h, K


def half_window(owner: str, name: str, window: ArrayLike, n: int) -> Float64Array:
    """Return the half h[0..L] of a symmetric window, from its weights, or as a Hamming window from a half-length."""
    h = plain_array(owner, name, window)
    h = hamming(count(owner, name, window, least=0)) if h.ndim == 0 else _checked_weights(owner, name, h)
    if h.size - 1 > n // 2:
        raise InputError(
            f"{owner}: {name} has L = {h.size - 1}, which must be at most n//2 = {n // 2}, half a revolution;"
            " shorten it"
        )
    return h


def hamming(half_length: int) -> Float64Array:
    """h[m] = 0.54 + 0.46 cos(pi m / L), m = 0 ... L; a single 1 at L = 0."""
    return 0.54 + 0.46 * np.cos(np.pi * np.arange(half_length + 1) / max(half_length, 1))


def _full(owner: str, name: str, n: int, *, circular: bool) -> Float64Array:
    if name != "full":
        raise InputError(f'{owner}: lag_window = {name!r} must be "full", a half-length L or an array h[0..L]')
    if not circular:
        return np.ones((n - 1) // 2 + 1)
    h = np.ones(n // 2 + 1)
    if n % 2 == 0 and n > 1:
        # Lags -n/2 and n/2 are the same one: half of it on either side counts it once and keeps W real for any K.
        h[-1] = 0.5
    return h


def _checked_weights(owner: str, name: str, h: NDArray[np.generic]) -> Float64Array:
    if h.ndim != 1 or h.size == 0 or h.dtype.kind not in "iuf" or not np.all(np.isfinite(h)) or h[0] != 1:
        raise InputError(
            f"{owner}: {name} of shape {h.shape} must be real, finite, one-dimensional h[0..L] with h[0] = 1;"
            " pass the half from lag 0 on, divided by its value there"
        )
    return h.astype(np.float64)


def analytic(x: NDArray[np.float64] | NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return a complex signal as it is, a real signal with its negative orders moved onto the positive ones, (12)."""
    return _from_real(x.real) if np.isrealobj(x) else x.astype(np.complex128, copy=False)


def _from_real(x: Float64Array) -> NDArray[np.complex128]:
    return analytic_of(np.fft.rfft(x), x.shape[-1])


def analytic_of(X: NDArray[np.complex128], n: int) -> NDArray[np.complex128]:
    """Return the complex signals (..., n) of real ones whose FFT has the bins X, (..., n // 2 + 1)."""
    Z = np.zeros((*X.shape[:-1], n), dtype=np.complex128)
    Z[..., : n // 2 + 1] = X
    # Mean and, for even n, Nyquist have no mirror: they are kept once.
    Z[..., 1 : (n + 1) // 2] *= 2
    return np.fft.ifft(Z)
