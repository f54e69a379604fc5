"""Coverage: how well a database's templates stand for what lies between them."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.typing import FloatArray
from sigdb.database.coverage_record import CoverageRecord, write_coverage
from sigdb.database.manifest import Manifest
from sigdb.database.reader import Database, check_complete
from sigdb.sweep.axes import MEASUREMENT_AXES, WHOLE_AXES
from sigdb.sweep.coarseness import coarseness
from sigdb.sweep.nearness import Nearness
from sigdb.sweep.off_grid import off_grid, whole_axes
from sigdb.sweep.plan import Plan
from sigdb.sweep.planning import make_plan
from sigdb.sweep.progress import Progress
from sigdb.sweep.reconstruction import plan_from
from sigdb.sweep.run import run

QUANTILE = 0.99
"""Share of signatures within the database that are within the threshold."""
USUAL_MATCH = 0.97
"""Least match that template banks for gravitational waves are laid out for."""

_SPECIMENS = 4


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
    on_progress: Callable[[Progress], Any] = lambda progress: None,
) -> Coverage:
    """Simulate random cases between those of a database, compare them with its templates, and store the threshold.

    The match of a case is the greatest normalised overlap of its residual signal with that of a template, over all
    turns; a template bank is dense enough where the match stays above 0.97, which costs 1 / 0.97^2 - 1 = 6 % of
    revolutions. It tells of shapes only. Severity acts as amplitude: there the separation from the nearest template
    tells, which should not be more than about one standard deviation of the noise.

    The threshold is the misfit (:meth:`sigdb.database.Database.match`) that 1 % of measured rows exceed, of damaged
    rows off the grid or of undamaged ones, whichever is greater.

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
    found = study(database, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress).found
    write_coverage(database.store, found.record)
    return found


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study of coverage that is not stored yet.

    Attributes
    ----------
    found
        Its result.
    cases
        Its cases with ``off_grid``, the number of each.
    signals
        Clean average of each case.
    measurements
        Measurements of the rows of each case, by ``off_grid``.
    """

    found: Coverage
    cases: pd.DataFrame
    signals: list[FloatArray]
    measurements: pd.DataFrame


def study(
    database: Database,
    *,
    cases: int,
    sensor: str | None,
    seed: int | None,
    jobs: int,
    on_progress: Callable[[Progress], Any],
) -> Study:
    """:func:`coverage` without storing it."""
    if cases < 1:
        raise InputError(f"cases = {cases} must be 1 or more: it is about the number of random cases")
    check_complete(database)
    sensor, base = database.stored_sensor(sensor), plan_from(database.manifest.resolved)
    seed = fresh_seed(database.manifest) if seed is None else seed
    design = off_grid(base, cases=cases, seed=seed, specimens=_SPECIMENS)
    trial = make_plan(design, base.measurement, base.signature, base.rig, base_fields=base.damage_fields)
    axes = ("teeth", "speed_rpm", "torque", "damaged_teeth", *base.damage_fields, *base.swept)
    values = _grid_values(database, base, axes)
    with tempfile.TemporaryDirectory() as folder:
        run(trial, folder, jobs=jobs, on_progress=lambda one: on_progress(replace(one, stage=f"off-grid {one.stage}")))
        between, nearness = Database(folder), Nearness(database, sensor)
        clean, signals = nearness.clean(between, axes, _noise(base), on_progress)
        measured = nearness.measured(between, on_progress)
        rows = between.cases()
    measurements = rows[["template", *MEASUREMENT_AXES]].drop_duplicates().rename(columns={"template": "off_grid"})
    if clean.empty or measured.empty:
        why = rows.loc[rows["status"] != "ok", "status"].iloc[0]
        raise DatabaseError(
            f"{database.store}: no case between those of the database has a result that can be compared; the first one "
            f"says: {why}"
        )
    values = {axis: grid for axis, grid in values.items() if clean[axis].nunique() > 1}
    found = Coverage(
        cases=clean.drop(columns="off_grid"),
        grid=values,
        coarse=coarseness(clean, values, {"teeth", *WHOLE_AXES, *whole_axes(base, base.rig_points.swept)}),
        measured=measured["misfit"].to_numpy(),
        failed=trial.n_templates - len(trial.rig_points) - len(clean),
        record=CoverageRecord(
            threshold=_threshold(measured),
            sensor=sensor,
            plans=tuple(plan.hash for plan in database.manifest.plans),
            details=_details(clean, measured, seed),
        ),
    )
    return Study(found=found, cases=clean, signals=signals, measurements=measurements)


def fresh_seed(manifest: Manifest) -> int:
    """Seed of cases that no extension was made from: each extension moves it on."""
    return manifest.seed + 1 + len(manifest.extensions)


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


def _noise(base: Plan) -> float:
    """Standard deviation of the noise of the database's least noisy average, in those of the undamaged gear's."""
    of_one = 10 ** (-base.measurements["snr_db"] / 20)
    return float((of_one / np.sqrt(base.measurements["averages"])).min())


def _grid_values(database: Database, base: Plan, axes: tuple[str, ...]) -> dict[str, FloatArray]:
    """Values of each axis that the database was begun with, those that have several."""
    found = pa.Table.from_batches(database.scan("templates", ["template", "tooth", "status", *axes])).to_pandas()
    damaged = found[(found["tooth"] > 0) & (found["template"] < base.n_templates)]
    if not (found["status"] == "ok").any():
        raise DatabaseError(
            f"{database.store}: no template has a result, so there is nothing to compare with; the first one says: "
            f"{found['status'].iloc[0]}"
        )
    values = {axis: np.unique(damaged[axis].dropna().to_numpy(float)) for axis in axes}
    return {axis: grid for axis, grid in values.items() if len(grid) > 1}
