"""Unit and verification: the unit cube of a rig's free numbers, and rigs with other values of them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.sweep.plan.resolved import hash_of
from sigdb.transmission import Choices, Range, Tie, load_transmission
from sigdb.transmission.ensemble.draws import draws

HARMONIC = ("meshes.main.profile", "harmonic")


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def cube(rig):
    return rig.assumptions


def test_the_rigs_assumptions_are_a_mapping_in_order_of_dependence(rig, cube):
    assert isinstance(cube["damping_ratio"], Range)
    assert isinstance(cube["meshes.main.hand"], Choices)
    assert isinstance(cube["bearings.gear-right.stiffness"], Tie)
    order = list(cube)
    assert order.index("bearings.gear-left.stiffness.2") < order.index("bearings.gear-right.stiffness")
    assert order.index("gears.pinion.node") < order.index("bearings.pinion-front.node")
    assert {one.path for one in cube.free} - set(cube) == {
        "meshes.main.profile.amplitudes.0", "meshes.main.profile.amplitudes.1",
        "meshes.main.profile.phases_deg.0", "meshes.main.profile.phases_deg.1",
    }  # fmt: skip
    assert len(cube.free) == len({(one.path, one.within) for one in cube.free})


def test_the_ends_of_the_cube_are_the_ends_of_the_ranges(rig, cube):
    low = rig.with_assumed(cube.from_unit(np.zeros(len(cube.free))))
    assert low.damping_ratio == 0.025
    assert low.bearings["pinion-front"].stiffness == pytest.approx((8e7, 8e7, 0.3 * 8e7), rel=1e-12)
    assert low.couplings["brake"].stiffness == pytest.approx(4e3, rel=1e-12)
    high = rig.with_assumed(cube.from_unit(np.where([one.within == HARMONIC for one in cube.free], 0.5, 0.999999)))
    assert_allclose(high.meshes["main"].stiffness, 4.5e8, rtol=1e-5)
    assert high.meshes["main"].hand == "right"
    assert high.meshes["main"].profile.amplitudes == pytest.approx((0.175, 0.06))


def test_points_of_the_cube_come_back_whatever_is_chosen(rig, cube):
    rng = np.random.default_rng(0)
    profile = [one.path for one in cube.free].index("meshes.main.profile")
    for place, kind in ((0.2, "trapezoid"), (0.7, "harmonic")):
        u = rng.random(len(cube.free))
        u[profile] = place
        values = cube.from_unit(u)
        member = rig.with_assumed(values)
        assert member.meshes["main"].profile.kind == kind
        back = member.assumptions.to_unit(member)
        for one, x, again in zip(cube.free, u, back, strict=True):
            if isinstance(one.assumption, Choices):
                assert one.assumption.at(again) == one.assumption.at(x)
            else:
                assert_allclose(again, x if one.within in (None, _chosen(member)) else 0.5, atol=1e-9)
        assert member.assumptions.values_of(member).keys() == values.keys()
        assert_allclose(cube.to_unit(member), back)


def _chosen(member):
    return ("meshes.main.profile", member.meshes["main"].profile.kind)


def test_ties_and_choices_that_go_together_follow(rig):
    other = rig.with_assumed(
        {
            "gear-left.stiffness": 2e8,
            "gear-shaft.segments.0.outer_diameter": 0.06,
            "main.hand": "right",
            "pinion.node": 4,
        }
    )
    assert other.bearings["gear-right"].stiffness == other.bearings["gear-left"].stiffness
    assert other.bearings["gear-left"].stiffness == pytest.approx((2e8, 2e8, 2e8 * 1.45 / 1.7))
    assert other.gears["gear"].bore == 0.06
    assert other.operating.rotation == 1
    assert other.bearings["pinion-front"].node == 1
    assert other.bearings["pinion-rear"] == rig.bearings["pinion-rear"]
    axis = other.shafts["pinion-shaft"].rotation[:, 2]
    assert -other.geometries["main"].normal @ axis > 0, "the pinion is thrust out of mesh for either hand"


def test_a_multiple_that_is_not_named_keeps_its_ratio(rig):
    other = rig.with_assumed({"bearings.pinion-front.stiffness": 3e8})
    assert other.bearings["pinion-front"].stiffness == pytest.approx((3e8, 3e8, 3e8 * 0.94 / 1.1))
    other = other.with_assumed({"bearings.pinion-front.stiffness.2": 0.5})
    assert other.bearings["pinion-front"].stiffness == pytest.approx((3e8, 3e8, 1.5e8))


def test_a_table_is_chosen_with_its_numbers_and_the_one_before_is_kept(rig):
    harmonic = rig.with_assumed(
        {"main.profile": "harmonic", "main.profile.amplitudes.0": 0.2, "main.profile.flank": 0.5}
    )
    assert harmonic.meshes["main"].profile.amplitudes == (0.2, 0.05)
    assert harmonic.meshes["main"].profile.flank == 0.5
    assert "meshes.main.profile.contact_ratio" not in harmonic.assumptions
    assert [one.path for one in harmonic.assumptions.free] == [one.path for one in rig.assumptions.free]
    back = harmonic.with_assumed({"main.profile": "trapezoid"})
    assert back.meshes["main"].profile == rig.meshes["main"].profile


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"main.stiffness": 1e9}, r"meshes\.main\.stiffness = 1e\+09 is outside .*1\.3e\+08 to 4\.5e\+08, log"),
        ({"main.stiffness": "stiff"}, r"meshes\.main\.stiffness = 'stiff' is outside"),
        ({"main.hand": "up"}, r"meshes\.main\.hand = 'up' is outside .*one of left, right"),
        ({"gear-right.stiffness": 2e8}, r"gear-right\.stiffness follows bearings\.gear-left\.stiffness; set that"),
        ({"gear.teeth": 40}, r"nothing is assumed of gears\.gear\.teeth"),
        ({"main.profile.amplitudes.0": 0.2}, r"nothing is assumed of meshes\.main\.profile\.amplitudes\.0"),
        ({"man.stiffness": 2e8}, r"has no part 'man'"),
    ],
)
def test_a_value_that_has_no_place_is_refused(rig, values, message):
    with pytest.raises(InputError, match=message):
        rig.with_assumed(values)


@pytest.mark.parametrize(
    ("u", "message"),
    [
        (3 * [0], r"u has the shape \(3,\); the rig has \d+ free numbers"),
        (44 * [1.5], r"must be from 0 to 1"),
    ],
)
def test_a_point_outside_the_cube_is_refused(cube, u, message):
    with pytest.raises(InputError, match=message):
        cube.from_unit(u)


def test_a_rig_outside_its_ranges_has_no_point(rig):
    replaced = rig.replace({"main.stiffness": 1e9})
    assert replaced.meshes["main"].stiffness == 1e9
    with pytest.raises(InputError, match=r"meshes\.main\.stiffness = 1e\+09 is outside"):
        rig.assumptions.to_unit(replaced)


def test_a_drawn_rig_is_read_back_from_its_text(rig, tmp_path):
    stream = draws(rig, 3)
    drawn = [rig.with_assumed(next(stream)) for _ in range(2)]
    for i, member in enumerate([rig, *drawn]):
        path = tmp_path / f"{i}.toml"
        path.write_text(member.to_toml(), encoding="utf-8")
        assert load_transmission(path) == member


def test_what_is_assumed_changes_no_hash_of_a_recipe(rig):
    without = {"rig": _without_assumed(rig.model_dump(mode="json"))}
    assert without["rig"] != rig.model_dump(mode="json")
    assert hash_of(without) == hash_of({"rig": rig.model_dump(mode="json")})
    member = rig.with_assumed({"main.stiffness": 3e8})
    assert hash_of(without) != hash_of({"rig": member.model_dump(mode="json")})


def _without_assumed(value):
    if isinstance(value, dict):
        return {key: _without_assumed(item) for key, item in value.items() if key != "assumed"}
    return [_without_assumed(item) for item in value] if isinstance(value, list) else value


def test_a_part_without_assumptions_is_dumped_as_before_there_were_any(rig):
    assert "assumed" not in rig.sensors["pinion-vertical"].model_dump()
    assert "assumed" in rig.gears["pinion"].model_dump()
