"""The range that a model was trained in, and the reasons why rows are outside of it."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray
from sigdb.database import Database
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.templates.bank import TemplateBank

Interval: TypeAlias = tuple[float, float]
"""Least and greatest value."""

Check: TypeAlias = tuple[BoolArray, Callable[[int], str]]
"""Whether rows are outside, and the words on a row that is."""

NEAR = {"speed_rpm": 0.02, "torque": 0.05}
"""Relative distances from a speed and from a torque of training that count as seen."""

WITHIN = {"averages": 2.0, "noise": 2.0, "level": 2.0}
"""Factors by which numbers of revolutions, noise and level may leave the range of training."""

_SURE = 4.0
"""Standard errors by which a level must leave its range; an average in much noise hardly shows its level."""

_LEAST_SAMPLES = 32
"""Samples a tooth of the coarsest database: rows without averages do not state theirs."""

_CLEAR = 0.25
"""Greatest standard error of a squared level, relative to it, from which the range is taken."""


@dataclass(frozen=True, kw_only=True)
class TrainedRange:
    """The range of the rows that a model was trained on. None stands for what is not known of an older model.

    Attributes
    ----------
    speed_rpm, torque
        Intervals of the operating points, rpm and N m. Neighbours that are closer than twice ``NEAR`` share one.
    averages
        Least and greatest number of revolutions of an average.
    noise
        Least and greatest noise of an average, in ``unit``: ``scatter / sqrt(averages)``, or that of white noise in
        which damage stands out as much.
    level
        Least and greatest root mean square of an average without its noise, in ``unit``.
    samples_per_tooth
        Samples of an average in a tooth pass.
    unit
        Unit of the signal.
    """

    speed_rpm: tuple[Interval, ...]
    torque: tuple[Interval, ...]
    samples_per_tooth: int
    averages: Interval | None = None
    noise: Interval | None = None
    level: Interval | None = None
    unit: str | None = None

    @classmethod
    def of_rows(cls, database: Database, rows: pd.DataFrame, noise: FloatArray | None = None) -> Self:
        """Return the range of rows of a database, by id; parameters as of :meth:`reasons`."""
        batch = Batch(table=_with_rms(database, rows))
        square, error = _squared_level(batch)
        return cls(
            speed_rpm=intervals(rows["speed_rpm"], NEAR["speed_rpm"]),
            torque=intervals(rows["torque"], NEAR["torque"]),
            samples_per_tooth=int(database.manifest.resolved["signature"]["samples_per_tooth"]),
            averages=_ends(rows["averages"]),
            noise=_ends(batch.noise() if noise is None else noise),
            level=_ends(np.sqrt(square[error < _CLEAR * square])),
            unit=(database.dataset("features").schema.field("scatter").metadata or {}).get(b"unit", b"").decode(),
        )

    @classmethod
    def of_bank(cls, bank: TemplateBank, averages: ArrayLike) -> Self:
        """Return the range that the templates of a bank cover, with numbers of revolutions of some rows."""
        level = np.sqrt(np.concatenate([point.reference_variance for point in bank.points]))
        return cls(
            speed_rpm=intervals([point.speed_rpm for point in bank.points], NEAR["speed_rpm"]),
            torque=intervals([point.torque for point in bank.points], NEAR["torque"]),
            samples_per_tooth=bank.points[0].samples // bank.points[0].teeth,
            averages=_ends(averages),
            level=_ends(level),
        )

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Self:
        """Return the range that ``model.json`` holds."""
        values = {field.name: content[field.name] for field in fields(cls)}
        for name in NEAR:
            values[name] = tuple((float(low), float(high)) for low, high in values[name])
        for name in WITHIN:
            values[name] = None if values[name] is None else (float(values[name][0]), float(values[name][1]))
        return cls(**values)

    def reasons(self, batch: Batch, noise: FloatArray | None = None) -> list[str]:
        """Return the reason why each row is outside the range, in words; empty for a row inside it.

        Parameters
        ----------
        batch
            The rows.
        noise
            (rows,) noise of their averages, in ``unit``, where it is not ``scatter / sqrt(averages)``.
        """
        reasons = [""] * len(batch)
        for outside, text in self._checks(batch, batch.noise() if noise is None else noise):
            for i in np.flatnonzero(outside):
                reasons[i] = reasons[i] or text(int(i))
        return reasons

    def row_reasons(self, database: Database, rows: pd.DataFrame) -> list[str]:
        """Return the reason why each row of a database, by id, is outside the range; empty for a row inside it."""
        return self.reasons(Batch(table=_with_rms(database, rows)))

    def _checks(self, batch: Batch, noise: FloatArray) -> Iterator[Check]:
        yield from self._point_checks(batch)
        if batch.tsa is not None:
            yield self._samples_check(batch)
        unit = f" {self.unit}" if self.unit else ""
        if self.averages is not None and "averages" in batch.table:
            yield _interval_check("averages", batch.column("averages"), self.averages, WITHIN["averages"], "rev")
        if self.noise is not None:
            # Less noise than in training only makes the other checks stricter.
            text = f"was not trained on; at most {self.noise[1]:.4g}{unit} was: check the unit and the scatter"
            yield noise > WITHIN["noise"] * self.noise[1], _words("noise, scatter / sqrt(averages), =", noise, text)
        if self.level is not None:
            yield self._level_check(batch, unit)

    def _point_checks(self, batch: Batch) -> Iterator[Check]:
        for name, seen, unit in (("speed_rpm", self.speed_rpm, "rpm"), ("torque", self.torque, "N m")):
            if name in batch.table:
                values, text = batch.column(name), f"{unit} was not trained on; {_text(seen)} was"
                yield ~_is_near(values, seen, NEAR[name]), _words(f"{name} =", values, text)

    def _samples_check(self, batch: Batch) -> Check:
        samples = np.empty(len(batch))
        for teeth, at in batch.by_teeth():
            samples[at] = (batch.tsa or {})[teeth].shape[1] / teeth
        text = f"samples a tooth, and {self.samples_per_tooth} were trained on; average with as many"
        return samples != self.samples_per_tooth, _words("tsa has", samples, text)

    def _level_check(self, batch: Batch, unit: str) -> Check:
        low, high = self.level or (0.0, np.inf)
        square, error = _squared_level(batch)
        margin, factor = _SURE * error, WITHIN["level"] ** 2
        outside = (square + margin < low**2 / factor) | (square - margin > high**2 * factor)
        text = f"without its noise, was not trained on; {_text([(low, high)])}{unit} was: check the unit and the sensor"
        return outside, _words("the level of the average,", np.sqrt(square.clip(min=0)), text)


def _words(begin: str, values: FloatArray, end: str) -> Callable[[int], str]:
    return lambda i: f"{begin} {values[i]:.4g} {end}"


def _interval_check(name: str, values: FloatArray, ends: Interval, factor: float, unit: str) -> Check:
    outside = (values < ends[0] / factor) | (values > ends[1] * factor)
    return outside, _words(f"{name} =", values, f"was not trained on; {_text([ends])} {unit} was")


def _squared_level(batch: Batch) -> tuple[FloatArray, FloatArray]:
    """Return squared root mean squares of averages without their noise, and their standard errors; nan without."""
    square: FloatArray = np.full(len(batch), np.nan)
    samples: FloatArray = np.ones(len(batch))
    if batch.tsa is not None:
        for teeth, at in batch.by_teeth():
            square[at], samples[at] = np.mean(batch.tsa[teeth].astype(float) ** 2, axis=1), batch.tsa[teeth].shape[1]
    elif "rms" in batch.table:
        square = batch.column("rms") ** 2
        samples = _LEAST_SAMPLES * batch.column("teeth")
    noise = np.nan_to_num(batch.noise() ** 2)
    value = square - noise
    return value, np.sqrt((2 * noise**2 + 4 * noise * np.abs(value)) / samples)


def _with_rms(database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows by id with their root mean squares, where the database has them."""
    if "rms" not in database.dataset("features").schema.names:
        return rows
    return rows.assign(rms=database.sql("select id, rms from features").set_index("id")["rms"])


def intervals(values: ArrayLike, near: float) -> tuple[Interval, ...]:
    """Return the intervals of values whose relative distances are at most twice ``near``.

    Examples
    --------
    >>> intervals([1000.0, 1030.0, 3000.0], 0.02)
    ((1000.0, 1030.0), (3000.0, 3000.0))
    """
    sorted_values = np.unique(np.asarray(values, float))
    apart = np.diff(sorted_values) > 2 * near * np.abs(sorted_values[1:])
    parts = np.split(sorted_values, np.flatnonzero(apart) + 1)
    return tuple((float(part[0]), float(part[-1])) for part in parts)


def _is_near(values: FloatArray, seen: Iterable[Interval], near: float) -> BoolArray:
    ends = [(low - near * abs(low), high + near * abs(high)) for low, high in seen]
    return np.any([(low <= values) & (values <= high) for low, high in ends], axis=0)


def _ends(values: ArrayLike) -> Interval | None:
    finite = np.asarray(values, float)
    finite = finite[np.isfinite(finite)]
    return (float(finite.min()), float(finite.max())) if finite.size else None


def _text(seen: Iterable[Interval]) -> str:
    return ", ".join(f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}" for low, high in seen)
