"""Verification: modes nearby, in closed form, against whole solutions and a formula."""

from functools import reduce

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission import Sensitivity, Transmission, coupled_modes, equations_of, load_transmission, synthesise

NUMBERS = {
    "bearings.left.stiffness": [1.2e6, 1e6, 1e8],
    "materials.steel.young_modulus": 2.11e11,
    "disks.large.outer_diameter": 0.35,
    "operating.speed_rpm": 4000.0,
    "damping_ratio": 0.02,
}
MODES = 12
STEP = 1e-4


def changed(rig, values):
    """The rig with other values by dotted path."""
    data = rig.model_dump()
    for path, value in values.items():
        *tables, field = path.split(".")
        reduce(dict.__getitem__, tables, data)[field] = value
    return Transmission.model_validate(data)


def both(modes):
    """The frequencies and damping ratios of the lowest modes."""
    return np.concatenate([modes.frequency_hz[:MODES], modes.damping_ratio[:MODES]])


@pytest.fixture(scope="module")
def rotor():
    return changed(load_transmission("friswell-5.9.1"), NUMBERS)


@pytest.fixture(scope="module")
def sensitivity(rotor):
    return Sensitivity(synthesise(rotor))


@pytest.mark.parametrize("path", NUMBERS)
def test_derivatives_are_those_of_whole_solutions(rotor, sensitivity, path):
    def moved(step):
        return changed(rotor, {path: (np.asarray(NUMBERS[path]) * (1 + step)).tolist()})

    size = both(sensitivity.modes)
    expected = (both(coupled_modes(moved(STEP))) - both(coupled_modes(moved(-STEP)))) / (2 * STEP)
    found = (both(sensitivity.modes_nearby(equations_of(moved(STEP / 100)))) - size) / (STEP / 100)
    assert_allclose(found / size, expected / size, rtol=1e-3, atol=1e-4)


def test_equal_frequencies_part_as_the_change_demands(rotor):
    """At rest, in round bearings: a bearing softer across one direction moves the modes of that direction alone."""
    across = [1e6, 1e6, 1e8]
    values = {"operating.speed_rpm": 0.0, "bearings.left.stiffness": across, "bearings.right.stiffness": across}
    round_rotor = changed(rotor, values)
    softer = changed(round_rotor, {"bearings.left.stiffness": [1e6 * (1 - 1e-4), 1e6, 1e8]})
    before, whole = coupled_modes(round_rotor), coupled_modes(softer)
    nearby = Sensitivity(synthesise(round_rotor)).modes_nearby(equations_of(softer))
    assert_allclose(before.frequency_hz[0], before.frequency_hz[1], rtol=1e-9)
    moved = nearby.frequency_hz[:6] / before.frequency_hz[:6] - 1
    assert_allclose(moved, whole.frequency_hz[:6] / before.frequency_hz[:6] - 1, atol=1e-8)
    assert_allclose(np.sort(np.abs(moved))[:3], 0.0, atol=1e-9)
    assert (np.sort(np.abs(moved))[3:] > 1e-6).all()
