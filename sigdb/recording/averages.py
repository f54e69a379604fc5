"""Consecutive synchronous averages of one channel of a recording, with their noise, without pictures and tables."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Unpack

import numpy as np

from sigdb.core import FloatArray, InputError, Note, validated
from sigdb.recording.blocks.averaged_record import MOST_OVER_ANGLE
from sigdb.recording.blocks.shared_channels import SharedChannels
from sigdb.recording.channel_record import ChannelRecord, channel_record
from sigdb.recording.evidence.presence import MeshPresence
from sigdb.recording.first_look.indicator_intervals import revolution_groups
from sigdb.recording.lines import average_noise
from sigdb.recording.notes import average_note, channel_notes, kept_notes, presence_note, range_notes, spoilt_notes
from sigdb.recording.settings import AveragingOptions, AveragingSettings
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recording.blocks.recording_blocks import RecordingBlocks
    from sigdb.recording.recording import Recording


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedAverages:
    """Averages of consecutive revolutions of a gear's shaft by one channel of a recording.

    Attributes
    ----------
    source, channel, unit
        The recording, the channel, and the unit of its samples ("" if it is unknown).
    gear, shaft, teeth
        Names of gear and shaft in the rig, None without one, and the tooth count.
    angle, absolute
        Source of the shaft's angle in words, and whether tooth 1 is the first after the tacho's mark.
    revolutions
        Revolutions M of each average.
    begin, speed_rpm
        (A,) time of the first revolution of each average, s, and its mean speed, rev/min.
    tsa
        (A, n) the averages.
    scatter
        (A,) standard deviation between their revolutions, as an rms over the angle.
    noise
        (A, n / 2 + 1) standard deviation of white noise with the density of the average's noise at each order.
    groups
        (A, G, n) averages of up to 24 groups of consecutive revolutions of each.
    kept, highest_order
        Standard deviation of the average of all revolutions over that of the record, and its Nyquist frequency in
        orders.
    presence
        Whether the gear is to be seen in the record.
    notes
        Notes on the reading, the angle and the average.
    """

    source: str
    channel: str
    unit: str
    gear: str | None
    shaft: str | None
    teeth: int
    angle: str
    absolute: bool
    revolutions: int
    begin: FloatArray
    speed_rpm: FloatArray
    tsa: FloatArray
    scatter: FloatArray
    noise: FloatArray
    groups: FloatArray
    kept: float
    highest_order: float
    presence: MeshPresence
    notes: tuple[Note, ...]


def recorded_averages(
    recording: "Recording | RecordingBlocks",
    settings: AveragingSettings | None = None,
    *,
    rig: Transmission | None = None,
    averages: int | None = None,
    shared: SharedChannels | None = None,
    **options: Unpack[AveragingOptions],
) -> RecordedAverages:
    """Compute the averages of consecutive revolutions of a recording.

    Parameters
    ----------
    recording : Recording or RecordingBlocks
        As in :func:`recorded_signature`.
    settings : AveragingSettings, optional
        Settings of the average; the defaults if left out.
    rig : Transmission, optional
        The rig.
    averages : int, optional
        Revolutions of each average. By default there is one average, that of :func:`recorded_signature` but for
        rounding. Averages are taken of the first 2048 revolutions. Clipped samples, spikes and drop-outs are noted
        where the reading of the file has found them.
    shared : SharedChannels, optional
        The channels of this recording that are averaged over the same gear, one call after the other: their angle and
        their resampling are then computed once.
    **options
        Fields of :class:`AveragingSettings`, which win over ``settings``.

    Returns
    -------
    RecordedAverages
        The averages, in the order of time.

    Raises
    ------
    InputError
        As :func:`recorded_signature`, and if the recording has fewer revolutions than an average.
    NoMeshError
        As :func:`recorded_signature`.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.recording import Channel, Recording, recorded_averages
    >>> fs, t = 10_000.0, np.arange(40_000) / 10_000
    >>> mesh = Channel(name="a1", samples=np.cos(2 * np.pi * 12 * 20 * t), sampling_rate=fs, unit="m/s^2")
    >>> tacho = Channel(name="tacho", samples=5.0 * (20 * t % 1 < 0.1), sampling_rate=fs, unit="V")
    >>> recording = Recording(source="example", channels=(mesh, tacho), tacho="tacho")
    >>> averages = recorded_averages(recording, teeth=12, averages=30)
    >>> averages.tsa.shape, averages.speed_rpm.round().tolist()
    ((2, 768), [1200.0, 1200.0])
    """
    base = {} if settings is None else settings.model_dump(exclude_unset=True)
    settings = validated(AveragingSettings, base | dict(options), owner="recorded_averages")
    channel = channel_record(recording, settings, rig, shared=shared or SharedChannels())
    record, gear = channel.record, channel.gear
    n, over_angle = record.samples_per_rev, record.record.over_angle
    if averages is None:
        average, M = record.record.average, record.revolutions
        pieces = [over_angle]
        tsa, scatter = average.tsa[None], np.array([np.sqrt(np.mean(average.scatter**2))])
    else:
        M = averages
        pieces = _pieces(channel, M)
        tsa = np.array([piece.reshape(-1, n).mean(axis=0) for piece in pieces])
        scatter = np.array([np.sqrt(np.mean(piece.reshape(-1, n).var(axis=0, ddof=min(1, M - 1)))) for piece in pieces])
    ends = record.times[np.arange(len(pieces) + 1) * M]
    return RecordedAverages(
        source=channel.recording.source,
        channel=channel.signal.name,
        unit=channel.signal.unit,
        gear=gear.name,
        shaft=gear.shaft,
        teeth=gear.teeth,
        angle=record.angle.source,
        absolute=record.angle.absolute,
        revolutions=M,
        begin=ends[:-1],
        speed_rpm=60 * M / np.diff(ends),
        tsa=tsa,
        scatter=scatter,
        noise=np.array(
            [
                average_noise(
                    piece,
                    samples_per_rev=n,
                    scatter=float(s),
                    highest=record.highest_order,
                    averages=M,
                    power=record.power if len(pieces) == 1 else None,
                )
                for piece, s in zip(pieces, scatter, strict=True)
            ]
        ),
        groups=np.array([revolution_groups(piece, samples_per_rev=n, cycle=gear.cycle)[0] for piece in pieces]),
        kept=record.record.kept,
        highest_order=record.highest_order,
        presence=record.presence,
        notes=(
            *channel.recording.notes,
            *channel_notes(channel.recording, channel.signal),
            *record.angle.notes,
            average_note(gear, M, record.available),
            presence_note(record.presence, record.record.kept),
            *kept_notes(record.presence, record.record.kept),
            *spoilt_notes(channel.recording, channel.signal, in_blocks=True),  # its reading has noted faults
            *range_notes(gear.teeth, record.highest_order, settings.samples_per_tooth),
        ),
    )


def _pieces(channel: ChannelRecord, revolutions: int) -> list[FloatArray]:
    """Return the record over the angle in pieces of so many revolutions; what is left at the end is dropped."""
    n, over_angle = channel.record.samples_per_rev, channel.record.record.over_angle
    present = len(over_angle) // n
    if not 1 <= revolutions <= present:
        most = (
            "" if present < MOST_OVER_ANGLE else f", the most that an average of a part of a recording has: {present}"
        )
        raise InputError(
            f"{channel.recording.source}: averages of {revolutions} revolutions need at least as many, and there are "
            f"{present}{most}; ask for fewer"
        )
    size = revolutions * n
    return [over_angle[start : start + size] for start in range(0, present // revolutions * size, size)]
