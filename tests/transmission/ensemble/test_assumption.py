"""Unit: ranges, choices and ties, and what a rig file may say of them."""

import math

import pytest

from sigdb.core.errors import InputError
from sigdb.transmission import Choices, Range, Tie, load_transmission
from sigdb.transmission.ensemble.assumption import flattened
from sigdb.transmission.rig import transmission_of


@pytest.mark.parametrize(
    ("scale", "u", "value"),
    [("linear", 0, 1.0), ("linear", 0.5, 50.5), ("linear", 1, 100.0), ("log", 0, 1.0), ("log", 0.5, 10.0)],
)
def test_a_range_maps_the_unit_interval_and_back(scale, u, value):
    own = Range(low=1.0, high=100.0, scale=scale)
    assert math.isclose(own.at(u), value, rel_tol=1e-12)
    assert math.isclose(own.unit(value), u, abs_tol=1e-12)


def test_choices_share_the_unit_interval():
    choices = Choices(choices=(2, 3, 4, 5))
    assert [choices.at(u) for u in (0.0, 0.24, 0.26, 0.99, 1.0)] == [2, 2, 3, 5, 5]
    assert all(choices.at(choices.unit(value)) == value for value in (2, 3, 4, 5))


def test_a_range_holds_its_ends_and_their_rounding_but_nothing_outside():
    own = Range(low=0.1, high=0.3)
    assert own.holds(0.1)
    assert own.holds(0.30000000000000004)
    assert not own.holds(0.31)
    assert not own.holds(True)


def test_assumptions_in_words():
    assert str(Range(low=8e7, high=2e8, scale="log")) == "8e+07 to 2e+08, log"
    assert str(Range(low=0.3, high=1.0, of="bearings.a.stiffness.0")) == "0.3 to 1 times bearings.a.stiffness.0"
    assert str(Choices(choices=("left", "right"))) == "one of left, right"
    assert str(Tie(target="a.b")) == "as a.b"
    assert str(Tie(target="a.b", factor=2.0)) == "2 times a.b"


def test_dotted_keys_of_toml_are_read_as_they_are_meant():
    inner = {"low": 1.0, "high": 2.0}
    assert flattened({"shape": {"front": {"1": inner}}, "mass": inner}) == {"shape.front.1": inner, "mass": inner}


BEARING = ("bearings", "pinion-front")


@pytest.mark.parametrize(
    ("table", "assumed", "message"),
    [
        (BEARING, {"stiffness": {"low": 2.0e8, "high": 8.0e7}}, r"low = 2e\+08 must be less than high = 8e\+07"),
        (BEARING, {"stiffness": {"low": 1.0e8, "high": 1.0e8}}, r"low = 1e\+08 must be less than high = 1e\+08"),
        (
            BEARING,
            {"stiffness": {"low": 0.0, "high": 1.0, "scale": "log"}},
            r"low = 0 must be greater than 0 for .*log",
        ),
        (BEARING, {"stiffness": {"low": 0.0, "high": 1.0, "scale": "cubic"}}, r"scale = 'cubic' must be 'linear' or"),
        (BEARING, {"stiffness": {"lo": 1.0, "high": 1.5}}, r"unknown key .*assumed\.stiffness\.lo; did you mean 'low'"),
        (BEARING, {"stiffness": {"low": float("nan"), "high": 1.5}}, r"low = nan must be a finite number"),
        (
            BEARING,
            {"stifness": {"low": 1.0, "high": 1.5}},
            r"assumed\.stifness names no field here; did you .*stiffness",
        ),
        (BEARING, {"stiffness.3": {"low": 1.0, "high": 1.5}}, r"assumed\.stiffness\.3 names no number that is stated"),
        (BEARING, {"node": {"low": 1.0, "high": 3.0}}, r"assumed\.node: a whole number has a range by choices"),
        (
            BEARING,
            {"seat": {"low": 1.0, "high": 3.0}},
            r"assumed\.seat: only a number or a list of numbers has a range",
        ),
        (BEARING, {"node": {"choices": [2]}}, r"choices = \[2\] has no alternative; give two or more"),
        (BEARING, {"node": {"choices": [2, 2]}}, r"choices = \[2, 2\] repeat one"),
        (BEARING, {"node": {"choices": ["front", "rear"]}}, r"must be of the kind of its value, 2"),
        (BEARING, {"stiffness": {"as": "bearings.front.stiffness"}}, r"has no parameter 'bearings\.front\.stiffness'"),
        (BEARING, {"stiffness": {"as": "front.stiffness"}}, r"has no part 'front'"),
        (BEARING, {"stiffness": {"as": "main.stiffness"}}, r"they do not go together"),
        (BEARING, {"stiffness": {"as": "pinion-front.stiffness"}}, r"a circle"),
        (BEARING, {"stiffness.2": {"low": 0.1, "high": 1.0, "of": "pinion-front.stiffness.2"}}, r"a circle"),
        (BEARING, {"node": {"as": "gear.teeth", "choices": [1, 2]}}, r"as = 'gear\.teeth' has no 2 choices"),
        (
            ("meshes", "main"),
            {"profile": {"choices": [{"kind": "trapezoid"}, {"kind": "harmonic"}]}},
            r"kind = 'harmonic'",
        ),
        (("meshes", "main"), {"profile": {"choices": [{"kind": "trapezoid"}, {"flank": 0.1}]}}, r"need a kind each"),
    ],
)
def test_what_a_rig_file_cannot_assume(table, assumed, message):
    data = load_transmission("nasa-spiral-bevel").model_dump()
    part = data[table[0]][table[1]]
    part["assumed"] = assumed
    with pytest.raises(InputError, match=message):
        transmission_of(data, owner="rig.toml")


def test_ties_in_a_circle_of_several_name_each_of_them():
    data = load_transmission("nasa-spiral-bevel").model_dump()
    for one, other in (("pinion-front", "gear-left"), ("gear-left", "gear-right"), ("gear-right", "pinion-front")):
        data["bearings"][one]["assumed"] = {"stiffness": {"as": f"{other}.stiffness"}}
    with pytest.raises(InputError, match=r"gear-right.* follows .*: a circle"):
        transmission_of(data, owner="rig.toml")


@pytest.mark.parametrize(
    ("line", "other", "message"),
    [
        ("stiffness = 2.2e8", "stiffness = 5.2e8", r"main\.stiffness = 5\.2e\+08 is outside .*1\.3e\+08 to 4\.5e\+08"),
        ("node = 0\nteeth", "node = 1\nteeth", r"gears\.pinion\.node = 1 is outside .*one of 0, 4"),
        ("bore = 0.055", "bore = 0.05", r"gear\.bore = 0\.05 is assumed as .*outer_diameter, so it must be 0\.055"),
        ("rotation = -1", "rotation = 1", r"operating\.rotation = 1 is assumed -1, 1, with .*hand, so it must be -1"),
    ],
)  # fmt: skip
def test_a_file_whose_numbers_are_not_as_it_assumes(tmp_path, line, other, message):
    text = load_text("nasa_spiral_bevel")
    assert text.count(line) == 1
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(line, other), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_transmission(path)


def load_text(name):
    from pathlib import Path

    return (Path(__file__).parents[3] / "data" / "transmissions" / f"{name}.toml").read_text(encoding="utf-8")
