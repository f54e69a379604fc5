"""Unit: a rig from a few known numbers is valid, of the right size, and says where each of its numbers is from."""

import math

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.transmission import Assumptions, describe_rig
from sigdb.transmission.known.stage_size import bearing_stiffness, size_stage

SPREAD = [
    {"teeth": "12/12", "torque": 1.0, "speed": 10000.0},
    {"teeth": "12/120", "torque": 1.0, "speed": 100.0, "module": 0.02},
    {"teeth": "120/12", "torque": 10000.0, "speed": 1000.0, "module": 0.02},
    {"teeth": "17/19", "torque": 0.5, "speed": 3000.0, "module": 0.0005},
    {"teeth": "120/120", "torque": 10000.0, "speed": 300.0},
    {"teeth": "120/120", "torque": 200.0, "speed": 300.0, "helix_angle": 5.0},
    {"teeth": "23/67", "torque": 45.0, "speed": 1480.0, "module": 0.0025, "helix_angle": 30.0},
    {"teeth": "21/106", "torque": 150.0, "speed": 400.0, "energy_method": True},
    {"teeth": "32/80,48/64", "torque": 15.0, "speed": 1800.0, "module": 0.0015},
    {"teeth": "80/20,19/81", "torque": 3.0, "speed": 1800.0, "helix_angle": 15.0},
    {"teeth": "23/67,19/81,17/90", "torque": 45.0, "speed": 1480.0, "module": (0.0025, 0.004, 0.006)},
]


@pytest.mark.parametrize("known", SPREAD, ids=lambda known: known["teeth"])
def test_a_rig_from_known_numbers_has_no_remarks(known):
    rig = sigdb.new_rig(**known)
    facts = describe_rig(rig)
    assert facts["remarks"] == []
    assert all(0 < mesh["static_compression"] < 1e-4 for mesh in facts["meshes"])
    stages = [tuple(map(int, pair.split("/"))) for pair in known["teeth"].split(",")]
    assert [(rig.gears[mesh.driving].teeth, rig.gears[mesh.driven].teeth) for mesh in rig.meshes.values()] == stages
    assert (rig.operating.torque, rig.operating.speed_rpm) == (known["torque"], known["speed"])


@pytest.mark.parametrize("known", [SPREAD[i] for i in (0, 2, 4, 5, 7, 9, 10)], ids=lambda known: known["teeth"])
def test_every_corner_of_the_ranges_is_a_valid_rig(known):
    rig = sigdb.new_rig(**known)
    free = rig.assumptions.free
    assert ((rig.assumptions.to_unit(rig) >= 0) & (rig.assumptions.to_unit(rig) <= 1)).all()
    for corner in (np.zeros(len(free)), np.ones(len(free)), np.arange(len(free)) % 2, np.arange(1, len(free) + 1) % 2):
        member = rig.with_assumed(rig.assumptions.from_unit(corner))
        assert all(member.gears[name].bore > 0 for name in member.gears)


def without_source_or_range(part, fields=()):
    """Yield the fields of a rig whose numbers have no source, or are assumed without a range, choices or a tie."""
    if not hasattr(part, "sources"):
        return
    for name in type(part).model_fields:
        value = getattr(part, name)
        if name in ("sources", "assumed") or value == type(part).model_fields[name].default:
            continue
        for inner in value.values() if isinstance(value, dict) else value if isinstance(value, tuple) else (value,):
            yield from without_source_or_range(inner, (*fields, name))
        if isinstance(value, int | float) or (isinstance(value, tuple) and value and isinstance(value[0], float)):
            source = part.sources.get(name, "none")
            if source == "none" or (source.startswith("assumed:") and name not in part.assumed):
                yield ".".join((*fields, name))


@pytest.mark.parametrize("known", SPREAD[6:10], ids=lambda known: known["teeth"])
def test_every_number_has_a_source_and_every_assumed_one_a_range(known):
    rig = sigdb.new_rig(**known)
    assert set(without_source_or_range(rig)) == set()
    assert isinstance(rig.assumptions, Assumptions)
    free = {number.path for number in rig.assumptions.free}
    assert ("meshes.main.module" in free) == (known.get("module") is None and "," not in known["teeth"])


@pytest.mark.parametrize(
    "known",
    [
        {"teeth": "18/36", "module": "2.5mm", "speed": "1480rpm", "torque": "45Nm"},
        {"teeth": [(12, 24), (12, 24)], "speed": "25 Hz", "torque": "0.12 kN m", "helix_angle": "15 deg"},
    ],
    ids=["spur", "two helical stages"],
)
def test_the_healthy_rig_keeps_contact(known):
    assert sigdb.simulate(sigdb.new_rig(**known)).min_mesh_force > 0.2


def test_a_helical_module_is_the_normal_one_and_axial_forces_on_a_shaft_are_opposite():
    rig = sigdb.new_rig("23/67,19/81", module="2.5 mm", speed=1480.0, torque=45.0, helix_angle="15 deg")
    assert math.isclose(rig.meshes["stage-1"].module, 0.0025 / math.cos(math.radians(15)), rel_tol=1e-12)
    axial = {force["gear"]: force["axial"] for force in describe_rig(rig)["tooth_forces"]}
    assert axial["wheel-1"] * axial["pinion-2"] < 0


def test_sizes_follow_the_rules():
    # Root stress: 2 x 45 / (23 x 2.5 mm) N on 25 mm x 2.5 mm, times 6.5.
    size = size_stage((23, 67), 45.0, 0.0, 0.0025, "rig")
    assert (size.face_width, size.least_width, size.most_width) == (0.025, 0.0175, 0.035)
    assert math.isclose(size.bending, 2 * 45 / (23 * 0.0025) / (0.025 * 0.0025) * 6.5, rel_tol=1e-12)
    # The module goes with the cube root of the torque: 8 times the torque, twice the module.
    assert (
        size_stage((20, 40), 400.0, 0.0, None, "rig").module == 2 * size_stage((20, 40), 50.0, 0.0, None, "rig").module
    )
    # Kraemer's formula goes with the cube root of the load, above the least load of the bearing.
    assert math.isclose(bearing_stiffness(0.02, 8000.0), 2 * bearing_stiffness(0.02, 1000.0), rel_tol=1e-12)
    assert bearing_stiffness(0.02, 0.0) == bearing_stiffness(0.02, 80.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"teeth": "23x67"}, "new_rig: teeth: '23x67' must be tooth counts of driving and driven gear, such as 23/67"),
        ({"teeth": "23/67,19/81,17/90,20/20"}, "teeth names 4 stages; a rig has at most 3"),
        ({"teeth": "5/67"}, "teeth = 5 must be from 8 to 400"),
        ({"module": 2.5}, r"module = 2.5 m must be from 0.0002 m to 0.06 m; did you mean 2.5 mm\?"),
        ({"module": "3 kg"}, r"module.0: '3 kg' is a mass; a length is needed, such as \"3 mm\""),
        ({"module": "2 mm,3 mm"}, "module has 2 values; give one for all stages, or 1"),
        (
            {"module": "1 mm", "torque": 4500.0},
            "bends teeth of module 1 mm by .* MPa, more than steel bears; a module of",
        ),
        ({"torque": -1.0}, "torque = -1.0 must be greater than 0"),
        ({"speed": "5 mm"}, "speed_rpm: '5 mm' is a length; a speed of rotation is needed"),
        ({"teeth": "12/120,12/120,12/120", "torque": 1e4}, "stage 2: .* asks for a module of .*; lower the torque"),
        ({"helix_angle": 15.0, "energy_method": True}, "the energy method is for spur teeth"),
        (
            {"teeth": "12/12", "helix_angle": 40.0},
            "the transverse contact ratio of 12/12 teeth is 1.0.*; raise the tooth",
        ),
    ],
)
def test_numbers_that_no_machine_has_are_refused(changed, message):
    with pytest.raises(InputError, match=message):
        sigdb.new_rig(**({"teeth": "23/67", "speed": 1480.0, "torque": 45.0} | changed))
