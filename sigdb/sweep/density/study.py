"""Study of random cases off a database's grid: they are simulated, and compared with its templates."""

import tempfile
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import DatabaseError, FloatArray, InputError, OnProgress
from sigdb.database import Database, Manifest, check_complete
from sigdb.sweep.density.nearness import Nearness
from sigdb.sweep.density.off_grid import off_grid
from sigdb.sweep.design.axes import MEASUREMENT_AXES
from sigdb.sweep.plan.make_plan import make_plan, plan_from
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.run import run

_SPECIMENS = 4


@dataclass(frozen=True, kw_only=True)
class Study:
    """Cases off a database's grid, compared with its templates.

    Attributes
    ----------
    database, base, sensor, seed
        The database, the plan that it was begun with, the sensor, and the seed of the cases.
    cases
        A row for each clean case: as :attr:`Coverage.cases`, and ``off_grid``, its number.
    signals
        Clean average of each case.
    measured
        ``tooth`` and ``residual_distance`` of measured rows.
    measurements
        Measurements of the rows of each case, by ``off_grid``.
    failed
        Number of cases without a result.
    """

    database: Database
    base: Plan
    sensor: str
    seed: int
    cases: pd.DataFrame
    signals: list[FloatArray]
    measured: pd.DataFrame
    measurements: pd.DataFrame
    failed: int


def study(
    database: Database,
    *,
    cases: int,
    sensor: str | None,
    seed: int | None,
    jobs: int,
    on_progress: OnProgress,
) -> Study:
    """Simulate cases off the grid of a database and compare them; the arguments are those of :func:`coverage`."""
    if cases < 1:
        raise InputError(f"cases = {cases} must be 1 or more: it is about the number of random cases")
    check_complete(database)
    _check_any_result(database)
    sensor, base = database.stored_sensor(sensor), plan_from(database.manifest.resolved)
    seed = fresh_seed(database.manifest) if seed is None else seed
    design = off_grid(base, cases=cases, seed=seed, specimens=_SPECIMENS)
    trial = make_plan(
        design,
        base.measurement,
        base.signature,
        base.rig,
        base_fields=base.damage_fields,
        nuisance=base.nuisance,
    )
    with tempfile.TemporaryDirectory() as folder:
        run(trial, folder, jobs=jobs, on_progress=_with_stage(on_progress))
        between, nearness = Database(folder), Nearness(database, sensor)
        clean, signals = nearness.clean(between, case_axes(base), _noise(base), on_progress)
        measured = nearness.measured(between, on_progress)
        rows = between.cases()
    if clean.empty or measured.empty:
        raise DatabaseError(
            f"{database.store}: no case between those of the database has a result that can be compared; the first one "
            f"says: {rows['status'][rows['status'] != 'ok'].iloc[0]}"
        )
    return Study(
        database=database,
        base=base,
        sensor=sensor,
        seed=seed,
        cases=clean,
        signals=signals,
        measured=measured,
        measurements=rows[["template", *MEASUREMENT_AXES]].drop_duplicates().rename(columns={"template": "off_grid"}),
        failed=trial.n_templates - len(trial.rig_points) - len(clean),
    )


def fresh_seed(manifest: Manifest) -> int:
    """Return a seed of cases that no extension was made from: each extension moves it on."""
    return manifest.seed + 1 + len(manifest.extensions)


def case_axes(base: Plan) -> tuple[str, ...]:
    """Return the columns of numbers that describe a case."""
    return ("teeth", "speed_rpm", "torque", "damaged_teeth", *base.damage_fields, *base.swept)


def _with_stage(on_progress: OnProgress) -> OnProgress:
    return lambda progress: on_progress(replace(progress, stage=f"off-grid {progress.stage}"))


def _check_any_result(database: Database) -> None:
    status = pa.Table.from_batches(database.scan("templates", ["status"]))["status"].to_pylist()
    if "ok" not in status:
        raise DatabaseError(
            f"{database.store}: no template has a result, so there is nothing to compare with; the first one says: "
            f"{status[0]}"
        )


def _noise(base: Plan) -> float:
    """Return the standard deviation of the least noise of an average, in that of the undamaged gear's average."""
    of_revolution = 10 ** (-base.measurements["snr_db"] / 20)
    return float((of_revolution / np.sqrt(base.measurements["averages"])).min())
