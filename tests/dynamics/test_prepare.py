import numpy as np
import pytest

import sigdb
from sigdb.core import InputError


@pytest.fixture(scope="module")
def prepared():
    return sigdb.prepare("nasa-spiral-bevel")


def test_a_prepared_rig_simulates_as_simulate_does(prepared):
    errors = 1e-6 * np.random.default_rng(0).standard_normal(12)
    for damage in (None, {"tooth": 6, "stiffness_loss": 0.4}, sigdb.Damage(tooth=12, damaged_teeth=2, friction=0.1)):
        ours = prepared.simulate(damage, index_errors=errors)
        theirs = sigdb.simulate("nasa-spiral-bevel", damage, index_errors=errors)
        for sensor in theirs.signals:
            np.testing.assert_array_equal(ours.signal(sensor), theirs.signal(sensor))


def test_another_gear_is_refused(prepared):
    with pytest.raises(InputError, match=r"gear = 'gear', but the rig is prepared for 'pinion'"):
        prepared.simulate({"gear": "gear", "tooth": 1, "stiffness_loss": 0.3})
