"""Times of the pulses in a tacho's waveform."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError
from sigdb.signature.checks import Float64Array, finite, positive, real_signal

_OWNER = "tacho_pulses"


def tacho_pulses(
    waveform: ArrayLike, fs: float, *, threshold: float | None = None, hysteresis: float | None = None
) -> Float64Array:
    """Find the times at which a tacho's waveform rises through a threshold.

    A pulse counts only after the waveform has been below ``threshold - hysteresis``: noise smaller than that makes no
    pulses of its own. The crossing lies on the straight line between the samples on either side of it.

    Parameters
    ----------
    waveform : array_like, (samples,)
        In any unit. For falling edges pass ``-waveform`` and ``-threshold``.
    fs : float
        Sampling rate, Hz.
    threshold : float, optional
        In the unit of the waveform; midway between its least and its largest sample by default.
    hysteresis : float, optional
        Above 0, in the unit of the waveform; a quarter of its range by default.

    Returns
    -------
    (pulses,) float64
        Times, s, sample 0 at time 0; none where nothing crosses.

    Raises
    ------
    InputError
        If the waveform is empty, complex or not finite, has more than one axis, or an option is out of its range.

    Examples
    --------
    >>> from sigdb.signature import tacho_pulses
    >>> tacho_pulses([0, 0, 4, 5, 0, 0, 5, 5], 1.0, threshold=1.0, hysteresis=0.5).tolist()
    [1.25, 5.2]
    """
    x = _one_channel(waveform)
    middle, range_ = (np.max(x) + np.min(x)) / 2, np.ptp(x)
    # A waveform without range has no pulses, whatever the hysteresis.
    usual = range_ / 4 if range_ > 0 else 1.0
    detector = TachoDetector(
        fs,
        threshold=middle if threshold is None else threshold,
        hysteresis=usual if hysteresis is None else hysteresis,
    )
    return detector.push(x)


class TachoDetector:
    """Detector of pulses in a waveform that comes in blocks, as :func:`tacho_pulses` finds them.

    Parameters
    ----------
    fs : float
        Sampling rate, Hz.
    threshold, hysteresis : float
        As in :func:`tacho_pulses`. There is no default, since the range of later blocks is unknown.

    Raises
    ------
    InputError
        If an argument is out of its range.

    Examples
    --------
    >>> from sigdb.signature import TachoDetector
    >>> detector = TachoDetector(1.0, threshold=1.0, hysteresis=0.5)
    >>> [detector.push(block).tolist() for block in ([0, 0], [4, 5, 0, 0], [5, 5])]
    [[], [1.25], [5.2]]
    """

    def __init__(self, fs: float, *, threshold: float, hysteresis: float) -> None:
        self._fs = positive(_OWNER, "fs", fs)
        self._high = finite(_OWNER, "threshold", threshold)
        self._low = self._high - positive(_OWNER, "hysteresis", hysteresis)
        self._samples = 0
        self._last = np.nan
        self._armed = False

    def push(self, waveform: ArrayLike) -> Float64Array:
        """Return the pulses of the next block.

        Parameters
        ----------
        waveform : array_like, (samples,)
            The samples that follow those taken so far.

        Returns
        -------
        (pulses,) float64
            Times, s, from the first sample of the first block.

        Raises
        ------
        InputError
            If the waveform is empty, complex or not finite, or has more than one axis.
        """
        x = _one_channel(waveform)
        rises, falls = _begins(x >= self._high), _begins(x < self._low)
        # A rise counts if the waveform has been low since the rise before it, or before the block.
        lows = np.searchsorted(falls, rises)
        fires = rises[lows > np.append(0, lows)[:-1]]
        if self._armed and rises.size and lows[0] == 0:
            fires = np.append(rises[0], fires)
        before, after = np.where(fires > 0, x[fires - 1], self._last), x[fires]
        crossings = self._samples + fires - 1 + (self._high - before) / (after - before)
        self._samples += x.size
        self._last = float(x[-1])
        last_rise, last_fall = (int(each[-1]) if each.size else -1 for each in (rises, falls))
        self._armed = last_fall > last_rise or (self._armed and last_rise < 0)
        return crossings / self._fs


def _begins(inside: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the first samples of runs inside."""
    return np.flatnonzero(inside & ~np.append(False, inside)[:-1])


def _one_channel(waveform: ArrayLike) -> Float64Array:
    x, _ = real_signal(_OWNER, "waveform", waveform)
    if x.ndim != 1:
        raise InputError(f"{_OWNER}: waveform of shape {x.shape} must have one axis; pass one channel")
    return x
