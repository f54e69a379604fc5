"""Unit: rigs and their parts are frozen, from outside and from inside."""

import ast
from pathlib import Path

import pytest

import sigdb.dynamics
import sigdb.transmission
from sigdb.core.errors import InputError
from sigdb.transmission import Mesh, Transmission, load_transmission

MODULES = [
    path
    for package in (sigdb.transmission, sigdb.dynamics)
    for path in sorted(Path(package.__file__).parent.rglob("*.py"))
]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_no_module_writes_past_a_frozen_instance(path):
    """Neither ``instance.__dict__[...] = ...`` nor ``object.__setattr__(instance, ...)``."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        targets = node.targets if isinstance(node, ast.Assign) else []
        for target in targets:
            written = isinstance(target, ast.Subscript) and isinstance(target.value, ast.Attribute)
            assert not (written and target.value.attr == "__dict__"), f"line {node.lineno}"
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            assert node.func.attr not in ("__setattr__", "__delattr__"), f"line {node.lineno}"


def test_a_rig_and_its_meshes_refuse_assignment():
    rig = load_transmission("spur-test-rig")
    with pytest.raises(InputError, match="cannot be assigned"):
        rig.meshes = {}
    with pytest.raises(InputError, match="cannot be assigned"):
        rig.meshes["main"].stiffness = 1.0


def test_a_mesh_that_a_rig_is_made_of_stays_without_its_gears():
    """The rig has a copy that knows them; its mean stiffness follows from the profile and is no stated field."""
    data = load_transmission("spur-test-rig").model_dump()
    mesh = Mesh.model_validate(data["meshes"]["main"])
    rig = Transmission.model_validate(data | {"meshes": {"main": mesh}})
    assert mesh.stiffness is None
    assert rig.meshes["main"] is not mesh
    assert rig.meshes["main"].stiffness > 1e8
    assert "stiffness" not in rig.meshes["main"].model_fields_set
    assert "stiffness" not in rig.model_dump()["meshes"]["main"]
    assert Transmission.model_validate(rig.model_dump()) == rig


def test_the_mean_of_a_table_is_its_area_until_another_is_stated():
    data = load_transmission("nasa-spiral-bevel").model_dump()["meshes"]["main"]
    del data["stiffness"], data["assumed"]
    data["profile"] = {
        "kind": "table", "places": [0.0, 0.6, 1.2], "pair_stiffnesses": [1e8, 2e8, 1e8], "flank": 0.2
    }  # fmt: skip
    follows, stated = Mesh.model_validate(data), Mesh.model_validate(data | {"stiffness": 3e8})
    assert follows.stiffness == follows.profile.mean_stiffness
    assert stated.stiffness == 3e8
