"""Validation: the rigs of the identified ensemble hold their targets, are apart, and have the stored numbers."""

import json
import re
from pathlib import Path

import pytest

import sigdb
from sigdb.paper import identified, identified_rigs
from sigdb.paper.margins import HELD_OUT

ROOT = Path(__file__).parents[2]
NUMBERS = json.loads((ROOT / "docs" / "guide" / "paper_identified.json").read_text(encoding="utf-8"))
PAGE = " ".join((ROOT / "docs" / "guide" / "paper.md").read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def rigs():
    return identified_rigs()


def test_the_first_and_the_last_hold_their_targets_and_have_the_stored_margins(rigs):
    for rig, stored in ((rigs[0], NUMBERS["members"][0]), (rigs[-1], NUMBERS["members"][-1])):
        found = identified.margins_of(rig)
        assert found is not None
        assert found.holds_targets
        assert found.contact == pytest.approx(stored["contact"], abs=1e-4)
        assert found.min_compression == pytest.approx(stored["min_compression"], abs=1e-4)
        assert found.margins == pytest.approx(stored["margins"], abs=1e-3)


def test_a_margin_above_0_or_an_open_mesh_does_not_hold(rigs):
    margins = dict(NUMBERS["members"][0]["margins"])
    assert identified.RigMargins(margins=margins, contact=0.1, min_compression=-0.1).holds_targets
    assert not identified.RigMargins(margins=margins, contact=-0.1, min_compression=-0.1).holds_targets
    assert not identified.RigMargins(margins=margins | {"P5": 0.01}, contact=0.1, min_compression=0.1).holds_targets
    assert identified.RigMargins(margins=margins | {HELD_OUT[0]: 0.01}, contact=0.1, min_compression=0.1).holds_targets


def test_the_members_are_apart_and_differ_only_in_what_is_assumed(rigs):
    assert len(rigs) == len(NUMBERS["members"])
    assert (identified.distances(rigs) >= 0.2).all()
    prior = sigdb.load_transmission(identified.PRIOR)
    for rig in rigs:
        values = prior.assumptions.values_of(rig)
        assert (
            identified.with_output(prior.with_assumed(values), rig.sensors[identified.SENSOR].quantity, rig.name) == rig
        )


def test_the_built_in_rig_is_the_first_member_with_its_fitted_numbers_named(rigs):
    rig = sigdb.load_transmission("nasa-spiral-bevel-identified")
    values, first = rig.assumptions.values_of(rig), rigs[0].assumptions.values_of(rigs[0])
    assert list(values) == list(first)
    for path, value in values.items():
        assert value == (first[path] if isinstance(value, str) else pytest.approx(first[path], rel=1e-6)), path
    fitted = {
        name
        for part in (rig, rig.meshes["main"], rig.couplings["motor"])
        for name, text in part.sources.items()
        if text.startswith("fitted: ")
    }
    assert fitted >= {"damping_ratio", "stiffness", "profile", "inertia"}


def test_a_change_moves_one_kind_of_number(rigs):
    changes = dict(identified.changed_rigs(rigs[0]))
    assert list(changes) == list(NUMBERS["members"][0]["holds_when_changed"])
    assert changes["speed +3 %"].value("operating.speed_rpm") == pytest.approx(1.03 * 14400)
    stiffness = rigs[0].bearings["gear-left"].stiffness[0]
    assert changes["bearings -15 %"].bearings["gear-left"].stiffness[0] == pytest.approx(0.85 * stiffness)


def on_page(pattern):
    """The whole numbers of the only sentence of the page that has a pattern."""
    (groups,) = re.findall(pattern, PAGE)
    return [int(number.replace(" ", "")) for number in groups]


def holding(claim):
    """How many members hold a claim."""
    return sum(member["margins"][claim] <= 0 for member in NUMBERS["members"])


def test_the_page_states_the_stored_numbers():
    members = len(NUMBERS["members"])
    assert on_page(r"In ([\d ]+) evaluations it found (\d+) rigs that hold all targets") == [
        identified.evaluations(),
        members,
    ]
    assert NUMBERS["evaluations"] == identified.evaluations()
    changes = [sum(member["holds_when_changed"].values()) for member in NUMBERS["members"]]
    assert on_page(r"(\d+) of the (\d+) rigs hold all targets under none of the (\d+) changes") == [
        changes.count(0),
        members,
        len(NUMBERS["members"][0]["holds_when_changed"]),
    ]
    assert on_page(r"P8 holds by its number in (\d+) of (\d+)") == [holding("P8"), members]
    assert on_page(r"P9 holds in (\d+) of (\d+)") == [holding("P9"), members]
    assert NUMBERS["least_distance"] == pytest.approx(identified.distances(identified_rigs()).min(), rel=1e-6)
