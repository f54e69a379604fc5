"""Speed of a shaft from the spectrum of a record: the mesh harmonics and sidebands of that speed stand out."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError, IntArray, NotApplicableError

HARMONICS = 3
"""Mesh harmonics that are searched, each with its two first sidebands."""
_TURNS = 10
"""Revolutions of a frame, less what makes its transform fast: sidebands lie ten bins from their mesh harmonic."""
_SURVEYED = 64
"""Frames, spread over the record, of the first survey of a wide range."""
_WIDE = 1.5
"""Ratio of the ends of a range above which it is first surveyed, then narrowed."""
_NARROWED = 0.15
"""Half-width of the narrowed range, relative to its centre."""
_SAME = 0.05
"""Relative difference below which two speeds are one answer: a speed drifts."""
_CHANGE = 0.02
"""Greatest relative change of the speed between frames, which are half a frame apart."""
_BEYOND = 2.2
"""Ratio of the ends to which speeds are searched beyond a narrow range."""
_AT_END = 2
"""Steps of the speed from an end of the range within which a track lies at it."""
_TOGETHER = 8
"""Frames that are transformed together."""
_FLOOR = 4
"""Shaft orders to either side of a line over which the median gives its level."""


@dataclass(frozen=True, kw_only=True)
class SpeedTrack:
    """Speed of a shaft over a record, from its spectrum.

    Attributes
    ----------
    time
        (frames,) centres of the frames, s.
    speed_rpm
        (frames,) speed in each frame, accurate to about one part in a thousand.
    runner_up_rpm
        The next likely speed that is more than 5 % away; nan where there is none.
    runner_up
        Score of that speed relative to the score of the track.
    outside_rpm, outside
        The likeliest speed beyond the range, from half its low end to twice its high end, and its score relative to
        that of the track; nan and 0 where nothing is searched.
    at_end
        Share of the frames in which the track lies at an end of the range.
    """

    time: FloatArray
    speed_rpm: FloatArray
    runner_up_rpm: float
    runner_up: float
    outside_rpm: float = np.nan
    outside: float = 0.0
    at_end: float = 0.0


def find_speed(x: FloatArray, fs: float, *, teeth: int, range_rpm: tuple[float, float]) -> SpeedTrack:
    """Follow the speed at which the mesh harmonics and their first sidebands stand out most.

    The score of a speed in a frame is a sum over orders ``h Z - 1, h Z, h Z + 1`` for h = 1..3. Each term is the
    logarithm of the spectrum's power over the level about it, and 0 below the level. The track is the sequence of
    speeds with the greatest sum of scores that changes by at most 2 % between frames (dynamic programming). All
    channels vote: in a single channel a sideband may stand out more than its mesh harmonic.

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
    SpeedTrack

    Raises
    ------
    InputError
        If the range does not rise, if its mesh frequencies do not fit the record, if the record is too short, or if
        nothing stands out of its spectrum.

    References
    ----------
    .. [1] Leclere, Andre, Antoni, "A multi-order probabilistic approach for instantaneous angular speed tracking",
       Mechanical Systems and Signal Processing 81, 2016: the idea that many orders vote for a speed.
    """
    low, high = _checked(range_rpm, x.shape[-1], fs, teeth)
    scaled = _scaled(x)
    wide = high / low > _WIDE
    frames = _Frames(scaled, fs, teeth, low, high, most=_SURVEYED if wide else None)
    best, rival, share = _likeliest(frames.speeds, frames.surveyed())
    if wide:
        low, high = max(low, best * (1 - _NARROWED)), min(high, best * (1 + _NARROWED))
        frames = _Frames(scaled, fs, teeth, low, high)
    track = frames.best_track()
    ends = (track <= _AT_END) | (track >= len(frames.speeds) - 1 - _AT_END)
    outside, relative = _beyond(scaled, fs, teeth, float(np.median(frames.speeds[track])), range_rpm)
    return SpeedTrack(
        time=frames.time,
        speed_rpm=60 * frames.speeds[track],
        runner_up_rpm=60 * rival,
        runner_up=share,
        outside_rpm=60 * outside,
        outside=relative,
        at_end=float(np.mean(ends)),
    )


def _scaled(x: FloatArray) -> NDArray[np.float32]:
    """Return the channels less their means, with a greatest sample of 1."""
    scaled: NDArray[np.float32] = np.empty(x.shape, np.float32)
    for channel, place in zip(x, scaled, strict=True):
        apart = channel - channel.mean()
        np.divide(apart, max(apart.max(), -apart.min()) or 1.0, out=place, casting="same_kind")
    return scaled


def _beyond(
    x: NDArray[np.float32], fs: float, teeth: int, speed: float, range_rpm: tuple[float, float]
) -> tuple[float, float]:
    """Return the likeliest speed beyond the range, rev/s, and its score relative to that of the speed of the track."""
    low, high = range_rpm[0] / 60, range_rpm[1] / 60
    least = max(low / _BEYOND, 2 * _TURNS * fs / x.shape[-1])  # two frames
    most = min(high * _BEYOND, fs / 2 / (teeth + 1.5))
    if high / low > _WIDE or not least < speed < most:
        return np.nan, 0.0
    wide = _Frames(x, fs, teeth, least, most, most=_SURVEYED, overlap=False)
    scores, sums, speeds = wide.surveyed(), wide.scores.sum(axis=0), wide.speeds
    others = np.where((speeds < low) | (speeds > high), scores, 0)
    # A speed that drifts reaches over the range's end.
    others[np.abs(speeds / speed - 1) < _SAME / 2] = 0
    best, reference = int(np.argmax(others)), float(scores[int(np.argmin(np.abs(speeds - speed)))])
    if not others[best] > 0:
        return np.nan, 0.0
    near = np.where((np.abs(speeds / speeds[best] - 1) < _SAME / 2) & (others > 0), sums, 0)
    return float(speeds[int(np.argmax(near))]), float(others[best]) / reference if reference > 0 else np.inf


def _likeliest(speeds: FloatArray, scores: FloatArray) -> tuple[float, float, float]:
    """Return the likeliest speed, the likeliest speed that is not near it, and the ratio of their scores."""
    best = int(np.argmax(scores))
    if not scores[best] > 0:
        raise NotApplicableError("no speed is found: nothing stands out of the record's spectrum; check the channel")
    others = np.where(np.abs(speeds / speeds[best] - 1) > _SAME, scores, 0)
    rival = int(np.argmax(others))
    if not others[rival] > 0:
        return float(speeds[best]), np.nan, 0.0
    return float(speeds[best]), float(speeds[rival]), float(others[rival] / scores[best])


def _checked(range_rpm: tuple[float, float], samples: int, fs: float, teeth: int) -> tuple[float, float]:
    """Return the range in rev/s, cut where the first mesh harmonic reaches half the sampling rate."""
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
    """Scores of speeds in frames of a record."""

    def __init__(
        self,
        x: NDArray[np.float32],
        fs: float,
        teeth: int,
        low: float,
        high: float,
        *,
        most: int | None = None,
        overlap: bool = True,
    ) -> None:
        from scipy.fft import prev_fast_len

        length = int(prev_fast_len(int(_TURNS * fs / low), real=True))
        starts = np.arange(0, x.shape[-1] - length + 1, length // 2 if overlap else length)
        if most is not None and len(starts) > most:
            starts = starts[np.linspace(0, len(starts) - 1, most).astype(int)]
        self.time = (starts + length / 2) / fs
        bin_ = fs / length
        orders = (teeth * np.arange(1, HARMONICS + 1)[:, None] + [-1, 0, 1]).ravel()
        step = bin_ / 2 / orders[-1]
        self.speeds: FloatArray = np.arange(low, high + step, step)
        reach, last = round(_FLOOR * low / bin_), int(orders[-1] * high / bin_)
        outstanding = _outstanding(x, starts, length, reach, last)
        bins = np.round(orders[:, None] * self.speeds / bin_).astype(int)
        self.scores = _summed(outstanding, bins)
        """(frames, speeds) scores."""

    def surveyed(self) -> FloatArray:
        """Return (speeds,) sums over the frames, whose speeds may differ by a few per cent."""
        scores = self.scores
        if len(scores) > _SURVEYED:
            scores = scores[np.linspace(0, len(scores) - 1, _SURVEYED).astype(int)]
        # A drift shifts the logarithm of speed; one window serves all speeds and is too wide at the low end.
        width = max(1, int(_SAME / 4 * np.mean(self.speeds) / np.diff(self.speeds[:2])[0]))
        return np.asarray(greatest_within(scores, width).sum(axis=0, dtype=np.float64))

    def best_track(self) -> IntArray:
        """Return (frames,) indices of the likeliest sequence of speeds without jumps."""
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


def greatest_within(scores: FloatArray, reach: int) -> FloatArray:
    """Return (frames, speeds) greatest of the scores, which are at least 0, within a reach to both sides.

    The width over which the greatest is taken doubles with each step.
    """
    greatest, width, wanted = np.pad(scores, ((0, 0), (reach, reach))), 1, 2 * reach + 1
    while width < wanted:
        step = min(width, wanted - width)
        greatest = np.maximum(greatest[:, step:], greatest[:, :-step])
        width += step
    return greatest


def _summed(levels: FloatArray, bins: IntArray) -> FloatArray:
    """Return (frames, speeds) sums of (bins, frames) levels over (orders, speeds) bins; 0 beyond the spectrum."""
    levels = np.concatenate([levels, np.zeros_like(levels[:1])])
    total, each = np.zeros((2, bins.shape[1], levels.shape[1]), dtype=levels.dtype)
    for row in bins:
        total += np.take(levels, row, axis=0, out=each, mode="clip")
    return np.ascontiguousarray(total.T)


def _outstanding(x: NDArray[np.float32], starts: IntArray, length: int, reach: int, last: int) -> FloatArray:
    """Return (bins, frames) logarithms of power over the level about each bin, at least 0, summed over the channels."""
    from scipy.fft import rfft
    from scipy.ndimage import median_filter

    window = np.hanning(length + 1)[:-1].astype(np.float32)
    bins = min(last + reach, length // 2) + 1
    tiny = np.finfo(np.float32).tiny
    total = np.zeros((bins, len(starts)), dtype=np.float32)
    for channel in x:
        frames = sliding_window_view(channel, length)
        power = np.empty((len(starts), bins), dtype=np.float32)
        for i in range(0, len(starts), _TOGETHER):  # transforms of several frames share their instructions
            spectra = rfft(window * frames[starts[i : i + _TOGETHER]])[:, :bins]
            power[i : i + _TOGETHER] = spectra.real**2 + spectra.imag**2
        floor = median_filter(power.mean(axis=0), 2 * reach + 1, mode="nearest")
        total += np.log(np.maximum(power, tiny) / np.maximum(floor, tiny)).clip(min=0).T
    return total
