"""Validation: the geared turbo-generator set going by unbalance, marched, against the history that ROSS computes.

The case has no preload, so that the mesh is pulled as often as pressed: it is marched without backlash, where it does
both. ``data/reference/ross_time_response.csv`` says how it was made and how exact it is.
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics.march.marcher import Marcher, MeshTables
from sigdb.transmission import Transmission, elements_from, load_transmission, modal_system

REFERENCE = Path(__file__).parents[2] / "data" / "reference" / "ross_time_response.csv"
SENSORS = {
    "wheel-vertical": ("wheel", (0.0, 1.0, 0.0), "displacement"),
    "pinion-horizontal": ("pinion", (1.0, 0.0, 0.0), "displacement"),
    "pinion-vertical": ("pinion", (0.0, 1.0, 0.0), "displacement"),
    "pinion-vertical-velocity": ("pinion", (0.0, 1.0, 0.0), "velocity"),
}
NO_BACKLASH = 1e-18
"""Way between the flanks, m: below all deflections."""


@pytest.fixture(scope="module")
def history():
    """Columns of the file by name, and the error stated for each but time, of its peak-to-peak."""
    lines = REFERENCE.read_text(encoding="utf-8").splitlines()
    (stated,) = (line.split(",")[1:] for line in lines if line.startswith("# error,"))
    names, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    columns = dict(zip(names, np.array(rows, float).T, strict=True))
    return columns, dict(zip(names[1:], map(float, stated), strict=True))


def unbalanced_rig():
    data = load_transmission("friswell-turbogenerator").model_dump()
    data["gears"]["wheel"] |= {"unbalance": 1e-2}
    data["gears"]["pinion"] |= {"unbalance": 1e-4, "unbalance_angle_deg": 60.0}
    data["meshes"]["main"] |= {"backlash": NO_BACKLASH}
    data["sensors"] = {
        name: {"gear": gear, "direction": direction, "quantity": quantity}
        for name, (gear, direction, quantity) in SENSORS.items()
    }
    return Transmission(**data)


@pytest.fixture(scope="module")
def marched(history):
    """Outputs by name at the file's times with two steps, and the mesh force; the mesh stiffness is its mean."""
    rig, (columns, _) = unbalanced_rig(), history
    system, time = modal_system(rig), columns["time"]
    turning = [len(system.meshes) + 2 + i for i in range(2 * len(system.unbalanced))]
    others = np.eye(system.inputs.shape[1])[:, turning]
    tables = MeshTables(
        rates=np.ones(1),
        forces=np.array([[[rig.meshes["main"].stiffness] * 2, [0.0] * 2]]),
        friction=np.zeros((0, 2, 2)),
    )
    found = []
    for finer in (25, 50):
        t = np.arange((len(time) - 1) * finer + 1) * (time[1] / finer)
        angles = np.array([abs(rig.speed(shaft)) * t for shaft in system.unbalanced])
        forces = np.ascontiguousarray(np.stack([np.cos(angles), np.sin(angles)], axis=1).reshape(-1, len(t)).T)
        marcher = Marcher(system, elements_from(rig, "wheel", system), tables, t[1], others)
        rest = np.zeros((system.poles.imag >= 0).sum(), complex)
        first, _ = marcher.start(rest, 0.0, forces[0], np.zeros(0))
        outputs, mesh_force = marcher.run(np.zeros(len(t) - 1), forces[1:], np.zeros((len(t) - 1, 0)))
        found.append(np.vstack([first, outputs])[::finer])
    names = system.meshes + system.sensors
    return *(dict(zip(names, one.T, strict=True)) for one in found), mesh_force[:, 0]


def test_the_mesh_is_pressed_and_pulled(marched):
    force = marched[2]
    assert force.max() > 0
    assert force.min() < -0.1 * force.max()


@pytest.mark.parametrize("name", ["main", *SENSORS])
def test_the_marched_history_is_that_of_ross(name, history, marched):
    """The error of the march is taken out by its order, as in ``settle``; what is left of it is below ROSS's own."""
    coarse, fine, _ = marched
    columns, error = history
    exact, size = fine[name] + (fine[name] - coarse[name]) / 3, np.ptp(columns[name])
    assert_allclose(exact, columns[name], rtol=0, atol=1.2 * error[name] * size)
    # The march alone: second order, and its error at 4 us.
    assert_allclose(coarse[name] - exact, 4 * (fine[name] - exact), rtol=0, atol=1e-12 * size)
    assert np.abs(coarse[name] - exact).max() < 1e-4 * size
