"""The templates nearest to an average, each at its best turn."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, check_unmasked, plain_array
from sigdb.database.matching.index import RMS, MatchIndex
from sigdb.database.matching.residuals import root_mean_square, unit_residuals

_SPARE = 32
"""Templates beyond k that are compared a second time, in double precision."""


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """The nearest templates of a match index, the nearest first.

    Attributes
    ----------
    place
        (k,) places in the index.
    shift
        (k,) turns in samples.
    match
        (k,) overlaps of the residuals, ``<z, z_t turned> / (|z| |z_t|)``; 0 for a template without a residual.
    residual_distance
        (k,) root mean squares of ``z - z_t turned``, in standard deviations of the average.
    """

    place: IntArray
    shift: IntArray
    match: FloatArray
    residual_distance: FloatArray


def checked_average(tsa: ArrayLike) -> FloatArray:
    """Return an average as (n,) float64.

    Raises
    ------
    InputError
        If it is not one row of finite numbers that vary.
    """
    check_unmasked("match", "tsa", tsa)
    try:
        x = np.asarray(tsa, dtype=float)
    except (TypeError, ValueError):
        raise InputError("tsa must be an array of real numbers: one revolution of an averaged signal") from None
    if x.ndim != 1:
        raise InputError(f"tsa has shape {x.shape}; give one average of one revolution, (n,)")
    if not np.isfinite(x).all():
        raise InputError(f"tsa[{np.flatnonzero(~np.isfinite(x))[0]}] is not a finite number")
    if x.size and np.ptp(x) <= 64 * np.finfo(float).eps * np.abs(x).max():
        raise InputError("tsa does not vary: there is no signal to compare; check the sensor")
    return x


def whole_shifts(turns: ArrayLike | None, samples_per_tooth: int, n: int) -> IntArray:
    """Return turns in teeth as shifts in samples; all shifts if None.

    Raises
    ------
    InputError
        If a turn is no whole number of samples.
    """
    if turns is None:
        return np.arange(n)
    shifts = np.atleast_1d(plain_array("match", "turns", turns, float)) * samples_per_tooth
    wrong = shifts[~(np.abs(shifts - np.round(shifts)) < 1e-6)]
    if wrong.size or not shifts.size:
        value = f"{wrong[0] / samples_per_tooth:g}" if wrong.size else "none"
        raise InputError(
            f"turns: {value} teeth is not a whole number of samples; a tooth has {samples_per_tooth} samples"
        )
    return np.unique(np.round(shifts).astype(np.int64) % n)


Distance = Callable[[FloatArray, float, FloatArray], FloatArray]
"""A measure of nearness: called with the mean product of z and z_t at the best turn (templates,), the root mean square
of z, and those of z_t (templates,). The nearest template has the least value."""


def residual_distance(product: FloatArray, rms: float, template_rms: FloatArray) -> FloatArray:
    """Return the root mean square of ``z - z_t``, in which size and shape count.

    Since residuals are of averages of unit standard deviation, it is in standard deviations of the average; 0 for a
    template that equals the average.
    """
    return np.sqrt(np.maximum(rms**2 + template_rms**2 - 2 * product, 0))


def mismatch(product: FloatArray, rms: float, template_rms: FloatArray) -> FloatArray:
    """Return 1 less the match, in which only the shape counts; 1 for a template without a residual."""
    norm = rms * template_rms
    match: FloatArray = np.divide(product, norm, out=np.zeros_like(norm), where=norm > 0)
    return 1 - match


def nearest(
    index: MatchIndex,
    x: FloatArray,
    *,
    teeth: int,
    k: int,
    shifts: IntArray,
    among: BoolArray,
    distance: Distance = residual_distance,
) -> Nearest:
    """Return the k templates of least distance, each at its best turn.

    The square of the residual distance is ``mean (z - z_t turned)^2 = mean z^2 + mean z_t^2 - 2 max_s c(s) / n``. The
    circular correlation ``c(s) = sum_m z[m] z_t[m - s]`` comes from the spectra, in single precision for all templates
    and in double precision for the nearest.

    Parameters
    ----------
    index
        The templates.
    x
        (n,) average.
    teeth
        Tooth count of the averaged gear.
    k
        Number of templates to return.
    shifts
        Turns that are tried, in samples.
    among
        (templates,) which of them take part.
    distance
        :func:`residual_distance` or :func:`mismatch`.
    """
    z = unit_residuals(x, teeth)
    Z, n, rms = np.fft.rfft(z), z.size, float(root_mean_square(z))
    template_rms = index.cases[RMS].to_numpy()

    def correlation(Z_t: NDArray[np.complexfloating], Z: NDArray[np.complexfloating]) -> FloatArray:
        """c(-s) for all s: it conjugates one spectrum instead of many."""
        c: FloatArray = scipy.fft.irfft(Z_t * np.conj(Z), n, axis=-1, overwrite_x=True)
        return c if shifts.size == n else c[:, -shifts]

    single = Z.astype(np.complex64)
    best = np.concatenate(_each(index.spectra, lambda block: correlation(block, single).max(axis=1)))
    coarse = np.where(among, distance(best / n, rms, template_rms), np.inf)
    few = min(int(among.sum()), k + _SPARE)
    place = np.sort(np.argpartition(coarse, few - 1)[:few])

    Z_t = _spectra(index, place).astype(complex)
    at = correlation(Z_t, Z).argmax(axis=1)
    shift = -at % n if shifts.size == n else shifts[at]
    z_t = np.take_along_axis(np.fft.irfft(Z_t, n), (np.arange(n) - shift[:, None]) % n, axis=1)
    # The root mean square comes from the same z_t as the product, or a small distance would be rounding.
    product, template_rms = (z_t * z).mean(axis=1), root_mean_square(z_t)
    order = np.argsort(distance(product, rms, template_rms), kind="stable")[:k]
    return Nearest(
        place=place[order],
        shift=shift[order],
        match=1 - mismatch(product, rms, template_rms)[order],
        residual_distance=residual_distance(product, rms, template_rms)[order],
    )


def _each(
    blocks: Sequence[NDArray[np.complex64]], compute: Callable[[NDArray[np.complex64]], FloatArray]
) -> list[FloatArray]:
    if len(blocks) == 1:
        return [compute(blocks[0])]
    with ThreadPoolExecutor(min(len(blocks), os.cpu_count() or 1)) as threads:
        return list(threads.map(compute, blocks))


def _spectra(index: MatchIndex, places: IntArray) -> NDArray[np.complex64]:
    """Spectra of some templates, from blocks of unequal size."""
    ends = np.cumsum([len(block) for block in index.spectra])
    block = np.searchsorted(ends, places, side="right")
    return np.stack([index.spectra[b][place - ends[b]] for b, place in zip(block, places, strict=True)])
