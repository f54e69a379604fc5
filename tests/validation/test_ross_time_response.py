"""Validation: the geared turbo-generator set going by unbalance, against the history that ROSS computes.

``data/reference/ross_time_response.csv`` is written by ``benchmarks/ross_time_response.py`` with the versions, the case
and ROSS's own error of integration in its head.
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission import Transmission, load_transmission, modal_system

REFERENCE = Path(__file__).parents[2] / "data" / "reference" / "ross_time_response.csv"
SENSORS = {
    "wheel-vertical": ("wheel", (0.0, 1.0, 0.0), "displacement"),
    "pinion-horizontal": ("pinion", (1.0, 0.0, 0.0), "displacement"),
    "pinion-vertical": ("pinion", (0.0, 1.0, 0.0), "displacement"),
    "pinion-vertical-velocity": ("pinion", (0.0, 1.0, 0.0), "velocity"),
}


def recorded():
    """Time, s, then the mesh's compression and the sensors by name; and the error stated for each but time."""
    lines = REFERENCE.read_text(encoding="utf-8").splitlines()
    (stated,) = (line.split(",")[1:] for line in lines if line.startswith("# error,"))
    names, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    history = dict(zip(names, np.array(rows, float).T, strict=True))
    return history, dict(zip(names[1:], map(float, stated), strict=True))


def unbalanced_rig():
    """The published rig with the recorded case's unbalances and the sensors that it has columns for."""
    data = load_transmission("friswell-turbogenerator").model_dump()
    data["gears"]["wheel"] |= {"unbalance": 1e-2}
    data["gears"]["pinion"] |= {"unbalance": 1e-4, "unbalance_angle_deg": 60.0}
    data["sensors"] = {
        name: {"gear": gear, "direction": direction, "quantity": quantity}
        for name, (gear, direction, quantity) in SENSORS.items()
    }
    return Transmission(**data)


def response_from_rest(rig, t):
    """By name, to a force ``Re(f exp(i w t))`` from t = 0: ``z = b f (exp(i w t) - exp(lambda t)) / (i w - lambda)``.

    The output's real part is the response to the force's real part, since the impulse response is real.
    """
    system = modal_system(rig)
    y = np.zeros((len(system.outputs), len(t)))
    for i, shaft in enumerate(system.unbalanced):
        w = abs(rig.speed(shaft))
        cosine = len(system.meshes) + 2 + 2 * i
        phasor = np.zeros(system.inputs.shape[1], complex)
        phasor[cosine : cosine + 2] = 1.0, -1.0j
        driven, free = np.exp(1j * w * t), np.exp(np.multiply.outer(system.poles, t))
        z = (system.inputs @ phasor / (1j * w - system.poles))[:, None] * (driven - free)
        y += (system.outputs @ z + np.multiply.outer(system.direct @ phasor, driven)).real
    return dict(zip(system.meshes + system.sensors, y, strict=True))


def test_the_reference_says_which_versions_made_it_and_how_exact_it_is():
    head = REFERENCE.read_text(encoding="utf-8").splitlines()[:2]
    assert "ross-rotordynamics 2." in head[1]
    assert "benchmarks/ross_time_response.py" in head[1]
    assert max(recorded()[1].values()) < 1e-6


@pytest.mark.parametrize("name", ["main", *SENSORS])
def test_the_history_from_rest_is_that_of_ross(name):
    """Both have the same elements, so that what is left is ROSS's error of integration. It is known by halving the
    step, to the digits that are stated; a tenth more is for those digits and for the peak between them."""
    history, error = recorded()
    exact = response_from_rest(unbalanced_rig(), history["time"])[name]
    assert len(exact) == 1001
    assert_allclose(history[name], exact, rtol=0, atol=1.1 * error[name] * np.ptp(exact))
