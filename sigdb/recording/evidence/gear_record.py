"""The averaged record of a gear, and the search for the speed at which the gear is present."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, NotApplicableError, Note
from sigdb.recording.blocks.averaged_record import AveragedRecord, averaged_record
from sigdb.recording.blocks.shared_channels import SharedChannels
from sigdb.recording.evidence.order_combs import ALARM
from sigdb.recording.evidence.presence import MeshPresence, mesh_presence
from sigdb.recording.lines import fast_revolutions, hann_power
from sigdb.recording.orders import AveragedGear
from sigdb.recording.shaft_angle import ShaftAngle, mesh_angle_at
from sigdb.recording.speed import HARMONICS
from sigdb.recording.tacho.rig_fit import check_mesh_in_range

if TYPE_CHECKING:
    from sigdb.recording.blocks.recording_blocks import RecordingBlocks
    from sigdb.recording.recording import Channel, Recording


@dataclass(frozen=True, kw_only=True, eq=False)
class GearRecord:
    """A channel averaged over the revolutions of a gear's shaft, and whether the gear is to be seen.

    Attributes
    ----------
    signal, angle
        The channel, and the angle of the averaged shaft.
    record
        Average over M revolutions, and the record over the angle.
    times
        (M + 1,) times at which the revolutions begin and end, s.
    available
        Whole revolutions of the recording.
    presence
        Whether the gear is to be seen.
    power
        :func:`sigdb.recording.lines.hann_power` of the first revolutions of the record over the angle.
    """

    signal: "Channel"
    angle: ShaftAngle
    record: AveragedRecord
    times: FloatArray
    available: int
    presence: MeshPresence
    power: FloatArray

    @property
    def revolutions(self) -> int:
        """Revolutions M of the average."""
        return self.record.average.revolutions

    @property
    def samples_per_rev(self) -> int:
        """Samples n of a revolution."""
        return len(self.record.average.tsa)

    @property
    def speed_rpm(self) -> float:
        """Mean speed of the shaft over the average, rev/min."""
        return float(60 * self.revolutions / (self.times[-1] - self.times[0]))

    @property
    def highest_order(self) -> float:
        """Half the sampling rate, in orders, at the mean speed."""
        return self.signal.sampling_rate / 2 / (self.speed_rpm / 60)

    @property
    def lowest_nyquist_order(self) -> float:
        """Half the sampling rate, in orders, at the greatest speed."""
        return self.signal.sampling_rate / 2 * float(np.diff(self.times).min())


def gear_record(
    recording: "Recording | RecordingBlocks",
    signal: "Channel",
    angle: ShaftAngle,
    gear: AveragedGear,
    *,
    samples_per_tooth: int,
    revolutions: int | None,
    mesh_phase: bool,
    shared: SharedChannels | None = None,
) -> GearRecord:
    """Return the average of a channel over the revolutions of a shaft, or over whole tooth cycles if one fits in.

    Parameters
    ----------
    recording
        The recording of the channel, or its blocks.
    signal, angle, gear
        Channel, angle of the shaft, gear on it.
    samples_per_tooth
        Samples of the average in a tooth pass.
    revolutions
        Revolutions to average; None for as many whole tooth cycles as there are.
    mesh_phase
        Whether the angle was taken from the phase of the mesh.
    shared
        Channels that are averaged one after the other; see :func:`averaged_record`.

    Raises
    ------
    InputError
        If there are too few revolutions, or the mesh lies above half the sampling rate.
    """
    fs, n = signal.sampling_rate, gear.teeth * samples_per_tooth
    available = angle.revolutions((len(signal.samples) - 1) / fs)
    if revolutions is None and gear.cycle:
        revolutions = available // gear.cycle * gear.cycle or None
    record = averaged_record(
        recording,
        signal,
        angle,
        samples_per_rev=n,
        available=available,
        revolutions=revolutions,
        shared=shared,
        alone=mesh_phase,
    )
    M = record.average.revolutions
    places = np.arange(M + 1) * angle.pulses_per_rev / angle.ratio
    times = np.interp(places, np.arange(len(angle.pulses)), angle.pulses)
    speed_rpm = float(60 * M / (times[-1] - times[0]))
    check_mesh_in_range(signal, recording.source, teeth=gear.teeth, speed_rpm=speed_rpm)
    over_angle = record.over_angle[: fast_revolutions(len(record.over_angle) // n) * n]
    power = hann_power(over_angle)
    presence = mesh_presence(
        over_angle,
        samples_per_rev=n,
        teeth=gear.teeth,
        highest=fs / 2 / (speed_rpm / 60),
        others=gear.others,
        mates=gear.mates,
        mesh_phase=mesh_phase,
        power=power,
    )
    return GearRecord(
        signal=signal,
        angle=angle,
        record=record,
        times=times,
        available=available,
        presence=replace(presence, kept_by_noise=1 / math.sqrt(M)),
        power=power,
    )


def sideband_speeds(teeth: int) -> list[float]:
    """Return the speeds, relative to the apparent one, if the search took sidebands for mesh harmonics.

    A sideband of order ``h Z + s`` that passed for order h Z gives a speed that is ``(h Z + s) / (h Z)`` times too
    high; h = 1, 2, 3, and s from -h to h.
    """
    parts = {Fraction(s, h) for h in range(1, HARMONICS + 1) for s in range(-h, h + 1) if s}
    return [teeth / (teeth + float(part)) for part in sorted(parts, key=abs)]


def at_true_speed(
    recording: "Recording | RecordingBlocks",
    record: GearRecord,
    gear: AveragedGear,
    *,
    range_rpm: tuple[float, float],
    samples_per_tooth: int,
    revolutions: int | None,
    shared: SharedChannels | None = None,
) -> GearRecord:
    """Return the record at the speed at which the gear is present, if the phase followed a sideband; else unchanged.

    The speed is searched by lines that stand out, and a sideband may stand out as much as the mesh. At a wrong speed
    nothing repeats once a revolution (:func:`mesh_presence`). One of K other speeds must show the gear, with p at most
    0.001 / K.
    """
    if record.presence.present:
        return record
    speeds = [s for s in sideband_speeds(gear.teeth) if _within(s * record.speed_rpm, range_rpm)]
    others = _present(record, gear, speeds, recording, samples_per_tooth, revolutions, shared)
    within = (other for other in others if _within(other.speed_rpm, range_rpm))
    return min(within, key=lambda other: other.presence.p_value, default=record)


def _within(speed_rpm: float, range_rpm: tuple[float, float]) -> bool:
    return range_rpm[0] <= speed_rpm <= range_rpm[1]


def _present(
    record: GearRecord,
    gear: AveragedGear,
    speeds: Sequence[float],
    recording: "Recording | RecordingBlocks",
    samples_per_tooth: int,
    revolutions: int | None,
    shared: SharedChannels | None,
) -> Iterator[GearRecord]:
    for speed in speeds:
        try:
            angle = mesh_angle_at(record.angle, record.signal, teeth=gear.teeth, relative=speed)
            other = gear_record(
                recording,
                record.signal,
                angle,
                gear,
                samples_per_tooth=samples_per_tooth,
                revolutions=revolutions,
                mesh_phase=True,
                shared=shared,
            )
        except NotApplicableError:
            continue
        if other.presence.present and other.presence.p_value <= ALARM / len(speeds):
            yield _with_note(other, record.speed_rpm)


def _with_note(record: GearRecord, apparent_rpm: float) -> GearRecord:
    text = (
        f"at {apparent_rpm:.1f} rpm, the likeliest speed by the spectrum, nothing repeats once a revolution: a sideband"
        f" passed for the mesh there; the gear is present at {record.speed_rpm:.1f} rpm, which was taken"
    )
    values = {"apparent_rpm": apparent_rpm, "speed_rpm": record.speed_rpm}
    note = Note(code="speed-by-repetition", text=text, values=values)
    return replace(record, angle=replace(record.angle, notes=(*record.angle.notes, note)))
