"""Computation of the signature of a gear from a recording: angle, synchronous average, spectra, indicators."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypedDict, Unpack

import numpy as np
import pandas as pd

from sigdb.core import InputError, NotApplicableError, validated
from sigdb.recording.blocks.averaged_record import tacho_in_blocks
from sigdb.recording.blocks.recording_blocks import RecordingBlocks
from sigdb.recording.evidence.gear_record import GearRecord, at_true_speed, gear_record
from sigdb.recording.evidence.presence import NoMeshError
from sigdb.recording.evidence.repeatability import repeatability
from sigdb.recording.first_look.envelope_spectrum import envelope_spectrum
from sigdb.recording.first_look.indicator_intervals import indicator_intervals, revolution_groups
from sigdb.recording.first_look.order_map import OrderMap, order_map
from sigdb.recording.first_look.shaft_evidence import shaft_evidence
from sigdb.recording.lines import average_noise, record_spectrum, spectral_lines
from sigdb.recording.notes import (
    average_note,
    channel_notes,
    kept_notes,
    presence_note,
    range_notes,
    spoilt_notes,
)
from sigdb.recording.orders import AveragedGear, averaged_gear
from sigdb.recording.settings import AveragingOptions, AveragingSettings
from sigdb.recording.shaft_angle import constant_angle, mesh_angle
from sigdb.recording.signature import RecordedSignature
from sigdb.recording.tacho.rig_fit import fit_to_rig
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

_GREATEST = 1e60
"""Greatest sample: sums of fourth powers stay below the greatest float."""


class _Average(TypedDict):
    """Length of an average."""

    samples_per_tooth: int
    revolutions: int | None


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
    source, recording = recording, _needed(recording, settings)
    gear = averaged_gear(_teeth(recording, settings), rig, settings.gear)
    signal = _signal(recording, settings.channel)
    result = _record(source, recording, signal, gear, settings, rig)
    n, M, presence, highest = result.samples_per_rev, result.revolutions, result.presence, result.highest_order
    average, angle, x = result.record.average, result.angle, result.record.over_angle
    spectrum = record_spectrum(x, samples_per_rev=n, highest=min(highest, _SHOWN_MESH_ORDERS * gear.teeth))
    scatter = float(np.sqrt(np.mean(average.scatter**2)))
    order, c = order_spectrum(average.tsa)
    values = indicators(average.tsa, teeth=gear.teeth) if presence.present else {}
    envelope = envelope_spectrum(
        x,
        samples_per_rev=n,
        highest=result.lowest_nyquist_order,
        orders=(*(order for order in gear.orders if order.kind == "shaft"), *gear.bearings),
        band=settings.envelope_band,
    )
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
        groups=revolution_groups(x, samples_per_rev=n, cycle=gear.cycle)[0],
        averages=M,
        dropped=result.available - M,
        cycle=gear.cycle,
        speed_rpm=result.speed_rpm,
        speed_track=angle.speed_track(),
        kept=result.record.kept,
        presence=presence,
        repeatability=repeatability(
            x, samples_per_rev=n, teeth=gear.teeth, highest=result.lowest_nyquist_order, presence=presence
        ),
        highest_order=highest,
        order_spectrum=pd.DataFrame({"order": order, "amplitude": np.abs(c)}),
        record_spectrum=pd.DataFrame({name: getattr(spectrum, name) for name in ("order", "amplitude", "level")}),
        lines=spectral_lines(spectrum, gear.orders, teeth=gear.teeth),
        indicators={name: float(value) for name, value in values.items()},
        intervals=_intervals(result, gear),
        envelope=envelope,
        shafts=shaft_evidence(envelope, (each for each in gear.orders if each.kind == "shaft" and each.order % 1)),
        order_map=_order_map(result, gear),
        notes=(
            *recording.notes,
            *channel_notes(recording, signal),
            *angle.notes,
            average_note(gear, M, result.available),
            presence_note(presence, result.record.kept),
            *kept_notes(presence, result.record.kept),
            *(spoilt_notes(recording, signal, in_blocks=isinstance(source, RecordingBlocks)) if values else ()),
            *range_notes(gear.teeth, highest, settings.samples_per_tooth),
        ),
    )


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


def _intervals(result: GearRecord, gear: AveragedGear) -> pd.DataFrame:
    """Return the intervals of the indicators; an empty table where the gear is not present, as it has no indicators."""
    if not result.presence.present:
        return pd.DataFrame({"indicator": [], "low": [], "high": []})
    return indicator_intervals(
        result.record.over_angle,
        samples_per_rev=result.samples_per_rev,
        teeth=gear.teeth,
        averages=result.revolutions,
        cycle=gear.cycle,
    )


def _order_map(result: GearRecord, gear: AveragedGear) -> OrderMap | None:
    """Return the order map of a run-up; None where the speed changes too little."""
    x, n, times = result.record.over_angle, result.samples_per_rev, result.times
    highest = min(result.lowest_nyquist_order, _SHOWN_MESH_ORDERS * gear.teeth)
    speed = pd.DataFrame({"speed_rpm": 60 / np.diff(times[: len(x) // n + 1])})
    try:
        return order_map(x, speed, samples_per_rev=n, highest=highest)
    except NotApplicableError:
        return None


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
) -> GearRecord:
    """Return the averaged record, by the angle from the tacho or from the phase of the mesh."""
    most = max(float(signal.samples.max()), -float(signal.samples.min()))  # nan where they are read in blocks
    if most > _GREATEST:
        raise InputError(
            f"{recording.source}: channel {signal.name} has a sample of {most:g}; give it in a unit in which it is "
            f"below {_GREATEST:g}"
        )
    average: _Average = {"samples_per_tooth": settings.samples_per_tooth, "revolutions": settings.revolutions}
    if settings.constant_speed:
        if settings.mesh_phase:
            raise InputError("constant_speed and mesh_phase are both set; the angle is taken from one of them")
        angle = constant_angle(recording, signal, speed_rpm=settings.speed_rpm)
        return gear_record(source, signal, angle, gear, mesh_phase=False, **average)
    if not settings.mesh_phase:
        waveform = tacho_in_blocks(source) if isinstance(source, RecordingBlocks) else None
        angle = tacho_angle(recording, signal, waveform=waveform)
        angle = fit_to_rig(angle, recording, gear, rig=rig, stated_rpm=settings.speed_rpm)
        return gear_record(source, signal, angle, gear, mesh_phase=False, **average)
    near = _range(recording, gear, settings)

    def by_phase(*, doubtful: bool) -> GearRecord:
        angle = mesh_angle(
            recording, signal, teeth=gear.teeth, range_rpm=near, harmonic=settings.harmonic, doubtful=doubtful
        )
        return gear_record(recording, signal, angle, gear, mesh_phase=True, **average)

    with _mesh_followed(recording, gear.teeth):
        result = at_true_speed(recording, by_phase(doubtful=True), gear, range_rpm=near, **average)
        return result if result.presence.present else by_phase(doubtful=False)


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
