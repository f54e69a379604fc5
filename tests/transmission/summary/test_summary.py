"""Unit: numbers of a rig that are assumed, their ranges in words, and remarks on those without one."""

import pytest

from sigdb.report import rig_text
from sigdb.transmission import built_in_transmissions, describe_rig, load_transmission
from sigdb.transmission.summary.summary import assumed_facts, origins, unranged_numbers


@pytest.mark.parametrize("name", built_in_transmissions())
def test_every_assumed_number_of_a_built_in_rig_has_a_range(name):
    rig = load_transmission(name)
    assert unranged_numbers(rig) == []
    assert rig.assumptions.free
    assert ((point := rig.assumptions.to_unit(rig)) >= 0).all()
    assert (point <= 1).all()


@pytest.fixture(scope="module")
def rig():
    return load_transmission("chaari-8dof")


def test_ranges_choices_and_ties_in_words():
    facts = {row["path"]: row for row in assumed_facts(load_transmission("nasa-spiral-bevel"))}
    assert facts["damping_ratio"] == {
        "path": "damping_ratio", "value": 0.054, "assumed": "0.025 to 0.06", "is_free": True
    }  # fmt: skip
    assert facts["meshes.main.profile"]["value"] == "trapezoid"
    assert facts["meshes.main.profile"]["assumed"] == "one of trapezoid, harmonic"
    assert facts["bearings.gear-right.stiffness"] == {
        "path": "bearings.gear-right.stiffness",
        "value": [1.7e8, 1.7e8, 1.45e8],
        "assumed": "as bearings.gear-left.stiffness",
        "is_free": False,
    }


def test_a_number_without_range_and_source_is_remarked_on_by_its_path(rig):
    data = rig.model_dump()
    data["meshes"]["main"]["assumed"] = {}
    data["meshes"]["main"]["sources"]["module"] = "assumed: usual"
    del data["couplings"]["motor"]["sources"]["inertia"]
    data["couplings"]["brake"]["sources"]["inertia"] = "fitted: to the first torsional frequency"
    changed = type(rig).model_validate(data)
    assert unranged_numbers(changed) == ["couplings.motor.inertia", "meshes.main.module", "meshes.main.stiffness"]
    facts = describe_rig(changed)
    (remark,) = facts["remarks"]
    assert remark == (
        "3 numbers are assumed without a range: couplings.motor.inertia, meshes.main.module, meshes.main.stiffness; "
        "give each assumed.KEY, or another source"
    )
    assert remark in rig_text(facts)
    assert origins(changed)["fitted"] == 1


def test_many_numbers_without_a_range_are_counted_and_the_first_named(rig):
    data = rig.model_dump() | {"sources": {}, "assumed": {}}
    for name in ("bearings", "meshes", "gears"):
        for part in data[name].values():
            part["sources"] = part["assumed"] = {}
    changed = type(rig).model_validate(data)
    (remark,) = describe_rig(changed)["remarks"]
    count = len(unranged_numbers(changed))
    assert remark.startswith(f"{count} numbers are assumed without a range: damping_ratio, ")
    assert f" and {count - 6} more; give" in remark


def test_the_page_of_a_rig_shows_what_is_assumed(rig):
    lines = rig_text(describe_rig(rig)).splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("Assumed numbers, 3 of them free"))
    assert [line.split() for line in lines[head + 2 : head + 4]] == [
        ["meshes.main.stiffness", "2e+08", "1.7e+08", "to", "2.3e+08"],
        ["meshes.main.profile.contact_ratio", "1.6", "1.55", "to", "1.7"],
    ]
