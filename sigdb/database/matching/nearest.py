"""The templates of least misfit to an average, each at its best turn."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.database.matching.index import RMS, MatchIndex
from sigdb.database.matching.residuals import root_mean_square, unit_residuals

_SPARE = 32
"""Templates beyond k that are compared again in double precision."""


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """The nearest templates of a bank, the nearest first: place in it, turn in samples, match and misfit."""

    place: IntArray
    shift: IntArray
    match: FloatArray
    misfit: FloatArray


def checked_average(tsa: ArrayLike) -> FloatArray:
    """One average, (n,) float64.

    Raises
    ------
    InputError
        If it is not one row of finite numbers that vary.
    """
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
    """Turns in teeth as shifts in samples; every sample's if None.

    Raises
    ------
    InputError
        If a turn is no whole number of samples.
    """
    if turns is None:
        return np.arange(n)
    shifts = np.atleast_1d(np.asarray(turns, dtype=float)) * samples_per_tooth
    wrong = shifts[~(np.abs(shifts - np.round(shifts)) < 1e-6)]
    if wrong.size or not shifts.size:
        value = f"{wrong[0] / samples_per_tooth:g}" if wrong.size else "none"
        raise InputError(
            f"turns: {value} teeth is not a whole number of samples, of which a tooth has {samples_per_tooth}"
        )
    return np.unique(np.round(shifts).astype(np.int64) % n)


Distance = Callable[[FloatArray, float, FloatArray], FloatArray]
"""From the mean product of z and z_t at the best turn and their root mean squares to what is least for the nearest."""


def misfit(product: FloatArray, own: float, rms: FloatArray) -> FloatArray:
    """Root mean square of ``z - z_t``: size and shape count."""
    return np.sqrt(np.maximum(own**2 + rms**2 - 2 * product, 0))


def mismatch(product: FloatArray, own: float, rms: FloatArray) -> FloatArray:
    """One less the match: only the shape counts; 1 where there is none."""
    norm = own * rms
    match: FloatArray = np.divide(product, norm, out=np.zeros_like(norm), where=norm > 0)
    return 1 - match


def nearest(
    bank: MatchIndex,
    x: FloatArray,
    *,
    teeth: int,
    k: int,
    shifts: IntArray,
    among: NDArray[np.bool_],
    distance: Distance = misfit,
) -> Nearest:
    """The k templates of least distance, each at its best turn.

    ``misfit^2 = mean (z - z_t turned)^2 = mean z^2 + mean z_t^2 - 2 max_s c(s) / n``, with the circular correlation
    ``c(s) = sum_m z[m] z_t[m - s]`` from the spectra, in single precision for all and in double for the nearest.

    Parameters
    ----------
    x
        (n,) average.
    shifts
        Turns that are tried, in samples.
    among
        (templates,) which of them take part.
    distance
        :func:`misfit` or :func:`mismatch`.
    """
    z = unit_residuals(x, teeth)
    Z, n, own = np.fft.rfft(z), z.size, float(root_mean_square(z))
    rms = bank.cases[RMS].to_numpy()

    def correlation(Z_t: NDArray[np.complexfloating], Z: NDArray[np.complexfloating]) -> FloatArray:
        """c(-s) for all s: conjugating the one spectrum, not the many."""
        c: FloatArray = scipy.fft.irfft(Z_t * np.conj(Z), n, axis=-1, overwrite_x=True)
        return c if shifts.size == n else c[:, -shifts]

    single = Z.astype(np.complex64)
    best = np.concatenate(_each(bank.spectra, lambda block: correlation(block, single).max(axis=1)))
    coarse = np.where(among, distance(best / n, own, rms), np.inf)
    few = min(int(among.sum()), k + _SPARE)
    place = np.sort(np.argpartition(coarse, few - 1)[:few])

    Z_t = _spectra(bank, place).astype(complex)
    at = correlation(Z_t, Z).argmax(axis=1)
    shift = -at % n if shifts.size == n else shifts[at]
    z_t = np.take_along_axis(np.fft.irfft(Z_t, n), (np.arange(n) - shift[:, None]) % n, axis=1)
    # The size of the very signal in the product, or a small misfit is rounding.
    product, rms = (z_t * z).mean(axis=1), root_mean_square(z_t)
    order = np.argsort(distance(product, own, rms), kind="stable")[:k]
    return Nearest(
        place=place[order],
        shift=shift[order],
        match=1 - mismatch(product, own, rms)[order],
        misfit=misfit(product, own, rms)[order],
    )


def _each(blocks: Sequence[NDArray[np.complex64]], compute: Callable[[Any], FloatArray]) -> list[FloatArray]:
    if len(blocks) == 1:
        return [compute(blocks[0])]
    with ThreadPoolExecutor(min(len(blocks), os.cpu_count() or 1)) as threads:
        return list(threads.map(compute, blocks))


def _spectra(bank: MatchIndex, places: IntArray) -> NDArray[np.complex64]:
    """Spectra of some templates, from blocks of unequal size."""
    ends = np.cumsum([len(block) for block in bank.spectra])
    block = np.searchsorted(ends, places, side="right")
    return np.stack([bank.spectra[b][place - ends[b]] for b, place in zip(block, places, strict=True)])
