"""Pulses at equal angles from an encoder's counts, from an angle, or from a speed."""

from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.tacho.uneven_marks import EvenPulses

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel

_ANGLE_UNITS = {"deg": 360.0, "degree": 360.0, "degrees": 360.0, "°": 360.0, "grad": 360.0} | {
    "rad": 2 * np.pi, "radian": 2 * np.pi, "radians": 2 * np.pi, "rev": 1.0, "revolution": 1.0, "revolutions": 1.0,
    "turn": 1.0, "turns": 1.0, "u": 1.0,
}  # fmt: skip
"""Units of a revolution, by the unit's name in small letters."""
_SPEED_UNITS = {
    "rpm": 60.0, "r/min": 60.0, "rev/min": 60.0, "1/min": 60.0, "min^-1": 60.0, "min-1": 60.0, "min⁻¹": 60.0,
    "u/min": 60.0, "hz": 1.0, "rev/s": 1.0, "r/s": 1.0, "1/s": 1.0, "s^-1": 1.0, "rps": 1.0,
    "rad/s": 2 * np.pi, "deg/s": 360.0, "°/s": 360.0,
}  # fmt: skip
"""Values of a speed of 1 rev/s, by the unit's name in small letters."""
_LEAST_SAMPLES = 4
_MOST_TURNS = 200_000
"""Most revolutions of a record whose speed is integrated, which bounds the memory."""
_MOST_PULSES = 64
"""Most pulses of a revolution that are taken from an angle."""
_SAMPLES = 4
"""Fewest knots of the angle from pulse to pulse."""
_LARGEST_STEP = 0.4
"""Largest turn from sample to sample, rev: beyond a half its direction is unknown."""
_BACKWARDS = 0.02
"""Largest share of the turn that may run backwards, by noise."""
_COUNTERS = tuple(2.0**bits for bits in (8, 10, 12, 14, 16, 20, 24, 31, 32))
"""Counts at which counters wrap around."""


def counted_pulses(channel: "Channel", counts_per_rev: float, name: str) -> EvenPulses:
    """Return pulses from the counts of an encoder, which rise or fall and may wrap around.

    Raises
    ------
    InputError
        If the counts stand still, turn back, or wrap around at an unknown count.
    """
    _check_length(channel)
    steps = np.diff(channel.samples)
    if np.any(channel.samples != np.round(channel.samples)):
        raise InputError("its samples are no whole numbers, so they are no counts; give tacho_kind angle or waveform")
    usual = float(np.median(steps[steps != 0])) if np.any(steps) else 0.0
    sign = 1.0 if usual > 0 else -1.0
    steps, modulus = _unwrapped(sign * steps, abs(usual), counts_per_rev)
    if counts_per_rev <= 0 or usual == 0:
        raise InputError("its counts stand still; check that it is the tacho")
    if modulus:
        steps = np.where(steps < -modulus / 2, steps + modulus, steps)
    first = sign * channel.samples[0] if modulus == counts_per_rev else 0.0
    counts = first + np.append(0.0, np.cumsum(steps))
    changed = np.flatnonzero(steps > 0)
    # The count changed somewhere between two samples: its middle value belongs to the middle of that time.
    angle = (counts[changed] + counts[changed + 1] + 1) / 2 / counts_per_rev
    _check_forwards(steps, "counts")
    even = _even((changed + 0.5) / channel.sampling_rate, angle, counts_per_rev, modulus == counts_per_rev)
    values: dict[str, str | int | float] = {"channel": name, "counts_per_rev": counts_per_rev, "wraps_at": modulus}
    text = f"tacho {name}: counts, {counts_per_rev:g} a revolution"
    text += f", which wrap around at {modulus:g}" if modulus else ""
    return _noted(even, Note(code="tacho-counts", text=text + _falling(sign), values=values))


def _unwrapped(steps: FloatArray, usual: float, counts_per_rev: float) -> tuple[FloatArray, float]:
    """Return the steps and the count at which they wrap around; 0 if they do not."""
    wraps = steps[steps < -max(20 * usual, 0.25 * counts_per_rev)]
    if not len(wraps):
        wraps = steps[(steps < -2 * usual) & (steps < -0.5 * counts_per_rev)]
    if not len(wraps):
        return steps, 0.0
    modulus = usual - float(np.median(wraps))
    near = [wrap for wrap in (counts_per_rev, 4 * counts_per_rev, *_COUNTERS) if abs(wrap - modulus) <= 3 * usual + 1]
    if not near:
        raise InputError(
            f"its counts fall by {-float(np.median(wraps)):g}, which is neither a revolution of {counts_per_rev:g}"
            " counts nor the range of a counter; check pulses_per_rev"
        )
    return steps, min(near, key=lambda wrap: abs(wrap - modulus))


def angle_pulses(channel: "Channel", name: str) -> EvenPulses:
    """Return pulses from an angle in deg, rad or rev, which may be wrapped at a revolution.

    Raises
    ------
    InputError
        If the unit is none of an angle, or the angle stands still, turns back or is sampled too rarely.
    """
    _check_length(channel)
    unit = channel.unit.strip().lower()
    if unit not in _ANGLE_UNITS:
        raise InputError(f"its unit {channel.unit!r} is none of an angle; give units of deg, rad or rev")
    turns = channel.samples / _ANGLE_UNITS[unit]
    steps = np.diff(turns)
    wrapped = bool(np.any(np.abs(steps) > 0.5)) and float(np.ptp(turns)) <= 1.01
    if wrapped:
        steps = steps - np.round(steps)
    if np.max(np.abs(steps), initial=0.0) > _LARGEST_STEP:
        raise InputError(
            f"it turns by {np.max(np.abs(steps)):.3g} revolutions from sample to sample; check its unit"
            f" {channel.unit!r} and its rate"
        )
    sign = 1.0 if steps.sum() > 0 else -1.0
    _check_forwards(sign * steps, "angles")
    angle = sign * turns[0] + np.append(0.0, np.cumsum(sign * steps))
    rising = np.append(True, angle[1:] > np.maximum.accumulate(angle)[:-1])
    even = _even(np.flatnonzero(rising) / channel.sampling_rate, angle[rising], _MOST_PULSES, wrapped)
    text = f"tacho {name}: an angle in {channel.unit}{', wrapped at a revolution' if wrapped else ''}{_falling(sign)}"
    return _noted(even, Note(code="tacho-angle", text=text, values={"channel": name, "wrapped": int(wrapped)}))


def speed_pulses(channel: "Channel", name: str) -> EvenPulses:
    """Return pulses from the integral of a speed in rpm, Hz or rad/s.

    Raises
    ------
    InputError
        If the unit is none of a speed, or the shaft stands still or turns back.
    """
    from scipy.interpolate import CubicSpline

    _check_length(channel)
    unit = channel.unit.strip().lower()
    if unit not in _SPEED_UNITS:
        raise InputError(f"its unit {channel.unit!r} is none of a speed; give units of rpm, Hz or rad/s")
    speed = channel.samples / _SPEED_UNITS[unit]
    sign = -1.0 if np.median(speed) < 0 else 1.0
    slow = np.flatnonzero(sign * speed <= 0)
    if len(slow):
        raise InputError(
            f"its speed is {channel.samples[slow[0]]:g} {channel.unit} at {slow[0] / channel.sampling_rate:.4g} s; the"
            " shaft must turn all the time, leave out that part of the record"
        )
    t = np.arange(len(speed)) / channel.sampling_rate
    turns = float(np.max(sign * speed)) * float(t[-1])
    if turns > _MOST_TURNS:
        raise InputError(
            f"its speed of {np.max(np.abs(channel.samples)):g} {channel.unit} is {turns:.3g} revolutions in the record;"
            " check its unit"
        )
    fine = np.linspace(0, t[-1], max(len(t), int(_SAMPLES * _MOST_PULSES * turns) + 2))
    angle = CubicSpline(t, sign * speed).antiderivative()(fine)
    if np.any(np.diff(angle) <= 0):
        raise InputError("its speed changes too fast for its rate; record it at a higher rate")
    even = _even(fine, angle, _MOST_PULSES, absolute=False)
    text = (
        f"tacho {name}: the angle is the integral of a speed in {channel.unit}; an error of 0.1 % in it is a"
        f" revolution in 1000, {angle[-1] / 1000:.2g} revolutions in this record, and smears the average: prefer"
        " pulses, or the phase of the mesh"
    )
    return _noted(even, Note(code="tacho-integrated", text=text, values={"channel": name, "turns": float(angle[-1])}))


def _falling(sign: float) -> str:
    return "" if sign > 0 else "; it falls, so the shaft is taken to turn the other way"


def _noted(even: EvenPulses, note: Note) -> EvenPulses:
    return EvenPulses(
        times=even.times, pulses_per_rev=even.pulses_per_rev, indexed=even.indexed, notes=(*even.notes, note)
    )


def _check_length(channel: "Channel") -> None:
    if len(channel.samples) < _LEAST_SAMPLES:
        raise InputError(f"it has {len(channel.samples)} values; at least {_LEAST_SAMPLES} are needed")


def _check_forwards(steps: FloatArray, word: str) -> None:
    """Refuse a shaft that stands still or turns back."""
    forwards, back = float(steps[steps > 0].sum()), -float(steps[steps < 0].sum())
    if back > _BACKWARDS * forwards or forwards == 0:
        where = int(np.argmin(steps))
        raise InputError(
            f"its {word} stand still or turn back, first after sample {where}; the shaft must turn in one direction,"
            " leave out that part of the record"
        )


def _even(t: FloatArray, angle: FloatArray, most: float, absolute: bool) -> EvenPulses:
    """Return pulses at equal angles: whole revolutions of an absolute angle, or from its beginning."""
    knots = (len(angle) - 1) / float(angle[-1] - angle[0]) if len(angle) > 1 and angle[-1] > angle[0] else 0.0
    wanted = min(most, _MOST_PULSES, knots / _SAMPLES)
    each = 2 ** int(np.log2(wanted)) if wanted >= 1 else 1
    begin = float(np.ceil(angle[0])) if absolute else float(angle[0])
    count = int((float(angle[-1]) - begin) * each + 1e-9) + 1
    times = np.interp(begin + np.arange(max(count, 0)) / each, angle, t)
    return EvenPulses(times=times, pulses_per_rev=each, indexed=absolute)
