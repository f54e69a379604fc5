"""Distances of cases off the grid, and of their measured rows, from the templates of a database."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import FloatArray, OnProgress, Progress
from sigdb.database import (
    Database,
    Distance,
    Matcher,
    Nearest,
    mismatch,
    nearest,
    residual_distance,
    root_mean_square,
    suffixed,
    unit_residuals,
)

T = TypeVar("T")


class Nearness:
    """Distances from the templates of a database, for one of its sensors."""

    def __init__(self, database: Database, sensor: str) -> None:
        self._database, self._sensor = database, sensor
        self._step = int(database.manifest.resolved["signature"]["samples_per_tooth"])
        self._matcher = Matcher(database)

    def clean(
        self, off_grid: Database, columns: Sequence[str], noise: float, on_progress: OnProgress
    ) -> tuple[pd.DataFrame, list[FloatArray]]:
        """Return the cases of a database off the grid with their distances, a row for each, and their clean averages.

        Parameters
        ----------
        off_grid
            Cases off the grid, with the same sensors.
        columns
            Parameters of a case that the result has too. Its other columns are ``off_grid`` (the number of the template
            there), ``match``, ``template``, ``residual_distance`` and ``separation``.
        noise
            Standard deviation of the noise of an average, in standard deviations of the undamaged clean average.
        """
        tsa, variance = (suffixed(name, off_grid.sensors, self._sensor) for name in ("tsa", "reference_variance"))
        names = dict.fromkeys(["template", "tooth", "status", *columns, tsa, variance])
        templates = pa.Table.from_batches(off_grid.scan("templates", list(names))).to_pandas()
        templates = templates[(templates["tooth"] > 0) & (templates["status"] == "ok")]
        signals = [y.astype(float) for y in templates[tsa]]
        deviation = noise * np.sqrt(templates[variance])
        distances = [
            self._distances(y, sigma)
            for y, sigma in with_progress(
                zip(signals, deviation, strict=True), len(signals), "off-grid cases", on_progress
            )
        ]
        compared = pd.DataFrame(distances, columns=["match", "template", "residual_distance", "separation"])
        cases = templates[list(columns)].assign(off_grid=templates["template"]).reset_index(drop=True)
        return pd.concat([cases, compared], axis=1), signals

    def _distances(self, y: FloatArray, deviation: float) -> dict[str, float]:
        near = self._nearest(y, residual_distance)
        least = float(near.residual_distance[0])
        return {
            "match": self._match(y),
            "template": self._matcher.index(self._sensor, len(y)).cases["template"][int(near.place[0])].as_py(),
            "residual_distance": least,
            "separation": least * float(y.std()) * np.sqrt(len(y)) / deviation,
        }

    def _match(self, y: FloatArray) -> float:
        """Return the greatest overlap; 1 without residual, as the undamaged gear's template has none either."""
        if not root_mean_square(unit_residuals(y, len(y) // self._step)):
            return 1.0
        return float(self._nearest(y, mismatch).match[0])

    def measured(self, off_grid: Database, on_progress: OnProgress) -> pd.DataFrame:
        """Return tooth and residual distance of the measured rows of a database off the grid."""
        column, done = suffixed("tsa", off_grid.sensors, self._sensor), "status = 'ok'"
        tooth = off_grid.cases(done)["tooth"].to_numpy()
        batches = off_grid.batches(done, table="signals", columns=[column])
        rows = (tsa.values.to_numpy().astype(float) for batch in batches for tsa in batch[column])
        each = with_progress(rows, len(tooth), "measured rows", on_progress)
        return pd.DataFrame(
            {
                "tooth": tooth,
                "residual_distance": [float(self._nearest(x, residual_distance).residual_distance[0]) for x in each],
            }
        )

    def _nearest(self, x: FloatArray, distance: Distance) -> Nearest:
        """Return the nearest template, over all turns."""
        index, n = self._matcher.index(self._sensor, len(x)), len(x)
        every = np.ones(index.cases.num_rows, dtype=bool)
        return nearest(index, x, teeth=n // self._step, k=1, shifts=np.arange(n), among=every, distance=distance)


def with_progress(rows: Iterable[T], total: int, stage: str, on_progress: OnProgress) -> Iterator[T]:
    """Yield the rows and report progress."""
    on_progress(Progress(stage=stage, done=0, total=total, before=0))
    for done, row in enumerate(rows, start=1):
        yield row
        on_progress(Progress(stage=stage, done=done, total=total, before=0))
