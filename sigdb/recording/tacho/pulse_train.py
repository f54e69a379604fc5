"""Trains of pulses: each pulse follows from those before it; extra ones are dropped, single lost ones filled in."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.recording.tacho.mark_pattern import JUMP, MarkPattern, other_repetition, pattern_and_seed
from sigdb.recording.tacho.phase_clusters import phase_clusters

_TOLERANCE = 0.3
"""Largest distance of a pulse from where it is expected, relative to the shortest step at its mark."""
_OFF = 0.4
"""Distance of a pulse from where the intervals about it let it expect, relative to the shortest step, that is odd."""
_ABOUT = 5
"""Intervals before and behind whose median is looked at."""
_SURE = 0.15
"""Logarithm of the ratio of two intervals up to which the next pulse is taken without a further look."""
_FEW_MARKS = 4
"""Marks of a revolution up to which a change of speed from interval to interval counts."""
_REMEMBERED = 6
"""Intervals from which the next is extrapolated."""
_MOST_LOST = 2
"""Most pulses in a row that are filled in, or those of a revolution where it has more."""
_CLEAN = 0.6
"""Least share of the time in which nothing was dropped or filled in."""
_CLEAN_OF_HALVES, _HALVES = 0.85, 0.05
"""That share where the extra pulses divide intervals in equal parts, and how equal."""
_MOST_FILLED = 0.1
"""Largest share of the pulses that may be filled in."""
_DISPLACED, _DEVIATIONS = 0.1, 8.0
"""Distance of a pulse from the curve through its neighbours from which on it is false: in steps, and in deviations."""
_ENDS = 3
"""Most pulses that may be left out at an end of the train."""


@dataclass(frozen=True, kw_only=True)
class PulseTrain:
    """Pulses of a shaft without a gap or an extra pulse.

    Attributes
    ----------
    times
        (pulses,) s.
    numbers
        (pulses,) consecutive numbers of the marks; number 0 is mark 0 of the pattern.
    pattern
        Angles of the marks.
    dropped, filled
        Times of the pulses that were dropped, and of the lost ones that were filled in, s.
    """

    times: FloatArray
    numbers: IntArray
    pattern: MarkPattern
    dropped: FloatArray = field(default_factory=lambda: np.empty(0))
    filled: FloatArray = field(default_factory=lambda: np.empty(0))

    @property
    def angles(self) -> FloatArray:
        """(pulses,) angles, rev."""
        return self.pattern.at(self.numbers)

    def misfit(self) -> FloatArray:
        """Return (pulses - 4,) distances of pulses from the cubic through two neighbours on either side, rev."""
        return _misfit(self.times, self.angles)[1]


def pulse_train(times: FloatArray, each: int) -> PulseTrain:
    """Return the train of pulses without extra and lost ones.

    The longest stretch of intervals that repeat fixes where pulses are expected. From there on, in both directions,
    each pulse is the nearest to the time at which the last intervals let it expect.

    Parameters
    ----------
    times
        (pulses,) s, increasing.
    each
        Stated pulses of a revolution, those of missing teeth counted or not.

    Raises
    ------
    InputError
        If pulses are so false, or so many are lost, that their angle is not certain; the message names the seconds.
    """
    if len(times) < 4:
        return PulseTrain(times=times, numbers=np.arange(len(times)), pattern=MarkPattern.even(each))
    pattern, first, last = pattern_and_seed(times, each)
    numbers = np.arange(len(times)) - first
    rest: list[FloatArray] = []
    kept = np.arange(len(times))
    if _is_odd(times, numbers, pattern):
        _refuse_other_pattern(times, each)
        clusters = phase_clusters(times, each) if each > 1 and _is_short(times, first, last) else None
        if clusters is not None:
            pattern, numbers, kept = clusters
        elif last - first < min(3, len(times) - 2):
            raise InputError(_unordered(times))
        else:
            numbers, kept = _followed(times, pattern, first, last)
        kept = _nearest(times, kept, pattern.at(numbers))
        rest = [np.delete(times, kept)]
    times, numbers, displaced = _without_displaced(times[kept], numbers, pattern)
    train = _filled(times, numbers, pattern)
    dropped = np.sort(np.concatenate([*rest, displaced]))
    _check_share(train, dropped, each)
    return PulseTrain(times=train[0], numbers=train[1], pattern=pattern, dropped=dropped, filled=train[2])


def _is_odd(times: FloatArray, numbers: IntArray, pattern: MarkPattern) -> bool:
    """Return whether an interval leaps, or is off by a good part of a step from those before or behind it."""
    per_rev = pattern.per_revolution(times, numbers)
    if np.any(np.abs(np.diff(np.log(per_rev))) > JUMP):
        return True
    if len(per_rev) <= _ABOUT:
        return False
    medians = np.median(np.lib.stride_tricks.sliding_window_view(per_rev, _ABOUT), axis=1)
    off = [per_rev[_ABOUT:] / medians[:-1] - 1, per_rev[:-_ABOUT] / medians[1:] - 1]
    steps = np.diff(pattern.at(numbers))
    far = [np.abs(off[0]) * steps[_ABOUT:], np.abs(off[1]) * steps[:-_ABOUT]]
    return bool(np.any(np.concatenate(far) > _OFF * pattern.steps.min()))


def _is_short(times: FloatArray, first: int, last: int) -> bool:
    return bool(times[last] - times[first] < (times[-1] - times[0]) / 3)


def _unordered(times: FloatArray) -> str:
    return (
        f"its intervals follow no order from {times[0]:.4g} to {times[-1]:.4g} s; check that it is the tacho, its"
        " threshold and pulses_per_rev"
    )


def _refuse_other_pattern(times: FloatArray, each: int) -> None:
    lag = other_repetition(times, each)
    if lag is not None:
        raise InputError(
            f"its intervals repeat after {lag} pulses, not {each}; check pulses_per_rev, perhaps {lag} or, with missing"
            f" teeth, {lag + 1} or {lag + 2}, and the threshold"
        )


def _followed(times: FloatArray, pattern: MarkPattern, first: int, last: int) -> tuple[IntArray, IntArray]:
    """Return the numbers of the marks and the pulses that belong to them, from the seed on in both directions."""
    per_rev = pattern.per_revolution(times[first : last + 1], np.arange(last - first + 1))
    onwards = _onwards(times, last, last - first, 1, pattern, per_rev)
    # Backwards in time: the same with the signs of times and numbers turned.
    turned, end = -times[::-1], len(times) - 1
    back = [(end - pulse, number) for pulse, number in _onwards(turned, end - first, 0, -1, pattern, per_rev[::-1])]
    seed = [(pulse, pulse - first) for pulse in range(first, last + 1)]
    kept, numbers = np.array([*back[::-1], *seed, *onwards]).T
    # A few pulses at an end, in the time of a few, are left out.
    few = _ENDS * max(1, pattern.marks // 4)
    if kept[0] > few:
        raise InputError(_lost_track(times[kept[0]], times[0], times[kept[0]]))
    if end - kept[-1] > few:
        raise InputError(_lost_track(times[kept[-1]], times[kept[-1]], times[-1]))
    return numbers, kept


def _lost_track(where: float, low: float, high: float) -> str:
    return (
        f"its pulses do not go on evenly at {where:.4g} s: pulses are false or lost there, or the shaft stood still;"
        f" leave out {low:.4g} to {high:.4g} s"
    )


def _onwards(
    times: FloatArray, pulse: int, number: int, sign: int, pattern: MarkPattern, before: FloatArray
) -> list[tuple[int, int]]:
    """Return the pulses after one, and the numbers of their marks, as far as they follow from those before."""
    marks, angles = pattern.marks, pattern.angles.tolist()
    limit = max(_MOST_LOST, marks)
    t, end = times.tolist(), len(times) - 1

    def angle(n: int) -> float:
        return n // marks + angles[n % marks]

    def step(n: int, count: int = 1) -> float:
        return sign * (angle(n + sign * count) - angle(n))

    accepted: list[tuple[int, int]] = []
    remembered = max(_REMEMBERED, marks // 4)
    recent = deque(before[-remembered:].tolist(), maxlen=remembered)
    while pulse < end:
        target, count = pulse + 1, 1
        interval = step(number)
        ahead = t[target + 1] - t[target] if target < end else np.inf
        sure = abs(np.log((t[target] - t[pulse]) / interval / recent[-1])) < _SURE
        if not (sure and ahead > step(number + sign) * recent[-1] / 2):
            reached = _next(
                times, pulse, _expected(np.array(recent), marks), [step(number, m) for m in range(1, limit + 2)]
            )
            if reached is None:
                break
            target, count = reached
            after = (t[target + 1] - t[target]) / step(number + sign * count) if target < end else np.inf
            # Near an end nothing confirms that a pulse is lost, and not that the shaft stops.
            if count > 1 and (target > end - _ENDS or not _is_confirmed(after / float(np.median(recent)))):
                break
            interval = step(number, count)
        recent.append((t[target] - t[pulse]) / interval)
        pulse, number = target, number + sign * count
        accepted.append((pulse, number))
    return accepted


def _is_confirmed(intervals: float) -> bool:
    """Return whether the time to the next pulse is about an interval, or a few of them where more are lost."""
    whole = min(max(1, round(intervals)), _MOST_LOST + 1) if np.isfinite(intervals) else 1
    return bool(abs(np.log(intervals / whole)) < (JUMP if whole == 1 else JUMP / 3))


def _next(times: FloatArray, pulse: int, per_rev: float, steps: list[float]) -> tuple[int, int] | None:
    """Return the pulse nearest to where one is expected, and its distance in marks; None if there is none."""
    for count, reach in enumerate(steps, start=1):
        shortest = min(np.diff([0.0, *steps])[max(count - 1, 0) : count + 1])
        expected = times[pulse] + reach * per_rev
        if expected - _TOLERANCE * shortest * per_rev > times[-1]:
            return None
        near = pulse + 1 + int(np.argmin(np.abs(times[pulse + 1 :] - expected)))
        if abs(times[near] - expected) <= _TOLERANCE * shortest * per_rev:
            return near, count
    return None


def _expected(recent: FloatArray, marks: int) -> float:
    """Return the time of a revolution in the next interval, from those before it.

    Few marks: the line of median slope, at most a third off the median. Many: the median, which noise moves little.
    """
    size, middle = len(recent), float(np.median(recent))
    if marks > _FEW_MARKS:
        return middle
    if size < 3:
        return float(recent[-1])
    i, j = np.triu_indices(size, 1)
    slope = float(np.median((recent[j] - recent[i]) / (j - i)))
    level = float(np.median(recent - slope * np.arange(size)))
    return min(max(level + slope * size, middle / 1.5), middle * 1.5)


def _misfit(times: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distances from the cubic through two neighbours on either side, in steps of the pulse and in rev."""
    if len(times) < 5:
        return np.empty(0), np.empty(0)
    places = [angles[k : len(angles) - 4 + k] for k in range(5)]
    t = [times[k : len(times) - 4 + k] for k in range(5)]
    expected = np.zeros(len(places[0]))
    for k in (0, 1, 3, 4):
        weight = np.ones(len(expected))
        for other in {0, 1, 3, 4} - {k}:
            weight *= (places[2] - places[other]) / (places[k] - places[other])
        expected += weight * t[k]
    per_rev = (t[4] - t[0]) / (places[4] - places[0])
    revolutions = (t[2] - expected) / per_rev
    return revolutions / np.minimum(places[2] - places[1], places[3] - places[2]), revolutions


def _nearest(times: FloatArray, kept: IntArray, angles: FloatArray) -> IntArray:
    """Return the kept pulses, each replaced by an extra one next to it that its neighbours expect rather."""
    if len(kept) < 5:
        return kept
    kept = kept.copy()
    extra = np.setdiff1d(np.arange(len(times)), kept)
    for pulse in extra:
        place = int(np.argmin(np.abs(times[kept] - times[pulse])))
        if not 2 <= place < len(kept) - 2:
            continue
        near = slice(place - 2, place + 3)
        tried = kept[near].copy()
        tried[2] = pulse
        if np.any(np.diff(tried) <= 0):
            continue
        now, then = (abs(float(_misfit(times[five], angles[near])[0][0])) for five in (kept[near], tried))
        if then < now / 2:
            kept[place] = pulse
    return kept


def _without_displaced(
    times: FloatArray, numbers: IntArray, pattern: MarkPattern
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return the pulses without those that lie far off the curve through their neighbours, and the times of these."""
    displaced: list[float] = []
    limit = max(_ENDS, len(times) // 500)
    while len(steps := _misfit(times, pattern.at(numbers))[0]):
        worst = int(np.argmax(np.abs(steps)))
        deviation = float(np.median(np.abs(steps))) / 0.6745
        if abs(steps[worst]) < max(_DISPLACED, _DEVIATIONS * deviation):
            break
        displaced.append(float(times[worst + 2]))
        near = np.abs(np.array(displaced) - displaced[-1]) < (_ENDS + pattern.marks) * np.diff(times).mean()
        if len(displaced) > limit or np.count_nonzero(near) > _ENDS:
            low, high = min(displaced), max(displaced)
            raise InputError(
                f"{len(displaced)} pulses or more, from {low:.4g} to {high:.4g} s, lie far from where their neighbours"
                " let them expect; check threshold and pulses_per_rev, or leave out that part of the record"
            )
        times, numbers = np.delete(times, worst + 2), np.delete(numbers, worst + 2)
    return times, numbers, np.array(displaced)


def _filled(times: FloatArray, numbers: IntArray, pattern: MarkPattern) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return all pulses with those that were lost, their numbers, and the times of the lost ones."""
    from scipy.interpolate import CubicSpline

    every = np.arange(numbers[0], numbers[-1] + 1)
    lost = np.setdiff1d(every, numbers)
    if not len(lost):
        return times, every, np.empty(0)
    filled = CubicSpline(pattern.at(numbers), times)(pattern.at(lost))
    whole = np.empty(len(every))
    whole[numbers - numbers[0]], whole[lost - numbers[0]] = times, filled
    return whole, every, filled


def _check_share(train: tuple[FloatArray, IntArray, FloatArray], dropped: FloatArray, each: int) -> None:
    """Refuse a train of which too much was dropped or filled in, or whose true pulses may be the dropped ones too."""
    whole, _, filled = train
    wrong = np.sort(np.concatenate([dropped, filled]))
    if not len(wrong):
        return
    mended: NDArray[np.bool_] = np.zeros(len(whole) - 1, bool)
    place = np.clip(np.searchsorted(whole, wrong) - 1, 0, len(mended) - 1)
    mended[place] = True
    share = 1 - float(np.diff(whole)[mended].sum()) / float(whole[-1] - whole[0])
    # Pulses that divide intervals in equal parts may be true ones, and lost elsewhere.
    inside = np.isin(wrong, dropped) & mended[place]
    part = (
        (wrong - whole[place]) / np.diff(whole)[place] * (1 + np.bincount(place[inside], minlength=len(mended)))[place]
    )
    halves = inside & (np.abs(part - np.round(part)) < _HALVES)
    least = _CLEAN_OF_HALVES if np.count_nonzero(halves) > max(_ENDS, len(dropped) / 2) else _CLEAN
    if share >= least and len(filled) <= _MOST_FILLED * len(whole):
        return
    raise InputError(
        f"{len(dropped)} pulses are extra and {len(filled)} are lost, from {wrong[0]:.4g} to {wrong[-1]:.4g} s, if a"
        f" revolution has {each}: too many to tell which are right; check threshold, hysteresis and pulses_per_rev, or"
        " leave out that part of the record"
    )
