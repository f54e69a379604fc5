"""The speed of a shaft from the spectrum of a record: the speed whose mesh harmonics and their sidebands stand out."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError, IntArray

HARMONICS = 3
"""Mesh harmonics that are looked for, each with its two first sidebands."""
_TURNS = 10
"""Revolutions of a frame: sidebands lie ten bins from their mesh harmonic."""
_SURVEYED = 64
"""Frames, spread over the record, of the first look at a wide range."""
_WIDE = 1.5
"""Ratio of the ends of a range from which on it is first surveyed, then narrowed."""
_NARROWED = 0.15
_SAME = 0.05
"""Speeds that differ by less are one answer, at a speed that drifts."""
_CHANGE = 0.02
"""Greatest change of the speed from frame to frame, half a frame apart."""
_FLOOR = 4
"""Shaft orders to either side over which the level about a line is taken, as a median."""


@dataclass(frozen=True, kw_only=True)
class FoundSpeed:
    """A shaft's speed over a record, as its spectrum tells it.

    Attributes
    ----------
    time
        (frames,) middles of the frames, s.
    speed_rpm
        (frames,) speed in each; good to about one part in a thousand.
    runner_up_rpm
        The next likely speed, more than 5 % away; nan where the range holds none.
    runner_up
        Its score over that of the speed found.
    """

    time: FloatArray
    speed_rpm: FloatArray
    runner_up_rpm: float
    runner_up: float


def find_speed(x: FloatArray, fs: float, *, teeth: int, range_rpm: tuple[float, float]) -> FoundSpeed:
    """Follow the speed at which the mesh harmonics and their first sidebands stand out most.

    The score of a speed in a frame is the sum, over orders ``h Z - 1, h Z, h Z + 1`` for h = 1..3, of the logarithm of
    the spectrum's power over the level about it, those below the level counting nothing. The track is the sequence of
    speeds with the greatest sum of scores that changes by at most 2 % from one frame to the next (dynamic programming).
    All channels vote: in one alone a sideband may stand out more than its mesh harmonic.

    Parameters
    ----------
    x
        (channels, samples) records of one length.
    fs
        Sampling rate, Hz.
    teeth
        Tooth count Z of the gear on the shaft.
    range_rpm
        Least and greatest speed of the shaft.

    Returns
    -------
    FoundSpeed

    Raises
    ------
    InputError
        If the range is not one, its mesh frequencies do not fit the record, the record is too short for it, or nothing
        stands out of its spectrum.

    References
    ----------
    .. [1] Leclere, Andre, Antoni, "A multi-order probabilistic approach for instantaneous angular speed tracking",
       Mechanical Systems and Signal Processing 81, 2016: the idea that many orders vote for a speed.
    """
    low, high = _checked(range_rpm, x.shape[-1], fs, teeth)
    spread = _Frames(x, fs, teeth, low, high, most=_SURVEYED)
    best, rival, share = _likeliest(spread.speeds, spread.surveyed())
    if high / low > _WIDE:
        low, high = max(low, best * (1 - _NARROWED)), min(high, best * (1 + _NARROWED))
    frames = _Frames(x, fs, teeth, low, high, most=None)
    track = frames.best_track()
    return FoundSpeed(
        time=frames.time,
        speed_rpm=60 * frames.speeds[track],
        runner_up_rpm=60 * rival,
        runner_up=share,
    )


def _likeliest(speeds: FloatArray, scores: FloatArray) -> tuple[float, float, float]:
    """The likeliest speed, the likeliest of those that are not near it, and its score over that of the first."""
    best = int(np.argmax(scores))
    if not scores[best] > 0:
        raise InputError("no speed is found: nothing stands out of the record's spectrum; check the channel")
    others = np.where(np.abs(speeds / speeds[best] - 1) > _SAME, scores, 0)
    rival = int(np.argmax(others))
    if not others[rival] > 0:
        return float(speeds[best]), np.nan, 0.0
    return float(speeds[best]), float(speeds[rival]), float(others[rival] / scores[best])


def _checked(range_rpm: tuple[float, float], samples: int, fs: float, teeth: int) -> tuple[float, float]:
    """The range in revolutions a second, as far up as the first mesh harmonic is below half the sampling rate."""
    low, high = range_rpm[0] / 60, min(range_rpm[1] / 60, fs / 2 / (teeth + 1.5))
    if not 0 < low < high:
        raise InputError(
            f"speed range {range_rpm[0]:g} to {range_rpm[1]:g} rpm must rise from above 0, and its mesh of {teeth}"
            f" teeth must begin below fs/2 = {fs / 2:g} Hz; check its unit and the sampling rate"
        )
    if samples < 2 * _TURNS * fs / low:
        raise InputError(
            f"a record of {samples / fs:.3g} s is too short to find a speed from {60 * low:g} rpm on: it needs"
            f" {2 * _TURNS / low:.3g} s, {2 * _TURNS} revolutions; give the speed or a narrower range, or record longer"
        )
    return low, high


class _Frames:
    """Scores of speeds in overlapping frames of a record."""

    def __init__(self, x: FloatArray, fs: float, teeth: int, low: float, high: float, *, most: int | None) -> None:
        length = int(_TURNS * fs / low)
        starts = np.arange(0, x.shape[-1] - length + 1, length // 2)
        if most is not None and len(starts) > most:
            starts = starts[np.linspace(0, len(starts) - 1, most).astype(int)]
        self.time = (starts + length / 2) / fs
        bin_ = fs / length
        self.orders = (teeth * np.arange(1, HARMONICS + 1)[:, None] + [-1, 0, 1]).ravel()
        step = bin_ / 2 / self.orders[-1]
        self.speeds: FloatArray = np.arange(low, high + step, step)
        reach, last = round(_FLOOR * low / bin_), int(self.orders[-1] * high / bin_)
        self._levels = [_outstanding(channel, starts, length, reach, last) for channel in x]
        self._bins = np.round(self.orders[:, None] * self.speeds / bin_).astype(int)

    @property
    def scores(self) -> FloatArray:
        """(frames, speeds)."""
        total = np.zeros((len(self.time), len(self.speeds)), dtype=np.float32)
        for bins in self._bins:
            total += self._line(bins)
        return total

    def surveyed(self) -> FloatArray:
        """(speeds,) sums over the frames, each of which may lie a few per cent off."""
        from scipy.ndimage import maximum_filter1d

        # A drift is a shift of the logarithm of speed; the greatest window serves all, at the low end too wide.
        width = max(1, int(_SAME / 4 * np.mean(self.speeds) / np.diff(self.speeds[:2])[0]))
        return np.asarray(maximum_filter1d(self.scores, 2 * width + 1, axis=1).sum(axis=0))

    def best_track(self) -> IntArray:
        """(frames,) places among the speeds: the likeliest sequence without jumps."""
        from scipy.ndimage import maximum_filter1d

        scores = self.scores
        reach = max(1, int(_CHANGE * self.speeds[0] / (self.speeds[1] - self.speeds[0])))
        total = scores.astype(float)
        for i in range(1, len(total)):
            total[i] += maximum_filter1d(total[i - 1], 2 * reach + 1)
        track = np.empty(len(total), dtype=np.int64)
        track[-1] = np.argmax(total[-1])
        for i in range(len(total) - 2, -1, -1):
            first = max(track[i + 1] - reach, 0)
            track[i] = first + np.argmax(total[i, first : track[i + 1] + reach + 1])
        return track

    def _line(self, bins: IntArray) -> FloatArray:
        return sum((_at(level, bins) for level in self._levels), start=np.zeros(1, dtype=np.float32))


def _at(level: FloatArray, bins: IntArray) -> FloatArray:
    """(frames, speeds) the level in these bins; none beyond the spectrum."""
    inside = bins < level.shape[1]
    return np.where(inside, level[:, np.where(inside, bins, 0)], np.float32(0))


def _outstanding(x: FloatArray, starts: IntArray, length: int, reach: int, last: int) -> FloatArray:
    """(frames, bins) logarithm of power over the level about each bin, at least 0."""
    from scipy.ndimage import median_filter

    window = np.hanning(length + 1)[:-1]
    bins = min(last + reach, length // 2) + 1
    spectra = (np.fft.rfft(window * x[start : start + length])[:bins] for start in starts)
    power = np.array([np.abs(spectrum) ** 2 for spectrum in spectra])
    floor = median_filter(power.mean(axis=0), 2 * reach + 1, mode="nearest")
    tiny = np.finfo(float).tiny
    return np.log(np.maximum(power, tiny) / np.maximum(floor, tiny)).clip(min=0).astype(np.float32)
