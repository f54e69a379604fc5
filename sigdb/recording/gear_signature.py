"""Computation of the signature of a gear from a recording: angle, synchronous average, spectra, indicators."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Unpack

import numpy as np
import pandas as pd

from sigdb.core import InputError, NotApplicableError, validated
from sigdb.recording.blocks.averaged_record import averaged_record, tacho_in_blocks
from sigdb.recording.blocks.recording_blocks import RecordingBlocks
from sigdb.recording.evidence.presence import NoMeshError, mesh_presence
from sigdb.recording.lines import average_noise, record_spectrum, spectral_lines
from sigdb.recording.notes import average_note, channel_notes, presence_note, range_notes
from sigdb.recording.orders import AveragedGear, averaged_gear
from sigdb.recording.settings import AveragingOptions, AveragingSettings
from sigdb.recording.shaft_angle import ShaftAngle, mesh_angle
from sigdb.recording.signature import RecordedSignature
from sigdb.recording.tacho.rig_fit import check_mesh_in_range, fit_to_rig
from sigdb.recording.tacho.tacho_angle import tacho_angle
from sigdb.signature import indicators, order_spectrum
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

_UNKNOWN_RPM = (300.0, 6000.0)
"""Range in which an unknown speed is searched, rev/min."""
_NEAR_STATED, _NEAR_RATED = 0.05, 0.2
"""Relative half-widths of the range about a stated speed, and about the rig's operating point."""
_SHOWN_MESH_ORDERS = 4.5
"""Highest order of the record's spectrum, in mesh orders."""


def recorded_signature(
    recording: "Recording | RecordingBlocks",
    settings: AveragingSettings | None = None,
    *,
    rig: Transmission | None = None,
    **options: Unpack[AveragingOptions],
) -> RecordedSignature:
    """Compute the signature of a recording, from its tacho or, without a tacho, from the phase of the mesh.

    Parameters
    ----------
    recording : Recording or RecordingBlocks
        From :func:`sigdb.read_recording`, or from :func:`sigdb.recording.read_in_blocks` if it is larger than memory.
    settings : AveragingSettings, optional
        Settings of the average; the defaults if left out.
    rig : Transmission, optional
        The rig. It names the orders and gives the tooth cycle.
    **options
        Fields of :class:`AveragingSettings`, which win over ``settings``: ``channel``, ``teeth``, ``gear``,
        ``mesh_phase``, ``harmonic``, ``speed_rpm``, ``speed_range_rpm``, ``samples_per_tooth`` and ``revolutions``.
        Without a speed, the phase of the mesh is searched near the recording's speed, within 20 % of the rig's, or
        from 300 to 6000 rpm.

    Returns
    -------
    RecordedSignature
        The synchronous average with its spectra, lines, indicators and notes.

    Raises
    ------
    InputError
        If channel, gear or tooth count is missing or unknown, if there is no tacho and ``mesh_phase`` is not set, or if
        the recording holds no such speed or too few revolutions.
    NoMeshError
        If the phase of the mesh cannot be followed, since no mesh of that gear stands out of the recording.

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
    base = {} if settings is None else settings.model_dump(exclude_unset=True)
    settings = validated(AveragingSettings, base | dict(options), owner="recorded_signature")
    source, recording = recording, recording.whole if isinstance(recording, RecordingBlocks) else recording
    gear = averaged_gear(_teeth(recording, settings), rig, settings.gear)
    signal = _signal(recording, settings.channel)
    fs, n = signal.sampling_rate, gear.teeth * settings.samples_per_tooth
    with _mesh_followed(recording, gear.teeth, settings.mesh_phase):
        angle = _angle(recording, signal, gear, settings, rig, source)
        available = angle.revolutions((len(signal.samples) - 1) / fs)
        wanted = _revolutions(available, gear.cycle, settings.revolutions)
        record = averaged_record(source, signal, angle, samples_per_rev=n, available=available, revolutions=wanted)
    average, x = record.average, record.over_angle
    M = average.revolutions
    speed = _mean_speed(angle, M)
    check_mesh_in_range(signal, recording.source, teeth=gear.teeth, speed_rpm=speed)
    highest = fs / 2 / (speed / 60)
    spectrum = record_spectrum(x, samples_per_rev=n, highest=min(highest, _SHOWN_MESH_ORDERS * gear.teeth))
    scatter = float(np.sqrt(np.mean(average.scatter**2)))
    order, c = order_spectrum(average.tsa)
    presence = mesh_presence(
        x,
        samples_per_rev=n,
        teeth=gear.teeth,
        highest=highest,
        others=gear.others,
        mates=gear.mates,
        mesh_phase=settings.mesh_phase,
    )
    values = indicators(average.tsa, teeth=gear.teeth) if presence.present else {}
    return RecordedSignature(
        source=recording.source,
        channel=signal.name,
        unit=signal.unit,
        gear=gear.name,
        shaft=gear.shaft,
        teeth=gear.teeth,
        angle=angle.source,
        absolute=angle.absolute,
        tsa=average.tsa,
        scatter=scatter,
        noise=average_noise(x, samples_per_rev=n, scatter=scatter, highest=highest, averages=M),
        averages=M,
        dropped=available - M,
        cycle=gear.cycle,
        speed_rpm=speed,
        speed_track=angle.speed_track(),
        kept=record.kept,
        presence=presence,
        highest_order=highest,
        order_spectrum=pd.DataFrame({"order": order, "amplitude": np.abs(c)}),
        record_spectrum=pd.DataFrame({name: getattr(spectrum, name) for name in ("order", "amplitude", "level")}),
        lines=spectral_lines(spectrum, gear.orders, teeth=gear.teeth),
        indicators={name: float(value) for name, value in values.items()},
        notes=(
            *recording.notes,
            *channel_notes(recording, signal),
            *angle.notes,
            average_note(gear, M, available),
            presence_note(presence, record.kept),
            *range_notes(gear.teeth, highest, settings.samples_per_tooth),
        ),
    )


def _teeth(recording: "Recording", settings: AveragingSettings) -> int | None:
    """Return the tooth count of the settings, or the recording's where the settings name no gear either."""
    return recording.teeth if settings.teeth is None and settings.gear is None else settings.teeth


def _signal(recording: "Recording", name: str | None) -> "Channel":
    if name is not None:
        return recording.channel(name)
    if not recording.signals:
        raise InputError(f"{recording.source}: no channel besides the tacho; a signature needs a signal")
    return recording.signals[0]


def _angle(
    recording: "Recording",
    signal: "Channel",
    gear: AveragedGear,
    settings: AveragingSettings,
    rig: Transmission | None,
    source: "Recording | RecordingBlocks",
) -> ShaftAngle:
    """Return the angle of the averaged shaft, from the tacho or from the phase of the mesh."""
    waveform = None
    if isinstance(source, RecordingBlocks):
        if settings.mesh_phase:
            raise InputError(
                f"{recording.source}: the phase of the mesh needs the whole recording, which is read in blocks; give a "
                "tacho, or cut the recording"
            )
        waveform = tacho_in_blocks(source)
    if not settings.mesh_phase:
        return fit_to_rig(
            tacho_angle(recording, signal, waveform=waveform), recording, gear, rig=rig, stated_rpm=settings.speed_rpm
        )
    near = _range(recording, gear, settings)
    return mesh_angle(recording, signal, teeth=gear.teeth, range_rpm=near, harmonic=settings.harmonic)


@contextmanager
def _mesh_followed(recording: "Recording", teeth: int, mesh_phase: bool) -> Iterator[None]:
    """Refuse a record whose mesh has no phase that can be followed, as one without the mesh."""
    try:
        yield
    except NotApplicableError as error:
        if not mesh_phase:
            raise
        why = str(error).removeprefix(f"{recording.source}: ")
        text = f"{recording.source}: no mesh of {teeth} teeth stands out of this recording: {why}"
        raise NoMeshError(text) from error


def _range(recording: "Recording", gear: AveragedGear, settings: AveragingSettings) -> tuple[float, float]:
    """Return the range in which the speed of the shaft is searched, rev/min."""
    if settings.speed_rpm is None and settings.speed_range_rpm is not None:
        return settings.speed_range_rpm
    stated = recording.speed_rpm if settings.speed_rpm is None else settings.speed_rpm
    if stated is not None:
        return stated * (1 - _NEAR_STATED), stated * (1 + _NEAR_STATED)
    if gear.speed_rpm is not None:
        return gear.speed_rpm * (1 - _NEAR_RATED), gear.speed_rpm * (1 + _NEAR_RATED)
    return _UNKNOWN_RPM


def _revolutions(available: int, cycle: int | None, requested: int | None) -> int | None:
    """Return the requested revolutions, or whole tooth cycles if one fits in; None for all revolutions."""
    if requested is not None:
        return requested
    return available // cycle * cycle or None if cycle else None


def _mean_speed(angle: ShaftAngle, revolutions: int) -> float:
    """Return the speed of the averaged shaft from the first pulse to the end of the average, rev/min."""
    last = revolutions * angle.pulses_per_rev / angle.ratio
    ends = np.interp([0.0, last], np.arange(len(angle.pulses)), angle.pulses)
    return float(60 * revolutions / (ends[1] - ends[0]))
