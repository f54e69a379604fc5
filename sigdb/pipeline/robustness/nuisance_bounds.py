"""The best possible answers under each disturbance: by a law whose only nuisance is that disturbance."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import Database
from sigdb.dynamics import PeriodicRig, prepare_periodic
from sigdb.measurement import NuisanceMixture, NuisanceSettings
from sigdb.pipeline.robustness.disturbances import Disturbance
from sigdb.pipeline.robustness.off_law_rows import CLEAN
from sigdb.recognition import TSA, Hypotheses, Nuisances, OperatingPoint, operating_points, stacked_modes, whitened
from sigdb.sweep import NuisanceModes, Plan, plan_from

_LEVELS = (0.0, 1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 12.0, 18.0)
"""Levels of further noise, dB."""


@dataclass(frozen=True, eq=False)
class NuisanceBounds:
    """Errors of the best possible answers to rows with a disturbance.

    The size of a disturbance is the standard deviation, or the limit, of a nuisance of the law of the rows, which
    otherwise has none. So the best possible answer knows the kind and the size of what may be wrong, and not its value.

    Parameters
    ----------
    database
        A database of a rig with one mesh.
    rows
        Rows whose cases, noise and index errors are taken, by id.
    sensor
        The sensor.
    rigs
        Rigs drawn for a nuisance of the machine.
    """

    database: Database
    rows: pd.DataFrame
    sensor: str
    rigs: int

    def loss_db(self, disturbance: Disturbance, rows: pd.DataFrame, error: float) -> float:
        """Return the increase of the noise, dB, at which the best possible answer to rows has a share of errors.

        The rows keep their gears, rigs and noise; the noise alone grows.

        Parameters
        ----------
        disturbance
            The disturbance that the best possible answer knows.
        rows
            Rows of :meth:`OffLawRows.disturbed_rows` with it.
        error
            A model's share of errors on the same rows.

        Returns
        -------
        float
            0 where the best answer has as many already; infinite beyond the greatest level.
        """
        points = [self._point(point, disturbance) for point in self._points]
        errors: list[float] = []
        for level in _LEVELS:
            errors.append(_errors(points, disturbance, rows, 10 ** (level / 20)))
            if errors[-1] >= error:
                break
        rising = np.maximum.accumulate(errors)
        return float(np.interp(error, rising, _LEVELS[: len(rising)])) if error <= rising[-1] else np.inf

    @cached_property
    def _points(self) -> list[OperatingPoint]:
        points, _ = operating_points(self.database, self.rows.index, among=self.rows.index, sensor=self.sensor)
        return points

    @cached_property
    def _plan(self) -> Plan:
        return plan_from(self.database.manifest.resolved)

    def _point(self, point: OperatingPoint, disturbance: Disturbance) -> OperatingPoint:
        """Return an operating point whose laws have only the nuisances of a disturbance, and white noise."""
        laws = point.hypotheses
        numbers = {"rigs": self.rigs, **disturbance.nuisance(laws.teeth)}
        settings = NuisanceSettings.model_validate(numbers)
        laws = replace(laws, nuisances=self._nuisances(laws, settings) if settings.exist else None)
        if disturbance.colour is not None:
            laws = laws.whitened(disturbance.colour(laws.signal.shape[1], laws.teeth))
        rows = point.rows.assign(index_error=point.rows["index_error"] * disturbance.index_error)
        return replace(point, hypotheses=laws, rows=rows, colours=None)

    def _nuisances(self, laws: Hypotheses, settings: NuisanceSettings) -> Nuisances:
        """Return the nuisances of the templates, all of which each machine has."""
        numbers = laws.cases["template"].tolist()
        plan = replace(self._plan, nuisance=settings)
        point = plan.case(numbers[0]).rig_point
        modes_of = NuisanceModes(plan, plan.rig_points[point])
        damages = [plan.case(number).damage.on_teeth(laws.teeth) for number in numbers]
        states = self._stated(point).steady_state(damages)
        at = list(plan.sensors).index(self.sensor)
        modes, counts = [], []
        for i, damage in enumerate(damages):
            variance = np.full(len(plan.sensors), laws.reference_variance[i])
            of_template, of_each = modes_of.of(damage, states[i], variance)
            modes.append(of_template[at])
            counts.append(of_each)
        stacked, most = stacked_modes(modes, counts)
        mixture = NuisanceMixture.certain(len(most), settings.mark)
        return Nuisances(modes=stacked, counts=most, mixture=mixture)

    def _stated(self, point: int) -> PeriodicRig:
        """Return the rig of a rig point as it is stated."""
        plan = self._plan
        return prepare_periodic(
            plan.rig_points[point].rig, gear=plan.gear, samples_per_tooth=plan.signature.samples_per_tooth
        )


def _errors(points: list[OperatingPoint], disturbance: Disturbance, rows: pd.DataFrame, factor: float) -> float:
    """Return the share of errors of the best answers to rows whose noise is multiplied by a factor."""
    wrong = total = 0
    for point in points:
        some = rows[rows.index.isin(point.rows.index)]
        if some.empty:
            continue
        clean, tsa = (np.stack(some[name].tolist()) for name in (CLEAN, TSA))
        x: FloatArray = clean + factor * (tsa - clean)
        if disturbance.colour is not None:
            x = whitened(x, disturbance.colour(x.shape[1], point.hypotheses.teeth))
        law = point.rows.loc[some.index]
        law = law.assign(noise=law["noise"] * factor)
        wrong += int((point.posterior(x, law).tooth != some["tooth"].to_numpy()).sum())
        total += len(some)
    return wrong / max(total, 1)
