"""Faults of samples: clipping, spikes and drop-outs of a channel."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, IntArray

FLAT = 3
"""Samples at an extreme in a row from which on a smooth signal is clipped."""

OFTEN, MORE = 5, 4
"""Fewest samples at an extreme of a clipped signal, and how many times more there are than at the next values."""

FAR = 10.0
"""Least height of a spike, in standard deviations of normal samples with the same median absolute deviation."""

ABOVE = 4.0
"""Least height of a spike, in the deviation that 1 % of the samples exceed."""

ISOLATED = 0.3
"""Largest deviation of the samples about a spike, relative to its height."""

LONGEST_SPIKE = 2
"""Samples of a spike."""

PULSES, EQUAL = 8, 0.2
"""Number of spikes or flat parts, and relative spread of their heights or distances, of the pulses of a tacho."""

LONGEST_STILL = 16
"""Samples of one value from which on a live signal has dropped out."""

_SAMPLED = 1_000_000
"""Samples of a channel from which its spread is estimated."""


@dataclass(frozen=True, kw_only=True)
class SampleRuns:
    """Runs of faulty samples: the first sample and the number of samples of each."""

    starts: IntArray
    lengths: IntArray

    @property
    def samples(self) -> int:
        """Number of samples in all runs."""
        return int(self.lengths.sum())


NO_RUNS = SampleRuns(starts=np.zeros(0, dtype=np.int64), lengths=np.zeros(0, dtype=np.int64))


def runs_of(where: IntArray) -> SampleRuns:
    """Return the runs of consecutive numbers in a rising series of samples."""
    if not where.size:
        return NO_RUNS
    begins = np.concatenate([[0], np.flatnonzero(np.diff(where) > 1) + 1])
    lengths = np.diff(np.concatenate([begins, [where.size]]))
    return SampleRuns(starts=where[begins].astype(np.int64), lengths=lengths.astype(np.int64))


def clipped_runs(x: FloatArray) -> SampleRuns:
    """Return the runs of samples at the extremes of a clipped signal.

    A signal is clipped if it stays at an extreme for three samples and leaves it steeply, or if far more samples are
    at the extreme than at the next values. Square waves, which are at their extremes most of the time, are not clipped.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.clip(np.sin(np.arange(1000) / 10), -0.8, 2)
    >>> clipped_runs(x).samples, clipped_runs(np.sin(np.arange(1000) / 10)).samples
    (206, 0)
    """
    low, high = float(x.min()), float(x.max())
    if low == high or x.size < 4 * FLAT:
        return NO_RUNS
    parts = [runs for sign in (1.0, -1.0) if (runs := _clipped_above(x, sign)).samples]
    if not parts or sum(part.samples for part in parts) > x.size / 2 or _is_square(x, low, high, parts):
        return NO_RUNS
    starts = np.concatenate([part.starts for part in parts])
    lengths = np.concatenate([part.lengths for part in parts])
    order = np.argsort(starts)
    return SampleRuns(starts=starts[order], lengths=lengths[order])


def _clipped_above(x: FloatArray, sign: float) -> SampleRuns:
    """Return the runs at the largest value (sign 1) or the least (sign -1), if the signal is clipped there."""
    extreme = float(x.max() if sign > 0 else x.min())
    runs = runs_of(np.flatnonzero(x == extreme))
    resolution = _resolution(x)
    before = sign * (extreme - x[np.maximum(runs.starts - 1, 0)])
    after = sign * (extreme - x[np.minimum(runs.starts + runs.lengths, x.size - 1)])
    # The top of a parabola that is flat within the resolution over a run leaves it by no more than this.
    smooth = 2 * resolution * (1 + 2 / runs.lengths) ** 2
    flat = (runs.lengths >= FLAT) & (np.minimum(before, after) > smooth)
    return runs if flat.any() or _heaps_up(x, sign, runs.samples) else NO_RUNS


def _heaps_up(x: FloatArray, sign: float, count: int) -> bool:
    """Return whether far more samples are at an extreme than at the next values of the signal."""
    if count < OFTEN:
        return False
    most = min(x.size, 2 * count + 4096)
    top = np.sort(np.partition(sign * x, x.size - most)[x.size - most :])[::-1]
    same = 1e-6 * float(np.ptp(x))
    levels = np.flatnonzero(np.diff(top) < -same)
    sizes = np.diff(np.concatenate([[-1], levels]))
    return bool(sizes.size > MORE and 2 * count > sizes[0] > MORE * sizes[1:4].max())


def _is_square(x: FloatArray, low: float, high: float, parts: list[SampleRuns]) -> bool:
    """Return whether a signal is at two levels: few samples are between, and it leaves a level at once."""
    span = high - low
    between = np.count_nonzero((x > low + span / 4) & (x < high - span / 4))
    if between > 0.05 * x.size:
        return False
    outside = np.concatenate([np.minimum(part.starts + part.lengths + 1, x.size - 1) for part in parts])
    level = np.concatenate([x[part.starts] for part in parts])
    return bool(np.median(np.abs(x[outside] - level)) > span / 2)


def spike_runs(x: FloatArray) -> SampleRuns:
    """Return single samples, or two in a row, that are far outside while their neighbours are not.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.sin(np.arange(1000) / 10)
    >>> x[700] = 30
    >>> spike_runs(x).starts.tolist()
    [700]
    """
    sampled = x[:: max(1, x.size // _SAMPLED)]
    centre = float(np.median(sampled))
    deviation = np.abs(sampled - centre)
    spread = 1.4826 * float(np.median(deviation))
    if not spread > 0:
        return NO_RUNS
    height = max(FAR * spread, ABOVE * float(np.quantile(deviation, 0.99)))
    runs = runs_of(np.flatnonzero(np.abs(x - centre) > height))
    ends = runs.starts + runs.lengths
    heights = np.abs(x[runs.starts] - centre)
    heights = np.maximum(heights, np.abs(x[ends - 1] - centre))
    isolated = runs.lengths <= LONGEST_SPIKE
    for near in (runs.starts - 1, runs.starts - 2, ends, ends + 1):
        inside = (near >= 0) & (near < x.size)
        nearby = np.where(inside, np.abs(x[np.clip(near, 0, x.size - 1)] - centre), 0.0)
        isolated &= nearby < ISOLATED * heights
    heights = heights[isolated]
    if heights.size >= PULSES and heights.std() < EQUAL * heights.mean():
        return NO_RUNS
    return SampleRuns(starts=runs.starts[isolated], lengths=runs.lengths[isolated])


def drop_out_runs(x: FloatArray) -> SampleRuns:
    """Return the runs of one value in a signal that moves otherwise; runs at its extremes are left to clipping.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.sin(np.arange(1000) / 10)
    >>> x[300:350] = 0
    >>> runs = drop_out_runs(x)
    >>> runs.starts.tolist(), runs.lengths.tolist()
    ([300], [50])
    """
    still = x[1:] == x[:-1]
    runs = runs_of(np.flatnonzero(still))
    runs = SampleRuns(starts=runs.starts, lengths=runs.lengths + 1)
    inner = (x[runs.starts] != x.min()) & (x[runs.starts] != x.max()) if runs.starts.size else np.zeros(0, dtype=bool)
    long = inner & (runs.lengths >= LONGEST_STILL)
    alive = x.size - int(runs.lengths[long].sum())
    if not long.any() or alive < max(4 * LONGEST_STILL, 0.1 * x.size):
        return NO_RUNS
    share = (np.count_nonzero(still) - int((runs.lengths[long] - 1).sum())) / alive
    if share >= 0.5:
        return NO_RUNS
    longest = 2 * np.log(x.size) / -np.log(share) if share > 0 else 0.0
    long &= runs.lengths > longest
    if _are_regular(runs.starts[long]):
        return NO_RUNS
    long &= _jumps(x, runs) > 2 * _resolution(x)
    return SampleRuns(starts=runs.starts[long], lengths=runs.lengths[long])


def _jumps(x: FloatArray, runs: SampleRuns) -> FloatArray:
    """Return the larger of the changes into and out of each run."""
    ends = runs.starts + runs.lengths
    into = np.abs(x[runs.starts] - x[np.maximum(runs.starts - 1, 0)])
    return np.asarray(np.maximum(into, np.abs(x[np.minimum(ends, x.size - 1)] - x[ends - 1])))


def _are_regular(starts: IntArray) -> bool:
    """Return whether flat parts lie as regularly as between the pulses of a tacho."""
    apart = np.diff(starts)
    middle = np.median(apart) if apart.size >= PULSES else 0.0
    return bool(middle > 0 and np.median(np.abs(apart - middle)) < EQUAL * middle)


def _resolution(x: FloatArray) -> float:
    """Return the smallest change between samples."""
    steps = np.abs(np.diff(x[:_SAMPLED]))
    return float(steps[steps > 0].min(initial=np.inf))
