"""Verification: healthy signals nearby, in closed form, against differences of whole solutions."""

from functools import reduce

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics import HealthySensitivity, prepare_periodic
from sigdb.transmission import Sensitivity, Transmission, equations_of, load_transmission, synthesise

EXCITED = {
    "gears.pinion.unbalance": 2e-4,
    "gears.pinion.runout": 2e-6,
    "gears.wheel.runout": 3e-6,
    "operating.load_fluctuation": 0.2,
    "operating.load_order": 4,
    "meshes.main.damping": 300.0,
    "meshes.main.profile_error": {"amplitude": 3e-6},
    "sensors.pinion-vertical.direction": [0.1, 1.0, 0.0],
}
NUMBERS = {
    "bearings.pinion.stiffness": [1e8, 1e8, 0.0],
    "gears.wheel.mass": 2.5,
    "gears.pinion.unbalance": 2e-4,
    "couplings.brake.inertia": 0.0045,
    "meshes.main.stiffness": 2e8,
    "meshes.main.module": 3e-3,
    "meshes.main.pressure_angle_deg": 20.0,
    "meshes.main.profile.contact_ratio": 1.6,
    "meshes.main.profile_error.amplitude": 3e-6,
    "sensors.pinion-vertical.direction": [0.1, 1.0, 0.0],
    "operating.speed_rpm": 1500.0,
    "operating.load_fluctuation": 0.2,
    "damping_ratio": 0.07,
}


def changed(rig, values):
    """The rig with other values by dotted path."""
    data = rig.model_dump()
    for path, value in values.items():
        *tables, field = path.split(".")
        reduce(dict.__getitem__, tables, data)[field] = value
    return Transmission.model_validate(data)


def signals(rig):
    return prepare_periodic(rig, samples_per_tooth=16, refine=False).healthy_signals()


@pytest.fixture(scope="module")
def rig():
    return changed(load_transmission("chaari-8dof"), EXCITED)


@pytest.fixture(scope="module")
def sensitivity(rig):
    modes = synthesise(rig)
    prepared = prepare_periodic(rig, samples_per_tooth=16, refine=False, system=modes.system())
    return HealthySensitivity(prepared, Sensitivity(modes))


@pytest.mark.parametrize("path", NUMBERS)
def test_derivatives_are_those_of_whole_solutions(rig, sensitivity, path):
    value, step = NUMBERS[path], np.array([1e-4, 0.0, 0.0]) if path.endswith("direction") else 1e-4

    def moved(factor):
        return changed(rig, {path: (np.asarray(value) * (1 + factor * step)).tolist()})

    expected = (signals(moved(1)) - signals(moved(-1))) / 2
    found = 100 * (sensitivity.signals_nearby(equations_of(moved(0.01))) - sensitivity.prepared.healthy_signals())
    assert_allclose(found, expected, rtol=0, atol=1e-3 * np.abs(expected).max())


def test_the_rig_itself_is_near(rig, sensitivity):
    assert_allclose(
        sensitivity.signals_nearby(equations_of(rig)), signals(rig), rtol=0, atol=1e-9 * np.ptp(signals(rig))
    )
