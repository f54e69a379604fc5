"""Pattern of the marks of a revolution: how many there are, where they sit, and where their pulses repeat."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError, IntArray

JUMP = float(np.log(1.6))
"""Logarithm of the ratio of neighbouring intervals from which on no shaft explains it."""

_ALIKE = 0.3
"""Logarithm of the ratio of two intervals a revolution apart below which they are of the same marks."""
_UNSURE = 2
"""Intervals at either end of the longest stretch that are not taken for granted."""
_REVOLUTIONS = 3
"""Revolutions from which a pattern is taken."""
_MOST_MISSING = 4
"""Most teeth in the gap of a wheel with missing teeth."""
_MOST_SUGGESTED = 128
"""Most pulses of a pattern that is looked for to suggest their number."""


@dataclass(frozen=True, kw_only=True)
class MarkPattern:
    """Angles of the marks of a revolution.

    Attributes
    ----------
    angles
        (marks,) rev, from 0, increasing, below 1.
    """

    angles: FloatArray

    @classmethod
    def even(cls, marks: int) -> "MarkPattern":
        """Return marks at equal distances."""
        return cls(angles=np.arange(marks) / marks)

    @property
    def marks(self) -> int:
        """Number of marks."""
        return len(self.angles)

    @property
    def steps(self) -> FloatArray:
        """(marks,) angle from each mark to the next, rev."""
        return np.diff(np.append(self.angles, 1.0))

    def at(self, numbers: IntArray) -> FloatArray:
        """Return the angles of marks by their number, which counts on over the revolutions, rev."""
        return numbers // self.marks + self.angles[numbers % self.marks]

    def per_revolution(self, times: FloatArray, numbers: IntArray) -> FloatArray:
        """Return the time of a revolution, s, as each interval between pulses gives it."""
        return np.diff(times) / np.diff(self.at(numbers))

    def index(self) -> int | None:
        """Return the mark that stands out: behind the longest or shortest interval, or between the two shortest."""
        if self.marks < 2:
            return 0
        relative = self.steps * self.marks
        ordered = np.sort(relative)
        if ordered[-1] > 1.3 * (ordered[-2] if self.marks > 2 else ordered[0]):
            return (int(np.argmax(relative)) + 1) % self.marks
        if self.marks > 2 and 1.3 * ordered[0] < ordered[1]:
            return (int(np.argmin(relative)) + 1) % self.marks
        short = np.flatnonzero(1.3 * relative < ordered[min(2, self.marks - 1)])
        if self.marks > 3 and len(short) == 2 and short[1] - short[0] in (1, self.marks - 1):
            return int(short[1] if short[1] - short[0] == 1 else short[0])
        return None


def pulses_in_pattern(times: FloatArray, each: int) -> int:
    """Return the pulses after which the intervals repeat: those of a revolution, less the teeth of a gap, or one more.

    Parameters
    ----------
    times
        (pulses,) s.
    each
        Stated pulses of a revolution, those of missing teeth counted or not.
    """
    logs = np.log(np.diff(times))
    lags = [each, *(each - gap for gap in range(1, min(_MOST_MISSING, each // 4) + 1)), each + 1]
    different = {lag: _different(logs, lag) for lag in lags if lag > 0 and _REVOLUTIONS * lag <= len(logs)}
    if each < 3 or each not in different:
        return each
    best = min(different, key=lambda lag: different[lag])
    return best if different[best] + 0.5 / each < different[each] else each


def other_repetition(times: FloatArray, each: int) -> int | None:
    """Return another number of pulses after which the intervals repeat far better, up to 128; None without one."""
    logs = np.log(np.diff(times))
    usual = _different(logs, pulses_in_pattern(times, each))
    lags = range(2, min(_MOST_SUGGESTED, len(logs) // _REVOLUTIONS) + 1)
    for lag in lags:
        # A pattern has two intervals or more in each repetition that differ from the next.
        if lag != each and usual > 1 / lag and _different(logs, lag) < min(0.02, usual / 5):
            return lag
    return None


def _different(logs: FloatArray, lag: int) -> float:
    """Return the share of intervals that differ from those a lag later."""
    return float(np.mean(np.abs(logs[lag:] - logs[:-lag]) > _ALIKE)) if len(logs) > lag else 1.0


def regular_time(times: FloatArray, each: int) -> float:
    """Return the time, s, in intervals that are alike those a revolution before or after."""
    if len(times) < 3:
        return 0.0
    d = np.diff(times)
    lag = pulses_in_pattern(times, each)
    if len(d) <= lag:
        return float(d.sum())
    same = np.abs(np.log(d[lag:] / d[:-lag])) < _ALIKE
    regular = np.append(same, np.zeros(lag, bool)) | np.append(np.zeros(lag, bool), same)
    return float(d[regular].sum())


def pattern_and_seed(times: FloatArray, each: int) -> tuple[MarkPattern, int, int]:
    """Return the pattern of the marks, and the first and last pulse of the longest stretch without a doubt.

    The first pulse of that stretch is mark 0 of the pattern.

    Raises
    ------
    InputError
        If the pulses do not repeat with such a number of marks.
    """
    d = np.diff(times)
    lag = pulses_in_pattern(times, each)
    first, last, unsure = *_longest(times, np.abs(np.diff(np.log(d))) < JUMP, 1), _UNSURE
    if each > 1 and (lag != each or times[last] - times[first] < (times[-1] - times[0]) / 3):
        first, last = _longest(times, np.abs(np.log(d[lag:] / d[:-lag])) < _ALIKE, lag)
        unsure = lag
    # A false pulse may have cut an interval at an end short, or turned a revolution there.
    ends = min(unsure, (last - first) // 6)
    first, last = first + ends, last - ends
    if lag == 1 or last - first < _REVOLUTIONS * lag:
        return MarkPattern.even(each), first, last
    return _pattern(_shares(times[first : last + 1], lag), each), first, last


def _longest(times: FloatArray, same: NDArray[np.bool_], lag: int) -> tuple[int, int]:
    """Return the first and last pulse of the longest time in which each interval is like the one a lag later."""
    edges = np.diff(np.concatenate([[0], same.astype(np.int8), [0]]))
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) + lag
    if not len(starts):
        return 0, 1
    longest = int(np.argmax(times[stops] - times[starts]))
    return int(starts[longest]), int(stops[longest])


def _shares(times: FloatArray, marks: int) -> FloatArray:
    """Return the median share that each interval has of the revolution about it; the first begins at mark 0."""
    d, half = np.diff(times), marks // 2
    revolution = times[marks:] - times[:-marks]
    share = d[half : half + len(revolution)] / revolution
    mark = np.arange(half, half + len(share)) % marks
    medians = np.array([np.median(share[mark == j]) for j in range(marks)])
    return medians / medians.sum()


def _pattern(shares: FloatArray, each: int) -> MarkPattern:
    """Return the pattern of shares of a revolution; a wheel with missing teeth has its other teeth evenly spaced."""
    if len(shares) < each:
        teeth = np.round(shares * each)
        if teeth.sum() != each or np.any(np.abs(shares * each - teeth) > 0.3):
            raise InputError(
                f"its intervals repeat after {len(shares)} pulses, not {each}, and not as those of a wheel with"
                f" missing teeth; check pulses_per_rev, perhaps {len(shares)}"
            )
        shares = teeth / each
    return MarkPattern(angles=np.append(0.0, np.cumsum(shares)[:-1]))
