"""Angle of a shaft from its tacho: a waveform with pulses, the times of pulses, an encoder, or a speed."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.shaft_angle import PULSE_SHARE, RELATIVE_TEETH, ShaftAngle
from sigdb.recording.tacho.encoder_angle import angle_pulses, counted_pulses, speed_pulses
from sigdb.recording.tacho.pulse_train import PulseTrain, pulse_train
from sigdb.recording.tacho.uneven_marks import EvenPulses, even_pulses
from sigdb.recording.tacho.waveform import Waveform
from sigdb.recording.tacho.waveform_pulses import WaveformPulses, waveform_pulses

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

_LEAST_COVERED = 0.5
"""Least share of the signal in which the tacho must have pulses."""
_COVERED = 0.95
"""Share of the signal below which its part with pulses is noted."""
_LARGEST = 1e100
"""Largest value of a tacho: no unit needs a larger one."""
_TIME_UNITS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0}
"""Seconds in units of time."""


def tacho_angle(recording: "Recording", signal: "Channel", *, waveform: Waveform | None = None) -> ShaftAngle:
    """Return the angle from the recording's tacho, at times from the first sample of a signal.

    Parameters
    ----------
    recording
        The recording.
    signal
        Its signal.
    waveform
        Waveform of its tacho in blocks; the recording then has no samples.

    Raises
    ------
    InputError
        If the recording has no tacho, if the tacho has too few pulses, if pulses are false or lost, if they cover too
        little of the signal, or if a revolution has no whole number of pulses.
    """
    name = _name(recording)
    each, ratio = recording.pulses_per_rev, recording.ratio
    if (each < 1 or round(each) != each) and recording.tacho_kind in ("waveform", "pulse-times"):
        raise InputError(
            f"{recording.source}: pulses_per_rev = {each:g} must be a whole number; what gears lie between is ratio"
        )
    try:
        even, train, notes = _pulses(recording, signal, name, waveform)
    except InputError as error:
        raise InputError(f"{recording.source}: tacho {name}: {error}") from None
    begins = _first_inside(even)
    times = even.times[begins:]
    absolute = even.indexed and round(ratio) == ratio
    if len(times) <= even.pulses_per_rev:
        raise InputError(f"{recording.source}: tacho {name}: {_too_few(len(times), even.pulses_per_rev)}")
    return ShaftAngle(
        pulses=times,
        pulses_per_rev=even.pulses_per_rev,
        ratio=ratio,
        absolute=absolute,
        source=f"tacho {name}",
        notes=(
            *notes,
            *even.notes,
            *_coverage(recording.source, name, times, signal.duration, even.pulses_per_rev),
            *_angle_notes(ratio, absolute),
        ),
        misfit=_deviation(train.misfit()),
    )


def _name(recording: "Recording") -> str:
    if recording.tacho is not None:
        return recording.tacho
    if recording.pulse_times is not None:
        return "pulse times"
    raise InputError(
        f"{recording.source}: no channel is known as its tacho; name it, or take the angle from the phase of the"
        " mesh (mesh_phase)"
    )


def _pulses(
    recording: "Recording", signal: "Channel", name: str, in_blocks: Waveform | None
) -> tuple[EvenPulses, PulseTrain, list[Note]]:
    """Return even pulses in the signal's time, the train that they come from, and notes on them."""
    if recording.pulse_times is not None:
        return _of_train(recording, recording.pulse_times - signal.start, name, [])
    tacho = recording.channel(name)
    extremes = (in_blocks.least, in_blocks.greatest) if in_blocks is not None else tacho.samples
    largest = float(np.max(np.abs(extremes)))
    if largest > _LARGEST:
        raise InputError(f"it holds values up to {largest:g}; check that it is the tacho")
    _check_level(recording, float(np.min(extremes)), float(np.max(extremes)))
    shift = tacho.start - signal.start
    match recording.tacho_kind:
        case "waveform":
            waveform = waveform_pulses(
                tacho.samples if in_blocks is None else in_blocks,
                tacho.sampling_rate,
                pulses_per_rev=int(recording.pulses_per_rev),
                threshold=recording.threshold,
                hysteresis=recording.hysteresis,
                edge=recording.edge,
            )
            notes = list(_waveform_notes(name, waveform, recording))
            return _of_train(recording, waveform.times + shift, name, notes, share=waveform.pulse_share)
        case "pulse-times":
            times = tacho.samples * _seconds(tacho.unit) - signal.start
            return _of_train(recording, times, name, [])
        case "counts":
            even = counted_pulses(tacho, recording.pulses_per_rev, name)
        case "angle":
            even = angle_pulses(tacho, name)
        case "speed":
            even = speed_pulses(tacho, name)
    train = pulse_train(even.times, even.pulses_per_rev)
    if len(train.dropped) or len(train.filled):
        wrong = float(np.min([*train.dropped, *train.filled]))
        raise InputError(f"the angle leaps at {wrong:.4g} s; check it, or leave out that part of the record")
    even = EvenPulses(
        times=even.times + shift, pulses_per_rev=even.pulses_per_rev, indexed=even.indexed, notes=even.notes
    )
    return even, train, []


def _check_level(recording: "Recording", least: float, greatest: float) -> None:
    """Refuse a threshold and a hysteresis that no pulse of a waveform reaches."""
    threshold, hysteresis = recording.threshold, recording.hysteresis
    if recording.tacho_kind != "waveform":
        return
    if threshold is not None and np.isfinite(threshold) and not least < threshold < greatest:
        raise InputError(
            f"threshold = {threshold:g} is not between its least and greatest values, {least:.4g} and {greatest:.4g}"
        )
    if hysteresis is not None and hysteresis >= greatest - least:
        raise InputError(f"hysteresis = {hysteresis:g} is not below its range, {least:.4g} to {greatest:.4g}")


def _too_few(pulses: int, each: int) -> str:
    return (
        f"it has {pulses} pulses, which bound no revolution of {each:g}; check that it is the tacho, its threshold and"
        " pulses_per_rev, or record longer"
    )


def _seconds(unit: str) -> float:
    if unit.strip().lower() not in _TIME_UNITS:
        raise InputError(f"its unit {unit!r} is none of time; pulse times are in s, ms or us")
    return _TIME_UNITS[unit.strip().lower()]


def _of_train(
    recording: "Recording", times: FloatArray, name: str, notes: list[Note], *, share: float | None = None
) -> tuple[EvenPulses, PulseTrain, list[Note]]:
    each = int(recording.pulses_per_rev)
    longest = max(channel.duration for channel in recording.channels)
    stated = recording.pulse_times is not None or recording.tacho_kind == "pulse-times"
    if len(times) and stated and not -longest <= np.median(times) <= 2 * longest:
        raise InputError(
            f"its pulses lie at {times[0]:.6g} to {times[-1]:.6g} s of a record of {longest:.4g} s; give times in s"
            " from the record's beginning, or their unit"
        )
    if np.any(np.diff(times) <= 0):
        where = int(np.argmin(np.diff(times))) + 1
        raise InputError(f"pulse {where + 1} at {times[where]:.6g} s is not after the one before; sort the times")
    if len(times) <= each:
        raise InputError(_too_few(len(times), each))
    train = pulse_train(times, each)
    even = even_pulses(train, pulses_per_rev=each, name=name)
    text = f"tacho {name}: {len(times)} pulses, {each:g} a revolution of its shaft"
    values: dict[str, str | int | float] = {"channel": name, "pulses": len(times), "pulses_per_rev": each}
    if share is not None:
        values[PULSE_SHARE] = share
    return even, train, [Note(code="tacho", text=text, values=values), *notes, *_mended(name, train)]


def _waveform_notes(name: str, waveform: WaveformPulses, recording: "Recording") -> Iterator[Note]:
    if len(waveform.spikes):
        first = float(waveform.spikes[0])
        count = len(waveform.spikes)
        yield Note(
            code="tacho-spike",
            text=f"tacho {name}: {count} spike{'s' if count > 1 else ''}, the first at {first:.4g} s, up to"
            f" {waveform.spike_height:.3g} times the height of a pulse; the levels of the pulses are taken without",
            values={"channel": name, "spikes": count, "first_s": first, "height": waveform.spike_height},
        )
    if waveform.local:
        text = f"tacho {name}: threshold and hysteresis follow the levels of the waveform, which are not steady"
        yield Note(code="tacho-levels", text=text, values={"channel": name})
    if waveform.edge == "falling":
        reason = "as the settings say"
        if recording.edge is None:
            reason = f"since it is high in {waveform.high_share:.0%} of the time: its short, low state is the pulse"
        yield Note(
            code="tacho-edge",
            text=f"tacho {name}: the falling edge counts, {reason}",
            values={"channel": name, "edge": waveform.edge, "high_share": waveform.high_share},
        )


def _mended(name: str, train: PulseTrain) -> Iterator[Note]:
    dropped, filled = train.dropped, train.filled
    if not (len(dropped) or len(filled)):
        return
    wrong = np.sort(np.concatenate([dropped, filled]))
    parts = [f"{len(dropped)} extra pulse{'s were' if len(dropped) != 1 else ' was'} dropped"] if len(dropped) else []
    parts += [f"{len(filled)} lost pulse{'s were' if len(filled) != 1 else ' was'} filled in"] if len(filled) else []
    where = f"at {wrong[0]:.4g} s" if len(wrong) == 1 else f"from {wrong[0]:.4g} to {wrong[-1]:.4g} s"
    yield Note(
        code="tacho-mended",
        text=f"tacho {name}: {' and '.join(parts)}, {where}, so that the speed is smooth",
        values={
            "channel": name,
            "dropped": len(dropped),
            "filled": len(filled),
            "first_s": float(wrong[0]),
            "last_s": float(wrong[-1]),
        },
    )


def _first_inside(even: EvenPulses) -> int:
    """Return the first pulse that is not before the record; with an index, it is at the same mark."""
    before = int(np.count_nonzero(even.times < 0))
    each = even.pulses_per_rev if even.indexed else 1
    return -(-before // each) * each


def _coverage(source: str, name: str, times: FloatArray, duration: float, each: int) -> Iterator[Note]:
    """Yield a note if the pulses cover a part of the signal only."""
    first, last = float(times[0]), min(float(times[-1]), duration)
    covered = last - first
    revolution = float(np.median(times[each:] - times[:-each]))
    if covered >= _COVERED * duration or duration - covered < 2 * revolution:
        return
    text = f"pulses cover {covered:.4g} s of {duration:.4g} s of the signal, from {first:.4g} to {last:.4g} s"
    if covered < _LEAST_COVERED * duration:
        raise InputError(
            f"{source}: tacho {name}: its {text}; check its threshold, or leave out the part without pulses"
        )
    values = {"covered_s": covered, "duration_s": duration, "first_s": first, "last_s": last}
    yield Note(code="tacho-coverage", text=f"tacho {name}: {text}; the rest is not averaged", values=values)


def _angle_notes(ratio: float, absolute: bool) -> Iterator[Note]:
    if ratio != 1:
        text = f"the averaged shaft turns {ratio:.6g} times a revolution of the tacho's shaft"
        yield Note(code="tacho-ratio", text=text, values={"ratio": ratio})
    if not absolute:
        text = (
            "tooth numbers are relative: the tacho has no pulse at a fixed angle of the averaged shaft, so tooth 1 is"
            " the tooth at the first pulse of this recording"
        )
        yield Note(code=RELATIVE_TEETH, text=text)


def _deviation(misfit: FloatArray) -> float:
    """Return the standard deviation by the median, which single pulses do not widen."""
    return float(np.median(np.abs(misfit)) / 0.6745) if len(misfit) else 0.0
