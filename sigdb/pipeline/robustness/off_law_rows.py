"""Rows that do not follow the law of a database: its cases, simulated anew with a disturbance."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray, SigdbError
from sigdb.database import Database
from sigdb.dynamics import PeriodicRig, prepare_periodic, superpose
from sigdb.measurement import coloured, index_errors, measured_noise, noise_deviation, whole_mean
from sigdb.pipeline.robustness.disturbances import DamagedTeeth, Disturbance
from sigdb.signature import features
from sigdb.sweep import Plan, plan_from
from sigdb.transmission import Transmission

CLEAN = "clean"
"""Column of averages without noise."""


@dataclass(frozen=True, eq=False)
class OffLawRows:
    """Cases of a database whose rows are made with disturbances.

    Parameters
    ----------
    database
        A database of a rig with one mesh.
    cases
        Rows of the database, by id, whose cases, noise and size of index errors are taken.
    sensor
        The sensor.
    """

    database: Database
    cases: pd.DataFrame
    sensor: str

    @cached_property
    def plan(self) -> Plan:
        """The plan of the database."""
        return plan_from(self.database.manifest.resolved)

    def disturbed_rows(self, disturbance: Disturbance, stream: np.random.Generator) -> pd.DataFrame:
        """Return rows with a disturbance, with the columns that models read.

        Parameters
        ----------
        disturbance
            The disturbance.
        stream
            Random stream of rigs, gears, paths and noise.

        Returns
        -------
        pandas.DataFrame
            The stated case, ``averages``, ``scatter``, ``tsa``, the features and ``clean``, the average without noise,
            by the id of the case. Cases without a steady state that keeps contact are left out.
        """
        parts = [
            self._rows(point, some, disturbance, stream)
            for point, some in self._places()
            for some in np.array_split(some, disturbance.rigs)
        ]
        return pd.concat([part for part in parts if len(part)])

    def _places(self) -> Iterator[tuple[int, IntArray]]:
        """Yield rig points with the places of their cases."""
        points = np.array([self.plan.case(number).rig_point for number in self.cases["template"].tolist()])
        for point in np.unique(points).tolist():
            yield point, np.flatnonzero(points == point)

    def _rows(
        self, point: int, places: IntArray, disturbance: Disturbance, stream: np.random.Generator
    ) -> pd.DataFrame:
        """Return rows of a rig point, all on one changed rig."""
        cases = self.cases.iloc[places]
        rig = self.plan.rig_points[point].rig
        if disturbance.rig is None:
            prepared = self._stated(point)
        else:
            prepared = self._prepared(disturbance.rig(rig, self.plan.gear, stream))
        x, kept = self._clean(prepared, self.plan.rig_points[point].mate_teeth, cases, disturbance, stream)
        x, cases = x[kept], cases[kept]
        if not len(x):
            return cases
        teeth = self.plan.rig_points[point].teeth
        for change in disturbance.averages:
            x = change(x, teeth, stream)
        return self._measured(x, cases, teeth, self._reference(point), disturbance, stream)

    def _clean(
        self,
        prepared: PeriodicRig,
        mate_teeth: int,
        cases: pd.DataFrame,
        disturbance: Disturbance,
        stream: np.random.Generator,
    ) -> tuple[FloatArray, BoolArray]:
        """Return clean averages (rows, n) of gears with index errors, and which of them keep contact."""
        plan, teeth = self.plan, prepared.teeth
        samples = plan.signature.samples_per_tooth
        templates, which = np.unique(cases["template"].to_numpy(), return_inverse=True)
        damages: list[DamagedTeeth] = [plan.case(int(number)).damage.on_teeth(teeth) for number in templates]
        if disturbance.damage is not None:
            damages = [disturbance.damage(damage, teeth) for damage in damages]
        sizes = disturbance.index_error * cases["index_error"].to_numpy()
        turns = np.maximum(cases["tooth"].to_numpy() - 1, 0)
        errors = sizes[:, None] * np.stack(
            [index_errors(stream, teeth, mate_teeth, runout=plan.design.runout) for _ in range(len(cases))]
        )
        x, kept = np.empty((len(cases), teeth * samples)), np.ones(len(cases), bool)
        at = list(plan.rig.sensors).index(self.sensor)
        for i, damage in enumerate(damages):
            rows = np.flatnonzero(which == i)
            state = prepared.steady_state([damage])[0]
            angles = np.outer(turns[rows] * 2 * np.pi / teeth, state.orders)
            phases = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
            parts = (state.signals[at], state.specimen_response[at], state.harmonic_response[at])
            x[rows] = superpose(*parts, errors[rows], phases)
            kept[rows] = not state.contact_loss
        for i, turn in enumerate(turns.tolist()):
            x[i] = np.roll(x[i], turn * samples)
        return x, kept

    def _prepared(self, rig: Transmission) -> PeriodicRig:
        """Return a rig that is prepared for damage of the averaged gear."""
        return prepare_periodic(rig, gear=self.plan.gear, samples_per_tooth=self.plan.signature.samples_per_tooth)

    def _stated(self, point: int) -> PeriodicRig:
        """Return the rig of a rig point as it is stated."""
        if point not in self._kept:
            self._kept[point] = self._prepared(self.plan.rig_points[point].rig)
        return self._kept[point]

    @cached_property
    def _kept(self) -> dict[int, PeriodicRig]:
        return {}

    def _reference(self, point: int) -> float:
        """Return the variance of the healthy average of the stated rig."""
        at = list(self.plan.rig.sensors).index(self.sensor)
        return float(self._stated(point).healthy_signals()[at].var())

    def _measured(
        self,
        x: FloatArray,
        cases: pd.DataFrame,
        teeth: int,
        reference: float,
        disturbance: Disturbance,
        stream: np.random.Generator,
    ) -> pd.DataFrame:
        """Return rows of clean averages with noise and features."""
        averages = cases["averages"].to_numpy()
        deviation = noise_deviation(np.full(len(x), reference), cases["snr_db"].to_numpy())
        shape = np.ones(x.shape[1] // 2 + 1) if disturbance.colour is None else disturbance.colour(x.shape[1], teeth)
        noise = np.empty_like(x)
        for count in np.unique(averages).tolist():
            at = np.flatnonzero(averages == count)
            noise[at] = disturbance.noise(stream, len(at), x.shape[1], int(count))
        tsa = x + coloured(noise, shape) * (deviation / np.sqrt(averages))[:, None]
        by_order = self._by_order(x, deviation[:, None] * shape, averages, disturbance, stream)
        scatter = np.sqrt(whole_mean(by_order**2))
        columns: dict[str, Any] = {
            "scatter": scatter,
            "tsa": list(tsa),
            CLEAN: list(x),
            "noise": list(by_order / np.sqrt(averages)[:, None]),
        }
        for name, values in features(tsa, teeth=teeth).items():
            columns[name] = list(values.reshape(len(x), -1)) if values.ndim > 1 else values
        return cases.drop(columns=[name for name in columns if name in cases]).assign(**columns)

    @staticmethod
    def _by_order(
        x: FloatArray, deviation: FloatArray, averages: IntArray, disturbance: Disturbance, stream: np.random.Generator
    ) -> FloatArray:
        """Return the scatter by order (rows, n / 2 + 1) that the revolutions of averages show.

        A modulation that averages out adds to the orders that the average has.
        """
        power = np.abs(np.fft.rfft(x - x.mean(axis=1, keepdims=True), axis=1)) ** 2 / x.shape[1]
        noise = measured_noise(stream, deviation, averages[:, None])
        return np.sqrt(noise**2 + disturbance.scatter * power)


def applicable(rows: OffLawRows, disturbance: Disturbance) -> bool:
    """Return whether the rig of some rows can have a disturbance."""
    if disturbance.rig is None:
        return True
    try:
        disturbance.rig(rows.plan.rig, rows.plan.gear, np.random.default_rng(0))
    except SigdbError:
        return False
    return True
