"""The averaged record of one channel of a recording: channel, gear and shaft angle by the settings of the average."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from sigdb.core import InputError, NotApplicableError
from sigdb.recording.blocks.averaged_record import tacho_in_blocks
from sigdb.recording.blocks.recording_blocks import RecordingBlocks
from sigdb.recording.blocks.shared_channels import SharedChannels
from sigdb.recording.evidence.gear_record import GearRecord, at_true_speed, gear_record
from sigdb.recording.evidence.presence import NoMeshError
from sigdb.recording.orders import AveragedGear, averaged_gear
from sigdb.recording.settings import AveragingSettings
from sigdb.recording.shaft_angle import constant_angle, mesh_angle, mesh_speed, refuse_lost_mesh
from sigdb.recording.tacho.rig_fit import fit_to_rig
from sigdb.recording.tacho.tacho_angle import tacho_angle
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

_UNKNOWN_RPM = (300.0, 6000.0)
"""Range in which an unknown speed is searched, rev/min."""
_NEAR_STATED, _NEAR_RATED = 0.05, 0.2
"""Relative half-widths of the range about a stated speed, and about the rig's operating point."""

_GREATEST = 1e60
"""Greatest sample: sums of fourth powers stay below the greatest float."""


class _Average(TypedDict):
    """Length of an average."""

    samples_per_tooth: int
    revolutions: int | None
    shared: SharedChannels | None


@dataclass(frozen=True, kw_only=True, eq=False)
class ChannelRecord:
    """A channel of a recording, averaged over the revolutions of a gear's shaft.

    Attributes
    ----------
    recording
        The recording, with the samples that its angle needs.
    signal
        The channel.
    gear
        The averaged gear.
    record
        Average, record over the angle, and presence of the gear.
    """

    recording: "Recording"
    signal: "Channel"
    gear: AveragedGear
    record: GearRecord


def channel_record(
    recording: "Recording | RecordingBlocks",
    settings: AveragingSettings,
    rig: Transmission | None,
    *,
    shared: SharedChannels | None = None,
) -> ChannelRecord:
    """Return the averaged record of the channel and the gear that the settings name.

    Work that other channels share is done once for all of them: ``shared``. The record is then resampled once where it
    is short enough; see :func:`sigdb.recording.blocks.averaged_record.averaged_record`.

    Raises
    ------
    InputError, NoMeshError
        As :func:`recorded_signature`.
    """
    source, recording = recording, _needed(recording, settings)
    gear = averaged_gear(_teeth(recording, settings), rig, settings.gear)
    signal = _signal(recording, settings.channel)
    record = _record(source, recording, signal, gear, settings, rig, shared=shared)
    return ChannelRecord(recording=recording, signal=signal, gear=gear, record=record)


def _needed(recording: "Recording | RecordingBlocks", settings: AveragingSettings) -> "Recording":
    """Return the recording with the samples that its angle needs at once; in blocks, the others are read later."""
    if not isinstance(recording, RecordingBlocks):
        return recording
    whole = recording.whole
    if settings.mesh_phase:
        return recording.in_memory()
    if whole.tacho is None or whole.pulse_times is not None or whole.tacho_kind == "waveform":
        return whole
    return recording.in_memory(whole.tacho)


def _teeth(recording: "Recording", settings: AveragingSettings) -> int | None:
    """Return the tooth count of the settings, or the recording's where the settings name no gear either."""
    return recording.teeth if settings.teeth is None and settings.gear is None else settings.teeth


def _signal(recording: "Recording", name: str | None) -> "Channel":
    if name is not None:
        return recording.channel(name)
    if not recording.signals:
        raise InputError(f"{recording.source}: no channel besides the tacho; a signature needs a signal")
    constant = {str(note.values.get("channel")) for note in recording.notes if note.code == "constant-channel"}
    return next((signal for signal in recording.signals if signal.name not in constant), recording.signals[0])


def _record(
    source: "Recording | RecordingBlocks",
    recording: "Recording",
    signal: "Channel",
    gear: AveragedGear,
    settings: AveragingSettings,
    rig: Transmission | None,
    *,
    shared: SharedChannels | None,
) -> GearRecord:
    """Return the averaged record, by the angle from the tacho or from the phase of the mesh."""
    most = max(float(signal.samples.max()), -float(signal.samples.min()))  # nan where they are read in blocks
    if most > _GREATEST:
        raise InputError(
            f"{recording.source}: channel {signal.name} has a sample of {most:g}; give it in a unit in which it is "
            f"below {_GREATEST:g}"
        )
    average: _Average = {
        "samples_per_tooth": settings.samples_per_tooth,
        "revolutions": settings.revolutions,
        "shared": shared,
    }
    common = shared or SharedChannels()
    if settings.constant_speed:
        if settings.mesh_phase:
            raise InputError("constant_speed and mesh_phase are both set; the angle is taken from one of them")
        angle = constant_angle(recording, signal, speed_rpm=settings.speed_rpm)
        return gear_record(source, signal, angle, gear, mesh_phase=False, **average)
    if not settings.mesh_phase:
        waveform = tacho_in_blocks(source) if isinstance(source, RecordingBlocks) else None
        place = ("tacho", signal.start, signal.duration)
        angle = common.value(place, lambda: tacho_angle(recording, signal, waveform=waveform))
        angle = fit_to_rig(angle, recording, gear, rig=rig, stated_rpm=settings.speed_rpm)
        return gear_record(source, signal, angle, gear, mesh_phase=False, **average)
    near = _range(recording, gear, settings)

    with _mesh_followed(recording, gear.teeth):
        track = common.value(
            ("speed", signal.sampling_rate, signal.samples.size, gear.teeth, near),
            lambda: mesh_speed(recording, signal, teeth=gear.teeth, range_rpm=near),
        )
        angle = mesh_angle(recording, signal, teeth=gear.teeth, range_rpm=near, track=track, harmonic=settings.harmonic)
        record = gear_record(recording, signal, angle, gear, mesh_phase=True, **average)
        record = at_true_speed(recording, record, gear, range_rpm=near, **average)
        if not record.presence.present:
            refuse_lost_mesh(recording.source, angle, track, range_rpm=near)
        return record


@contextmanager
def _mesh_followed(recording: "Recording", teeth: int) -> Iterator[None]:
    """Refuse a record whose mesh has no phase that can be followed, as one without the mesh."""
    try:
        yield
    except NotApplicableError as error:
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
