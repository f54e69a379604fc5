"""The bank of a template scorer: the laws of averages at each operating point of a database, as plain arrays."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, IntArray, NotApplicableError
from sigdb.database import (
    MEMBER,
    QUANTITIES,
    Database,
    database_quantities,
    kind_classes,
    severity_levels,
    suffixed,
)
from sigdb.recognition.laws.mixture_laws import Nuisances
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.templates.hypotheses import Hypotheses
from sigdb.recognition.templates.local_templates import LocalTemplates, SpeedRanges
from sigdb.recognition.templates.point_templates import (
    PointTemplates,
    nearest_nuisances,
    stored_signals,
    template_keys,
    template_shares,
)
from sigdb.recognition.templates.severity_grid import SeverityInterpolation, severity_interpolation
from sigdb.recognition.templates.speed_curve import Interpolation, SpeedCurve, interpolation

_PRECISION = 2e-4
"""Greatest error of a stored signal, in norm, in standard deviations of the noise of the quietest average.
The log-likelihood of a template that resembles the average then changes by less than 0.01."""

_CASE = ("teeth", *QUANTITIES)


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
    interpolations
        How far the templates hold between the operating points, by tooth count; none in a bank of points alone.
    severities
        Severities between which they hold, by tooth count; none where they are those of the templates alone.
    quantities
        Quantities of the severity of the templates, the number of damaged teeth last.
    """

    sensor: str
    index_error: float
    points: tuple[PointTemplates, ...]
    interpolations: tuple[Interpolation, ...] = ()
    severities: tuple[SeverityInterpolation, ...] = ()
    quantities: tuple[str, ...] = QUANTITIES

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

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
        in the quietest row. The bank keeps as many operating points as the interpolation over speed and torque takes
        (:class:`Interpolation`), and all where it does not hold.

        Parameters
        ----------
        database
            A database with rows. The templates of a rig with several meshes are not turned: each is of its tooth.
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
            If there are no templates, as in a database of recordings, or if an operating point has no healthy or no
            damaged template. Also if rows are of a single revolution, which has no scatter to take the noise from.
        InputError
            If the database has no such sensor.
        """
        if database.manifest.is_measured:
            raise NotApplicableError(f"{database.store} has no templates: recordings have none, only simulations")
        sensor = database.stored_sensor(sensor)
        scatter = suffixed("scatter", database.sensors, sensor)
        seen = "from features where status = 'ok' and not coalesce(contact_loss, false)"
        if specimens is not None:
            seen += f" and specimen in ({', '.join(str(int(number)) for number in np.unique(specimens))})"
        rows = database.sql(
            "select template, count(*) as n, min(averages) as averages, "
            f"min({scatter} / sqrt(averages)) as noise {seen} group by template"
        )
        if rows.empty:
            raise NotApplicableError(f"{database.store} has no row with a result that keeps contact")
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
        if index_error is None:
            # Summed in their order, whatever the threads of the query: each training gives the same bytes.
            errors = database.sql(f"select index_error, count(*) as n {seen} group by index_error order by index_error")
            size, count = (errors[name].to_numpy(float) for name in ("index_error", "n"))
            index_error = float(np.sqrt(size**2 @ count / count.sum()))
        noise = float(rows["noise"].min())
        quantities = database_quantities(database)
        facts: dict[str, Any] = {"sensor": sensor, "index_error": index_error, "quantities": quantities}
        parts = []
        for teeth in sorted(set(points["teeth"].astype(int))):
            alike = points.loc[points["teeth"] == teeth, ["speed_rpm", "torque"]].to_numpy(float)
            at = [(float(speed), float(torque)) for speed, torque in alike]
            laws = [_laws(database, sensor, *point, teeth=teeth, cases=cases) for point in at]
            shares = [template_shares(law, rows.set_index("template")["n"]) for law in laws]
            parts.append(cls.of_laws(laws, shares, points=at, noise=noise, **facts))
        return cls(
            points=tuple(point for part in parts for point in part.points),
            interpolations=tuple(between for part in parts for between in part.interpolations),
            severities=tuple(between for part in parts for between in part.severities),
            **facts,
        )

    @classmethod
    def of_laws(
        cls,
        laws: Sequence[Hypotheses],
        shares: Sequence[FloatArray],
        *,
        points: Sequence[tuple[float, float]],
        sensor: str,
        index_error: float,
        noise: float,
        quantities: tuple[str, ...] = QUANTITIES,
    ) -> Self:
        """The bank of the laws of one tooth count at some operating points.

        It keeps as many points as the interpolation between them takes, and all where it does not hold. Templates that
        are not turned hold at their own points and severities alone.

        Parameters
        ----------
        laws
            Hypotheses of each operating point.
        shares
            (templates,) share of each template among the rows of its kind, for each operating point.
        points
            Speed (rpm) and torque (N m) of each operating point.
        sensor
            Sensor of the averages.
        index_error
            Size of the index errors, m.
        noise
            Deviation of the noise of the quietest average, which errors are compared with, in the signal's unit.
        quantities
            Quantities of the severity, see :func:`sigdb.database.severity_quantities`.
        """

        def stored(places: Sequence[int]) -> list[PointTemplates]:
            return PointTemplates.of(
                [laws[place] for place in places],
                [shares[place] for place in places],
                points=[points[place] for place in places],
                index_error=index_error,
                tolerance=_PRECISION * noise,
                quantities=quantities,
            )

        kept = stored(range(len(points)))
        if laws[0].untied:
            return cls(sensor=sensor, index_error=index_error, points=tuple(kept), quantities=quantities)
        between: tuple[Interpolation, ...] = ()
        if (signals := stored_signals(kept)) is not None:
            estimated, places = interpolation(signals[0], teeth=laws[0].teeth, noise=noise)
            if estimated.holds:
                between, kept = (estimated,), kept if len(places) == len(points) else stored(places.tolist())
        sizes = severity_interpolation(
            laws[0].teeth,
            [severity_levels(law.cases, quantities).to_numpy() for law in laws],
            [law.healthy for law in laws],
            [law.signal for law in laws],
            noise=noise,
        )
        return cls(
            sensor=sensor,
            index_error=index_error,
            points=tuple(kept),
            interpolations=between,
            severities=(sizes,) if sizes is not None and sizes.holds else (),
            quantities=quantities,
        )

    @property
    def teeth(self) -> tuple[int, ...]:
        """Tooth counts that it has."""
        return tuple(sorted({point.teeth for point in self.points}))

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of damage of its templates, ``none`` first; ``none`` alone in a bank of an earlier version."""
        return kind_classes(kind for point in self.points for kind in point.kinds)

    def has_continuous_severity(self, teeth: int) -> bool:
        """Return whether its templates of a tooth count hold between their severities."""
        return any(between.teeth == teeth for between in self.severities)

    def healthy_variance(self, batch: Batch) -> FloatArray:
        """Return the variance of the healthy clean average at the operating points of averages, (rows,)."""
        variance = np.empty(len(batch))
        for local, at, coefficients in self.locals(*batch.operating_point()):
            variance[at] = local.healthy_variance(coefficients)
        return variance

    def effective_noise(self, batch: Batch) -> FloatArray:
        """Return the deviation of white noise in which damage stands out as much as in that of averages, (rows,).

        It is the noise itself where that is white, and for tooth counts that the bank has not.
        """
        if batch.noise_by_order is None:
            return batch.noise()
        noise = batch.row_noise()
        stored = np.flatnonzero(np.isin(batch.column("teeth"), self.teeth))
        for local, at, _ in self.locals(*batch.take(stored).operating_point()) if stored.size else ():
            for levels, places in noise.alike(stored[at]):
                if levels.any():
                    noise.level[stored[at[places]]] *= local.effective_noise(levels)
        return noise.level

    def locals(
        self, speed_rpm: FloatArray, torque: FloatArray, teeth: FloatArray | IntArray
    ) -> Iterator[tuple[LocalTemplates, IntArray, FloatArray | None]]:
        """Yield the templates near operating points, with the places of their rows and the coefficients of these.

        Parameters
        ----------
        speed_rpm, torque, teeth
            (rows,) operating points (rpm, N m) and tooth counts.

        Raises
        ------
        NotApplicableError
            If the bank has no such tooth count.
        """
        nearest = self.nearest(speed_rpm, torque, teeth)
        for count in np.unique(teeth).astype(int):
            of_count = np.flatnonzero(teeth == count)
            ranges = self._ranges.get(int(count))
            place = nearest[of_count] if ranges is None else ranges.place(speed_rpm[of_count])
            for number in np.unique(place).tolist():
                at = of_count[place == number]
                if ranges is None:
                    yield self.points[number].local, at, None
                else:
                    local = ranges.templates(number)
                    yield local, at, local.coefficients(ranges.clipped(speed_rpm[at]), torque[at])

    def nuisances(self, speed_rpm: float, torque: float, teeth: int) -> Nuisances | None:
        """Return the nuisances of the templates that :meth:`locals` yields for an operating point; None without any."""
        if teeth in self._ranges:
            return self._ranges[teeth].nuisances(speed_rpm)
        (place,) = self.nearest(np.array([speed_rpm]), np.array([torque]), np.array([teeth]))
        return self.points[place].nuisances

    def stored_point(self, speed_rpm: float, torque: float, teeth: int) -> tuple[float, float]:
        """Return the operating point, rpm and N m, whose templates stand for one: itself where the bank interpolates.

        It is the nearest one that the templates hold for.
        """
        for between in self.interpolations:
            if between.teeth == teeth:
                return float(np.clip(speed_rpm, *between.speed_rpm)), torque
        (place,) = self.nearest(np.array([speed_rpm]), np.array([torque]), np.array([teeth]))
        return self.points[place].speed_rpm, self.points[place].torque

    def reasons(self, speed_rpm: FloatArray, torque: FloatArray, teeth: FloatArray | IntArray) -> list[str]:
        """Return why the templates do not cover operating points, in words; empty where they do."""
        reasons = [""] * len(speed_rpm)
        for between in self.interpolations:
            low, high = between.speed_rpm
            outside = (np.asarray(teeth) == between.teeth) & ~((low <= speed_rpm) & (speed_rpm <= high))
            for i in np.flatnonzero(outside) if between.speeds > 1 else ():
                reasons[i] = (
                    f"speed_rpm = {speed_rpm[i]:.6g} rpm is beyond the templates, which hold from {low:.6g} to "
                    f"{high:.6g} rpm"
                )
        return reasons

    @cached_property
    def _ranges(self) -> dict[int, SpeedRanges]:
        """Templates in ranges of speed by tooth count, where there is an interpolation."""
        return {between.teeth: self._range(between) for between in self.interpolations}

    def _range(self, between: Interpolation) -> SpeedRanges:
        between.check()
        points = [point for point in self.points if point.teeth == between.teeth]
        stored = stored_signals(points)
        if stored is None:
            raise NotApplicableError(f"the bank has too few templates of {between.teeth} teeth; train it again")
        signals, keys = stored
        curve = SpeedCurve(signals, between.signal_powers, between.harmonic_powers)
        first = [
            next((point, place[key]) for point in points if key in (place := template_keys(point))) for key in keys
        ]
        share = [
            np.mean([point.share[place[key]] for point in points if key in (place := template_keys(point))])
            for key in keys
        ]
        return SpeedRanges(
            curve,
            basis=points[0].signals.basis.astype(float),
            reach=between.speed_rpm,
            count=between.ranges,
            torque=float(np.mean([point.torque for point in points])),
            teeth=between.teeth,
            index_error=self.index_error,
            healthy=np.array([point.healthy[i] for point, i in first]),
            share=np.array(share),
            severity=np.array([point.severity[i] for point, i in first]),
            phases=np.array([point.phases[i] for point, i in first]),
            kinds=[point.kinds[i] for point, i in first if point.kinds],
            nuisances=nearest_nuisances(points, keys),
        )

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
        nearest, least = np.zeros(len(speed_rpm), int), np.full(len(speed_rpm), np.inf)
        for i, point in enumerate(self.points):
            closer = (distance := point.distance(speed_rpm, torque, teeth)) < least
            nearest[closer], least[closer] = i, distance[closer]
        return nearest


def _laws(
    database: Database, sensor: str, speed_rpm: float, torque: float, *, teeth: int, cases: pd.DataFrame | None
) -> Hypotheses:
    laws = Hypotheses.of(database, speed_rpm=speed_rpm, torque=torque, teeth=teeth, sensor=sensor, untied=True)
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
