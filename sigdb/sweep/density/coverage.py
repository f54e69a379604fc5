"""Grid coverage: how well the templates of a database represent the cases between them."""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from os import PathLike

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
"""Most intervals reported for an axis."""


def coarseness(cases: pd.DataFrame, values: Mapping[str, FloatArray], whole: Container[str]) -> pd.DataFrame:
    """Return the match and the separation of cases off the grid, by interval between neighbouring values of an axis.

    Parameters
    ----------
    cases : pandas.DataFrame
        As :attr:`Coverage.cases`.
    values : mapping
        Values of each axis in the grid, ascending. An axis with more than ten intervals, as a sampled axis has, is
        divided into ten equal intervals.
    whole : container of str
        Axes of whole numbers, which are reported by value.

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
"""Share of the database's own measured rows that lie within the threshold."""
USUAL_MATCH = 0.97
"""Least match of template banks for gravitational waves."""


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """How well the templates of a database represent the cases between them.

    Attributes
    ----------
    cases : pandas.DataFrame
        A row for each case off the grid, without noise and index errors, with the parameters of the case. ``match`` is
        the greatest normalised overlap with a template, 1 where damage leaves no residual. ``template`` is the number
        of the template of least ``residual_distance``. ``separation`` is the distance from that template in standard
        deviations of the noise.
    grid : dict of ndarray
        Values of the axes between which the cases lie, as the database was begun with them.
    coarse : pandas.DataFrame
        For each axis and each interval between neighbouring values, the number of cases, the least and the median
        match, and the greatest separation.
    measured : ndarray, (rows,)
        Residual distance of measured rows of these cases and of undamaged gears, with specimens and noise.
    failed : int
        Number of cases without a result.
    record : CoverageRecord
        The threshold of *outside the database* and a summary, as the database stores them.
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
    """Compare random cases between those of a database with its templates, and store the threshold of *outside*.

    The match of a case is the greatest normalised overlap of its residual signal with that of a template, over all
    turns. A template bank is dense enough where the match stays above 0.97, which costs 1 / 0.97^2 - 1 = 6 % more
    revolutions [1]_. The match compares shapes only. Severity acts as amplitude, which the separation from the nearest
    template compares: it should not be more than about one standard deviation of the noise. The separation is
    ``residual_distance std(y) sqrt(n) / sigma``. Here y is the clean average of the case, of n samples, and sigma the
    standard deviation of the noise in the least noisy average of the database.

    The threshold is the residual distance (:meth:`sigdb.database.Database.match`) that 1 % of measured rows exceed: of
    damaged rows off the grid or of undamaged rows, whichever is greater. These rows have gear pairs and noise of their
    own.

    Parameters
    ----------
    location : str or path-like
        A finished database, in which ``coverage.json`` is written.
    cases : int
        Approximate number of cases off the grid.
    sensor : str, optional
        Name of a stored sensor; the first sensor if left out.
    seed : int, optional
        Seed of the cases, their specimens and their noise. If left out, the seed of the database plus 1, plus 1 for
        each extension.
    jobs : int
        Number of worker processes; -1 for one on each core.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever something is finished.

    Returns
    -------
    Coverage
        The cases, where they match badly, and the stored threshold.

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
    result = study(database, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress)
    measured = summarize(result)
    write_coverage(database.store, measured.record)
    return measured


def summarize(study: Study) -> Coverage:
    """Return the coverage that a study measured."""
    base, cases = study.base, study.cases
    grid = {axis: values for axis, values in _grid(study).items() if cases[axis].nunique() > 1}
    return Coverage(
        cases=cases.drop(columns="off_grid"),
        grid=grid,
        coarse=coarseness(cases, grid, {"teeth", *WHOLE_AXES, *whole_axes(base, base.rig_points.swept)}),
        measured=study.measured["residual_distance"].to_numpy(),
        failed=study.failed,
        record=CoverageRecord(
            threshold=_threshold(study.measured),
            sensor=study.sensor,
            plans=tuple(plan.hash for plan in study.database.manifest.plans),
            details=_details(cases, study.measured, study.seed),
        ),
    )


def _threshold(measured: pd.DataFrame) -> float:
    """Return the quantile of the residual distance, of damaged rows or of undamaged rows, whichever is greater."""
    return float(measured.groupby(measured["tooth"] > 0)["residual_distance"].quantile(QUANTILE).max())


def _details(clean: pd.DataFrame, measured: pd.DataFrame, seed: int) -> dict[str, float]:
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


def _grid(study: Study) -> dict[str, FloatArray]:
    """Return the values of each axis that had several when the database was begun."""
    axes = case_axes(study.base)
    templates = pa.Table.from_batches(study.database.scan("templates", ["template", "tooth", *axes])).to_pandas()
    damaged = templates[(templates["tooth"] > 0) & (templates["template"] < study.base.n_templates)]
    values = {axis: np.unique(damaged[axis].dropna().to_numpy(float)) for axis in axes}
    return {axis: some for axis, some in values.items() if len(some) > 1}
