"""How often teeth part: in the templates and rows of the recipes, and over a grid of damage on every built-in rig.

A case counts where the least force of a mesh, in the linear periodic solution, is below zero. Forces are
fractions of the static one. Rows of a recipe have their specimen's index errors; a template has none. The grid has
every stiffness loss with every phase shift, the latter in tooth passes so that it means the same on every gear.

    python benchmarks/contact_loss.py [--json FILE]
"""

import argparse
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, json_option, publish
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core.streams import specimen_stream
from sigdb.dynamics import PeriodicRig, SteadyState, prepare_periodic
from sigdb.measurement import index_errors
from sigdb.pipeline.recipe import load_recipe
from sigdb.sweep import Plan
from sigdb.transmission import ToothDamage, Transmission, built_in_transmissions

RECIPES = sorted((Path(__file__).parents[1] / "pipelines").glob("*.toml"))
LOSSES = tuple(round(0.1 * i, 1) for i in range(11))
SHIFTS = (-0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2)
"""Tooth passes; positive is later."""
DAMAGED_TEETH = (1, 2, 3)
SAMPLES_PER_TOOTH = 32


def main() -> None:
    """Print the tables, or a JSON document with the same numbers and every case of the grid."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    given = parser.parse_args()
    with threadpool_limits(1):
        recipes = [of_recipe(load_recipe(path).plan(), path.stem) for path in RECIPES]
        cases = {rig.name: list(grid(rig)) for rig in loaded()}
    rigs = [row for name, found in cases.items() for row in summaries(name, found)]
    machine = environment("numpy", "scipy")
    losses = f"Losses {LOSSES[0]} to {LOSSES[-1]}, shifts {SHIFTS[0]} to {SHIFTS[-1]} passes"
    publish(machine, {"Recipes": recipes, losses: rigs}, given.json, more={"cases": cases})


def loaded() -> Iterator[Transmission]:
    """The built-in rigs that have torque through a mesh."""
    for name in built_in_transmissions():
        rig = sigdb.load_transmission(name)
        if rig.meshes and rig.operating.torque:
            yield rig


def grid(rig: Transmission) -> Iterator[dict[str, Any]]:
    """The healthy rig, then least force by case."""
    prepared = prepare_periodic(rig, samples_per_tooth=SAMPLES_PER_TOOTH)
    for teeth in (0, *DAMAGED_TEETH):
        for loss in LOSSES if teeth else (0.0,):
            for shift in SHIFTS if teeth else (0.0,):
                if bool(teeth) == bool(loss or shift):
                    least = least_force(prepared, teeth, loss, shift)
                    yield {"damaged_teeth": teeth, "stiffness_loss": loss, "shift": shift, "min_mesh_force": least}


def least_force(prepared: PeriodicRig, teeth: int, loss: float, shift: float) -> float:
    """Of a case with damage from tooth 1 on."""
    one = ToothDamage(stiffness_loss=loss, phase_shift_deg=360 / prepared.teeth * shift)
    return prepared.steady_state([dict.fromkeys(range(1, teeth + 1), one)], specimens=False)[0].min_mesh_force


def summaries(name: str, cases: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each number of damaged teeth."""
    rows = []
    healthy = cases[0]["min_mesh_force"]
    for teeth in DAMAGED_TEETH:
        found = [case for case in cases if case["damaged_teeth"] == teeth]
        lost = [case for case in found if case["min_mesh_force"] < 0]
        rows.append(
            {
                "rig": name,
                "healthy": healthy,
                "damaged teeth": teeth,
                "cases": len(found),
                "parted": f"{len(lost) / len(found):.0%}",
                "from loss, no shift": lowest(case["stiffness_loss"] for case in lost if not case["shift"]),
                "from shift, no loss": lowest(abs(case["shift"]) for case in lost if not case["stiffness_loss"]),
            }
        )
    return rows


def lowest(values: Iterator[float]) -> float | str:
    """The least of some values, or a dash."""
    return min(values, default="-")


def of_recipe(plan: Plan, name: str) -> dict[str, Any]:
    """Templates and rows of a recipe that lose contact."""
    prepared = [
        prepare_periodic(point.rig, gear=plan.gear, samples_per_tooth=plan.signature.samples_per_tooth)
        for point in plan.rig_points
    ]
    cases = list(plan.cases())
    states = [prepared[case.rig_point].steady_state([case.damage.on_teeth(prepared[case.rig_point].teeth)])[0]
              for case in cases]  # fmt: skip
    least = np.array([state.min_mesh_force for state in states])
    of_rows = least_of_rows(plan, states)
    healthy = [least[i] for i, case in enumerate(cases) if not case.damage.is_damage]
    return {
        "recipe": name,
        "templates": len(least),
        "parted": int(np.count_nonzero(least < 0)),
        "healthy": float(min(healthy)),
        "least": float(least.min()),
        "rows": plan.rows,
        "rows parted": int(np.count_nonzero(of_rows < 0)),
        "share of rows": f"{np.mean(of_rows < 0):.1%}",
        "least of rows": float(of_rows.min()),
    }


def least_of_rows(plan: Plan, states: list[SteadyState]) -> Any:
    """(rows,) least force of each row with its specimen; noise draws of a case have the same."""
    rows = plan.table(0, plan.rows)
    same = rows.groupby(["template", "tooth", "specimen", "index_error"], sort=False)["id"]
    least = np.empty(plan.rows)
    for (template, tooth, specimen, index_error), ids in same:
        least[ids.to_numpy()] = least_of_row(plan, states[template], template, tooth, specimen, index_error)
    return least


def least_of_row(plan: Plan, state: SteadyState, template: int, tooth: int, specimen: int, index_error: float) -> float:
    """Least force of a template, turned to a tooth, with a specimen's index errors."""
    if state.min_mesh_force < 0:
        return state.min_mesh_force
    case = plan.case(template)
    point, turn = plan.rig_points[case.rig_point], tooth - case.damage.tooth
    angle = np.array(state.orders) * turn * 2 * np.pi / point.teeth
    phases = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    errors = np.roll(unit_errors(plan.seed, specimen, point.teeth, point.mate_teeth), -turn) * index_error
    force = state.mesh_force_at(errors, phases) / state.static_force
    return min(float(force.min()), float(state.least_force_elsewhere))


@cache
def unit_errors(seed: int, specimen: int, teeth: int, mate_teeth: int) -> Any:
    """(teeth,) index errors of a specimen, for a size of 1."""
    return index_errors(specimen_stream(seed, specimen), teeth, mate_teeth)


if __name__ == "__main__":
    main()
