"""Coverage: how well a database's templates stand for what lies between them."""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core.errors import DatabaseError
from sigdb.core.typing import FloatArray
from sigdb.database.coverage_record import CoverageRecord, write_coverage
from sigdb.database.match import template_bank
from sigdb.database.nearest import mismatch, nearest
from sigdb.database.reader import Database, check_complete
from sigdb.database.schema import suffixed
from sigdb.sweep.coarseness import coarseness
from sigdb.sweep.off_grid import off_grid
from sigdb.sweep.plan import Plan
from sigdb.sweep.planning import make_plan
from sigdb.sweep.progress import Progress
from sigdb.sweep.reconstruction import plan_from
from sigdb.sweep.run import run

QUANTILE = 0.99
"""Share of signatures within the database that are within the threshold."""

_SPECIMENS = 4


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """How well the templates stand for what lies between them.

    Attributes
    ----------
    cases
        One row a case off the grid, without noise and index errors: its parameters, ``match`` (the greatest normalised
        overlap with a template), ``template`` (the one of least misfit), ``misfit``, and ``separation``, its distance
        from that template in standard deviations of the noise of an average.
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
        Seed of the cases, their specimens and their noise; one more than the database's if left out.
    jobs
        Worker processes; -1 for one on each core.
    on_progress
        Called with what is finished whenever that changes.

    Raises
    ------
    InputError
        If nothing lies between the database's cases.
    DatabaseError
        If it is not finished or damaged.
    """
    found, _ = study(location, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress)
    write_coverage(Database(location).store, found.record)
    return found


def study(
    location: str | PathLike[str],
    *,
    cases: int,
    sensor: str | None,
    seed: int | None,
    jobs: int,
    on_progress: Callable[[Progress], Any],
) -> tuple[Coverage, list[FloatArray]]:
    """:func:`coverage` without storing it, and the clean average of each case."""
    database = Database(location)
    check_complete(database)
    sensor, base = database.stored_sensor(sensor), plan_from(database.manifest.resolved)
    seed = base.seed + 1 if seed is None else seed
    design = off_grid(base.design, base.rig, cases=cases, seed=seed, specimens=_SPECIMENS)
    trial = make_plan(design, base.measurement, base.signature, base.rig)
    with tempfile.TemporaryDirectory() as folder:
        run(trial, folder, jobs=jobs, on_progress=on_progress)
        between = Database(folder)
        clean, signals = _clean(database, between, base, sensor, on_progress)
        measured = _measured(database, between, sensor, on_progress)
    if clean.empty or not len(measured):
        raise DatabaseError(f"{database.store}: no case between those of the database has a result")
    damaged = measured["tooth"] > 0
    kinds = (measured[damaged], measured[~damaged])
    threshold = max(np.quantile(some["misfit"], QUANTILE) for some in kinds if len(some))
    match = clean["match"]
    details = {
        "cases": len(clean),
        "rows": len(measured),
        "seed": seed,
        "quantile": QUANTILE,
        "match_least": float(match.min()),
        "match_median": float(match.median()),
        "share_above_0.97": float((match >= 0.97).mean()),
        "separation_median": float(clean["separation"].median()),
        "separation_greatest": float(clean["separation"].max()),
    }
    plans = tuple(plan.hash for plan in database.manifest.plans)
    axes = ("teeth", "speed_rpm", "torque", "damaged_teeth", *base.damage_fields, *base.swept)
    templates = pa.Table.from_batches(database.scan("templates", axes)).to_pandas()
    found = Coverage(
        cases=clean,
        coarse=coarseness(clean, templates, axes),
        measured=measured["misfit"].to_numpy(),
        failed=trial.n_templates - len(trial.rig_points) - len(clean),
        record=CoverageRecord(threshold=float(threshold), sensor=sensor, plans=plans, details=details),
    )
    return found, signals


def _clean(
    database: Database, between: Database, base: Plan, sensor: str, on_progress: Callable[[Progress], Any]
) -> tuple[pd.DataFrame, list[FloatArray]]:
    """Cases off the grid, clean, against the templates; and their averages."""
    templates = between.templates()
    templates = templates[(templates["tooth"] > 0) & (templates["status"] == "ok")]
    column = suffixed("tsa", database.sensors, sensor)
    rows, signals = [], [y.astype(float) for y in templates[column]]
    for y, case in _counted(
        zip(signals, templates.to_dict("records"), strict=True), len(signals), "cases", on_progress
    ):
        shape, near = (_nearest(database, y, sensor, **options) for options in ({"distance": mismatch}, {}))
        rows.append(
            {name: case[name] for name in base.case_columns(base.first_template)}
            | {
                "match": shape["match"],
                "template": near["template"],
                "misfit": near["misfit"],
                "separation": near["misfit"] * y.std() * np.sqrt(len(y)) / _noise(base, case, sensor, database),
            }
        )
    return pd.DataFrame(rows), signals


def _noise(base: Plan, case: dict[Any, Any], sensor: str, database: Database) -> float:
    """Standard deviation of the noise of an average of the recipe's measurement."""
    reference = case[suffixed("reference_variance", database.sensors, sensor)]
    of_one = np.sqrt(reference) * 10 ** (-base.measurement.snr_db / 20)
    return float(of_one / np.sqrt(base.measurement.averages))


def _measured(
    database: Database, between: Database, sensor: str, on_progress: Callable[[Progress], Any]
) -> pd.DataFrame:
    """Tooth and misfit of measured rows off the grid."""
    column, done = suffixed("tsa", database.sensors, sensor), []
    total = len(between.cases("status = 'ok'"))
    tooth = between.cases("status = 'ok'").set_index("id")["tooth"]

    def averages() -> Iterator[tuple[int, FloatArray]]:
        for batch in between.batches("status = 'ok'", table="signals", columns=["id", column]):
            yield from zip(batch["id"].to_pylist(), batch[column].to_numpy(zero_copy_only=False), strict=True)

    for id, tsa in _counted(averages(), total, "measured rows", on_progress):
        found = _nearest(database, np.asarray(tsa, float), sensor)
        done.append({"tooth": tooth[id], "misfit": found["misfit"]})
    return pd.DataFrame(done, columns=["tooth", "misfit"])


def _nearest(database: Database, x: FloatArray, sensor: str, **options: Any) -> dict[str, float]:
    """Number, match and misfit of the nearest template over all turns."""
    teeth = len(x) // int(database.manifest.resolved["signature"]["samples_per_tooth"])
    bank = template_bank(database, sensor, len(x))
    found = nearest(
        bank, x, teeth=teeth, k=1, shifts=np.arange(len(x)), among=np.ones(bank.cases.num_rows, bool), **options
    )
    one = {name: float(values[0]) for name, values in asdict(found).items()}
    return {"template": bank.cases["template"][int(one["place"])].as_py(), **one}


def _counted(rows: Any, total: int, stage: str, on_progress: Callable[[Progress], Any]) -> Iterator[Any]:
    on_progress(Progress(stage=stage, done=0, total=total, before=0))
    for done, row in enumerate(rows, start=1):
        yield row
        on_progress(Progress(stage=stage, done=done, total=total, before=0))
