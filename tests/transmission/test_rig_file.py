"""The built-in rigs: published numbers, and an origin for every number of every file."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.transmission import Transmission, built_in_transmissions, load_transmission

FOLDER = Path(__file__).parents[2] / "data" / "transmissions"
FILES = sorted(FOLDER.glob("*.toml"))


def _numbers_without_origin(table, path=""):
    """Dotted keys of a TOML table (and of those in it) that hold numbers and have no entry in ``sources``."""
    sources = table.get("sources", {})
    for key, value in table.items():
        if key in ("sources", "assumed"):
            continue
        here = f"{path}{key}"
        holds_numbers = isinstance(value, int | float) or (
            isinstance(value, list) and value and all(isinstance(x, int | float) for x in value)
        )
        if holds_numbers or key == "shape":
            if not any(
                sources.get(key, "").startswith(f"{origin}: ")
                for origin in ("published", "derived", "fitted", "assumed")
            ):
                yield here
        elif isinstance(value, dict):
            yield from _numbers_without_origin(value, f"{here}.")
        elif isinstance(value, list):
            for i, one in enumerate(one for one in value if isinstance(one, dict)):
                yield from _numbers_without_origin(one, f"{here}.{i}.")


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_number_has_an_origin(path):
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    assert list(_numbers_without_origin(table)) == []


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_published_number_names_a_work_that_the_head_cites_or_a_standard(path):
    text = path.read_text(encoding="utf-8")
    head = " ".join(line for line in text.splitlines() if line.startswith("#"))
    for source in re.findall(r'"published: ([^"]*)"', text):
        assert re.search(r"\b(the paper|the book)\b|\b(ISO|EN) \d+|, (19|20)\d\d\b", source), source
        assert not re.match(r"the (paper|book)\b", source) or re.search(r"\b(19|20)\d\d\b", head), source


def test_the_search_for_origins_finds_a_missing_one():
    table = tomllib.loads((FOLDER / "nasa_spiral_bevel.toml").read_text(encoding="utf-8"))
    del table["gears"]["pinion"]["sources"]["teeth"]
    del table["casing"]["modes"][1]["sources"]["shape"]
    assert sorted(_numbers_without_origin(table)) == ["casing.modes.1.shape", "gears.pinion.teeth"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_file_loads_by_name_and_by_path_to_the_same_rig(path):
    name = path.stem.replace("_", "-")
    assert name in built_in_transmissions()
    by_name, by_path = load_transmission(name), load_transmission(path)
    assert isinstance(by_name, Transmission)
    assert by_name.model_dump() == by_path.model_dump() == load_transmission(str(path)).model_dump()
    assert by_name.name == name


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(InputError, match=r"no built-in rig 'nasa'; known: .*nasa-spiral-bevel.*ends in \.toml"):
        load_transmission("nasa")


def test_paper_gears_and_operating_point(rig):
    """Published: 12/36 teeth, 35 deg spiral, 22.5 deg pressure angle, 1 in face, 90 deg, 720 hp at 14 400 rpm."""
    assert (rig.gears["pinion"].teeth, rig.gears["gear"].teeth) == (12, 36)
    mesh = rig.meshes["main"]
    assert (mesh.driving, mesh.driven) == ("pinion", "gear")
    assert mesh.helix_angle_deg == 35.0
    assert mesh.pressure_angle_deg == 22.5
    assert_allclose(mesh.face_width, 0.0254, rtol=1e-12)
    assert rig.operating.speed_rpm == 14400.0
    axes = [rig.shafts[name].rotation[:, 2] for name in ("pinion-shaft", "gear-shaft")]
    assert_allclose(axes[0] @ axes[1], 0, atol=1e-12)
    mechanical_horsepower = 745.699872
    assert_allclose(rig.operating.torque * 2 * np.pi * 240, 720 * mechanical_horsepower, rtol=1e-4)


def test_paper_derived_speeds_and_angles(rig):
    """Derived from the paper: mesh 2880 Hz, gear 4800 rpm, pitch angles atan(12/36) and its complement."""
    assert_allclose(rig.mesh_frequency("main"), 2880.0, rtol=1e-12)
    assert_allclose(abs(rig.speed("pinion-shaft")), 2 * np.pi * 240, rtol=1e-12)
    assert_allclose(abs(rig.speed("gear-shaft")), 2 * np.pi * 80, rtol=1e-12)
    assert_allclose(rig.geometries["main"].pitch_angles_deg, [18.435, 71.565], atol=5e-4)


def test_mean_cone_distance_and_module_are_those_of_the_diametral_pitch(rig):
    """Diametral pitch 5.141 per inch; mean cone distance 81.043 mm from both radii."""
    assert_allclose(rig.meshes["main"].module, 0.0254 / 5.141, rtol=1e-5)
    gammas = np.arctan([12 / 36, 36 / 12])
    assert_allclose(np.array(rig.geometries["main"].radii) / np.sin(gammas), 81.043e-3, rtol=2e-5)


def test_the_pinion_is_thrust_out_of_mesh_as_the_file_says(rig):
    """The normal is the force on the driven gear, so the pinion feels its opposite; its apex lies behind it."""
    axis = rig.shafts["pinion-shaft"].rotation[:, 2]
    assert rig.gears["pinion"].apex == "behind"
    assert -rig.geometries["main"].normal @ axis > 0


def test_body_masses_are_those_that_the_file_states(rig):
    """0.61 kg and 3.1 kg, by the volume of a cylinder of the mean pitch radius."""
    for name, radius, stated in (
        ("pinion", 0.081043 * 12 / np.hypot(12, 36), 0.61),
        ("gear", 0.081043 * 36 / np.hypot(12, 36), 3.1),
    ):
        gear = rig.gears[name]
        volume = np.pi * (radius**2 - gear.bore**2 / 4) * gear.body_length
        assert_allclose(7800 * volume, stated, rtol=0.02)


def test_stresses_in_the_shafts_are_those_that_the_file_states(rig):
    """Torsion of a solid round shaft, 16 T / (pi d^3): 9 MPa and 33 MPa."""
    assert_allclose(16 * 356.05 / (np.pi * rig.shafts["pinion-shaft"].segments[0].outer_diameter ** 3), 9e6, rtol=0.05)
    assert_allclose(16 * 1068.15 / (np.pi * rig.shafts["gear-shaft"].segments[0].outer_diameter ** 3), 33e6, rtol=0.05)


def test_the_rig_has_the_papers_two_sensors(rig):
    assert (rig.sensors["pinion-vertical"].quantity, rig.sensors["pinion-vertical"].unit) == ("velocity", "m/s")
    housing = rig.sensors["pinion-housing-vertical"]
    assert (housing.quantity, housing.unit, housing.point) == ("acceleration", "m/s^2", "pinion-front")
    assert all(sensor.direction == (0.0, 1.0, 0.0) for sensor in rig.sensors.values())


def test_mates_and_turning(rig):
    assert rig.mate("pinion") == "gear"
    assert rig.mate("gear") == "pinion"
    assert rig.turns_exactly("pinion")
    assert rig.turns_exactly("gear")
    with pytest.raises(InputError, match=r"gear = 'wheel' does not exist; known: pinion, gear"):
        rig.meshes_of("wheel")
