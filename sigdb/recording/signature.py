"""The signature of a recording, and how it is handed on: as a row for estimators, as plain numbers."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError
from sigdb.signature import FEATURES, features


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
    noise
        (n / 2 + 1,) standard deviation that white noise of the density of the average's at each order has: from what
        the record holds between its lines; nan with one revolution.
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
        Named orders, and lines between whole orders that nothing named explains: ``name``, ``kind``, ``order``,
        ``amplitude`` (peak), ``over_level`` (amplitude over the level about it), ``found`` (stands out of it).
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
    noise: FloatArray
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
            ``teeth``, ``speed_rpm``, ``torque``, ``averages``, ``scatter``, ``tsa``, and the columns of
            :data:`sigdb.signature.FEATURES`.
        """
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
        """All of it by name as plain lists, dictionaries and numbers, tables as columns; None for what is not known."""
        return {name: _plain(value) for name, value in vars(self).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, pd.DataFrame):
        return {str(column): _plain(value[column].to_numpy()) for column in value}
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


_KNOWN = {
    "m/s^2": ("m/s^2", 1.0),
    "m/s2": ("m/s^2", 1.0),
    "m/s²": ("m/s^2", 1.0),
    "g": ("m/s^2", 9.80665),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "in/s": ("m/s", 0.0254),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
}
"""SI unit and factor of units; standard gravity and inch as defined."""


def in_unit(signature: RecordedSignature, wanted: str) -> RecordedSignature:
    """The signature in the unit of a simulated sensor; a note where the recording's is not stated.

    Raises
    ------
    InputError
        If it is another quantity or not a known unit.
    """
    if not signature.unit:
        note = f"The unit of {signature.channel} is not stated; it was taken to be {wanted}."
        return replace(signature, unit=wanted, notes=(*signature.notes, note))
    unit, factor = _KNOWN.get(signature.unit, ("", 0.0))
    if unit != wanted:
        raise InputError(
            f"{signature.source}: {signature.channel} is in {signature.unit!r}, the simulated sensor in {wanted!r}; "
            "give a healthy recording, which tells the path, or a sensor of that quantity, or the right unit"
        )
    return replace(
        signature,
        unit=wanted,
        tsa=signature.tsa * factor,
        scatter=signature.scatter * factor,
        noise=signature.noise * factor,
    )
