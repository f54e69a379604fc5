"""Unit and verification: rigs drawn from what is assumed of one, and those that are left out."""

import json
from itertools import islice
from pathlib import Path

import pytest

import sigdb
from sigdb.core.errors import InputError, UnstableRigError
from sigdb.dynamics import drawn_ensemble, possible_rig, prepare_periodic
from sigdb.dynamics.drawn_ensemble import FREE, INVALID, MOST_IN_A_ROW, OPEN, UNSTABLE
from sigdb.dynamics.period import nearest_period
from sigdb.transmission import Transmission, draws, new_rig

GUIDE = Path(__file__).parents[2] / "docs" / "guide"


@pytest.fixture(scope="module")
def rig():
    return sigdb.load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def rigs(rig):
    return sigdb.ensemble(rig, 3, rng=7)


def test_a_member_depends_on_the_seed_and_its_number_not_on_how_many_are_drawn(rig, rigs):
    assert sigdb.ensemble(rig, 1, rng=7)[0] == rigs[0]
    assert len(set(rigs)) == len(rigs) == 3
    assert rigs[:2] == rigs.members[:2]
    assert next(draws(rig, 8)) != next(draws(rig, 7)) == rigs.values[0]


def test_members_are_those_of_their_values(rig, rigs):
    for member, values in zip(rigs, rigs.values, strict=True):
        assert member == rig.with_assumed(values)
        now = member.assumptions.values_of(member)
        assert now.keys() == values.keys()
        assert all(
            now[path] == (pytest.approx(value) if isinstance(value, float) else value) for path, value in values.items()
        )
    assert repr(rigs) == "<Ensemble of 3 rigs from 'nasa-spiral-bevel', 44 free numbers; left out 0>"


def test_the_table_has_a_row_a_member_and_nothing_where_a_number_is_absent(rigs):
    table = rigs.to_pandas()
    assert table.shape == (3, 43)
    for member, row in zip(rigs, table.itertuples(), strict=True):
        is_harmonic = member.meshes["main"].profile.kind == "harmonic"
        assert table["meshes.main.profile"][row.Index] == member.meshes["main"].profile.kind
        assert (table["meshes.main.profile.amplitudes.0"].notna()[row.Index]) == is_harmonic
        assert (table["meshes.main.profile.contact_ratio"].notna()[row.Index]) != is_harmonic


def test_numbers_that_do_not_go_together_are_left_out_and_counted(rig):
    """Flanks of a trapezoid longer than half of its contact: which draws these are follows from their values."""
    data = rig.model_dump()
    data["meshes"]["main"]["assumed"] = {}
    data["meshes"]["main"]["profile"]["assumed"] = {
        "contact_ratio": {"low": 1.2, "high": 1.4}, "flank": {"low": 0.4, "high": 0.9}
    }  # fmt: skip
    del data["operating"]["assumed"]
    narrow = Transmission.model_validate(data)
    path = "meshes.main.profile."
    stream = list(islice(draws(narrow, 1), 8))
    fits = [2 * values[path + "flank"] <= values[path + "contact_ratio"] for values in stream]
    last = [i for i, fit in enumerate(fits) if fit][1]
    rigs = sigdb.ensemble(narrow, 2, rng=1)
    assert [dict(values) for values in rigs.values] == [stream[i] for i in range(last + 1) if fits[i]]
    assert rigs.left_out[INVALID] == fits[:last].count(False) > 0
    assert "left out" in repr(rigs)
    assert INVALID in repr(rigs)


def test_a_mesh_that_opens_is_left_out(rig):
    (values,) = islice(draws(rig, 0), 9, 10)
    assert possible_rig(rig, values) == OPEN
    with pytest.warns(sigdb.dynamics.ContactLossWarning):
        assert sigdb.simulate(rig.with_assumed(values)).min_mesh_force < 0


@pytest.fixture(scope="module")
def train():
    """A hunting train, whose meshes repeat after 67 turns of the input shaft, later than a periodic solution goes."""
    return new_rig("23/67,19/81", speed="14800 rpm", torque="45 N m")


def without_damping(rig):
    return Transmission.model_validate(rig.model_dump() | {"damping_ratio": 1e-4, "assumed": {}})


@pytest.mark.parametrize(
    ("change", "number", "reason"), [(None, 0, None), (None, 2, OPEN), (without_damping, 7, UNSTABLE)]
)
def test_a_hunting_train_is_held_to_all_rules(train, change, number, reason):
    """The march in time over 60 turns from rest keeps the meshes closed in draw 0, and parts teeth in draw 2."""
    train = change(train) if change else train
    (values,) = islice(draws(train, 1), number, number + 1)
    found = possible_rig(train, values)
    assert found == reason if reason else found == train.with_assumed(values)


def test_a_hunting_train_has_no_periodic_solution_of_its_own(train):
    with pytest.raises(InputError, match="do not repeat within 60 revolutions"):
        prepare_periodic(train)


@pytest.mark.parametrize(
    ("stages", "revolutions", "passes"),
    [
        ("23/67,19/81", 2, (46, 13)),  # 2 * 23 / 67 * 19 = 13.045, 0.34 % more
        ("20/60,18/54", 1, (20, 6)),  # repeats after a turn
        ("19/48", 1, (19,)),
    ],
)
def test_the_nearest_train_has_mesh_frequencies_within_half_a_percent(stages, revolutions, passes):
    rig = new_rig(stages, speed=1480.0, torque=45.0)
    assert nearest_period(rig, next(iter(rig.gears))) == (revolutions, passes)


def test_an_unstable_rig_is_left_out(rig):
    data = rig.model_dump()
    data["damping_ratio"] = 0.004
    data["assumed"] = {}
    for mode in data["casing"]["modes"]:
        mode["damping_ratio"] = 0.004
        del mode["assumed"]["damping_ratio"]
    undamped = Transmission.model_validate(data)
    (values,) = islice(draws(undamped, 1), 5, 6)
    assert possible_rig(undamped, values) == UNSTABLE
    with pytest.raises(UnstableRigError):
        sigdb.simulate(undamped.with_assumed(values))


def test_a_rig_with_a_part_that_moves_freely_is_left_out_until_it_is_given_up(rig, monkeypatch):
    data = rig.model_dump()
    del data["bearings"]["pinion-rear"]
    assert possible_rig(Transmission.model_validate(data), {}) == FREE
    monkeypatch.setattr(drawn_ensemble, "possible_rig", lambda rig, values: FREE)
    with pytest.raises(
        InputError, match=rf"{MOST_IN_A_ROW} draws in a row cannot be \({MOST_IN_A_ROW} {FREE}\); narrow"
    ):
        sigdb.ensemble(rig, 1, rng=0)


@pytest.mark.parametrize("n", [0, -1, 1.5, True])
def test_a_number_of_members_that_is_none(rig, n):
    with pytest.raises(InputError, match=r"n = .* must be a whole number, 1 or more"):
        sigdb.ensemble(rig, n)


def test_a_rig_of_which_nothing_is_free(rig):
    with pytest.raises(InputError, match=r"rig 'bare' has no assumed number with a range or choices"):
        sigdb.ensemble(Transmission.model_validate(_bare(rig.model_dump()) | {"name": "bare"}), 1)


def _bare(value):
    if isinstance(value, dict):
        return {key: _bare(item) for key, item in value.items() if key != "assumed"}
    return [_bare(item) for item in value] if isinstance(value, list | tuple) else value


def test_stored_numbers_of_unknown_rigs_are_as_the_page_says():
    document = json.loads((GUIDE / "ensemble.json").read_text(encoding="utf-8"))
    rows = {(row["rig"], row["sensor"], row["named"]): row for row in document["tables"]["unknown rigs"]}
    spur = rows["spur-test-rig", "pinion-vertical", "exactly"]
    assert spur["8_drawn_rigs"] > 0.94
    assert max(spur["shipped_rig"], spur["one_drawn_rig"]) < 0.8
    bevel = rows["nasa-spiral-bevel", "pinion-vertical", "within one"]
    assert bevel["8_drawn_rigs"] > bevel["shipped_rig"] > bevel["one_drawn_rig"]
    assert rows["nasa-spiral-bevel", "pinion-vertical", "exactly"]["8_drawn_rigs"] < 0.5
    assert rows["nasa-spiral-bevel", "pinion-housing-vertical", "within one"]["8_drawn_rigs"] < 0.5
    assert "{stored} ensemble.json unknown rigs\n" in (GUIDE / "known_and_assumed.md").read_text(encoding="utf-8")
