"""Unit: the commands that describe a rig and begin one."""

import json
import tomllib
from math import cos, gcd, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.core.errors import InputError
from sigdb.core.fields import unit_of
from sigdb.transmission import Transmission, built_in_transmissions
from sigdb.transmission.parts.bodies import Disk
from sigdb.transmission.parts.gears import Gear, Mesh, Operating
from sigdb.transmission.parts.shafts import Material, Segment, Shaft
from sigdb.transmission.parts.supports import Bearing, Coupling
from sigdb.transmission.summary.new_rig import new_rig_text


def call(*arguments):
    result = CliRunner().invoke(cli, [str(one) for one in arguments])
    return result.exit_code, result.stdout, result.stderr, result.exception


def described(*arguments):
    code, out, _, _ = call("describe", *arguments, "--format", "json")
    assert code == 0
    return json.loads(out)


def line_of(text, title, name):
    """The cells of a row of one of the page's tables."""
    table = text.split(f"\n{title}")[1].split("\n\n")[0]
    (line,) = [line for line in table.splitlines() if line.split()[:1] == [name]]
    return line.split()


def test_the_page_tells_frequencies_and_ratio():
    code, text, _, _ = call("describe", "nasa-spiral-bevel")
    assert code == 0
    shaft, mesh = 14400 / 60, 14400 / 60 * 12
    assert line_of(text, "Shafts", "pinion-shaft")[5:7] == ["-14400", f"{shaft:g}"]
    assert line_of(text, "Shafts", "gear-shaft")[5:7] == ["4800", f"{shaft / 3:g}"]
    assert line_of(text, "Mesh frequencies", "main") == [
        "main",
        *(f"{one:g}" for one in (mesh, 2 * mesh, 3 * mesh, mesh * gcd(12, 36) / (12 * 36))),
    ]
    assert line_of(text, "Meshes", "main")[3] == "3"
    assert "14400 rpm and 356.05 N m (536.9 kW) from motor on shaft pinion-shaft to brake" in text
    # Pitch angle of a 12/36 pair at 90 deg.
    assert f"{18.435:g}" in line_of(text, "Gears", "pinion")


def test_the_tooth_cycle_of_a_hunting_pair():
    (mesh,) = described("spur-test-rig")["meshes"]
    assert mesh["mesh_frequency_hz"] == pytest.approx(1800 / 60 * 19)
    assert mesh["tooth_cycle_hz"] == pytest.approx(1800 / 60 / 48)  # 19 and 48 have no common factor
    assert mesh["ratio"] == pytest.approx(48 / 19)


def test_forces_on_a_spiral_bevel_pinion_are_those_of_the_textbook():
    facts = described("nasa-spiral-bevel")
    phi, psi, gamma = radians(22.5), radians(35), radians(18.4349488)
    radius = 0.0049407 * 12 / 2 - 0.0254 / 2 * sin(gamma)
    tangential = 356.05 / radius
    # Left-hand pinion turning left-handed about an axis away from the apex: thrust out of mesh.
    axial = tangential / cos(psi) * (tan(phi) * sin(gamma) + sin(psi) * cos(gamma))
    radial = tangential / cos(psi) * (tan(phi) * cos(gamma) - sin(psi) * sin(gamma))
    pinion, gear = facts["tooth_forces"]
    assert pinion["tangential"] == pytest.approx(tangential, rel=1e-6)
    assert (pinion["axial"], pinion["radial"]) == (pytest.approx(axial, rel=1e-6), pytest.approx(radial, rel=1e-6))
    # At 90 degrees the one gear's thrust is the other's radial force.
    assert (gear["axial"], gear["radial"]) == (pytest.approx(radial, rel=1e-6), pytest.approx(axial, rel=1e-6))
    (mesh,) = facts["meshes"]
    assert mesh["normal_force"] == pytest.approx(sqrt(tangential**2 + axial**2 + radial**2), rel=1e-6)
    assert mesh["static_compression"] == pytest.approx(mesh["normal_force"] / 2.2e8)


def test_torque_goes_through_two_stages():
    facts = described("two-stage-gearbox")
    first, second = facts["meshes"]
    for mesh, torque, teeth in ((first, 15.0, 32), (second, 15.0 * 80 / 32, 48)):
        assert mesh["normal_force"] == pytest.approx(torque / (1.5e-3 * teeth / 2 * cos(radians(20))), rel=1e-6)
    assert [mesh["mesh_frequency_hz"] for mesh in facts["meshes"]] == [pytest.approx(960), pytest.approx(576)]


def test_masses_of_shafts_and_bodies():
    facts = described("friswell-5.9.1")
    (shaft,) = facts["shafts"]
    assert shaft["mass"] == pytest.approx(7810 * pi / 4 * 0.05**2 * 1.5)
    assert shaft["length"] == pytest.approx(1.5)
    masses = {disk["name"]: disk["mass"] for disk in facts["disks"]}
    assert masses["small"] == pytest.approx(7810 * pi / 4 * (0.28**2 - 0.05**2) * 0.07)
    assert (facts["meshes"], facts["tooth_forces"], facts["gears"]) == ([], [], [])


@pytest.mark.parametrize("name", built_in_transmissions())
def test_every_built_in_rig_is_described(name):
    code, out, err, _ = call("describe", name)
    assert (code, err) == (0, "")
    assert out.startswith(f"{name}: ")
    assert "without a source" in out
    assert max(len(line) for line in out.splitlines()) < 160


def test_pictures_are_drawn_beside_the_page(tmp_path):
    code, out, err, _ = call("describe", "friswell-5.9.1", "--out", tmp_path / "new", "--format", "json")
    assert code == 0
    assert json.loads(out)["name"] == "friswell-5.9.1"
    assert err.splitlines() == [f"drawn: {tmp_path / 'new' / name}" for name in ("rig.png", "campbell.png")]
    for name in ("rig.png", "campbell.png"):
        assert (tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG")


def test_a_new_rig_loads_simulates_and_is_described(tmp_path):
    file = tmp_path / "my rig.toml"
    code, out, err, _ = call("new-rig", file)
    assert (code, err) == (0, "")
    assert str(file) in out
    rig = sigdb.load_transmission(file)
    assert rig.name == "my-rig"
    assert sigdb.simulate(rig).min_compression > 0.3
    facts = described(file)
    assert all((count > 0) == (origin == "assumed") for origin, count in facts["origins"].items())
    assert call("describe", file)[0] == 0


def test_a_new_rig_is_what_its_file_says(tmp_path):
    text = new_rig_text("pair")
    (tmp_path / "pair.toml").write_text(text, encoding="utf-8")
    rig = sigdb.load_transmission(tmp_path / "pair.toml")
    assert Transmission(**rig.model_dump()) == rig
    data = tomllib.loads(text)
    assert rig.value("meshes.main.module") == data["meshes"]["main"]["module"]
    assert rig.value("wheel.teeth") == data["gears"]["wheel"]["teeth"]


def test_a_new_rig_by_the_energy_method_takes_damage_by_its_geometry(tmp_path):
    text = new_rig_text("pair", energy_method=True)
    (tmp_path / "pair.toml").write_text(text, encoding="utf-8")
    rig = sigdb.load_transmission(tmp_path / "pair.toml")
    whole, cracked = (sigdb.simulate(rig, damage) for damage in (None, sigdb.Damage(tooth=3, crack_depth=0.002)))
    assert rig.meshes["main"].profile.kind == "energy-method"
    assert not np.array_equal(whole.signal("pinion-vertical"), cracked.signal("pinion-vertical"))
    assert set(tomllib.loads(text)) == set(tomllib.loads(new_rig_text("pair")))


@pytest.mark.parametrize("section", [Operating, Material, Shaft, Segment, Gear, Mesh, Coupling, Bearing, Disk])
def test_a_new_rig_explains_every_field(section):
    lines = new_rig_text("pair").splitlines()
    for name, field in section.model_fields.items():
        if name in ("sources", "assumed", "profile", "profile_error", "segments", "rolling"):
            continue
        unit = unit_of(field)
        meaning = f"# {field.description}{'' if unit == '-' else f' [{unit}]'}"
        after = [lines[i + 1] for i, line in enumerate(lines) if line == meaning]
        assert any(line.startswith((f"{name} = ", f"# {name} =")) for line in after), name


def test_a_new_rig_does_not_overwrite(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("mine", encoding="utf-8")
    code, _, _, error = call("new-rig", file)
    assert code == 1
    assert "exists already; choose another name, or give --force" in str(error)
    assert isinstance(error, InputError)
    assert file.read_text(encoding="utf-8") == "mine"
    assert call("new-rig", file, "--force")[0] == 0
    assert sigdb.load_transmission(file).name == "mine"


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["new-rig", "{tmp}/rig.txt"], 2, "a rig file's name ends in .toml"),
        (["new-rig", "{tmp}/file/rig.toml"], 3, "{tmp}/file"),
        (["describe", "nothing"], 2, "no built-in rig 'nothing'"),
        (["describe", "nothing.toml"], 2, "no such file"),
        (["describe", "luo-10dof", "--format", "yaml"], 2, "'yaml' is not one of 'text', 'json'"),
        (["describe", "luo-10dof", "--out", "{tmp}/file/x"], 3, "{tmp}/file"),
    ],
)
def test_exit_codes(leave, tmp_path, arguments, code, says):
    (tmp_path / "file").write_text("")
    left, _, err = leave(*(one.format(tmp=tmp_path) for one in arguments))
    assert left == code
    assert says.format(tmp=tmp_path) in err
    assert "Traceback" not in err
