"""Validation: natural frequencies of the geared turbo-generator against those that ROSS computes.

``data/reference/ross_two_shaft.csv`` is written by ``benchmarks/ross_frequencies.py`` with the versions in its head.
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission import coupled_modes, load_transmission

REFERENCE = Path(__file__).parents[2] / "data" / "reference" / "ross_two_shaft.csv"


def recorded():
    with REFERENCE.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    speeds = sorted({float(row["speed_rpm"]) for row in rows})
    return {s: [float(row["frequency_hz"]) for row in rows if float(row["speed_rpm"]) == s] for s in speeds}


def test_the_reference_says_which_versions_made_it():
    head = REFERENCE.read_text(encoding="utf-8").splitlines()[:2]
    assert "ross-rotordynamics 2." in head[1]
    assert "benchmarks/ross_frequencies.py" in head[1]


@pytest.mark.parametrize("speed_rpm", recorded())
def test_the_24_lowest_frequencies_are_those_of_ross(speed_rpm):
    """Both use the same consistent Timoshenko element, so that what is left is ROSS's own rounding of the recorded
    digits and of its constants: 5e-6, twenty times below the published digits."""
    expected = recorded()[speed_rpm]
    assert len(expected) == 24
    rig = load_transmission("friswell-turbogenerator").replace({"operating.speed_rpm": speed_rpm})
    found = coupled_modes(rig).frequency_hz
    assert_allclose(np.sort(found[found > 0.1])[:24], expected, rtol=5e-6)
