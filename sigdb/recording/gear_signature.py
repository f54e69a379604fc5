"""From a recording to its signature: angle, synchronous average, spectrum, indicators."""

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError
from sigdb.recording.lines import average_noise, record_spectrum, spectral_lines
from sigdb.recording.notes import average_notes, channel_notes, range_notes
from sigdb.recording.orders import AveragedGear, averaged_gear
from sigdb.recording.shaft_angle import ShaftAngle, mesh_angle, tacho_angle
from sigdb.recording.signature import RecordedSignature
from sigdb.signature import SynchronousAverage, indicators, order_spectrum, synchronous_average
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

_UNKNOWN_RPM = (300.0, 6000.0)
"""Where a speed is sought of which nothing is known."""
_NEAR_GIVEN, _NEAR_RATED = 0.05, 0.2
"""How far the speed may be from the one given, and from the rig's operating point."""
_ROUNDING = 64 * np.finfo(float).eps
_SHOWN_MESH_ORDERS = 4.5
"""Highest order of the record's spectrum, in mesh orders."""


def recorded_signature(
    recording: "Recording",
    *,
    channel: str | None = None,
    teeth: int | None = None,
    mesh_phase: bool = False,
    samples_per_tooth: int = 64,
    revolutions: int | None = None,
    rig: Transmission | None = None,
    gear: str | None = None,
    speed_rpm: float | None = None,
    speed_range_rpm: tuple[float, float] | None = None,
    harmonic: int | None = None,
) -> RecordedSignature:
    """The signature of a recording, by its tacho or, without one, by the phase of the mesh.

    Parameters
    ----------
    recording
        From :func:`sigdb.read_recording`.
    channel
        Name of the signal; by default the recording's first.
    teeth
        Tooth count of the gear on the averaged shaft; by default the recording's, or that of the rig's gear.
    mesh_phase
        Take the angle from the phase of a mesh harmonic, not from the tacho: tooth numbers are relative then.
    samples_per_tooth
        Samples of the average in a tooth pass, as in the database that it is to be compared with.
    revolutions
        Revolutions to average; by default as many whole tooth cycles as there are, or revolutions without a rig.
    rig, gear
        The rig, and its gear on the averaged shaft: they name the orders, and tell the tooth cycle.
    speed_rpm
        The averaged shaft's speed to within 5 %, for the phase of the mesh.
    speed_range_rpm
        Where to seek that speed; by default near the recording's, within 20 % of the rig's, or 300 to 6000 rpm.
    harmonic
        Mesh harmonic whose phase is taken; by default, of the first three, the one that gives the angle most evenly.

    Returns
    -------
    RecordedSignature

    Raises
    ------
    InputError
        If channel, gear or tooth count are missing or unknown, there is no tacho and ``mesh_phase`` is not asked for,
        or the recording holds no revolution, no such speed, or fewer revolutions than asked for.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.recording import Channel, Recording
    >>> from sigdb.recording import recorded_signature
    >>> fs, t = 10_000.0, np.arange(40_000) / 10_000
    >>> mesh = Channel(name="a1", samples=np.cos(2 * np.pi * 12 * 20 * t), sampling_rate=fs, unit="m/s^2")
    >>> tacho = Channel(name="tacho", samples=5.0 * (20 * t % 1 < 0.1), sampling_rate=fs, unit="V")
    >>> recording = Recording(source="example", channels=(mesh, tacho), tacho="tacho")
    >>> signature = recorded_signature(recording, teeth=12)
    >>> signature.averages, round(signature.speed_rpm), signature.absolute
    (78, 1200, True)
    """
    known = averaged_gear(recording.teeth if teeth is None and gear is None else teeth, rig, gear)
    signal = _signal(recording, channel)
    if mesh_phase:
        near = _range(recording, known, speed_rpm, speed_range_rpm)
        angle = mesh_angle(recording, signal, teeth=known.teeth, range_rpm=near, harmonic=harmonic)
    else:
        angle = tacho_angle(recording)
    fs = signal.sampling_rate
    available = angle.revolutions((len(signal.samples) - 1) / fs)
    n = known.teeth * samples_per_tooth
    average = _averaged(signal, angle, n, _revolutions(available, known.cycle, revolutions))
    M = average.revolutions
    speed, track = _mean_speed(angle, M), angle.speed_track()
    highest = fs / 2 / (speed / 60)
    x = _over_angle(signal, angle, n, M)
    spectrum = record_spectrum(x, samples_per_rev=n, highest=min(highest, _SHOWN_MESH_ORDERS * known.teeth))
    scatter = float(np.sqrt(np.mean(average.scatter**2)))
    order, c = order_spectrum(average.tsa)
    return RecordedSignature(
        source=recording.source,
        channel=signal.name,
        unit=signal.unit,
        gear=known.name,
        shaft=known.shaft,
        teeth=known.teeth,
        angle=angle.source,
        absolute=angle.absolute,
        tsa=average.tsa,
        scatter=scatter,
        noise=average_noise(x, samples_per_rev=n, scatter=scatter, highest=highest),
        averages=M,
        dropped=available - M,
        cycle=known.cycle,
        speed_rpm=speed,
        speed_track=track,
        kept=_kept(average.tsa, signal.samples),
        highest_order=highest,
        order_spectrum=pd.DataFrame({"order": order, "amplitude": np.abs(c)}),
        record_spectrum=pd.DataFrame({name: getattr(spectrum, name) for name in ("order", "amplitude", "level")}),
        lines=spectral_lines(spectrum, known.orders, teeth=known.teeth),
        indicators={name: float(value) for name, value in indicators(average.tsa, teeth=known.teeth).items()},
        notes=(
            *recording.notes,
            *channel_notes(recording, signal),
            *angle.notes,
            *average_notes(known, M, available),
            *range_notes(known.teeth, highest, samples_per_tooth),
        ),
    )


def _signal(recording: "Recording", name: str | None) -> "Channel":
    if name is not None:
        return recording.channel(name)
    if not recording.signals:
        raise InputError(f"{recording.source}: no channel beside the tacho; a signature needs a signal")
    return recording.signals[0]


def _range(
    recording: "Recording", known: AveragedGear, speed_rpm: float | None, range_rpm: tuple[float, float] | None
) -> tuple[float, float]:
    """Where the shaft's speed is sought."""
    if speed_rpm is None and range_rpm is not None:
        return range_rpm
    given = recording.speed_rpm if speed_rpm is None else speed_rpm
    if given is not None:
        return given * (1 - _NEAR_GIVEN), given * (1 + _NEAR_GIVEN)
    if known.speed_rpm is not None:
        return known.speed_rpm * (1 - _NEAR_RATED), known.speed_rpm * (1 + _NEAR_RATED)
    return _UNKNOWN_RPM


def _revolutions(available: int, cycle: int | None, asked: int | None) -> int | None:
    """Whole tooth cycles where one fits in; None for all there are."""
    if asked is not None:
        return asked
    return available // cycle * cycle or None if cycle else None


def _averaged(signal: "Channel", angle: ShaftAngle, n: int, revolutions: int | None) -> SynchronousAverage:
    return synchronous_average(
        signal.samples,
        signal.sampling_rate,
        angle.pulses,
        samples_per_rev=n,
        pulses_per_rev=angle.pulses_per_rev,
        ratio=angle.ratio,
        revolutions=revolutions,
    )


def _over_angle(signal: "Channel", angle: ShaftAngle, n: int, M: int) -> FloatArray:
    """The record in equal steps of angle: all M revolutions taken as one long one."""
    return synchronous_average(
        signal.samples,
        signal.sampling_rate,
        angle.pulses,
        samples_per_rev=M * n,
        pulses_per_rev=angle.pulses_per_rev * M,
        ratio=angle.ratio,
        revolutions=1,
    ).tsa


def _kept(tsa: FloatArray, x: FloatArray) -> float:
    """Ratio of the standard deviations; 0 for a record without any but rounding."""
    peak = float(np.max(np.abs(x))) or 1.0
    deviation = float(np.std(x / peak))
    return float(np.std(tsa / peak)) / deviation if deviation > _ROUNDING else 0.0


def _mean_speed(angle: ShaftAngle, revolutions: int) -> float:
    """Speed of the averaged shaft from the first pulse to the end of the average."""
    last = revolutions * angle.pulses_per_rev / angle.ratio
    ends = np.interp([0.0, last], np.arange(len(angle.pulses)), angle.pulses)
    return float(60 * revolutions / (ends[1] - ends[0]))
