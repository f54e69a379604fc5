"""Unit: members of an ensemble in a plan: their axis, their values in the resolved recipe, and their rigs."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.sweep import plan_from
from sigdb.sweep.plan import members

GIVEN = """
[sweep.ensemble]
members = 3
values = [{ "meshes.main.stiffness" = 3.0e8 }, { "meshes.main.stiffness" = 1.5e8 }, { "gears.gear.node" = 4 }]
"""
GRID = "\n[[sweep.grid]]\nstiffness_loss = 0.2\ntooth = 1\n"


@pytest.fixture(scope="module")
def rig():
    return sigdb.load_transmission("nasa-spiral-bevel")


def test_every_grid_has_every_member_unless_it_names_some(plan_of):
    plan = plan_of(GIVEN + GRID + GRID.replace("0.2", "0.4") + "rig.member = [1, 3]\n")
    table = plan.table(0, plan.rows)
    damaged = table[table["tooth"] > 0]
    assert sorted(damaged.groupby("stiffness_loss")["rig_member"].unique().map(sorted).items()) == [
        (0.2, [1, 2, 3]), (0.4, [1, 3])
    ]  # fmt: skip


def test_the_rig_of_a_point_is_its_member_at_the_swept_operating_point(plan_of, rig):
    plan = plan_of(GIVEN + GRID + "operating.torque = [300.0, 356.05]\n")
    points = plan.rig_points
    assert len(points) == 6
    for point, number, torque in zip(points, points.parameter("rig_member"),
                                     points.parameter("operating.torque"), strict=True):  # fmt: skip
        expected = rig.with_assumed(plan.design.ensemble.values[int(number) - 1])
        assert point.rig == expected.replace({"operating.torque": torque, "rig_member": number})
    assert {point.rig.meshes["main"].stiffness for point in points} == {3e8, 1.5e8, 2.2e8}


def test_a_number_that_members_have_of_their_own_is_that_of_the_member_in_its_column(plan_of, tmp_path, rig):
    data = rig.model_dump()
    data["operating"]["assumed"] = data["operating"]["assumed"] | {"speed_rpm": {"low": 1.2e4, "high": 1.6e4}}
    path = tmp_path / "rig.toml"
    path.write_text(type(rig).model_validate(data).to_toml(), encoding="utf-8")
    values = 'values = [{ "operating.speed_rpm" = 1.3e4 }, { "operating.speed_rpm" = 1.5e4 }]\n'
    plan = plan_of(f"[sweep]\nrig = '{path}'\n[sweep.ensemble]\nmembers = 2\n{values}{GRID}")
    table = plan.table(0, plan.rows)
    assert set(zip(table["rig_member"], table["speed_rpm"], strict=True)) == {(1, 1.3e4), (2, 1.5e4)}


def test_draws_are_stored_and_the_plan_is_made_again_without_drawing(plan_of, rig, monkeypatch):
    plan = plan_of("[sweep.ensemble]\nmembers = 2\nseed = 5\n" + GRID)
    drawn = plan.design.ensemble.values
    assert [dict(values) for values in sigdb.ensemble(rig, 2, rng=5).values] == list(drawn)
    assert plan.resolved["sweep"]["ensemble"]["values"] == list(drawn)
    monkeypatch.setattr(members, "ensemble", None)
    again = plan_from(plan.resolved)
    assert again.hash == plan.hash
    assert again.rig_points[1].rig == plan.rig_points[1].rig


def test_another_draw_is_another_plan_and_no_ensemble_leaves_the_recipe_as_it_was(plan_of):
    with_values = GIVEN + GRID
    assert plan_of(with_values).hash != plan_of(with_values.replace("1.5e8", "1.6e8")).hash
    assert "ensemble" not in plan_of(GRID).resolved["sweep"]
    assert "rig_member" not in plan_of(GRID).resolved["rig"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GRID + "rig.member = [1]\n", r"sweep\.grid\.1: rig\.member names members of an ensemble"),
        (GIVEN + GRID + "rig.member = [0, 1]\n", r"grid\.1: rig\.member = 0 is no member; the ensemble has 1 to 3"),
        (GIVEN + GRID + "rig.member = [4]\n", r"rig\.member = 4 is no member"),
        (GIVEN + GRID + "rig.member = [1.5]\n", r"rig\.member = 1\.5 is no member"),
        (GIVEN + GRID + "main.stiffness = [2.0e8]\n", r"main\.stiffness is swept, and each member .* has its own"),
        (GIVEN.replace("members = 3", "members = 2") + GRID, r"values has 3 members and members = 2; give as many"),
        (GIVEN.replace("3.0e8", "9.0e8") + GRID, r"sweep\.ensemble\.values\.1: .*stiffness = 9e\+08 is outside"),
        ("[sweep.ensemble]\nmembers = 0\n" + GRID, r"sweep\.ensemble\.members = 0 must be greater than or equal to 1"),
    ],
)  # fmt: skip
def test_members_that_cannot_be_are_refused(plan_of, text, message):
    with pytest.raises(InputError, match=message):
        plan_of(text)


def test_a_range_of_members_is_sampled_in_whole_numbers(plan_of):
    grid = "\n[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.2\nrig.member = { min = 1, max = 3 }\npoints = 12\n"
    plan = plan_of(GIVEN + grid)
    assert np.unique(plan.rig_points.parameter("rig_member")).tolist() == [1, 2, 3]
