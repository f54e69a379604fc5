"""Pulses in a tacho's waveform: levels that follow a drift, a spike that hides nothing, and the edge that counts."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray
from sigdb.recording.tacho.mark_pattern import regular_time
from sigdb.signature import tacho_pulses

if TYPE_CHECKING:
    from sigdb.recording.recording import Edge

_WINDOWS = (16, 64, 256, 1024)
"""Numbers of windows of the record in which levels are taken, from few to many."""
_LEAST_WINDOW = 16
"""Fewest samples of a window."""
_NEIGHBOURS = 5
"""Windows whose median gives a level: a spike is in two of them at most."""
_DEPTHS = (0.25, 0.4)
"""Hysteresis to try, relative to the range: a pulse with a notch needs the deeper one."""
_WHOLE = 0.97
"""Share of the record in regular intervals from which on no other levels are tried."""
_EQUAL = 0.005
"""Difference of such shares that is no reason for other levels."""
_FEW, _LESS = 10, -0.05
"""Pulses below which other levels are tried all the same, and how much less regular those may be."""
_FLAT = 0.1
"""Range of a window, relative to the median range, below which the tacho stands still there."""
_MOSTLY = 2 / 3
"""Share of the time above the threshold from which on the low state is the pulse."""


@dataclass(frozen=True, kw_only=True)
class _Levels:
    """Low and high state of a waveform: numbers, or one for each sample."""

    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, kw_only=True)
class WaveformPulses:
    """Pulses of a waveform, and how they were found.

    Attributes
    ----------
    times
        (pulses,) s from the waveform's first sample.
    edge
        Edge that counts.
    high_share
        Share of the time above the threshold.
    local
        Whether threshold and hysteresis follow the waveform.
    spikes
        (spikes,) times of spikes, s.
    spike_height
        Height of the largest spike above the low state, relative to the pulses' height.
    """

    times: FloatArray
    edge: "Edge"
    high_share: float
    local: bool = False
    spikes: FloatArray = field(default_factory=lambda: np.empty(0))
    spike_height: float = 0.0


def waveform_pulses(
    x: FloatArray,
    fs: float,
    *,
    pulses_per_rev: int,
    threshold: float | None = None,
    hysteresis: float | None = None,
    edge: "Edge | None" = None,
) -> WaveformPulses:
    """Return the pulses of a tacho's waveform.

    Without a threshold, it lies midway between the extremes of the record. If such pulses do not fill the record, it
    lies midway between levels that follow the waveform, whichever windows give the most regular pulses. Without an
    edge, the leading edge of the shorter state counts: the rising one, unless the waveform is high most of the time.

    Parameters
    ----------
    x
        (samples,) waveform.
    fs
        Its sampling rate, Hz.
    pulses_per_rev
        Pulses of a revolution.
    threshold, hysteresis, edge
        As in :class:`sigdb.recording.Recording`.
    """
    if threshold is not None:
        depth = np.array(_usual_range(x) / 4 if hysteresis is None else hysteresis)
        times, used, share = _pulses(x, fs, np.array(threshold), depth, edge)
        return WaveformPulses(times=times, edge=used, high_share=share)
    best: tuple[float, WaveformPulses, _Levels] | None = None
    depths = _DEPTHS if hysteresis is None else (0.0,)
    for (levels, windows), fraction in product(_candidates(x), depths):
        depth = (levels.high - levels.low) * fraction if hysteresis is None else np.array(hysteresis)
        times, used, share = _pulses(x, fs, (levels.high + levels.low) / 2, depth, edge)
        if len(times) < 2 * windows:
            continue
        regular = regular_time(times, pulses_per_rev) / (len(x) / fs)
        # Few pulses may be spikes, which are regular by chance.
        few = best is not None and len(best[1].times) < _FEW and len(times) > 3 * len(best[1].times)
        if best is None or regular > best[0] + (_LESS if few else _EQUAL):
            local = best is not None and not (levels.low.ndim == 0 and levels.high == np.max(x))
            best = regular, WaveformPulses(times=times, edge=used, high_share=share, local=local), levels
        if len(times) >= _FEW and regular > min(_WHOLE, max(1 - 3 * pulses_per_rev / max(len(times), 1), 0.5)):
            break
    assert best is not None
    _, pulses, levels = best
    if not pulses.local:
        return pulses
    spikes, height = _spikes(x, fs, levels)
    return replace(pulses, spikes=spikes, spike_height=height)


def _candidates(x: FloatArray) -> Iterator[tuple[_Levels, int]]:
    """Yield levels to try, and the windows that they need two pulses in: extremes, percentiles, and moving levels."""
    yield _Levels(low=np.array(np.min(x)), high=np.array(np.max(x))), 0
    for percent in (0.5, 5.0):
        low, high = np.percentile(x, [percent, 100 - percent])
        if high > low:
            yield _Levels(low=low, high=high), 0
    for count in _WINDOWS:
        if len(x) >= count * _LEAST_WINDOW:
            yield _window_levels(x, count), count


def _window_levels(x: FloatArray, count: int) -> _Levels:
    """Return levels from the extremes of windows: their median over neighbours, and straight lines between."""
    from scipy.ndimage import median_filter

    edges = np.linspace(0, len(x), count + 1).astype(int)[:-1]
    low = median_filter(np.minimum.reduceat(x, edges), _NEIGHBOURS, mode="nearest")
    high = median_filter(np.maximum.reduceat(x, edges), _NEIGHBOURS, mode="nearest")
    usual = float(np.median(high - low))
    # A tacho that stands still makes no pulses of its noise.
    high = np.where(high - low > _FLAT * usual, high, low + 2 * usual)
    centres, samples = edges + len(x) / count / 2, np.arange(len(x))
    return _Levels(low=np.interp(samples, centres, low), high=np.interp(samples, centres, high))


def _usual_range(x: FloatArray) -> float:
    """Return the median range of sixteen windows, which a spike does not widen."""
    count = _WINDOWS[0]
    if len(x) < count * _LEAST_WINDOW:
        return float(np.ptp(x))
    edges = np.linspace(0, len(x), count + 1).astype(int)[:-1]
    usual = float(np.median(np.maximum.reduceat(x, edges) - np.minimum.reduceat(x, edges)))
    return usual or float(np.ptp(x))


def _pulses(
    x: FloatArray, fs: float, threshold: FloatArray, depth: FloatArray, edge: "Edge | None"
) -> tuple[FloatArray, "Edge", float]:
    """Return pulses, the edge that counts, and the share of the time above the threshold."""
    share = float(np.mean(x > threshold))
    used: Edge = edge or ("falling" if share > _MOSTLY else "rising")
    sign = 1.0 if used == "rising" else -1.0
    if not np.all(depth > 0):
        return np.empty(0), used, share
    if threshold.ndim or depth.ndim:
        return tacho_pulses(sign * (x - threshold) / depth, fs, threshold=0.0, hysteresis=1.0), used, share
    return tacho_pulses(sign * x, fs, threshold=sign * float(threshold), hysteresis=float(depth)), used, share


def _spikes(x: FloatArray, fs: float, levels: _Levels) -> tuple[FloatArray, float]:
    """Return the times of samples more than a pulse's height beyond either state, and the largest relative height."""
    height = (x - levels.low) / (levels.high - levels.low)
    places = np.flatnonzero((height > 2) | (height < -1))
    if not len(places):
        return np.empty(0), 0.0
    groups = places[np.append(True, np.diff(places) > 3)]
    return groups / fs, float(np.max(np.abs(height[places])))
