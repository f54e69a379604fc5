"""The Wigner-Ville distribution summed over tooth passes and bands of order, without forming the distribution."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import SIGNALS_AT_ONCE, InputError, blocks
from sigdb.signature.checks import GREATEST_COUNT, Float64Array, band_edges, count, real_or_complex_signal
from sigdb.signature.wigner_ville.lag_window import LagWindow, analytic, lag_weights

_MOST_BANDS = 1_000_000
_KEPT = 8
"""Matrices of bands that are kept: those of the tooth counts that a program works on."""


def mesh_bands(teeth: int, *, per_mesh_order: int = 4, mesh_orders: int = 4) -> Float64Array:
    """Return the edges of bands centred on fractions of the mesh order: 0, 1/4, ... 4 mesh orders by default.

    Parameters
    ----------
    teeth : int
        Tooth count Z: the mesh order.
    per_mesh_order : int
        Bands p a mesh order; each is Z/p orders wide, the first, which begins at order 0, half of that.
    mesh_orders : int
        The last band's centre, in mesh orders.

    Returns
    -------
    (mesh_orders * per_mesh_order + 2,) float64
        Edges in orders, ``Z [0, 1/2p, 3/2p, ...]``.

    Raises
    ------
    InputError
        If a count is below 1 or not an integer.

    Examples
    --------
    >>> from sigdb.signature import mesh_bands
    >>> mesh_bands(8, per_mesh_order=2, mesh_orders=1).tolist()
    [0.0, 2.0, 6.0, 10.0]
    """
    z = count("mesh_bands", "teeth", teeth, least=1, most=GREATEST_COUNT)
    p = count("mesh_bands", "per_mesh_order", per_mesh_order, least=1)
    last = count("mesh_bands", "mesh_orders", mesh_orders, least=1) * p
    if last > _MOST_BANDS:
        raise InputError(
            f"mesh_bands: per_mesh_order * mesh_orders = {last} must be at most {_MOST_BANDS}; ask for fewer"
        )
    return np.append(0.0, z * (2 * np.arange(last + 1) + 1) / (2 * p))


def pooled_wigner_ville(
    x: ArrayLike, *, teeth: int, bands: ArrayLike, lag_window: LagWindow | None = None, n_bins: int | None = None
) -> Float64Array:
    r"""Compute the circular Wigner-Ville distribution summed over each tooth pass and each band of order.

    ``F[c, b] = sum_i w[c, i] sum_{k in b} W[i, k]`` with W of :func:`wigner_ville`. Sample i stands for the angle from
    i/n to (i+1)/n of a revolution, cell c for that from c/teeth to (c+1)/teeth, and w is the fraction of the sample
    within the cell: 1 or 0 where n is a multiple of teeth. Bin k, of order ``k n / (2 K)``, is in band b if that order
    is in ``[bands[b], bands[b+1])``.

    Parameters
    ----------
    x : array_like, (..., n)
        Averages of one revolution in any unit. Complex input is z itself; real input is made analytic by its DFT.
    teeth : int
        Tooth passes a revolution, at most n; cell c is the pass of tooth c + 1.
    bands : array_like, (B + 1,)
        Increasing edges in orders, from 0 up to and including n/2; as of :func:`mesh_bands`. A band between two bins
        gives 0.
    lag_window : int, array_like or "full", optional
        As in :func:`wigner_ville`; a Hamming window of two tooth passes by default, ``L = 2 n // teeth``, at most n//4.
    n_bins : int, optional
        Count of bins K, at least 2L + 1 (n for the full window); n by default.

    Returns
    -------
    (..., teeth, B) float64
        Plain sums, in the square of the unit of ``x``; divided by ``n_bins n / teeth`` they do not depend on the tooth
        count.

    Raises
    ------
    InputError
        If ``x`` is empty or not finite, ``teeth`` is not an integer from 1 to n, or ``bands`` are not increasing or
        beyond n/2. If the window is malformed or longer than half a revolution, or ``n_bins`` is too few for it.

    Notes
    -----
    Lag products are summed over each cell first, ``R[c, m] = sum_i w[c, i] z[i+m] conj(z[i-m])``, then
    ``F = [Re R | Im R] D`` with ``D`` the sums of ``h[m] cos`` and ``h[m] sin`` of ``2 pi m k / K`` over the bins of a
    band.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import mesh_bands, pooled_wigner_ville
    >>> x = np.cos(2 * np.pi * 8 * np.arange(512) / 512)
    >>> F = pooled_wigner_ville(x, teeth=8, bands=mesh_bands(8))
    >>> F.shape, np.unique(F.argmax(axis=-1)).tolist()
    ((8, 17), [4])
    """
    a = real_or_complex_signal("pooled_wigner_ville", "x", x)
    n = a.shape[-1]
    cells = count("pooled_wigner_ville", "teeth", teeth, least=1)
    if cells > n:
        raise InputError(
            f"pooled_wigner_ville: teeth = {cells} must be at most n = {n}, one sample a tooth pass;"
            " average with more samples a revolution"
        )
    edges = band_edges("pooled_wigner_ville", bands, n)
    window = min(2 * n // cells, n // 4) if lag_window is None else lag_window
    h, K = lag_weights("pooled_wigner_ville", window, n, n_bins, circular=True)

    D = _band_matrix(h, K, edges, n)
    signals = a.reshape(-1, n)
    F = np.empty((signals.shape[0], cells, edges.size - 1))
    for some in blocks(signals.shape[0], SIGNALS_AT_ONCE):
        F[some] = pooled_products(analytic(signals[some]), cells, D)
    return F.reshape(*a.shape[:-1], cells, edges.size - 1)


def pooled_products(z: NDArray[np.complex128], cells: int, D: Float64Array) -> Float64Array:
    """Return the distribution of analytic signals, summed over cells and bands, (signals, cells, B).

    Parameters
    ----------
    z
        (signals, n) analytic signals: some at once, so that their products stay in the cache.
    cells
        Number of cells.
    D
        (2 (L + 1), B) sums over the bins of the bands, for each lag.
    """
    R = _cell_lag_products(z, cells, D.shape[0] // 2 - 1)
    return (R.reshape(-1, D.shape[0]) @ D).reshape(-1, cells, D.shape[1])


@lru_cache(_KEPT)
def mesh_band_matrix(n: int, teeth: int, mesh_orders: int) -> Float64Array:
    """Return D for three bins in each of :func:`mesh_bands` and a Hamming window of two tooth passes, (2 (L + 1), B).

    Edges of bands lie between bins. The window is at most half a revolution long.
    """
    n_bins = three_bins(n, teeth)
    edges = band_edges("features", mesh_bands(teeth, mesh_orders=mesh_orders), n)
    h, K = lag_weights("features", min(2 * n // teeth, n // 2), n, n_bins, circular=True)
    return _band_matrix(h, K, edges, n)


def three_bins(n: int, teeth: int) -> int:
    """Return the number of bins of which three lie in a quarter of the mesh order."""
    return round(6 * n / teeth)


def _cell_lag_products(z: NDArray[np.complex128], cells: int, L: int) -> Float64Array:
    """R[s, c, 0 or 1, m], the real and the imaginary part of the lag products summed over each cell."""
    from sigdb.signature.wigner_ville.lag_products import cell_lag_products

    n = z.shape[-1]
    # Cell edges c n / cells in whole numbers: a sample that an edge cuts belongs to both cells, in part.
    whole, cut = np.divmod(np.arange(cells + 1) * n, cells)
    fraction = cut / cells
    first, last = whole + (cut > 0), whole[1:]
    padded = np.pad(z, ((0, 0), (L, L)), mode="wrap")
    R = np.empty((z.shape[0], cells, 2, L + 1))
    re, im = np.ascontiguousarray(padded.real), np.ascontiguousarray(padded.imag)
    cell_lag_products(re, im, first[:-1], last, fraction[:-1], L, R)
    return R


def _band_matrix(h: Float64Array, K: int, edges: Float64Array, n: int) -> Float64Array:
    """D, ``(2 (L + 1), B)``: for each lag and band the sum over the band's bins of h cos, then of h sin."""
    order = np.arange(K) * n / (2 * K)
    bins = np.searchsorted(order, edges)
    start, stop = bins[:-1], bins[1:]
    m = np.arange(1, h.size)[:, None]
    # The sum of exp(j phi k) over start <= k < stop is sin(phi q / 2) / sin(phi / 2) exp(j phi p / 2),
    # phi = 2 pi m / K, q = stop - start, p = stop + start - 1; m p and m q are reduced mod 2K, before they are angles.
    p, q = (np.pi / K * (m * v % (2 * K)) for v in (stop + start - 1, stop - start))
    weighted = 2 * h[1:, None] * np.sin(q) / np.sin(np.pi / K * m)
    zero_lag = (stop - start)[None, :]
    return np.concatenate([zero_lag, weighted * np.cos(p), 0 * zero_lag, weighted * np.sin(p)])
