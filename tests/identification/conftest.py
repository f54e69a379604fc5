"""A heavy wheel on a short stiff shaft in two equal bearings with a range, and a published gear pair."""

import pytest

from sigdb.identification.rig_response import RigResponse
from sigdb.transmission import load_transmission

RIG = """
name = "wheel"
damping_ratio = 0.02
assumed.damping_ratio = { low = 0.01, high = 0.03 }

[operating]
shaft = "shaft"
speed_rpm = 0.0

[materials.steel]
density = 1.0
young_modulus = 2.0e11
shear_modulus = 8.0e10

[shafts.shaft]
axis = [0.0, 0.0, 1.0]
material = "steel"

[[shafts.shaft.segments]]
length = 0.2
outer_diameter = 0.2
elements = 2

[gears.wheel]
shaft = "shaft"
node = 1
teeth = 40
mass = 100.0
diametral_inertia = 1.0
polar_inertia = 2.0

[bearings.left]
shaft = "shaft"
node = 0
stiffness = [1.2e6, 3.0e6, 5.0e6]
assumed.stiffness = { low = 0.5e6, high = 2.0e6, scale = "log" }

[bearings.right]
shaft = "shaft"
node = 2
stiffness = [1.2e6, 3.0e6, 5.0e6]
assumed.stiffness = { as = "bearings.left.stiffness" }

[sensors.across]
gear = "wheel"
direction = [1.0, 0.0, 0.0]
quantity = "acceleration"
"""


@pytest.fixture(scope="session")
def wheel_text():
    return RIG


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    path = tmp_path_factory.mktemp("wheel") / "wheel.toml"
    path.write_text(RIG, encoding="utf-8")
    return load_transmission(path)


@pytest.fixture(scope="session")
def rig():
    return load_transmission("chaari-8dof")


@pytest.fixture(scope="session")
def response(rig):
    return RigResponse(rig)
