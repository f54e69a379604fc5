"""Extensions: plans of cases that are appended to a database."""

import numpy as np

from sigdb.core import ComplexArray, FloatArray, validated
from sigdb.database import Manifest, root_mean_square, unit_residuals
from sigdb.sweep.density.study import Study
from sigdb.sweep.design.axes import LIFE_AXES, MEASUREMENT_AXES
from sigdb.sweep.design.settings import SweepSettings
from sigdb.sweep.plan.layout import consecutive
from sigdb.sweep.plan.make_plan import make_plan, plan_from
from sigdb.sweep.plan.plan import Plan


def extension(manifest: Manifest, study: Study, match: float) -> Plan:
    """Return the plan of the poorly matched cases of a study, with all else as the database was begun.

    Each case has its own measurements, and all teeth that the database has for its tooth count.
    """
    base, last = plan_from(manifest.resolved), plan_from(manifest.plans[-1].resolved)
    rows = study.cases.loc[distant_cases(study, match)].merge(study.measurements, on="off_grid")
    axes = _columns_of_axes(base)
    grids = [
        {
            "tooth": _teeth(base, int(some["teeth"].iloc[0])),
            "table": {axis: some[column].tolist() for axis, column in axes.items()} | _no_life(base, len(some)),
        }
        for _, some in rows.groupby("teeth")
    ]
    kept = base.design.model_dump(include={"rig", "gear", "seed", "specimens", "draws", "solver", "ensemble"})
    return make_plan(
        validated(SweepSettings, kept | {"grid": grids}, owner="refinement"),
        base.measurement,
        base.signature,
        base.rig,
        first_row_part=last.first_row_part + last.row_parts,
        first_template_part=last.first_template_part + last.template_parts,
        part_rows=manifest.part_rows,
        base_fields=base.damage_fields,
        nuisance=base.nuisance,
    )


def distant_cases(study: Study, match: float) -> list[int]:
    """Return the places of poorly matched cases; no two of them match each other.

    The worst matched case is first taken, then the worst of those that do not match it, and so on.
    """
    poor = study.cases["match"][study.cases["match"] < match].sort_values(kind="stable")
    kept: list[int] = []
    residuals = {at: _unit_spectrum(study.signals[at], int(study.cases.loc[at, "teeth"])) for at in poor.index}
    for at in poor.index:
        n = len(study.signals[at])
        alike = (np.fft.irfft(residuals[at] * residuals[i].conj(), n).max() for i in kept if len(study.signals[i]) == n)
        if all(overlap < match for overlap in alike):
            kept.append(at)
    return sorted(kept)


def _unit_spectrum(tsa: FloatArray, teeth: int) -> ComplexArray:
    """Return the FFT of the residual, scaled so that a circular correlation of two is their overlap."""
    z = unit_residuals(tsa, teeth)
    return np.fft.rfft(z / (root_mean_square(z) * np.sqrt(len(z))))


def _columns_of_axes(base: Plan) -> dict[str, str]:
    """Return the column of a case for each axis of the database: damage, swept parameters of the rig, measurements."""
    columns = {
        ("operating", "speed_rpm"): "speed_rpm",
        ("operating", "torque"): "torque",
        ("gears", base.gear, "teeth"): "teeth",
    }
    rig = {axis: columns.get(base.rig.path(axis), axis) for axis in base.rig_points.swept}
    return {name: name for name in ("damaged_teeth", *base.damage_fields, *MEASUREMENT_AXES)} | rig


def _no_life(base: Plan, cases: int) -> dict[str, list[float]]:
    """Return the columns of lives for cases that are of none, where the database has them."""
    return {axis: [0.0] * cases for axis in LIFE_AXES if axis in base.measurements}


def _teeth(base: Plan, teeth: int) -> list[int] | str:
    """Return the first damaged teeth that a plan has rows for on a gear of that many teeth."""
    runs = base.row_runs
    of_gear = base.rig_points.teeth[base.templates.rig[runs.template]] == teeth
    at = consecutive(runs.tooth_start[of_gear], runs.tooth_count[of_gear])
    named = np.unique(runs.teeth[at])
    damaged = named[named > 0].tolist()
    return "all" if len(damaged) == teeth else damaged
