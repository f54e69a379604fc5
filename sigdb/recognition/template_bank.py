"""The bank of a template scorer: the laws of averages at each operating point of a database, as plain arrays."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Self

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.typing import BoolArray, FloatArray, IntArray
from sigdb.database import Database
from sigdb.recognition.likelihood import Hypotheses
from sigdb.recognition.severity import TARGETS

_ARRAYS = ("signal", "modes", "gains", "harmonic", "phases", "reference_variance")


@dataclass(frozen=True, kw_only=True, eq=False)
class PointTemplates:
    """The templates of one operating point and tooth count.

    Attributes
    ----------
    speed_rpm, torque, teeth
        The operating point, and the tooth count of the damaged gear.
    arrays
        What :class:`Hypotheses` is made of, by name, float32.
    healthy
        (templates,) whether a template is of a healthy gear.
    share
        (templates,) share of each among the rows of its kind, healthy or damaged.
    severity
        (templates, 3) stiffness loss, phase shift (deg) and number of damaged teeth; nan for a pattern.
    """

    speed_rpm: float
    torque: float
    teeth: int
    arrays: dict[str, FloatArray]
    healthy: BoolArray
    share: FloatArray
    severity: FloatArray

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def samples(self) -> int:
        """Samples of an average."""
        return int(self.arrays["signal"].shape[1])

    @cached_property
    def hypotheses(self) -> Hypotheses:
        """The laws, in double precision: their squares cancel."""
        cases = pd.DataFrame({"tooth": np.where(self.healthy, 0, 1)})
        arrays = {name: array.astype(float) for name, array in self.arrays.items()}
        return Hypotheses(teeth=self.teeth, cases=cases, **arrays)

    @cached_property
    def log_prior(self) -> FloatArray:
        """(templates, teeth): even odds of damage and none, every tooth alike."""
        with np.errstate(divide="ignore"):
            each = np.log(self.share / (2 * self.teeth))
        return np.repeat(each[:, None], self.teeth, axis=1)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class TemplateBank:
    """The templates of a database that a model carries with it.

    Attributes
    ----------
    sensor
        Whose averages they are.
    index_error
        Size of the index errors that specimens are taken to have, m.
    points
        Templates by operating point and tooth count.
    """

    sensor: str
    index_error: float
    points: tuple[PointTemplates, ...]

    def __repr__(self) -> str:
        count = sum(len(point.healthy) for point in self.points)
        return f"TemplateBank({count} templates of {self.sensor!r} at {len(self.points)} points, teeth {self.teeth})"

    @classmethod
    def of(cls, database: Database, *, sensor: str | None = None) -> Self:
        """The bank of a database.

        Each template weighs as many rows as it has; the size of the index errors is the root mean square of that of
        the rows. Templates without a result, and those with loss of contact, are left out.

        Parameters
        ----------
        database
            A database with rows, of a rig with one mesh.
        sensor
            A stored sensor; the first one if left out.

        Raises
        ------
        InputError
            If the rig does not turn exactly, rows are of a single revolution, so that their noise is not known from
            the scatter between revolutions, or an operating point has no healthy or no damaged template.
        """
        sensor = database.stored_sensor(sensor)
        rows = database.sql(
            "select template, count(*) as n, min(averages) as averages, sum(index_error ** 2) as square from cases "
            "where status = 'ok' and not coalesce(contact_loss, false) group by template"
        )
        if rows.empty:
            raise InputError(f"{database.store} has no row with a result that keeps contact; a bank is made for rows")
        if rows["averages"].min() < 2:
            raise InputError(
                f"{database.store} has averages of 1 revolution, which has no scatter between revolutions to take the "
                "noise from; set averages to 2 or more"
            )
        points = database.sql(
            "select distinct speed_rpm, torque, teeth from templates where status = 'ok' and not contact_loss "
            "order by all"
        )
        weight = rows.set_index("template")["n"]
        return cls(
            sensor=sensor,
            index_error=float(np.sqrt(rows["square"].sum() / rows["n"].sum())),
            points=tuple(
                _point(database, sensor, weight, float(speed), float(torque), int(teeth))
                for speed, torque, teeth in points.itertuples(index=False)
            ),
        )

    @property
    def teeth(self) -> tuple[int, ...]:
        """Tooth counts that it has."""
        return tuple(sorted({point.teeth for point in self.points}))

    def nearest(self, speed_rpm: FloatArray, torque: FloatArray, teeth: IntArray) -> IntArray:
        """(rows,) place of the point of the same tooth count whose speed and torque differ least, in shares of its own.

        Raises
        ------
        InputError
            If the bank has no such tooth count: averages of another one have another length and other passes.
        """
        lacking = sorted(set(np.unique(teeth).tolist()) - set(self.teeth))
        if lacking:
            raise InputError(
                f"teeth = {lacking[0]:g} is not in the bank of templates, which has {', '.join(map(str, self.teeth))}; "
                "train on a database with this tooth count"
            )
        distance = np.stack([_distance(point, speed_rpm, torque, teeth) for point in self.points], axis=1)
        return np.asarray(distance.argmin(axis=1))


def _distance(point: PointTemplates, speed_rpm: FloatArray, torque: FloatArray, teeth: IntArray) -> FloatArray:
    tiny = np.finfo(float).tiny
    relative = np.hypot(
        (speed_rpm - point.speed_rpm) / max(abs(point.speed_rpm), tiny),
        (torque - point.torque) / max(abs(point.torque), tiny),
    )
    return np.where(teeth == point.teeth, relative, np.inf)


def _point(
    database: Database, sensor: str, weight: pd.Series, speed_rpm: float, torque: float, teeth: int
) -> PointTemplates:
    laws = Hypotheses.of(database, speed_rpm=speed_rpm, torque=torque, teeth=teeth, sensor=sensor)
    rows = weight.reindex(laws.cases["template"]).fillna(0).to_numpy(float, copy=True)
    for kind, some in (("healthy", laws.healthy), ("damaged", ~laws.healthy)):
        if not some.any():
            raise InputError(
                f"{database.store} has no {kind} template that keeps contact at speed_rpm = {speed_rpm:g}, torque = "
                f"{torque:g}, teeth = {teeth}; set healthy in [sweep], or reduce the damage"
            )
        rows[some] = rows[some] / rows[some].sum() if rows[some].any() else 1 / some.sum()
    return PointTemplates(
        speed_rpm=speed_rpm,
        torque=torque,
        teeth=teeth,
        arrays={name: getattr(laws, name).astype(np.float32) for name in _ARRAYS},
        healthy=laws.healthy,
        share=rows,
        severity=laws.cases[list(TARGETS)].to_numpy(float),
    )
