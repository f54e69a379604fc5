"""The (pseudo) Wigner-Ville distribution of an average over angle and order."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError, plain_array
from sigdb.signature.checks import Float64Array, real_or_complex_signal
from sigdb.signature.wigner_ville.lag_window import LagWindow, analytic, half_window, lag_weights

_PADDING = {"circular": "wrap", "zero": "constant"}
_SMOOTHING = {"circular": "grid-wrap", "zero": "constant"}


def wigner_ville(
    x: ArrayLike,
    *,
    lag_window: LagWindow | None = None,
    time_window: int | ArrayLike | None = None,
    record_window: ArrayLike | None = None,
    boundary: str = "circular",
    n_bins: int | None = None,
) -> Float64Array:
    r"""Compute the Wigner-Ville distribution, (11) and (12) of [1]_, with a window on the lag.

    ``W[i, k] = sum_{m=-L}^{L} h[|m|] z[i+m] conj(z[i-m]) exp(-2 pi j m k / K)``

    With ``lag_window="full"`` this is the distribution itself, with a shorter window the pseudo distribution, and with
    a ``time_window`` as well the smoothed pseudo distribution,
    ``sum_{p=-G}^{G} g[|p|] W[i-p, k] / sum_{p=-G}^{G} g[|p|]``.

    Bin k is order ``k n / (2 K)``: half an order a bin at K = n. The period in order is n/2.

    Parameters
    ----------
    x : array_like, (..., n)
        Averages of one revolution in any unit. Complex input is z itself; real input is made analytic by its DFT, mean
        and Nyquist kept once.
    lag_window : int, array_like or "full", optional
        A half-length L, for a Hamming window with ``h[m] = 0.54 + 0.46 cos(pi m / L)``; the weights h[0..L] themselves,
        symmetric about h[0] = 1; or ``"full"``: all lags with weight 1, on the circle n consecutive ones. At most half
        a revolution, L = n//2; by default L = n//6, 60 degrees. Up to n/4 the two samples of a lag stay within half a
        revolution of each other; longer circular windows repeat each event half a revolution later.
    time_window : int or array_like, optional
        Smoothing along the revolution: a half-length G, for a Hamming window, or the weights g[0..G], symmetric about
        g[0] = 1; at most half a revolution. None by default.
    record_window : array_like, (n,), optional
        Weights on z itself. The literal form of the weighting in [1]_ is this with ``boundary="zero"`` and
        ``lag_window="full"``; it does not turn with the signal, since it prefers the middle of the record.
    boundary : {"circular", "zero"}
        Samples outside the record: the average as a period, or zeros.
    n_bins : int, optional
        Count of bins K, at least 2L + 1 (n for the full circular window); n by default.

    Returns
    -------
    (..., n, K) float64
        Time first, in the square of the unit of ``x``: ``sum_k W[i, k] = K |z[i]|^2`` for any window on the lag, the
        same smoothed for one on time.

    Raises
    ------
    InputError
        If ``x`` is empty or not finite, ``boundary`` is unknown, a window is malformed or longer than half a
        revolution, or ``n_bins`` is too few for it.

    Notes
    -----
    The full circular distribution of even n repeats itself, ``W[i + n/2, k] = (-1)^k W[i, k]`` at K = n; the window is
    there to suppress that.

    References
    ----------
    .. [1] Choy, Polyshchuk, Zakrajsek, Handschuh, Townsend, "Analysis of the Effects of Surface Pitting and Wear on the
       Vibrations of a Gear Transmission System", Tribology International 29(1), 1996.
    .. [2] Cohen, "Time-frequency distributions - a review", Proceedings of the IEEE 77(7), 1989, doi:10.1109/5.30749.

    Examples
    --------
    A tone of order 5 is a ridge at bin 10, everywhere in the revolution:

    >>> import numpy as np
    >>> from sigdb.signature import wigner_ville
    >>> W = wigner_ville(np.cos(2 * np.pi * 5 * np.arange(48) / 48))
    >>> W.shape, np.unique(W.argmax(axis=-1)).tolist()
    ((48, 48), [10])
    """
    a = real_or_complex_signal("wigner_ville", "x", x)
    if not isinstance(boundary, str) or boundary not in _PADDING:
        raise InputError(f'wigner_ville: boundary = {boundary!r} must be "circular" or "zero"; pass one of the two')
    n = a.shape[-1]
    window = n // 6 if lag_window is None else lag_window
    h, K = lag_weights("wigner_ville", window, n, n_bins, circular=boundary == "circular")
    z = analytic(a) if record_window is None else analytic(a) * _record_weights(record_window, n)
    r = _lag_products(z, h.size - 1, _PADDING[boundary]) * h
    if time_window is not None:
        r = _smoothed(r, half_window("wigner_ville", "time_window", time_window, n), _SMOOTHING[boundary])
    return _over_lag(r, K)


def _record_weights(record_window: ArrayLike, n: int) -> Float64Array:
    w = plain_array("wigner_ville", "record_window", record_window)
    if w.shape != (n,) or w.dtype.kind not in "iuf" or not np.all(np.isfinite(w)):
        raise InputError(
            f"wigner_ville: record_window of shape {w.shape} must be real, finite and of shape ({n},);"
            " pass a weight for each sample"
        )
    return w.astype(np.float64)


def _smoothed(r: NDArray[np.complex128], g: Float64Array, boundary: str) -> NDArray[np.complex128]:
    """Lag products averaged over neighbouring samples; the transform over the lag commutes with that."""
    from scipy.ndimage import convolve1d

    weights = np.concatenate([g[:0:-1], g])
    if weights.sum() <= 0:
        raise InputError(
            f"wigner_ville: time_window sums to {weights.sum():g}, which must be above 0; pass weights of one sign"
        )
    return convolve1d(r, weights / weights.sum(), axis=-2, mode=boundary)


def _lag_products(z: NDArray[np.complex128], L: int, padding: str) -> NDArray[np.complex128]:
    """z[i+m] conj(z[i-m]), ``(..., n, L + 1)``."""
    ends = [(0, 0)] * (z.ndim - 1) + [(L, L)]
    shifted = sliding_window_view(np.pad(z, ends, mode=padding), z.shape[-1], axis=-1)  # type: ignore[call-overload]
    return np.swapaxes(shifted[..., L:, :] * shifted[..., L::-1, :].conj(), -1, -2)


def _over_lag(r: NDArray[np.complex128], K: int) -> Float64Array:
    """The transform over all lags of products known at lags 0 ... L; those at -m are their conjugates."""
    L = r.shape[-1] - 1
    if L > 0 and 2 * L == K:
        # hfft takes the lag K/2 once; here it stands on both sides.
        r = r * np.append(np.ones(L), 2.0)
    return np.fft.hfft(r, K)
