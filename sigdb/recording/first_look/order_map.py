"""Order map of a run-up: amplitude by order and speed."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, NotApplicableError

LEAST_CHANGE = 0.1
"""Relative range of the speed from which on a recording is a run-up or a coast-down."""

_FRAME = 8
"""Revolutions of a frame: a resolution of an eighth of an order."""
_MOST_SPEEDS = 60
"""Largest number of bins of speed."""


@dataclass(frozen=True, kw_only=True)
class OrderMap:
    """Amplitude of a record by order and speed.

    Attributes
    ----------
    speed_rpm
        (S,) centres of the bins of speed, rising.
    order
        (K,) orders, 1/8 apart.
    amplitude
        (S, K) root mean square over the frames of a bin of the peak amplitude of a line; nan in a bin without frames.
    frames
        (S,) number of frames in each bin.
    """

    speed_rpm: FloatArray
    order: FloatArray
    amplitude: FloatArray
    frames: FloatArray

    def along(self, order: float) -> FloatArray:
        """Return the amplitudes (S,) of the order nearest to one, by speed."""
        return np.asarray(self.amplitude[:, int(np.argmin(np.abs(self.order - order)))])


def order_map(x: FloatArray, speed: pd.DataFrame, *, samples_per_rev: int, highest: float) -> OrderMap:
    """Return the order map of a record whose speed changes.

    Frames of eight revolutions, half overlapping, are Fourier-transformed under a Hann window over the angle (computed
    order tracking), and their powers are averaged in equal bins of speed.

    Parameters
    ----------
    x
        (K * samples_per_rev,) record in equal steps of angle, from the first revolution on.
    speed
        ``speed_rpm`` of each revolution, in their order.
    samples_per_rev
        Samples in a revolution.
    highest
        Highest order of the map.

    Returns
    -------
    OrderMap

    Raises
    ------
    NotApplicableError
        If there are fewer than two frames, or the speed changes by less than 10 %.

    References
    ----------
    .. [1] Fyfe, Munck, "Analysis of computed order tracking", Mechanical Systems and Signal Processing 11(2), 1997,
       doi:10.1006/mssp.1996.0056.

    Examples
    --------
    >>> import numpy as np, pandas as pd
    >>> turns = np.arange(200 * 64) / 64
    >>> speed = pd.DataFrame({"speed_rpm": np.linspace(600.0, 1200.0, 200)})
    >>> found = order_map(np.cos(2 * np.pi * 5 * turns), speed, samples_per_rev=64, highest=10.0)
    >>> bool(np.allclose(found.along(5.0), 1.0))
    True
    """
    rows = x.reshape(-1, samples_per_rev)
    track = np.interp(np.arange(len(rows)), np.linspace(0, len(rows) - 1, len(speed)), speed["speed_rpm"])
    starts = np.arange(0, len(rows) - _FRAME + 1, _FRAME // 2)
    if len(starts) < 2:
        raise NotApplicableError(f"an order map needs {_FRAME + _FRAME // 2} revolutions, there are {len(rows)}")
    of_frames = np.array([track[start : start + _FRAME].mean() for start in starts])
    least, most = float(of_frames.min()), float(of_frames.max())
    if most - least < LEAST_CHANGE * (most + least) / 2:
        raise NotApplicableError(f"the speed changes from {least:.1f} to {most:.1f} rpm, which is no run-up")
    bins = int(np.clip(len(starts) // 3, 2, _MOST_SPEEDS))
    edges = np.linspace(least, most, bins + 1)
    at = np.clip(np.searchsorted(edges, of_frames, side="right") - 1, 0, bins - 1)
    kept = min(int(highest * _FRAME), samples_per_rev * _FRAME // 2) + 1
    window = np.hanning(_FRAME * samples_per_rev + 1)[:-1]
    power, frames = np.zeros((bins, kept)), np.zeros(bins)
    for start, bin_ in zip(starts, at, strict=True):
        frame = rows[start : start + _FRAME].ravel()
        spectrum = np.fft.rfft(2 * window / window.sum() * (frame - frame.mean()))[:kept]
        power[bin_] += np.abs(spectrum) ** 2
        frames[bin_] += 1
    with np.errstate(invalid="ignore"):
        amplitude = np.sqrt(power / frames[:, None])
    return OrderMap(
        speed_rpm=(edges[1:] + edges[:-1]) / 2, order=np.arange(kept) / _FRAME, amplitude=amplitude, frames=frames
    )
