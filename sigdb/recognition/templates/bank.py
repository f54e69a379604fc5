"""The bank of a template scorer: the laws of averages at each operating point of a database, as plain arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray, IntArray, NotApplicableError
from sigdb.database import MEMBER, QUANTITIES, Database, suffixed
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.templates.compact_signals import CompactSignals
from sigdb.recognition.templates.hypotheses import Hypotheses

_PRECISION = 2e-4
"""Greatest error of a stored signal, in norm, in standard deviations of the noise of the quietest average.
The log-likelihood of a template that resembles the average then changes by less than 0.01."""

_CASE = ("teeth", *QUANTITIES)


@dataclass(frozen=True, kw_only=True, eq=False)
class PointTemplates:
    """The templates of one operating point and tooth count.

    Attributes
    ----------
    speed_rpm, torque, teeth
        The operating point, and the tooth count of the damaged gear.
    signals
        (templates, 1 + modes + harmonics) signals of each template: its nominal average; its response to index
        errors, each mode as large as it is on average; its harmonic signals. See :class:`Hypotheses`.
    index_error
        Size of the index errors that the modes are for, m.
    phases
        (templates, harmonics, teeth) phases of the harmonic ones.
    reference_variance
        (templates,) variance of the healthy clean average.
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
    signals: CompactSignals
    index_error: float
    phases: FloatArray
    reference_variance: FloatArray
    healthy: BoolArray
    share: FloatArray
    severity: FloatArray

    @classmethod
    def of(
        cls,
        laws: Sequence[Hypotheses],
        shares: Sequence[FloatArray],
        *,
        points: Sequence[tuple[float, float]],
        index_error: float,
        tolerance: float = 0.0,
    ) -> list[Self]:
        """Templates of all operating points of one tooth count, stored compactly.

        Parameters
        ----------
        laws
            Hypotheses of each operating point.
        shares
            (templates,) share of each template among the rows of its kind, for each operating point.
        points
            Speed (rpm) and torque (N m) of each operating point.
        index_error
            Size of the index errors, m.
        tolerance
            Tolerance of the compact signals, see :meth:`CompactSignals.of`.
        """
        stored = CompactSignals.of([_signals(law, index_error) for law in laws], tolerance=tolerance)
        return [
            cls(
                speed_rpm=speed_rpm,
                torque=torque,
                teeth=law.teeth,
                signals=signals,
                index_error=index_error,
                phases=law.phases,
                reference_variance=law.reference_variance,
                healthy=law.healthy,
                share=share,
                severity=law.cases[list(QUANTITIES)].to_numpy(float),
            )
            for (speed_rpm, torque), law, share, signals in zip(points, laws, shares, stored, strict=True)
        ]

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def samples(self) -> int:
        """Samples of an average."""
        return self.signals.samples

    @cached_property
    def hypotheses(self) -> Hypotheses:
        """The laws, expanded."""
        expanded, h = self.signals.expanded(), self.phases.shape[1]
        signal, response, harmonic = np.split(expanded, [1, expanded.shape[1] - h], axis=1)
        modes, spread, _ = np.linalg.svd(response.transpose(0, 2, 1), full_matrices=False)
        return Hypotheses(
            teeth=self.teeth,
            cases=pd.DataFrame({"tooth": np.where(self.healthy, 0, 1)}),
            signal=signal[:, 0],
            modes=modes,
            gains=spread / self.index_error if self.index_error else spread,
            harmonic=harmonic.transpose(0, 2, 1),
            phases=self.phases,
            reference_variance=self.reference_variance,
            turn_invariant=True,
        )

    @cached_property
    def log_prior(self) -> FloatArray:
        """(templates, teeth) logarithm of the prior: even odds of damage and none, all teeth equally likely."""
        with np.errstate(divide="ignore"):
            each = np.log(self.share / (2 * self.teeth))
        return np.repeat(each[:, None], self.teeth, axis=1)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class TemplateBank:
    """The templates of a database that a model carries with it.

    Attributes
    ----------
    sensor
        Sensor of their averages.
    index_error
        Size of the index errors that specimens are assumed to have, m.
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
    def of(
        cls,
        database: Database,
        *,
        sensor: str | None = None,
        index_error: float | None = None,
        cases: pd.DataFrame | None = None,
        specimens: ArrayLike | None = None,
    ) -> Self:
        """The bank of a database.

        Each template weighs as many rows as it has. Templates without a result, and those with loss of contact, are
        left out. Signals are stored with an error, in norm, of at most 1 / 5000 of the standard deviation of the noise
        in the quietest row.

        Parameters
        ----------
        database
            A database with rows, of a rig with one mesh.
        sensor
            A stored sensor; the first one if left out.
        index_error
            Size of the index errors, m; the root mean square of that of the rows if left out.
        cases
            Only templates of these cases: tooth counts ``teeth`` and severities, as in rows of features, and
            ``rig_member`` where they have it. All if left out.
        specimens
            Only rows of these count for the weights, the size of index errors and the noise. All if left out.

        Raises
        ------
        NotApplicableError
            If the rig does not turn exactly, or an operating point has no healthy or no damaged template. Also if rows
            are of a single revolution, since there is no scatter between revolutions to take the noise from.
        InputError
            If the database has no such sensor.
        """
        sensor = database.stored_sensor(sensor)
        scatter = suffixed("scatter", database.sensors, sensor)
        seen = (
            ""
            if specimens is None
            else f" and specimen in ({', '.join(str(int(number)) for number in np.unique(specimens))})"
        )
        rows = database.sql(
            "select template, count(*) as n, min(averages) as averages, sum(index_error ** 2) as square, "
            f"min({scatter} / sqrt(averages)) as noise from features "
            f"where status = 'ok' and not coalesce(contact_loss, false){seen} group by template"
        )
        if rows.empty:
            raise NotApplicableError(
                f"{database.store} has no row with a result that keeps contact; a bank is made for rows"
            )
        if rows["averages"].min() < 2:
            raise NotApplicableError(
                f"{database.store} has averages of 1 revolution, which has no scatter between revolutions to take the "
                "noise from; set averages to 2 or more"
            )
        points = database.sql(
            "select distinct speed_rpm, torque, teeth from templates where status = 'ok' and not contact_loss "
            "order by all"
        )
        if cases is not None:
            cases = cases[[*_CASE, *({MEMBER} & {*cases.columns})]].drop_duplicates()
            points = points[points["teeth"].isin(cases["teeth"])]
        weight = rows.set_index("template")["n"]
        if index_error is None:
            index_error = float(np.sqrt(rows["square"].sum() / rows["n"].sum()))
        templates: list[PointTemplates] = []
        for teeth in sorted(set(points["teeth"].astype(int))):
            alike = points.loc[points["teeth"] == teeth, ["speed_rpm", "torque"]].to_numpy(float)
            at = [(float(speed), float(torque)) for speed, torque in alike]
            laws = [_laws(database, sensor, *point, teeth=teeth, cases=cases) for point in at]
            templates += PointTemplates.of(
                laws,
                [_share(law, weight) for law in laws],
                points=at,
                index_error=index_error,
                tolerance=_PRECISION * float(rows["noise"].min()),
            )
        return cls(sensor=sensor, index_error=index_error, points=tuple(templates))

    @property
    def teeth(self) -> tuple[int, ...]:
        """Tooth counts that it has."""
        return tuple(sorted({point.teeth for point in self.points}))

    def noise_db(self, batch: Batch) -> FloatArray:
        """Return the noise of averages relative to the healthy signal at the nearest operating point, (rows,) dB.

        nan where the noise of a row is not known.
        """
        reference = np.array([point.reference_variance.mean() for point in self.points])
        return batch.noise_db(reference[self.nearest(*batch.operating_point())])

    def nearest(self, speed_rpm: FloatArray, torque: FloatArray, teeth: FloatArray | IntArray) -> IntArray:
        """Return the index of the nearest operating point of the same tooth count, (rows,).

        Its relative differences in speed and torque are least.

        Raises
        ------
        NotApplicableError
            If the bank has no such tooth count: averages of another one have another length and other passes.
        """
        lacking = sorted(set(np.unique(teeth).tolist()) - set(self.teeth))
        if lacking:
            raise NotApplicableError(
                f"teeth = {lacking[0]:g} is not in the bank of templates, which has {', '.join(map(str, self.teeth))}; "
                "train on a database with this tooth count"
            )
        distance = np.stack([_distance(point, speed_rpm, torque, teeth) for point in self.points], axis=1)
        return np.asarray(distance.argmin(axis=1))


def _distance(
    point: PointTemplates, speed_rpm: FloatArray, torque: FloatArray, teeth: FloatArray | IntArray
) -> FloatArray:
    tiny = np.finfo(float).tiny
    relative = np.hypot(
        (speed_rpm - point.speed_rpm) / max(abs(point.speed_rpm), tiny),
        (torque - point.torque) / max(abs(point.torque), tiny),
    )
    return np.where(teeth == point.teeth, relative, np.inf)


def _laws(
    database: Database, sensor: str, speed_rpm: float, torque: float, *, teeth: int, cases: pd.DataFrame | None
) -> Hypotheses:
    laws = Hypotheses.of(database, speed_rpm=speed_rpm, torque=torque, teeth=teeth, sensor=sensor)
    if cases is not None:
        keys = list(cases.columns)
        kept = laws.cases[keys].merge(cases.assign(kept=True), how="left", on=keys)["kept"]
        laws = laws.only(np.flatnonzero(kept.notna()))
    for kind, some in (("healthy", laws.healthy), ("damaged", ~laws.healthy)):
        if not some.any():
            raise NotApplicableError(
                f"{database.store} has no {kind} template that keeps contact at speed_rpm = {speed_rpm:g}, torque = "
                f"{torque:g}, teeth = {teeth}; set healthy in [sweep], or reduce the damage"
            )
    return laws


def _share(laws: Hypotheses, weight: pd.Series) -> FloatArray:
    """(templates,) share of each among the rows of its kind; equal shares where the kind has no rows."""
    rows = weight.reindex(laws.cases["template"]).fillna(0).to_numpy(float, copy=True)
    for some in (laws.healthy, ~laws.healthy):
        rows[some] = rows[some] / rows[some].sum() if rows[some].any() else 1 / some.sum()
    return rows


def _signals(laws: Hypotheses, index_error: float) -> FloatArray:
    """(templates, 1 + modes + harmonics, n) signals that make up each template, in the signal's unit."""
    response = laws.modes * (index_error * laws.gains)[:, None]
    return np.concatenate([laws.signal[:, :, None], response, laws.harmonic], axis=2).transpose(0, 2, 1)
