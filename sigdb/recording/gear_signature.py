"""Computation of the signature of a gear from a recording: angle, synchronous average, spectra, indicators."""

from typing import TYPE_CHECKING, Unpack

import numpy as np
import pandas as pd

from sigdb.core import NotApplicableError, validated
from sigdb.recording.blocks.recording_blocks import RecordingBlocks
from sigdb.recording.channel_record import channel_record
from sigdb.recording.evidence.gear_record import GearRecord
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
from sigdb.recording.orders import AveragedGear
from sigdb.recording.settings import AveragingOptions, AveragingSettings
from sigdb.recording.signature import RecordedSignature
from sigdb.signature import indicators, order_spectrum
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recording.recording import Recording

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
    source, channel = recording, channel_record(recording, settings, rig)
    recording, signal, gear, result = channel.recording, channel.signal, channel.gear, channel.record
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
        noise=average_noise(x, samples_per_rev=n, scatter=scatter, highest=highest, averages=M, power=result.power),
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
