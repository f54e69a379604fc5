"""Marks among many extra pulses: the revolution that most pulses repeat after, and the angles at which all repeat."""

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.recording.tacho.mark_pattern import MarkPattern

_STEP = 0.01
"""Width of the bins of a revolution's length, relative to it."""
_NEAR = 0.03
"""Largest change of a revolution's length to the next, relative to it."""
_TRIED = 24
"""Pulses from which a chain of revolutions is tried to start."""
_LEAST_REVOLUTIONS = 8
_PRESENT = 0.8
"""Share of the revolutions in which a mark has a pulse."""
_APART = 0.1
"""Least distance of two clusters, relative to the pitch."""


def phase_clusters(times: FloatArray, each: int) -> tuple[MarkPattern, IntArray, IntArray] | None:
    """Return the pattern of marks, the numbers of their pulses and which pulses they are; None if there is none.

    Parameters
    ----------
    times
        (pulses,) s; more than one in a revolution, and extra ones in any of them.
    each
        Marks of a revolution.
    """
    if len(times) < _LEAST_REVOLUTIONS * each:
        return None
    length = _revolution(times, each)
    chain = _chain(times, length)
    if chain is None or len(chain) < _LEAST_REVOLUTIONS:
        return None
    count = len(chain) - 1
    inside = np.arange(chain[0], chain[-1])
    turns = np.interp(times[inside], times[chain], np.arange(count + 1))
    # Half a step before the chain's pulse, so that its cluster is not cut in two.
    phase = (turns + _APART / 2 / each) % 1 - _APART / 2 / each
    order = np.argsort(phase)
    cluster = np.empty(len(phase), int)
    cluster[order] = np.append(0, np.cumsum(np.diff(phase[order]) > _APART / each))
    revolution = np.round(turns - phase).astype(int)
    filled = [len(np.unique(revolution[cluster == label])) for label in range(cluster.max() + 1)]
    marks = [label for label, present in enumerate(filled) if present >= _PRESENT * count]
    if len(marks) != each:
        return None
    angles = np.array([np.median(phase[cluster == label]) for label in marks])
    numbers, kept = [], []
    for mark, label in enumerate(marks):
        off = np.abs(phase - angles[mark])
        members = np.flatnonzero(cluster == label)
        best = members[np.lexsort((off[members], revolution[members]))]
        _, firsts = np.unique(revolution[best], return_index=True)
        kept.append(inside[best[firsts]])
        numbers.append(revolution[best[firsts]] * each + mark)
    joined = np.argsort(np.concatenate(numbers))
    pattern = MarkPattern(angles=np.append(0.0, angles[1:] - angles[0]))
    return pattern, np.concatenate(numbers)[joined], np.concatenate(kept)[joined]


def _revolution(times: FloatArray, each: int) -> float:
    """Return the length of a revolution: the most frequent time from a pulse to one about as many pulses later."""
    lags = range(max(1, each - 1), each + max(2, each // 2) + 1)
    logs = np.concatenate([np.log(times[lag:] - times[:-lag]) for lag in lags if lag < len(times)])
    bins = np.floor((logs - logs.min()) / _STEP).astype(int)
    counts = np.convolve(np.bincount(bins), [1, 1, 1], mode="same")
    return float(np.exp(logs.min() + (int(np.argmax(counts)) + 0.5) * _STEP))


def _chain(times: FloatArray, length: float) -> IntArray | None:
    """Return the pulses of the mark that has one in every revolution from the first on to the last."""
    best: list[int] = []
    for start in range(min(_TRIED, len(times))):
        chain, now = [start], length
        while True:
            expected = times[chain[-1]] + now
            near = int(np.argmin(np.abs(times - expected)))
            if near <= chain[-1] or abs(times[near] - expected) > _NEAR * now:
                break
            now = 0.5 * now + 0.5 * float(times[near] - times[chain[-1]])
            chain.append(near)
        if times[chain[-1]] - times[chain[0]] > (times[best[-1]] - times[best[0]] if best else 0.0):
            best = chain
    whole = bool(best) and times[-1] - times[best[-1]] < 2 * length and times[best[0]] - times[0] < 2 * length
    return np.array(best) if whole else None
