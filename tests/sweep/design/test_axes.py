"""Axes of a grid are the fields of damage and measurement: unit, bounds and help are declared there only."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import pytest
from pydantic import BeforeValidator, create_model

import sigdb
from sigdb.core import InputError, Section, quantity
from sigdb.core.fields import unit_of
from sigdb.measurement import MeasurementSettings
from sigdb.signature.settings import SignatureSettings
from sigdb.sweep import Grid, SweepSettings, make_plan
from sigdb.sweep.design.axes import AXES, DAMAGE_AXES, damage_axes
from sigdb.sweep.design.grid import grid_fields
from sigdb.transmission import Damage, ToothDamage
from sigdb.transmission.damage import Detail, Size, sizes_with_details

FIELDS = Damage.model_fields | ToothDamage.model_fields | MeasurementSettings.model_fields
OUTSIDE = {
    "damaged_teeth": 0,
    "stiffness_loss": 1.5,
    "loss_extent": -0.1,
    "friction": 1.1,
    "crack_depth": -1e-3,
    "crack_angle_deg": 0.0,
    "pit_diameter": -1e-3,
    "pit_depth": -1e-3,
    "pits": 0,
    "wear_depth": -1e-3,
    "flank_deviation": 0.02,
    "deviation_extent": 1.1,
    "deviation_place": -0.1,
    "chip_height": -1e-3,
    "chip_extent": 1.1,
    "averages": 0,
    "index_error": -1e-6,
}


@pytest.mark.parametrize("axis", [*DAMAGE_AXES, *MeasurementSettings.model_fields])
def test_unit_and_help_of_an_axis_are_those_of_its_field(axis):
    assert AXES[axis].field is FIELDS[axis]
    assert unit_of(Grid.model_fields[axis]) == unit_of(FIELDS[axis])
    assert Grid.model_fields[axis].description.startswith(FIELDS[axis].description)


@pytest.mark.parametrize("axis", [*DAMAGE_AXES, *MeasurementSettings.model_fields])
def test_bounds_of_an_axis_are_those_of_its_field(axis):
    """Every axis whose field has a bound is refused what the field refuses, in a list and in a table."""
    if axis not in OUTSIDE:
        assert all(isinstance(rule, Size | Detail | BeforeValidator) for rule in FIELDS[axis].metadata)
        return
    section = MeasurementSettings if axis in MeasurementSettings.model_fields else Damage
    for model, values in ((section, {axis: OUTSIDE[axis]}), (Grid, {axis: [OUTSIDE[axis]]})):
        with pytest.raises(InputError, match=f"{axis} = {OUTSIDE[axis]}|contradict"):
            model(**values if model is Grid else values | ({"tooth": 1} if model is Damage else {}))
    with pytest.raises(InputError, match=f"row 1: {axis} = {OUTSIDE[axis]} must be"):
        Grid(table={axis: [OUTSIDE[axis]]})


class Spalled(ToothDamage):
    spall_length: Annotated[float, Size(geometric=True)] = quantity("m", "Length of a spall.", ge=0, default=0.0)


def test_a_field_of_damage_becomes_an_axis():
    axes = {axis.name: axis for axis in damage_axes(Spalled)}
    assert sizes_with_details(Spalled)["spall_length"] == ()
    grid = create_model("SpalledGrid", __base__=Section, **grid_fields(AXES | axes))
    assert grid(spall_length=[1e-3, 2e-3]).spall_length == (1e-3, 2e-3)
    assert grid.model_fields["spall_length"].description == "Length of a spall."
    with pytest.raises(ValueError, match=r"spall_length = -1\.0 must be greater than or equal to 0"):
        axes["spall_length"].check(-1.0)


FIELD = """    burn: Annotated[float, Size()] = quantity("-", "Burn of the tooth.", ge=0, default=0.0)
    spall_length: Annotated[float, Size(geometric=True)] = quantity("m", "Length.", ge=0, default=0.0)

    @model_serializer"""
PROGRAM = """
import sigdb
from sigdb.measurement import MeasurementSettings
from sigdb.signature.settings import SignatureSettings
from sigdb.sweep import SweepSettings, make_plan
from sigdb.sweep.plan.schema import plan_schema
def plan(**grid):
    design = SweepSettings(rig="nasa-spiral-bevel", grid=[{"tooth": 1} | grid])
    return make_plan(design, MeasurementSettings(), SignatureSettings(), sigdb.load_transmission(design.rig))
print(plan(stiffness_loss=0.4).hash)
names = plan_schema(plan(burn=[0.1, 0.2])).arrow("features").names
print(*(name for name in names if name in ("burn", "spall_length")))
plan(spall_length=[1e-3, 2e-3])
"""


def test_a_declaration_in_one_place_is_enough(tmp_path):
    """In a copy of the package with two more fields of damage a recipe sweeps them, and older hashes stay.

    No rig can model the geometric one yet.
    """
    package = Path(sigdb.__file__).parent
    shutil.copytree(package, tmp_path / "sigdb", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "data").symlink_to(package.parent / "data")
    damage = tmp_path / "sigdb" / "transmission" / "damage.py"
    damage.write_text(damage.read_text().replace("    @model_serializer", FIELD, 1))
    run = subprocess.run([sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, env={})
    design = SweepSettings(rig="nasa-spiral-bevel", grid=[{"tooth": 1, "stiffness_loss": 0.4}])
    plan = make_plan(design, MeasurementSettings(), SignatureSettings(), sigdb.load_transmission(design.rig))
    assert run.stdout.split() == [plan.hash, "burn"]
    assert "sweep.grid.1: spall_length = 0.001 needs the geometry of the teeth" in run.stderr, run.stderr
