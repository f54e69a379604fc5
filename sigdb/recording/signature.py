"""The signature of a recording, with its conversions to a row for estimators, to plain values and to other units."""

from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from sigdb.core import FloatArray, InputError, Note, plain
from sigdb.recording.evidence.presence import MeshPresence
from sigdb.recording.evidence.repeatability import Repeatability
from sigdb.recording.first_look.envelope_spectrum import EnvelopeSpectrum
from sigdb.recording.first_look.order_map import OrderMap
from sigdb.signature import FEATURES, features


@dataclass(frozen=True, kw_only=True)
class RecordedSignature:
    """The signature of a recording: the average over a revolution of a shaft, and quantities derived from it.

    Attributes
    ----------
    source, channel, unit
        The recording, the channel, and the unit of its samples ("" if it is unknown).
    gear, shaft
        Names of the averaged gear and its shaft in the rig; None without a rig.
    teeth
        Tooth count Z of the gear.
    angle
        Source of the shaft's angle, in words.
    absolute
        Whether tooth 1 is the first after the tacho's mark, as in the rig's conventions. Otherwise it is the tooth that
        passes at the first pulse of this recording.
    tsa
        (n,) synchronous average over ``averages`` revolutions.
    scatter
        Standard deviation between the revolutions, as an rms over the angle: the database's column of that name. It
        contains everything that does not repeat every revolution, also other shafts.
    noise
        (n / 2 + 1,) standard deviation of white noise with the density of the average's noise at each order, estimated
        between the lines of the record; nan for a single revolution.
    groups
        (G, n) averages of up to 24 groups of consecutive revolutions, whole tooth cycles where ten such groups fit.
    averages, dropped
        Revolutions in the average, and the other revolutions of the recording.
    cycle
        Revolutions of a tooth cycle; None without a rig.
    speed_rpm
        Mean speed of the shaft over the average.
    speed_track
        ``time`` (s) and ``speed_rpm`` of each revolution.
    kept
        Standard deviation of the average over that of the record: the part of its rms that repeats every revolution.
    presence
        Whether the gear is to be seen in the record, with a probability and its statistics.
    highest_order
        The record's Nyquist frequency, in orders, at the mean speed. The average is zero above it.
    order_spectrum
        ``order`` and ``amplitude`` (peak) of the average: the database's column ``spectrum``.
    record_spectrum
        ``order``, ``amplitude`` and ``level`` of the record over the angle, also between whole orders.
    lines
        Named orders, and unnamed lines between whole orders: ``name``, ``kind``, ``order``, ``amplitude`` (peak),
        ``over_level`` (amplitude over the level about it), ``stands_out`` (whether the line stands out of the level).
    indicators
        Values of :data:`sigdb.signature.INDICATORS` by name; empty where the gear is not present.
    intervals
        ``indicator``, ``low``, ``high``: 95 % intervals of the indicators from the revolutions; empty where the gear is
        not present, nan for fewer than ten groups of revolutions.
    envelope
        Spectrum of the envelope in a band of orders, with the orders of shafts and bearings.
    shafts
        ``shaft``, ``order``, ``lines``, ``p_value``: whether something that no tooth of the averaged gear does repeats
        with the turn of each other shaft, by the envelope.
    order_map
        Amplitude by order and speed of a run-up or coast-down; None where the speed changes by less than 10 %.
    notes
        Notes on the reading, the angle and the average, in this order.
    repeatability
        Whether one event stands at one place of the gear's turn, without a healthy recording; None where the signature
        was not computed from the revolutions of a recording.
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
    noise: FloatArray
    groups: FloatArray
    averages: int
    dropped: int
    cycle: int | None
    speed_rpm: float
    speed_track: pd.DataFrame
    kept: float
    presence: MeshPresence
    highest_order: float
    order_spectrum: pd.DataFrame
    record_spectrum: pd.DataFrame
    lines: pd.DataFrame
    indicators: dict[str, float]
    intervals: pd.DataFrame
    envelope: EnvelopeSpectrum
    shafts: pd.DataFrame
    order_map: OrderMap | None
    notes: tuple[Note, ...]
    repeatability: Repeatability | None = None

    def row(self, *, torque: float, speed_rpm: float | None = None) -> pd.DataFrame:
        """Return a row with the columns that estimators read, as in a database.

        Parameters
        ----------
        torque : float
            Torque at the rig's operating point, N m.
        speed_rpm : float, optional
            Speed of the rig's drive shaft, as in a database's column; by default that of the averaged shaft.

        Returns
        -------
        pandas.DataFrame
            ``teeth``, ``speed_rpm``, ``torque``, ``averages``, ``scatter``, ``tsa``, and the columns of
            :data:`sigdb.signature.FEATURES`.

        Raises
        ------
        InputError
            If the gear is not present: features of noise are none of the gear.
        """
        if not self.presence.present:
            raise InputError(f"{self.source}: {self.presence.reason}, so it has no features of the gear")
        values = features(self.tsa, teeth=self.teeth)
        return pd.DataFrame(
            {
                "teeth": [self.teeth],
                "speed_rpm": [self.speed_rpm if speed_rpm is None else float(speed_rpm)],
                "torque": [float(torque)],
                "averages": [self.averages],
                "scatter": [self.scatter],
                "tsa": [self.tsa],
                **{name: [values[name].ravel() if FEATURES[name].axes else float(values[name])] for name in FEATURES},
            }
        )

    def as_json(self) -> dict[str, Any]:
        """Return all attributes as plain values for JSON.

        Returns
        -------
        dict
            Attributes by name. Tables are columns by name, notes have ``code``, ``text`` and ``values``, and None
            stands for a number that is unknown. ``envelope`` is split: its table is ``envelope_spectrum``.
            ``order_map`` holds the mesh harmonics only. ``groups`` is left out.
        """
        apart = ("envelope", "order_map", "groups")
        values = {name: _plain(value) for name, value in vars(self).items() if name not in apart}
        envelope = {name: _plain(value) for name, value in vars(self.envelope).items() if name != "spectrum"}
        return {
            **values,
            "envelope": envelope,
            "envelope_spectrum": _plain(self.envelope.spectrum),
            "order_map": _mesh_orders(self.order_map, self.teeth),
        }


def _plain(value: object) -> Any:
    return plain(value.to_dict("list") if isinstance(value, pd.DataFrame) else value)


def _mesh_orders(order_map: OrderMap | None, teeth: int) -> dict[str, Any] | None:
    """Return the amplitudes of the first mesh harmonics by speed."""
    if order_map is None:
        return None
    harmonics = [h for h in (1, 2, 3) if h * teeth <= order_map.order[-1]]
    amplitude = {f"mesh x{h}": plain(order_map.along(h * teeth)) for h in harmonics}
    return {"speed_rpm": plain(order_map.speed_rpm), "frames": plain(order_map.frames), "amplitude": amplitude}


_SI_UNITS = {
    "m/s^2": ("m/s^2", 1.0),
    "m/s2": ("m/s^2", 1.0),
    "m/s²": ("m/s^2", 1.0),
    "mm/s^2": ("m/s^2", 1e-3),
    "mm/s2": ("m/s^2", 1e-3),
    "mm/s²": ("m/s^2", 1e-3),
    "g": ("m/s^2", 9.80665),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "in/s": ("m/s", 0.0254),
    "ips": ("m/s", 0.0254),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
}
"""SI unit and factor by unit; standard gravity and inch as defined."""


def in_si_unit(unit: str) -> tuple[str, float]:
    """Return the SI unit of a unit of acceleration, velocity or displacement, and the factor; others stay."""
    return _SI_UNITS.get(unit, (unit, 1.0))


def in_unit(signature: RecordedSignature, wanted: str) -> RecordedSignature:
    """Return the signature in the unit of a simulated sensor, with a note where the recording states no unit.

    Raises
    ------
    InputError
        If the unit is unknown or of another quantity.
    """
    if not signature.unit:
        note = Note(
            code="unit-assumed",
            text=f"The unit of {signature.channel} is not stated; it was taken to be {wanted}.",
            values={"channel": signature.channel, "unit": wanted},
        )
        return replace(signature, unit=wanted, notes=(*signature.notes, note))
    unit, factor = _SI_UNITS.get(signature.unit, ("", 0.0))
    if unit != wanted:
        raise InputError(
            f"{signature.source}: {signature.channel} is in {signature.unit!r}, the simulated sensor in {wanted!r}; "
            "give a healthy recording, which gives the path, or a sensor of that quantity, or the right unit"
        )
    return _scaled(signature, wanted, factor)


def in_unit_of(signature: RecordedSignature, other: RecordedSignature) -> tuple[RecordedSignature, tuple[Note, ...]]:
    """Return the signature in the unit of another, and a note if it had a different one or none.

    Raises
    ------
    InputError
        If the units are of different quantities, or one of them is unknown.
    """
    if signature.unit == other.unit:
        return signature, ()
    units = {signature.source: signature.unit or "no stated unit", other.source: other.unit or "no stated unit"}
    values = {"from": signature.unit, "to": other.unit}
    if not (signature.unit and other.unit):
        text = f"Units: {_listed(units)}. They were taken to be the same."
        return replace(signature, unit=other.unit or signature.unit), (
            Note(code="unit-assumed", text=text, values=values),
        )
    (quantity, factor), (wanted, per) = (_SI_UNITS.get(unit, (unit, 1.0)) for unit in (signature.unit, other.unit))
    if quantity != wanted:
        raise InputError(
            f"the recordings differ in their unit: {_listed(units)}; compare recordings of one quantity, or give the"
            " right unit"
        )
    text = f"Units: {_listed(units)}. The former was converted into the latter."
    return _scaled(signature, other.unit, factor / per), (Note(code="unit-converted", text=text, values=values),)


def _listed(units: dict[str, str]) -> str:
    return ", ".join(f"{unit} in {source}" for source, unit in units.items())


def _scaled(signature: RecordedSignature, unit: str, factor: float) -> RecordedSignature:
    return replace(
        signature,
        unit=unit,
        tsa=signature.tsa * factor,
        scatter=signature.scatter * factor,
        noise=signature.noise * factor,
        groups=signature.groups * factor,
    )
