"""The plan of cases that are appended to a database."""

from typing import Any

import numpy as np

from sigdb.core import FloatArray, validated
from sigdb.database import Manifest, root_mean_square, unit_residuals
from sigdb.sweep.density.study import Study
from sigdb.sweep.design.axes import MEASUREMENT_AXES
from sigdb.sweep.design.design import SweepSettings
from sigdb.sweep.plan.layout import consecutive
from sigdb.sweep.plan.make_plan import make_plan, plan_from
from sigdb.sweep.plan.plan import Plan


def extension(manifest: Manifest, study: Study, match: float) -> Plan:
    """The plan of the cases that a study found poorly matched, with all else as the database was begun with.

    Each case has its own measurements, and all teeth that the database has for its tooth count.
    """
    base, last = plan_from(manifest.resolved), plan_from(manifest.plans[-1].resolved)
    rows = study.cases.loc[apart(study, match)].merge(study.measurements, on="off_grid")
    axes = _columns_of_axes(base)
    grids = [
        {
            "tooth": _teeth(base, int(some["teeth"].iloc[0])),
            "table": {axis: some[column].tolist() for axis, column in axes.items()},
        }
        for _, some in rows.groupby("teeth")
    ]
    kept = base.design.model_dump(include={"rig", "gear", "seed", "specimens", "draws", "solver"})
    return make_plan(
        validated(SweepSettings, kept | {"grid": grids}, owner="refinement"),
        base.measurement,
        base.signature,
        base.rig,
        first_row_part=last.first_row_part + last.row_parts,
        first_template_part=last.first_template_part + last.template_parts,
        part_rows=manifest.part_rows,
        base_fields=base.damage_fields,
    )


def apart(study: Study, match: float) -> list[int]:
    """The worst matched case, the worst of those that do not match that one either, and so on: their places."""
    poor = study.cases["match"][study.cases["match"] < match].sort_values(kind="stable")
    kept: list[int] = []
    residuals = {at: _unit_spectrum(study.signals[at], int(study.cases.loc[at, "teeth"])) for at in poor.index}
    for at in poor.index:
        n = len(study.signals[at])
        alike = (
            np.fft.irfft(residuals[at] * residuals[one].conj(), n).max() for one in kept if len(study.signals[one]) == n
        )
        if all(overlap < match for overlap in alike):
            kept.append(at)
    return sorted(kept)


def _unit_spectrum(tsa: FloatArray, teeth: int) -> Any:
    """FFT of the residual, scaled so that a circular correlation of two is their overlap."""
    z = unit_residuals(tsa, teeth)
    return np.fft.rfft(z / (root_mean_square(z) * np.sqrt(len(z))))


def _columns_of_axes(base: Plan) -> dict[str, str]:
    """Column of a case for each axis of the database: damage, what of the rig was swept, and measurements."""
    own = {
        ("operating", "speed_rpm"): "speed_rpm",
        ("operating", "torque"): "torque",
        ("gears", base.gear, "teeth"): "teeth",
    }
    rig = {axis: own.get(base.rig.path(axis), axis) for axis in base.rig_points.swept}
    return {name: name for name in ("damaged_teeth", *base.damage_fields, *MEASUREMENT_AXES)} | rig


def _teeth(base: Plan, teeth: int) -> list[int] | str:
    """First damaged teeth that a plan has rows for on a gear of that many teeth."""
    segments = base.segments
    of_gear = base.rig_points.teeth[base.templates.rig[segments.template]] == teeth
    at = consecutive(segments.tooth_start[of_gear], segments.tooth_count[of_gear])
    named = np.unique(segments.teeth[at])
    damaged = named[named > 0].tolist()
    return "all" if len(damaged) == teeth else damaged
