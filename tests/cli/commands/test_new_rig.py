"""Unit: ``sigdb new-rig`` with what is known of a rig; without, it is tested with ``sigdb describe``."""

import tomllib

import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli

KNOWN = "--module 2.5mm --speed 1480rpm --torque 45Nm"


def call(text, *more):
    return CliRunner().invoke(cli, ["new-rig", *text.split(), *map(str, more)])


def test_a_file_from_known_numbers_is_the_rig_of_the_function(tmp_path):
    file = tmp_path / "mine.toml"
    result = call(f"--teeth 23/67 {KNOWN}", file)
    assert (result.exit_code, result.stdout.split(": ")[1]) == (0, "a rig from the known numbers; look at it with")
    rig = sigdb.new_rig("23/67", module=0.0025, speed=1480.0, torque=45.0, name="mine")
    assert sigdb.load_transmission(file) == rig
    assert rig.assumptions["meshes.main.face_width"].scale == "log"


@pytest.mark.parametrize("modules", [["2.5mm,3mm"], ["2.5 mm, 0.003 m"], ["2.5mm", "--module", "3mm"]])
def test_modules_of_stages_are_listed_as_stages_are(modules):
    printed = call("--stages 23/67,19/81 --speed 1480 --torque 45 --module", *modules).stdout
    assert [mesh["module"] for mesh in tomllib.loads(printed)["meshes"].values()] == [0.0025, 0.003]


@pytest.mark.parametrize("stages", ["--stages 23/67,19/81", "--teeth 23/67 --stages 19/81"])
def test_without_a_file_the_rig_is_printed(stages):
    printed = call(f"{stages} {KNOWN} --module 3mm --helix-angle 0.2rad").stdout
    data = tomllib.loads(printed)
    assert [gear["teeth"] for gear in data["gears"].values()] == [23, 67, 19, 81]
    assert data["meshes"]["stage-2"]["sources"]["module"].startswith("derived: 3 mm, as stated to new-rig")
    assert printed.count("# Face width. [m]\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--teeth 23/67", "Error: --teeth needs --speed and --torque too."),
        ("--torque 45Nm mine.toml", "Error: --torque needs --teeth and --speed too."),
        ("", "Error: Missing argument 'FILE'; or give --teeth, --speed and --torque."),
        ("--teeth 23/67 --speed 1480 --torque 45 --module 2,5mm", "'2,5mm' has a comma; write a decimal point"),
        ("--teeth 23/67 --speed 1480 --torque 3kg", "'3kg' is a mass; a torque is needed"),
    ],
)
def test_a_wrong_use_says_what_is_lacking(arguments, message):
    result = call(arguments)
    assert (result.exit_code, message in result.output) == (2, True)
