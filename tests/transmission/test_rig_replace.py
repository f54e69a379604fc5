"""Unit: parameters of a rig by dotted path, and rigs with other values."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.transmission import load_transmission
from sigdb.transmission.system.assembly import assemble


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


def test_a_part_is_found_by_its_name_or_by_its_full_path(rig):
    assert rig.path("pinion.teeth") == rig.path("gears.pinion.teeth") == ("gears", "pinion", "teeth")
    assert rig.path("operating.speed_rpm") == ("operating", "speed_rpm")
    assert rig.path("damping_ratio") == ("damping_ratio",)
    assert rig.path("main.profile.flank") == ("meshes", "main", "profile", "flank")
    assert rig.path("motor.inertia") == ("couplings", "motor", "inertia")
    assert rig.path("casing.modes.1.frequency_hz") == ("casing", "modes", "1", "frequency_hz")
    assert rig.path("gear-shaft.segments.0.length") == ("shafts", "gear-shaft", "segments", "0", "length")


def test_values_are_those_of_the_file(rig):
    assert rig.value("pinion.teeth") == 12.0
    assert rig.value("main.stiffness") == 2.2e8
    assert rig.value("casing.modes.2.modal_mass") == 45.0


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("pinon.teeth", r"has no part 'pinon' \(in 'pinon\.teeth'\); did you mean 'pinion'\?"),
        ("speed", r"rig 'nasa-spiral-bevel' has no part 'speed'"),
        ("pinion.teth", r"has no parameter 'pinion\.teth'; did you mean 'teeth'\?"),
        ("gears.wheel.teeth", r"has no parameter 'gears\.wheel\.teeth'; known: gear, pinion"),
        ("casing.modes.3.frequency_hz", r"has no parameter 'casing\.modes\.3\.frequency_hz'"),
        ("pinion", r"'pinion' of rig 'nasa-spiral-bevel' is not a number; name a numeric field"),
        ("pinion.shaft", r"'pinion\.shaft' of rig .* is not a number"),
        ("pinion.sources.teeth", r"'pinion\.sources\.teeth' of rig .* is not a number"),
        ("pinion-front.stiffness", r"'pinion-front\.stiffness' of rig .* is not a number"),
        ("pinion.teeth.x", r"has no parameter 'pinion\.teeth\.x'"),
    ],
)
def test_a_path_to_no_number_is_refused(rig, path, message):
    for use in (rig.path, rig.value, lambda path: rig.replace({path: 1.0})):
        with pytest.raises(InputError, match=message):
            use(path)


def test_replacing_changes_the_named_values_and_nothing_else(rig):
    other = rig.replace({"main.stiffness": 1e8, "casing.modes.0.frequency_hz": 2000.0, "motor.inertia": 0.01})
    before, after = rig.model_dump(), other.model_dump()
    assert after["meshes"]["main"].pop("stiffness") == 1e8
    assert after["casing"]["modes"][0].pop("frequency_hz") == 2000.0
    assert after["couplings"]["motor"].pop("inertia") == 0.01
    assert before["meshes"]["main"].pop("stiffness") == 2.2e8
    assert before["casing"]["modes"][0].pop("frequency_hz") == 2530.0
    assert before["couplings"]["motor"].pop("inertia") == 0.0076
    assert before == after


def test_replacing_nothing_is_the_same_rig(rig):
    assert rig.replace({}) is rig


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"pinion.teeth": 12.5}, r"gears\.pinion\.teeth = 12\.5 must be a valid integer"),
        ({"pinion.teeth": 3}, r"gears\.pinion\.teeth = 3 must be greater than or equal to 5"),
        ({"main.module": float("nan")}, r"meshes\.main\.module = nan must be a finite number"),
        ({"main.module": -0.005}, r"meshes\.main\.module = -0\.005 must be greater than 0"),
        ({"pinion.node": 9}, r"gears\.pinion\.node = 9 does not exist"),
        (
            {"pinion-front.stiffness.0": 1e8},
            r"one component of a vector and cannot be set alone; set it in the rig file",
        ),
    ],
)
def test_a_replaced_value_is_checked_again_and_the_message_names_the_rig_and_the_values(rig, values, message):
    with pytest.raises(InputError, match=message):
        rig.replace(values)


def test_another_tooth_count_keeps_module_face_and_angles_and_changes_the_rest(rig):
    """Pitch angles, radii, speeds, mesh frequency and body from the formulae of a bevel pair."""
    other = rig.replace({"pinion.teeth": 15.0})
    mesh, geometry = other.meshes["main"], other.geometries["main"]
    assert other.gears["pinion"].teeth == 15
    assert mesh == rig.meshes["main"]

    gammas = np.arctan2([15, 36], [36, 15])
    assert_allclose(geometry.pitch_angles_deg, np.rad2deg(gammas), rtol=1e-12)
    radii = mesh.module * np.array([15, 36]) / 2 - mesh.face_width / 2 * np.sin(gammas)
    assert_allclose(geometry.radii, radii, rtol=1e-12)
    assert_allclose(other.mesh_frequency("main"), 14400 / 60 * 15, rtol=1e-12)
    assert_allclose(abs(other.speed("gear-shaft")), 2 * np.pi * 240 * 15 / 36, rtol=1e-12)


@pytest.mark.parametrize("teeth", [12, 15])
def test_a_gears_body_is_a_cylinder_of_its_mean_pitch_radius(rig, teeth):
    """The gear's mass and inertias, as what the assembly gains over one whose body is a film of 1e-9 of its length."""
    other = rig.replace({"pinion.teeth": teeth})
    thin = other.replace({"pinion.body_length": 0.038e-9})
    gained = np.diag(assemble(other).mass - assemble(thin).mass)[:6]

    gamma = np.arctan2(teeth, 36)
    r, length = 0.0049407 * teeth / 2 - 0.0254 / 2 * np.sin(gamma), 0.038
    m = 7800 * np.pi * r**2 * length
    diametral = m * (3 * r**2 + length**2) / 12
    assert_allclose(gained, [m, m, m, diametral, diametral, m * r**2 / 2], rtol=1e-7)


def test_a_bored_gears_body_is_a_hollow_cylinder(rig):
    thin = rig.replace({"gear.body_length": 0.0245e-9})
    gained = np.diag(assemble(rig).mass - assemble(thin).mass)
    gained = gained[gained > 1e-6]

    gamma = np.arctan2(36, 12)
    r, b, length = 0.0049407 * 36 / 2 - 0.0254 / 2 * np.sin(gamma), 0.055 / 2, 0.0245
    m = 7800 * np.pi * (r**2 - b**2) * length
    diametral = m * (3 * (r**2 + b**2) + length**2) / 12
    assert_allclose(gained, [m, m, m, diametral, diametral, m * (r**2 + b**2) / 2], rtol=1e-6)


def test_equal_rigs_are_equal_and_hash_alike():
    one, other = load_transmission("nasa-spiral-bevel"), load_transmission("nasa-spiral-bevel")
    assert one.geometries
    assert one == other
    assert hash(one) == hash(other)
    assert one != other.replace({"pinion.teeth": 13})


def test_a_count_can_be_replaced_by_a_whole_number():
    rig = load_transmission("nasa-spiral-bevel").replace({"pinion-shaft.segments.0.elements": 16.0})
    assert rig.shafts["pinion-shaft"].nodes == 17


@pytest.mark.parametrize("value", ["fast", "3000", True, [3000.0], None])
def test_a_replaced_value_that_is_no_number(rig, value):
    with pytest.raises(InputError, match=rf"operating\.speed_rpm = {re.escape(repr(value))} must be a number"):
        rig.replace({"operating.speed_rpm": value})
