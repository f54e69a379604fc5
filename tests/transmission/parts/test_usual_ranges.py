"""Unit: numbers outside the usual range of their kind are remarked on, and named where an error follows from them."""

import types
import typing

import numpy as np
import pytest
from click.testing import CliRunner
from pydantic import BaseModel

from sigdb.cli.main import cli
from sigdb.core import InputError, unit_of
from sigdb.transmission import Transmission, built_in_transmissions, describe_rig, load_transmission, write_new_rig
from sigdb.transmission.parts.usual_ranges import USUAL_RANGES, unusual_numbers
from sigdb.transmission.rig import transmission_of

NONE = {
    "gears.unbalance_angle_deg", "disks.unbalance_angle_deg", "gears.runout_angle_deg", "operating.load_angle_deg",
    "meshes.profile.phases_deg", "meshes.profile.places", "bearings.stiffness_matrix", "bearings.damping_matrix",
}  # fmt: skip
"""Fields with a unit, but without a usual range: angles of any size, places along a contact, mixed units."""


def fields_of(annotation, path=""):
    """Yield the path and the field of each number below a section, without the names of parts."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        for name, field in annotation.model_fields.items():
            inner = list(fields_of(field.annotation, f"{path}{name}."))
            yield from inner or [(f"{path}{name}", field)]
    elif typing.get_origin(annotation) in (dict, tuple, types.UnionType, typing.Union, typing.Annotated):
        for part in typing.get_args(annotation):
            yield from fields_of(part, path)


FIELDS = dict(fields_of(Transmission))


@pytest.mark.parametrize("usual", USUAL_RANGES, ids=lambda usual: usual.fields[0])
def test_each_range_is_one_of_fields_of_its_unit(usual):
    for field in usual.fields:
        assert unit_of(FIELDS[field]) == usual.unit
    assert 0 < usual.least < usual.greatest
    assert all(factor > 0 for factor, _ in usual.slips)


def test_every_field_with_a_unit_has_a_usual_range():
    ranged = {field for usual in USUAL_RANGES for field in usual.fields}
    assert {path for path, field in FIELDS.items() if unit_of(field) != "-"} - ranged == NONE


@pytest.mark.parametrize("name", built_in_transmissions())
def test_nothing_is_unusual_about_a_built_in_rig(name):
    assert unusual_numbers(load_transmission(name).model_dump()) == []


def changed(data, path, value):
    *place, last = path.split(".")
    here = data
    for word in place:
        here = here[int(word)] if word.isdigit() else here[word]
    here[last] = value
    return data


SLIPS = [
    ("spur-test-rig", "meshes.main.module", 3.175, "0.003175 m (3.175 mm)"),
    ("nasa-spiral-bevel", "meshes.main.module", 4.9, "0.0049 m (4.9 mm)"),
    ("nasa-spiral-bevel", "meshes.main.face_width", 25.4, "0.0254 m (25.4 mm)"),
    ("spur-test-rig", "shafts.wheel-shaft.segments.0.outer_diameter", 25.0, "0.025 m (25 mm)"),
    ("spur-test-rig", "shafts.wheel-shaft.segments.0.length", 60.0, "0.06 m (60 mm)"),
    ("spur-test-rig", "materials.steel.density", 7.8, "7800 kg/m^3 (7.8 g/cm^3)"),
    ("spur-test-rig", "materials.steel.young_modulus", 207.0, "2.07e+11 Pa (207 GPa)"),
    ("spur-test-rig", "materials.steel.young_modulus", 207e3, "2.07e+11 Pa (207000 MPa)"),
    ("nasa-spiral-bevel", "meshes.main.stiffness", 300.0, "3e+08 N/m (300 N/um)"),
    ("nasa-spiral-bevel", "operating.torque", 45000.0, "45 N m (45000 N mm)"),
    ("nasa-spiral-bevel", "meshes.main.pressure_angle_deg", 0.349066, "20 deg (0.349066 rad)"),
    ("nasa-spiral-bevel", "meshes.main.backlash", 0.15, "0.00015 m (0.15 mm)"),
    ("chaari-8dof", "couplings.motor.inertia", 4300.0, "0.0043 kg m^2 (4300 kg mm^2)"),
    ("nasa-spiral-bevel", "damping_ratio", 0.9, "0.009 (0.9 %)"),
    ("nasa-spiral-bevel", "operating.speed_rpm", 14.4e6, ""),
    ("nasa-spiral-bevel", "gears.gear.teeth", 3600, ""),
]


@pytest.mark.parametrize(
    ("name", "path", "wrong", "meant"), SLIPS, ids=[f"{path} {wrong}" for _, path, wrong, _ in SLIPS]
)
def test_a_number_in_another_unit_is_named_by_description_or_error(name, path, wrong, meant):
    data = changed(load_transmission(name).model_dump(), path, wrong)
    try:
        texts = describe_rig(transmission_of(data, owner="rig.toml"))["remarks"]
    except InputError as error:
        texts = [str(error)]
    (text,) = (text for text in texts if f"{path} = {wrong:g}" in text and "is outside the usual" in text)
    assert (f"did you mean {meant}?" in text) == bool(meant)


def test_an_inertia_that_does_not_fit_its_mass_is_named():
    data = changed(load_transmission("chaari-8dof").model_dump(), "gears.pinion.polar_inertia", 270.0)
    (text,) = unusual_numbers(data)
    assert text.startswith(
        "gears.pinion.polar_inertia = 270 kg m^2 with mass = 1.8 kg is that of a ring of radius 12.2 m"
    )


def test_what_is_zero_or_within_its_range_is_not_remarked_on():
    assert unusual_numbers({"gears": {"a": {"bore": 0.0, "teeth": 20, "mass": True, "sources": {"bore": 9.0}}}}) == []


def test_a_static_compression_that_no_tooth_bears_is_remarked_on():
    rig = load_transmission("nasa-spiral-bevel").replace({"operating.torque": 5000.0})
    radius = 81.043e-3 * np.sin(np.arctan(1 / 3))
    compression = 5000 / (radius * np.cos(np.deg2rad(22.5)) * np.cos(np.deg2rad(35))) / 2.2e8
    (remark,) = describe_rig(rig)["remarks"]
    start = f"meshes.main has a static compression of {compression * 1e6:.4g} um, above the usual 100 um; check"
    assert remark.startswith(start)


def test_the_command_prints_the_remarks_and_the_cause_of_an_error(tmp_path):
    file = tmp_path / "mine.toml"
    write_new_rig(file)
    text = file.read_text()
    (diameter,) = {line for line in text.splitlines() if line.startswith("outer_diameter")} or {""}
    file.write_text(text.replace("density = 7850.0", "density = 7.85"))
    said = CliRunner().invoke(cli, ["describe", str(file)])
    assert said.exit_code == 0
    assert "remarks\n  materials.steel.density = 7.85 kg/m^3 is outside the usual 800 to 23000 kg/m^3" in said.output
    file.write_text(text.replace(diameter, "outer_diameter = 25.0"))
    refused = CliRunner().invoke(cli, ["describe", str(file)])
    assert "outer_diameter = 25 m is outside the usual 0.001 to 4 m; did you mean 0.025 m" in str(refused.exception)
