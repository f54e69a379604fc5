"""From a recording to its signature: angle, synchronous average, spectrum, indicators, as a database's rows have them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.pipeline.recorded_angle import ShaftAngle, mesh_angle, tacho_angle
from sigdb.pipeline.recorded_lines import RecordSpectrum, record_spectrum, spectral_lines
from sigdb.pipeline.recorded_orders import AveragedGear, averaged_gear
from sigdb.signature import (
    SynchronousAverage,
    indicators,
    mesh_bands,
    order_spectrum,
    pooled_wigner_ville,
    synchronous_average,
)
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.measurement import Channel, Recording

_UNKNOWN_RPM = (300.0, 6000.0)
"""Where a speed is sought of which nothing is known."""
_NEAR_GIVEN, _NEAR_RATED = 0.05, 0.2
"""How far the speed may be from the one given, and from the rig's operating point."""
_SHOWN_MESH_ORDERS = 4.5
"""Highest order of the record's spectrum, in mesh orders."""


@dataclass(frozen=True, kw_only=True)
class RecordedSignature:
    """The signature of a recording: one revolution of a shaft, averaged, and what is made of it.

    Attributes
    ----------
    source, channel, unit
        The recording, the channel, and the unit of its samples ("" if it is not known).
    gear, shaft
        Names in the rig of the averaged gear and its shaft; None without a rig.
    teeth
        Its tooth count Z.
    angle
        What gave the shaft's angle, in words.
    absolute
        Whether tooth numbers are those of the rig's conventions, tooth 1 passing after the tacho's mark. Else tooth 1
        is the one that passes at the first pulse of this recording.
    tsa
        (n,) synchronous average over ``averages`` revolutions.
    scatter
        Standard deviation between the revolutions, as an rms over the angle: the database's column of that name. All
        that does not repeat every revolution is in it, other shafts too.
    averages, dropped
        Revolutions in the average, and those of the recording that are not.
    cycle
        Revolutions of a tooth cycle; None without a rig.
    speed_rpm
        Mean speed of the shaft over the average.
    speed_track
        ``time`` (s) and ``speed_rpm``, of each revolution.
    kept
        Standard deviation of the average over that of the record: the share of its rms that repeats every revolution.
    highest_order
        The record's Nyquist frequency, in orders, at the mean speed. Above it the average holds nothing.
    order_spectrum
        ``order`` and ``amplitude`` (peak) of the average: the database's column ``spectrum``.
    record_spectrum
        ``order``, ``amplitude`` and ``level`` of the record over the angle, between whole orders too.
    lines
        Named orders and the largest other lines: ``name``, ``kind``, ``order``, ``amplitude``, ``over_level``,
        ``found``.
    indicators
        :data:`sigdb.signature.INDICATORS` by name.
    notes
        What is to be known, one sentence each: the reader's first.
    """

    source: str
    channel: str
    unit: str
    gear: str | None
    shaft: str | None
    teeth: int
    angle: str
    absolute: bool
    tsa: FloatArray
    scatter: float
    averages: int
    dropped: int
    cycle: int | None
    speed_rpm: float
    speed_track: pd.DataFrame
    kept: float
    highest_order: float
    order_spectrum: pd.DataFrame
    record_spectrum: pd.DataFrame
    lines: pd.DataFrame
    indicators: dict[str, float]
    notes: tuple[str, ...]

    def row(self, *, torque: float, speed_rpm: float | None = None) -> pd.DataFrame:
        """One row with the columns that estimators read, as a database has them.

        Parameters
        ----------
        torque
            Torque at the rig's operating point, N m.
        speed_rpm
            Speed of the rig's drive shaft, which a database's column means; by default that of the averaged shaft.

        Returns
        -------
        pandas.DataFrame
            ``teeth``, ``speed_rpm``, ``torque``, ``averages``, ``scatter``, ``tsa``, ``fm4``, ``wigner_ville``.
        """
        step = len(self.tsa) // self.teeth
        cells = pooled_wigner_ville(
            self.tsa, teeth=self.teeth, bands=mesh_bands(self.teeth), lag_window=2 * step, n_bins=6 * step
        )
        return pd.DataFrame(
            {
                "teeth": [self.teeth],
                "speed_rpm": [self.speed_rpm if speed_rpm is None else float(speed_rpm)],
                "torque": [float(torque)],
                "averages": [self.averages],
                "scatter": [self.scatter],
                "tsa": [self.tsa],
                "fm4": [self.indicators["fm4"]],
                "wigner_ville": [cells.ravel() / (6 * step * step)],
            }
        )

    def as_json(self) -> dict[str, Any]:
        """Plain lists, dictionaries and numbers; None for a number that is not known."""
        tables = ("speed_track", "order_spectrum", "record_spectrum", "lines")
        plain = {name: value for name, value in vars(self).items() if name not in (*tables, "tsa", "notes")}
        plain["indicators"] = {name: _number(value) for name, value in self.indicators.items()}
        plain |= {"scatter": _number(self.scatter), "notes": list(self.notes), "tsa": self.tsa.tolist()}
        for name in tables:
            table = getattr(self, name)
            plain[name] = {column: [_number(one) for one in table[column].tolist()] for column in table}
        return plain


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
        Mesh harmonic whose phase is taken; by default the most outstanding one.

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
    >>> from sigdb.measurement import Channel, Recording
    >>> from sigdb.pipeline import recorded_signature
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
    spectrum = _spectrum(signal, angle, n, M, highest=min(highest, _SHOWN_MESH_ORDERS * known.teeth))
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
        scatter=float(np.sqrt(np.mean(average.scatter**2))),
        averages=M,
        dropped=available - M,
        cycle=known.cycle,
        speed_rpm=speed,
        speed_track=track,
        kept=float(np.std(average.tsa) / max(np.std(signal.samples), np.finfo(float).tiny)),
        highest_order=highest,
        order_spectrum=pd.DataFrame({"order": order, "amplitude": np.abs(c)}),
        record_spectrum=pd.DataFrame({name: getattr(spectrum, name) for name in ("order", "amplitude", "level")}),
        lines=spectral_lines(spectrum, known.orders),
        indicators={name: float(value) for name, value in indicators(average.tsa, teeth=known.teeth).items()},
        notes=(
            *recording.notes,
            *_channel_notes(recording, signal),
            *angle.notes,
            *_average_notes(known, M, available),
            *_range_notes(known.teeth, highest, samples_per_tooth),
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


def _spectrum(signal: "Channel", angle: ShaftAngle, n: int, M: int, *, highest: float) -> RecordSpectrum:
    """Spectrum of the record over the angle: all M revolutions taken as one long one are the record in equal steps."""
    x = synchronous_average(
        signal.samples,
        signal.sampling_rate,
        angle.pulses,
        samples_per_rev=M * n,
        pulses_per_rev=angle.pulses_per_rev * M,
        ratio=angle.ratio,
        revolutions=1,
    ).tsa
    return record_spectrum(x, samples_per_rev=n, highest=highest)


def _mean_speed(angle: ShaftAngle, revolutions: int) -> float:
    """Speed of the averaged shaft from the first pulse to the end of the average."""
    last = revolutions * angle.pulses_per_rev / angle.ratio
    ends = np.interp([0.0, last], np.arange(len(angle.pulses)), angle.pulses)
    return float(60 * revolutions / (ends[1] - ends[0]))


def _channel_notes(recording: "Recording", signal: "Channel") -> list[str]:
    names = [one.name for one in recording.signals]
    said = [f"channel {signal.name} of {', '.join(names)}"] if len(names) > 1 else []
    return said + ([] if signal.unit else [f"the unit of channel {signal.name} is not stated"])


def _average_notes(known: AveragedGear, M: int, available: int) -> list[str]:
    used = f"{M} of {available} whole revolutions averaged"
    if known.cycle is None:
        return [f"{used}: whole revolutions, not tooth cycles, since the mate's tooth count is not known"]
    if M % known.cycle:
        return [f"{used}: no whole number of tooth cycles of {known.cycle} revolutions, so traces of other orders stay"]
    return [f"{used}: {M // known.cycle} tooth cycles of {known.cycle} revolutions"]


def _range_notes(teeth: int, highest: float, samples_per_tooth: int) -> list[str]:
    if 2 * highest >= samples_per_tooth * teeth:
        return []
    return [
        f"the recording reaches to order {highest:.1f}, {highest / teeth:.1f} mesh orders: above it the average holds"
        f" nothing, where simulated ones of {samples_per_tooth} samples a tooth reach to {samples_per_tooth / 2:g}"
    ]


def _number(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value
