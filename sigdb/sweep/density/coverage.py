"""Coverage: how well a database's templates stand for what lies between them."""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import FloatArray, OnProgress, ignore
from sigdb.database import CoverageRecord, Database, write_coverage
from sigdb.sweep.density.off_grid import whole_axes
from sigdb.sweep.density.study import Study, case_axes, study
from sigdb.sweep.design.axes import WHOLE_AXES

COLUMNS = ("axis", "from", "to", "cases", "least_match", "median_match", "greatest_separation")
_INTERVALS = 10
"""Of an axis with more intervals than these, so many equal ones are told of."""


def coarseness(cases: pd.DataFrame, values: Mapping[str, FloatArray], whole: Container[str]) -> pd.DataFrame:
    """Cases off the grid by the interval between neighbouring values of an axis that they lie in.

    Parameters
    ----------
    cases
        As :attr:`Coverage.cases`.
    values
        The grid's values of each axis to look at, ascending. An axis that has more than ten intervals, as a sampled one
        has, is divided into ten equal ones.
    whole
        Axes of whole numbers: they are told by value.

    Returns
    -------
    pandas.DataFrame
        The columns :data:`COLUMNS`. An interval without cases is left out.
    """
    rows = []
    for axis, grid in values.items():
        for low, high in zip(grid, grid, strict=True) if axis in whole else _intervals(grid):
            inside = cases[cases[axis].between(low, high)]
            if len(inside):
                match, separation = inside["match"], inside["separation"].max()
                rows.append((axis, low, high, len(inside), match.min(), match.median(), separation))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _intervals(grid: FloatArray) -> list[tuple[float, float]]:
    edges = grid if len(grid) <= _INTERVALS + 1 else np.linspace(grid[0], grid[-1], _INTERVALS + 1)
    return list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))


QUANTILE = 0.99
"""Share of signatures within the database that are within the threshold."""
USUAL_MATCH = 0.97
"""Least match that template banks for gravitational waves are laid out for."""


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """How well the templates stand for what lies between them.

    Attributes
    ----------
    cases
        One row a case off the grid, without noise and index errors: its parameters, ``match`` (the greatest normalised
        overlap with a template; 1 where damage leaves no residual, as no damage does), ``template`` (the one of least
        misfit), ``misfit``, and ``separation``, its distance from that template in standard deviations of the noise.
    grid
        Values of the axes between which the cases lie, those that the database was begun with.
    coarse
        Where the cases lie: for each axis and each interval between neighbouring values, the number of cases, the least
        and the median match, the greatest separation.
    measured
        (rows,) misfit of measured rows of these cases and of undamaged gears, with specimens and noise.
    failed
        Cases without a result.
    record
        What is stored with the database: the threshold of *outside the database*, and a summary.
    """

    cases: pd.DataFrame
    grid: dict[str, FloatArray]
    coarse: pd.DataFrame
    measured: FloatArray
    failed: int
    record: CoverageRecord


def coverage(
    location: str | PathLike[str],
    *,
    cases: int = 200,
    sensor: str | None = None,
    seed: int | None = None,
    jobs: int = -1,
    on_progress: OnProgress = ignore,
) -> Coverage:
    """Simulate random cases between those of a database, compare them with its templates, and store the threshold.

    The match of a case is the greatest normalised overlap of its residual signal with that of a template, over all
    turns; a template bank is dense enough where the match stays above 0.97, which costs 1 / 0.97^2 - 1 = 6 % more
    revolutions [1]_. It tells of shapes only. Severity acts as amplitude: there the separation from the nearest
    template tells, which should not be more than about one standard deviation of the noise. It is
    ``misfit std(y) sqrt(n) / sigma``, with y the case's clean average of n samples, and sigma the standard deviation of
    the noise in the least noisy average of the database.

    The threshold is the misfit (:meth:`sigdb.database.Database.match`) that 1 % of measured rows exceed, of damaged
    rows off the grid or of undamaged ones, whichever is greater; they have gear pairs and noise of their own.

    Parameters
    ----------
    location
        A finished database; it is given ``coverage.json``.
    cases
        Cases off the grid, about.
    sensor
        Name of a stored sensor; the first one if left out.
    seed
        Seed of the cases, their specimens and their noise; one more than the database's if left out, and one more
        for each extension of it.
    jobs
        Worker processes; -1 for one on each core.
    on_progress
        Called with what is finished whenever that changes.

    Raises
    ------
    InputError
        If nothing lies between the database's cases, or ``sensor`` or ``cases`` is wrong.
    DatabaseError
        If it is not finished or damaged, or none of its templates, or none of the cases, has a result.

    References
    ----------
    .. [1] B. J. Owen, "Search templates for gravitational waves from inspiraling binaries: choice of template spacing",
           Physical Review D 53 (1996) 6749-6761, doi:10.1103/PhysRevD.53.6749.
    """
    database = Database(location)
    looked = study(database, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress)
    found = summary(looked)
    write_coverage(database.store, found.record)
    return found


def summary(looked: Study) -> Coverage:
    """What a study tells."""
    base, cases = looked.base, looked.cases
    grid = {axis: values for axis, values in _grid(looked).items() if cases[axis].nunique() > 1}
    return Coverage(
        cases=cases.drop(columns="off_grid"),
        grid=grid,
        coarse=coarseness(cases, grid, {"teeth", *WHOLE_AXES, *whole_axes(base, base.rig_points.swept)}),
        measured=looked.measured["misfit"].to_numpy(),
        failed=looked.failed,
        record=CoverageRecord(
            threshold=_threshold(looked.measured),
            sensor=looked.sensor,
            plans=tuple(plan.hash for plan in looked.database.manifest.plans),
            details=_details(cases, looked.measured, looked.seed),
        ),
    )


def _threshold(measured: pd.DataFrame) -> float:
    """The quantile of the misfit, of damaged rows or of undamaged ones, whichever is greater."""
    return float(measured.groupby(measured["tooth"] > 0)["misfit"].quantile(QUANTILE).max())


def _details(clean: pd.DataFrame, measured: pd.DataFrame, seed: int) -> dict[str, Any]:
    match, separation = clean["match"], clean["separation"]
    return {
        "cases": len(clean),
        "rows": len(measured),
        "seed": seed,
        "quantile": QUANTILE,
        "match_least": float(match.min()),
        "match_median": float(match.median()),
        "share_above_0.97": float((match >= USUAL_MATCH).mean()),
        "separation_median": float(separation.median()),
        "separation_greatest": float(separation.max()),
    }


def _grid(looked: Study) -> dict[str, FloatArray]:
    """Values of each axis that the database was begun with, those that have several."""
    axes = case_axes(looked.base)
    found = pa.Table.from_batches(looked.database.scan("templates", ["template", "tooth", *axes])).to_pandas()
    damaged = found[(found["tooth"] > 0) & (found["template"] < looked.base.n_templates)]
    values = {axis: np.unique(damaged[axis].dropna().to_numpy(float)) for axis in axes}
    return {axis: some for axis, some in values.items() if len(some) > 1}
