"""Refining: cases are appended to a database where its templates stand badly for what lies between them."""

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.fields import validated
from sigdb.core.typing import ComplexArray, FloatArray
from sigdb.database.coverage_record import write_coverage
from sigdb.database.manifest import Manifest, read_manifest
from sigdb.database.residuals import root_mean_square, unit_residuals
from sigdb.database.storage import Store
from sigdb.sweep.axes import MEASUREMENT_AXES
from sigdb.sweep.coverage import Coverage, study
from sigdb.sweep.design import Design
from sigdb.sweep.engines import Cluster, Processes
from sigdb.sweep.ownership import owned
from sigdb.sweep.plan import Plan
from sigdb.sweep.planning import make_plan
from sigdb.sweep.progress import Progress
from sigdb.sweep.reconstruction import plan_from
from sigdb.sweep.run import append, carry_out


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """What refining did.

    Attributes
    ----------
    reached
        Whether every case of the last study matched as asked.
    rounds
        Studies of coverage, each with cases of its own.
    cases, rows
        Cases and rows that were appended.
    coverage
        The last study, of the database as it is now; its threshold is stored.
    """

    reached: bool
    rounds: int
    cases: int
    rows: int
    coverage: Coverage


def refine(
    location: str | PathLike[str],
    *,
    match: float = 0.97,
    cases: int = 200,
    rounds: int = 10,
    jobs: int = -1,
    scheduler: str | None = None,
    on_progress: Callable[[Progress], Any] = lambda progress: None,
) -> Refinement:
    """Append cases to a database until random cases between those that it has match its templates.

    In each round as many cases as ``cases`` says are drawn between those of the database. Of those that match no
    template as asked the worst is appended, then the worst of those that do not match that one either, and so on; each
    with every tooth, specimen, noise draw and measurement of the database. The round whose cases all match is the last.
    Extensions share the specimens of the database, which keeps its ids: an extension begins with the next part.

    Stopped at any instant, the same call goes on.

    Parameters
    ----------
    location
        A finished database.
    match
        Least normalised overlap, between 0 and 1.
    cases
        Cases of a round.
    rounds
        Greatest number of rounds.
    jobs, scheduler, on_progress
        As of :func:`sigdb.sweep.run`.

    Raises
    ------
    InputError
        If ``match`` is not between 0 and 1, or nothing lies between the database's cases.
    DatabaseError
        If it is not finished, or another sweep is running on it.
    """
    if not 0 < match < 1:
        raise InputError(f"match = {match:g} must lie between 0 and 1; 0.97 is usual")
    store, engine = Store.at(location), Cluster(scheduler) if scheduler else Processes(jobs)
    with owned(store):
        store.clear_temporary()
        manifest = read_manifest(store)
        carry_out(_plans(manifest), store, engine, on_progress)
        appended = rows = 0
        for number in range(1, rounds + 1):
            manifest = read_manifest(store)
            # Each extension moves on the seed, so that a round that is done again draws the same cases.
            seed = manifest.seed + 1 + len(manifest.extensions)
            found, signals = study(location, cases=cases, sensor=None, seed=seed, jobs=jobs, on_progress=on_progress)
            poor = found.cases[found.cases["match"] < match]
            if poor.empty or number == rounds:
                break
            extension = _extension(manifest, poor.loc[_apart(poor, signals, match)])
            append(extension, store)
            appended, rows = appended + extension.n_templates, rows + extension.rows
            carry_out(_plans(read_manifest(store)), store, engine, on_progress)
        write_coverage(store, found.record)
    return Refinement(reached=poor.empty, rounds=number, cases=appended, rows=rows, coverage=found)


def _plans(manifest: Manifest) -> list[Plan]:
    return [plan_from(plan.resolved) for plan in manifest.plans]


def _apart(poor: pd.DataFrame, signals: list[FloatArray], match: float) -> list[int]:
    """The worst case, the worst of those that do not match it, and so on: their places."""
    kept: list[int] = []
    spectra = {at: _unit_spectrum(signals[at], int(poor.loc[at, "teeth"])) for at in poor.index}
    for at in poor["match"].sort_values(kind="stable").index:
        alike = (
            np.fft.irfft(spectra[at] * spectra[one].conj()).max() for one in kept if _same_length(signals, at, one)
        )
        if all(overlap < match for overlap in alike):
            kept.append(at)
    return sorted(kept)


def _same_length(signals: list[FloatArray], one: int, other: int) -> bool:
    return len(signals[one]) == len(signals[other])


def _unit_spectrum(tsa: FloatArray, teeth: int) -> ComplexArray:
    """FFT of the residual, scaled so that a circular correlation of two is their overlap."""
    z = unit_residuals(tsa, teeth)
    return np.fft.rfft(z / (root_mean_square(z) * np.sqrt(len(z))))


def _extension(manifest: Manifest, cases: pd.DataFrame) -> Plan:
    """The plan of cases that go to the end of a database, with all else as it was begun with."""
    base, last = plan_from(manifest.resolved), _plans(manifest)[-1]
    design = base.design
    grid = {
        "tooth": _teeth(design),
        "table": {axis: cases[column].tolist() for axis, column in _axes(base, cases).items()},
        **{axis: _listed(design, axis) for axis in MEASUREMENT_AXES if _listed(design, axis)},
    }
    extended = design.model_dump(include={"rig", "gear", "seed", "specimens", "draws"}) | {"grid": [grid]}
    return make_plan(
        validated(Design, extended, owner="refinement"),
        base.measurement,
        base.signature,
        base.rig,
        first_row_part=last.first_row_part + last.row_parts,
        first_template_part=last.first_template_part + last.template_parts,
        part_rows=manifest.part_rows,
        base_fields=base.damage_fields,
    )


def _axes(base: Plan, cases: pd.DataFrame) -> dict[str, str]:
    """Column of the cases for each axis of the database: damage, and what of the rig was swept."""
    path = base.rig.path
    special = {
        ("operating", "speed_rpm"): "speed_rpm",
        ("operating", "torque"): "torque",
        ("gears", base.gear, "teeth"): "teeth",
    }
    rig = {dotted: special.get(path(dotted), dotted) for dotted in base.rig_points.swept}
    return {name: name for name in ("damaged_teeth", *base.damage_fields)} | rig


def _teeth(design: Design) -> list[int] | str:
    named = [grid.tooth for grid in design.grid]
    return "all" if "all" in named else sorted({tooth for teeth in named for tooth in teeth if isinstance(tooth, int)})


def _listed(design: Design, axis: str) -> list[float]:
    """Values of a measurement's axis that the grids list."""
    return sorted({value for grid in design.grid for value in getattr(grid, axis)})
