"""Marks that are not evenly spaced: their angles are learnt from the revolutions, and even pulses interpolated."""

from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.tacho.mark_pattern import MarkPattern
from sigdb.recording.tacho.pulse_train import PulseTrain

_REVOLUTIONS = 8
"""Fewest revolutions from which the spacing of marks is learnt."""
_ROUGH = 0.03
"""Least difference of neighbouring intervals, relative to the pitch, that is the marks' and not the shaft's."""
_DEVIATIONS = 6.0
"""Standard errors of that difference that it must exceed."""
_SPREAD = 0.15
"""Largest distance of a mark from its learnt angle in single revolutions, in pitches, as a median over them."""


@dataclass(frozen=True, kw_only=True)
class EvenPulses:
    """Pulses at equal angles.

    Attributes
    ----------
    times
        (pulses,) s.
    pulses_per_rev
        Pulses of a revolution.
    indexed
        Whether the first is at a mark that differs from the others of its revolution.
    notes
        Notes on marks that are learnt.
    """

    times: FloatArray
    pulses_per_rev: int
    indexed: bool
    notes: tuple[Note, ...] = ()


def even_pulses(train: PulseTrain, *, pulses_per_rev: int, name: str) -> EvenPulses:
    """Return a train's pulses at equal angles; those of even marks as they are.

    Parameters
    ----------
    train
        The train.
    pulses_per_rev
        Stated pulses of a revolution.
    name
        Name of the tacho, for notes.

    Raises
    ------
    InputError
        If uneven marks do not repeat, or in too few revolutions to learn them.
    """
    if pulses_per_rev == 1:
        return EvenPulses(times=train.times, pulses_per_rev=1, indexed=True)
    uneven = train.pattern.marks != pulses_per_rev or _roughness(train.pattern.steps * train.pattern.marks) > 0.2
    learnt, error = _learnt(train)
    # A wheel with missing teeth is compared with its teeth, any other with even marks.
    wheel = train.pattern.marks < pulses_per_rev
    base = train.pattern if wheel else MarkPattern.even(train.pattern.marks)
    if learnt is None and uneven and not wheel:
        raise InputError(
            f"its marks are uneven, and {_whole_revolutions(train)} whole revolutions are too few to learn their"
            f" spacing, which needs {_REVOLUTIONS}, or do not repeat it; check pulses_per_rev, or record longer"
        )
    noise = _DEVIATIONS * np.sqrt(6) * error * pulses_per_rev
    if learnt is None or _roughness(learnt.steps / base.steps) < max(_ROUGH, noise):
        if not wheel:
            return EvenPulses(times=train.times, pulses_per_rev=pulses_per_rev, indexed=False)
        learnt = base
    train = replace(train, pattern=learnt)
    times, indexed = _interpolated(train, pulses_per_rev)
    return EvenPulses(
        times=times,
        pulses_per_rev=pulses_per_rev,
        indexed=indexed,
        notes=tuple(_notes(train, pulses_per_rev, name, indexed)),
    )


def _roughness(steps: FloatArray) -> float:
    """Return the largest difference of neighbouring relative steps."""
    return float(np.max(np.abs(np.diff(steps, append=steps[0]))))


def _whole_revolutions(train: PulseTrain) -> int:
    return (len(train.times) - 1) // train.pattern.marks


def _learnt(train: PulseTrain) -> tuple[MarkPattern | None, float]:
    """Return the pattern as the revolutions give it, and the standard error of its angles, rev; None if few or unlike.

    The shaft turns by a cubic spline of time through the passes of one mark; the others' angles are those at which it
    then passes them, averaged over the revolutions without the fifth that is furthest off.
    """
    from scipy.interpolate import CubicSpline
    from scipy.stats import trim_mean

    marks = train.pattern.marks
    begin = int(-train.numbers[0]) % marks
    count = (len(train.times) - begin) // marks
    if count < _REVOLUTIONS:
        return None, 0.0
    t = train.times[begin : begin + count * marks].reshape(count, marks)
    turn = CubicSpline(t[:, 0], np.arange(count))
    inside = t[1:-2]
    angles = turn(inside) - np.arange(1, count - 2)[:, None]
    mean = trim_mean(angles, 0.1, axis=0)
    spread = np.median(np.abs(angles - mean))
    if spread * marks > _SPREAD or np.any(np.diff(np.append(mean, 1.0)) <= 0):
        return None, 0.0
    error = float(np.sqrt(np.mean(np.var(angles, axis=0)) / len(angles)))
    return MarkPattern(angles=np.append(0.0, mean[1:])), error


def _interpolated(train: PulseTrain, pulses_per_rev: int) -> tuple[FloatArray, bool]:
    """Return the times at equal angles from the index on, or from the first pulse on, and whether there is an index."""
    from scipy.interpolate import CubicSpline

    angles, index = train.angles, train.pattern.index()
    begin = float(angles[0])
    if index is not None:
        at = float(train.pattern.angles[index])
        begin = float(np.ceil(begin - at - 1e-9)) + at
    count = int((angles[-1] - begin) * pulses_per_rev + 1e-9) + 1
    even = np.minimum(begin + np.arange(count) / pulses_per_rev, angles[-1])
    return CubicSpline(angles, train.times)(even), index is not None


def _notes(train: PulseTrain, pulses_per_rev: int, name: str, indexed: bool) -> list[Note]:
    pattern = train.pattern
    teeth = np.round(pattern.angles * pulses_per_rev) if pattern.marks < pulses_per_rev else np.arange(pattern.marks)
    deviation = (pattern.angles - teeth / (pulses_per_rev if pattern.marks < pulses_per_rev else pattern.marks)) * 360
    largest = float(np.max(np.abs(deviation - (deviation.max() + deviation.min()) / 2)))
    missing = pulses_per_rev - pattern.marks
    wheel = f" ({missing} missing of {pulses_per_rev})" if missing > 0 else ""
    notes = [
        Note(
            code="tacho-marks",
            text=f"tacho {name}: the spacing of its {pattern.marks} marks{wheel} is learnt from"
            f" {_whole_revolutions(train)} revolutions; they lie up to {largest:.2g} deg off even spacing",
            values={"channel": name, "marks": pattern.marks, "missing": max(missing, 0), "largest_deg": largest},
        )
    ]
    if indexed:
        steps = pattern.steps
        mark = pattern.index() or 0
        before = float(steps[mark - 1]) * 360
        word = "longest" if before >= float(steps.max()) * 360 else "shortest"
        notes.append(
            Note(
                code="tacho-index",
                text=f"tacho {name}: the mark behind the {word} interval, {before:.3g} deg, is the mark from which"
                " the angle counts",
                values={"channel": name, "interval_deg": before},
            )
        )
    return notes
