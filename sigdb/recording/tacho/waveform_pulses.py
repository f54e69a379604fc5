"""Pulses in a tacho's waveform: levels that follow a drift, a spike that hides nothing, and the edge that counts."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.recording.tacho.mark_pattern import regular_time
from sigdb.recording.tacho.waveform import Levels, Waveform
from sigdb.signature import TachoDetector

if TYPE_CHECKING:
    from sigdb.recording.recording import Edge

_DEPTHS = (0.25, 0.4)
"""Hysteresis to try, relative to the range: a pulse with a notch needs the deeper one."""
_WHOLE = 0.97
"""Share of the record in regular intervals from which on no other levels are tried."""
_EQUAL = 0.005
"""Difference of such shares that is no reason for other levels."""
_FEW, _LESS = 10, -0.05
"""Pulses below which other levels are tried all the same, and how much less regular those may be."""
_MOSTLY = 2 / 3
"""Share of the time above the threshold from which on the low state is the pulse."""


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

    @property
    def pulse_share(self) -> float:
        """Share of the time in the state that begins at the edge that counts."""
        return self.high_share if self.edge == "rising" else 1 - self.high_share


def waveform_pulses(
    x: FloatArray | Waveform,
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
        (samples,) waveform, or one in blocks.
    fs
        Its sampling rate, Hz.
    pulses_per_rev
        Pulses of a revolution.
    threshold, hysteresis, edge
        As in :class:`sigdb.recording.Recording`.
    """
    waveform = x if isinstance(x, Waveform) else Waveform.of(x)
    if threshold is not None:
        depth = waveform.usual_range() / 4 if hysteresis is None else hysteresis
        level = Levels(low=np.array(threshold), high=np.array(threshold))
        times, used, share = _pulses(waveform, fs, level, depth, 0.0, edge)
        return WaveformPulses(times=times, edge=used, high_share=share)
    best: tuple[float, WaveformPulses, Levels] | None = None
    fractions = _DEPTHS if hysteresis is None else (0.0,)
    # Percentiles and moving levels take time: they are computed where the levels before them do not suffice.
    for levels, windows, fraction in ((*each, fraction) for each in waveform.levels() for fraction in fractions):
        times, used, share = _pulses(waveform, fs, levels, hysteresis, fraction, edge)
        if len(times) < 2 * windows:
            continue
        regular = regular_time(times, pulses_per_rev) / (waveform.size / fs)
        # Few pulses may be spikes, which are regular by chance.
        few = best is not None and len(best[1].times) < _FEW and len(times) > 3 * len(best[1].times)
        if best is None or regular > best[0] + (_LESS if few else _EQUAL):
            local = best is not None and not (levels.low.ndim == 0 and levels.high == waveform.greatest)
            best = regular, WaveformPulses(times=times, edge=used, high_share=share, local=local), levels
        if len(times) >= _FEW and regular > min(_WHOLE, max(1 - 3 * pulses_per_rev / max(len(times), 1), 0.5)):
            break
    assert best is not None
    _, pulses, levels = best
    if not pulses.local:
        return pulses
    spikes, height = _spikes(waveform, fs, levels)
    return replace(pulses, spikes=spikes, spike_height=height)


def _pulses(
    waveform: Waveform, fs: float, levels: Levels, depth: float | None, fraction: float, edge: "Edge | None"
) -> tuple[FloatArray, "Edge", float]:
    """Return pulses, the edge that counts, and the share of the time above the threshold.

    The depth to which the waveform must return is a number, or a fraction of the range between the levels.
    """
    if edge is None and waveform.in_memory:
        edge = _edge(_count_above(next(iter(waveform.blocks())), levels, 0) / waveform.size)
    # In blocks, both edges are sought at once, since each look at the waveform reads the file.
    edges: tuple[Edge, ...] = ("rising", "falling") if edge is None else (edge,)
    detectors = {each: _Detector(fs, levels, depth, fraction, sign=1.0 if each == "rising" else -1.0) for each in edges}
    above = 0
    for first, x in waveform.numbered():
        above += _count_above(x, levels, first)
        for detector in detectors.values():
            detector.push(x, first)
    share = above / waveform.size
    used = edge or _edge(share)
    return detectors[used].pulses(), used, share


def _edge(high_share: float) -> "Edge":
    return "falling" if high_share > _MOSTLY else "rising"


def _count_above(x: FloatArray, levels: Levels, first: int) -> int:
    low, high = levels.at(first, len(x))
    return int(np.count_nonzero(x > (high + low) / 2))


class _Detector:
    """Detector of pulses between levels, in a waveform that comes in blocks."""

    def __init__(self, fs: float, levels: Levels, depth: float | None, fraction: float, *, sign: float) -> None:
        self._fs, self._levels, self._depth, self._fraction, self._sign = fs, levels, depth, fraction, sign
        self._detector: TachoDetector | None = None
        self._times: list[FloatArray] = []
        self._is_lost = False

    def push(self, x: FloatArray, first: int) -> None:
        """Take the next block, from a sample of this number on."""
        low, high = self._levels.at(first, len(x))
        threshold = (high + low) / 2
        depth = np.asarray((high - low) * self._fraction if self._depth is None else self._depth)
        self._is_lost |= not np.all(depth > 0)
        if self._is_lost:
            return
        if threshold.ndim or depth.ndim:
            x, threshold, depth = self._sign * (x - threshold) / depth, np.array(0.0), np.array(1.0)
        else:
            x, threshold = self._sign * x, self._sign * threshold
        if self._detector is None:
            self._detector = TachoDetector(self._fs, threshold=float(threshold), hysteresis=float(depth))
        self._times.append(self._detector.push(x))

    def pulses(self) -> FloatArray:
        """Return the times of the pulses, s; none where levels have no range between them."""
        return np.empty(0) if self._is_lost or not self._times else np.concatenate(self._times)


def _spikes(waveform: Waveform, fs: float, levels: Levels) -> tuple[FloatArray, float]:
    """Return the times of samples more than a pulse's height beyond either state, and the largest relative height."""
    beyond: list[IntArray] = []
    largest = 0.0
    for first, x in waveform.numbered():
        low, high = levels.at(first, len(x))
        height = (x - low) / (high - low)
        inside = np.flatnonzero((height > 2) | (height < -1))
        beyond.append(inside + first)
        largest = max(largest, float(np.max(np.abs(height[inside]), initial=0.0)))
    places = np.concatenate(beyond)
    if not len(places):
        return np.empty(0), 0.0
    groups = places[np.append(True, np.diff(places) > 3)]
    return groups / fs, largest
