"""Unit: what each of the splits S0 to S5 learns from and asks about, cell by cell."""

import hashlib
import json
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sigdb.core.errors import InputError
from sigdb.database import QUANTITIES
from sigdb.database.splits.kinds import between, beyond, changed_parts, make_split, model_form
from sigdb.database.splits.split import ASIDE, TEST, TRAINING, Split
from sigdb.recognition import RecognitionSettings, TemplateBank, evaluate, requested_rows, train
from sigdb.recognition.training import usable_rows

LOSSES, SHIFTS, COUNTS = (0.1, 0.2, 0.3, 0.4), (0.0, 1.5, 3.0), (1, 2)


def a_sweep(*, losses=LOSSES, shifts=SHIFTS, counts=COUNTS, specimens=6, draws=1, teeth=(3,)):
    """Rows of a grid: every specimen has every case at every tooth, and a healthy row of each gear."""
    rows = [
        (specimen, draw, tooth, count_of_teeth, loss, shift, count)
        for specimen, draw, count_of_teeth in product(range(specimens), range(draws), teeth)
        for tooth, loss, shift, count in [
            (0, 0.0, 0.0, 0),
            *product(range(1, count_of_teeth + 1), losses, shifts, counts),
        ]
    ]
    return pd.DataFrame(
        rows, columns=["specimen", "draw", "tooth", "teeth", "stiffness_loss", "phase_shift_deg", "damaged_teeth"]
    )


def cells(*axes):
    return pd.DataFrame(list(product(*axes)), columns=list(QUANTITIES))


def specimens_of(rows, folds, fold):
    return set(rows["specimen"][folds == fold])


axis = st.lists(st.integers(-9, 9), min_size=1, max_size=6, unique=True).map(sorted)


@given(axis, axis, axis)
def test_cells_between_keep_a_trained_neighbour_on_both_sides(losses, shifts, counts):
    grid = cells(losses, shifts, counts)
    held_out = set(grid[between(grid)].itertuples(index=False, name=None))
    axes = [losses, shifts, counts]
    for cell in held_out:
        for i, values in enumerate(axes):
            if len(values) >= 3:
                place = values.index(cell[i])
                assert 0 < place < len(values) - 1
                for neighbour in (values[place - 1], values[place + 1]):
                    assert (*cell[:i], neighbour, *cell[i + 1 :]) not in held_out
    # Of k values of an axis those at places 1, 3, ... but not the last are held out.
    expected = np.prod([(len(values) - 1) // 2 if len(values) >= 3 else len(values) for values in axes])
    assert len(held_out) == (expected if max(map(len, axes)) >= 3 else 0)


def test_between_of_a_cross_of_two_lines():
    # A line over the loss and one over the shift, not their product; (0, 0) damages nothing and is not there.
    loss_line = [(loss, 0.0, 1) for loss in (0.1, 0.2, 0.3)]
    shift_line = [(0.0, shift, 1) for shift in (1.0, 2.0, 3.0, 4.0)]
    grid = pd.DataFrame(loss_line + shift_line, columns=list(QUANTITIES))
    assert [tuple(cell) for cell in grid[between(grid)].to_numpy()] == [(0.2, 0, 1), (0, 2, 1)]


@given(axis, axis, axis)
def test_what_is_trained_is_inside_of_what_is_beyond(losses, shifts, counts):
    grid = cells(losses, shifts, counts)
    outer = beyond(grid)
    for values, name in zip((losses, shifts, counts), QUANTITIES, strict=True):
        magnitudes = {abs(value) for value in values}
        if len(magnitudes) >= 3:
            assert outer[(grid[name].abs() == max(magnitudes)).to_numpy()].all()
            assert (grid.loc[~outer, name].abs() < max(magnitudes)).all()
    if all(len({abs(value) for value in values}) < 3 for values in (losses, shifts, counts)):
        assert not outer.any()


def test_s1_is_by_specimen_alone():
    rows = a_sweep()
    split = make_split("S1", rows, seed=4, folds=3)
    assert split.keys == ["specimen"]
    folds = split.folds(rows)
    assert set(folds) == {TRAINING, TEST}
    assert len(specimens_of(rows, folds, TEST)) == 2
    assert specimens_of(rows, folds, TEST) & specimens_of(rows, folds, TRAINING) == set()


@pytest.mark.parametrize(
    ("name", "is_held_out"),
    [
        ("S2", lambda row: row.stiffness_loss == 0.2 and row.phase_shift_deg == 1.5),
        ("S3", lambda row: row.stiffness_loss == 0.4 or row.phase_shift_deg == 3.0),
    ],
)
def test_s2_and_s3_hold_out_cells_on_held_out_specimens(name, is_held_out):
    rows = a_sweep()
    folds = make_split(name, rows, seed=4, folds=3).folds(rows)
    other = make_split("S1", rows, seed=4, folds=3).folds(rows)
    for row, fold, side in zip(rows.itertuples(), folds, other, strict=True):
        asked = row.tooth == 0 or is_held_out(row)
        learnt = row.tooth == 0 or not is_held_out(row)
        expected = {TEST: asked, TRAINING: learnt}[side]
        assert fold == (side if expected else ASIDE)


def test_s4_asks_about_a_tooth_count_that_training_has_not():
    rows = a_sweep(losses=(0.2,), shifts=(0.0,), teeth=(3, 4, 5))
    folds = make_split("S4", rows, seed=1, folds=3).folds(rows)
    assert set(rows["teeth"][folds == TEST]) == {4}
    assert set(rows["teeth"][folds == TRAINING]) == {3, 5}
    assert specimens_of(rows, folds, TEST) & specimens_of(rows, folds, TRAINING) == set()
    assert set(rows["tooth"][folds == TEST]) == {0, 1, 2, 3, 4}
    two = a_sweep(losses=(0.2,), shifts=(0.0,), teeth=(3, 4))
    assert set(two["teeth"][make_split("S4", two, seed=1, folds=3).folds(two) == TEST]) == {4}


def test_s0_asks_about_other_draws_of_the_same_specimens_and_cases():
    rows = a_sweep(draws=4)
    split = make_split("S0", rows, seed=1, folds=2)
    folds = split.folds(rows)
    assert split.shares_specimens
    assert set(rows["draw"][folds == TEST]) == {0, 2}
    assert set(rows["draw"][folds == TRAINING]) == {1, 3}
    assert specimens_of(rows, folds, TEST) == specimens_of(rows, folds, TRAINING) == set(range(6))


@pytest.mark.parametrize(
    ("name", "rows", "message"),
    [
        ("S0", a_sweep(), "needs two noise draws or more of every case; set draws"),
        ("S2", a_sweep(losses=(0.1, 0.2), shifts=(0.0, 1.0)), "needs three values or more of a severity"),
        ("S3", a_sweep(losses=(0.1, 0.2), shifts=(-1.0, 1.0)), "needs three magnitudes or more of a severity"),
        ("S4", a_sweep(), "needs two tooth counts or more, all rows have 3; sweep GEAR.teeth"),
        ("S1", a_sweep(specimens=2), "2 specimens cannot be split into 3 folds"),
        ("S6", a_sweep(), r"needs rigs of an ensemble, two or more; give \[sweep\.ensemble\]"),
        ("S6", a_sweep().assign(rig_member=1), "needs rigs of an ensemble, two or more"),
        ("S7", a_sweep().assign(speed_rpm=100.0, torque=1.0), "needs operating points whose speed and torque are"),
        ("S7", pd.concat([a_sweep().assign(speed_rpm=100.0 * k, torque=1.0 * k) for k in (1, 2)]), "between those of"),
        ("S8", a_sweep(), "split = 'S8' does not exist"),
    ],
)
def test_a_database_that_cannot_be_split_so_says_what_is_needed(name, rows, message):
    with pytest.raises(InputError, match=message):
        make_split(name, rows, seed=1, folds=3)


def test_rows_of_patterns_and_healthy_ones_are_no_cells():
    rows = a_sweep()
    pattern = rows[rows["stiffness_loss"] == 0.1].assign(stiffness_loss=np.nan, phase_shift_deg=np.nan)
    rows = pd.concat([rows, pattern], ignore_index=True)
    folds = make_split("S2", rows, seed=4, folds=3).folds(rows)
    of_patterns = rows["stiffness_loss"].isna().to_numpy()
    assert set(folds[of_patterns]) == {TRAINING, ASIDE}
    assert set(folds[(rows["tooth"] == 0).to_numpy()]) == {TRAINING, TEST}


@pytest.mark.parametrize("name", ["S1", "S2", "S3"])
def test_the_table_holds_for_any_order_and_number_of_rows(name):
    rows = a_sweep()
    split = make_split(name, rows, seed=4, folds=3)
    order = np.random.default_rng(0).permutation(len(rows))
    shuffled = rows.iloc[order].set_axis(np.arange(len(rows)) + 1000)
    assert make_split(name, shuffled, seed=4, folds=3).hash == split.hash
    np.testing.assert_array_equal(split.folds(shuffled), split.folds(rows)[order])
    np.testing.assert_array_equal(split.folds(rows[:7]), split.folds(rows)[:7])
    assert make_split(name, rows, seed=5, folds=3).hash != split.hash


def of_table(fold, **others):
    table = pd.DataFrame({"specimen": [0, 1, 1], "draw": [0, 0, 1], "fold": fold})
    return Split(name="S1", text="a table of a test", table=table, **others)


def test_a_split_that_shares_a_specimen_is_caught():
    of_table([TRAINING, TEST, TEST])
    of_table([TRAINING, TEST, ASIDE])
    with pytest.raises(InputError, match=r"specimens \[1\] are in training and in test"):
        of_table([TRAINING, TEST, TRAINING])
    of_table([TRAINING, TEST, TRAINING], shares_specimens=True)


def test_a_table_that_is_ambiguous_or_lacks_a_side_is_caught():
    with pytest.raises(InputError, match="no case is in the fold 'test'"):
        of_table([TRAINING, TRAINING, ASIDE])
    table = pd.DataFrame({"specimen": [0, 0, 1], "fold": [TRAINING, ASIDE, TEST]})
    with pytest.raises(InputError, match="a case has two folds"):
        Split(name="S1", text="", table=table)


def test_a_case_that_the_table_does_not_hold_is_named():
    split = of_table([TRAINING, TEST, TEST])
    with pytest.raises(InputError, match=r"does not hold the case \{'specimen': 0, 'draw': 1\}"):
        split.folds(pd.DataFrame({"specimen": [1, 0], "draw": [0, 1]}))


def test_the_hash_is_that_of_name_and_table():
    split = of_table([TRAINING, TEST, TEST])
    assert replace(split, table=split.table[::-1]).hash == split.hash
    assert len(split.hash) == 64
    others = [of_table([TRAINING, TEST, ASIDE]), of_table([TEST, TRAINING, TRAINING]), replace(split, name="S2")]
    assert len({one.hash for one in (split, *others)}) == 4


@pytest.fixture(scope="module")
def three_losses(make_database):
    return make_database(specimens=3, healthy=4, grid="tooth = [1, 6]\nstiffness_loss = [0.2, 0.3, 0.4]")


def test_a_model_is_asked_about_what_its_split_holds_out(three_losses):
    model = train(three_losses, "location", RecognitionSettings(folds=3, learner="lda"), split="S2")
    (unseen,) = {0, 1, 2} - set(model.trained_on)
    assert model.rows == 2 * (4 + 2 * 2)
    rows = requested_rows(model, three_losses)
    assert set(rows["specimen"]) == {unseen}
    assert set(rows.loc[rows["tooth"] > 0, "stiffness_loss"]) == {0.3}
    assert len(rows) == 4 + 2
    evaluation = evaluate(model, three_losses, bound=False)
    assert evaluation.split == "S2"
    assert evaluation.split_text.startswith("between the grid's values")
    assert evaluation.split_hash == make_split("S2", usable_rows(three_losses, "location"), seed=1, folds=3).hash
    with pytest.raises(InputError, match="was extended since the model was trained"):
        evaluate(replace(model, split_hash="0" * 64), three_losses)


def test_a_model_of_one_tooth_count_is_asked_about_the_other(mixed_teeth):
    model = train(mixed_teeth, "location", RecognitionSettings(folds=3, learner="lda"), split="S4")
    assert set(requested_rows(model, mixed_teeth)["teeth"]) == {13}
    assert model.rows == 2 * (6 + 12 * 2)


def test_another_model_form_is_s5_and_says_what_differs(mixed_teeth, location_model, database):
    assert evaluate(location_model, mixed_teeth, bound=False).split == "S1"
    # The model remembers other bearings than those of the database that it is asked about.
    other = replace(location_model, form=location_model.form | {"rig.bearings": "other"})
    evaluation = evaluate(other, mixed_teeth, bound=False)
    assert evaluation.split == "S5"
    assert evaluation.split_text.startswith(f"another model form: {mixed_teeth.store}, which differs in rig.bearings;")
    (form,) = [note for note in evaluation.notes if note.code == "other-model-form"]
    assert form.values == {"parts": "rig.bearings"}


def test_the_model_form_is_the_rig_and_the_solver_and_not_the_cases(database, mixed_teeth):
    resolved = database.manifest.resolved
    form = model_form(resolved)
    assert changed_parts(form, mixed_teeth.manifest.resolved) == []
    softer = resolved | {
        "rig": resolved["rig"] | {"damping_ratio": 0.5, "title": "softer"},
        "solver": {"kind": "march"},
    }
    assert changed_parts(form, softer) == ["rig.damping_ratio", "solver"]


def test_sources_and_assumptions_are_no_part_of_the_model_form(database):
    resolved = database.manifest.resolved
    bearings = dict(resolved["rig"]["bearings"])
    name = next(iter(bearings))
    bearings[name] = bearings[name] | {
        "sources": {"node": "derived: the end"},
        "assumed": {"node": {"choices": [0, 1]}},
    }
    other = resolved | {"rig": resolved["rig"] | {"bearings": bearings}}
    assert changed_parts(model_form(resolved), other) == []
    bearings[name] = bearings[name] | {"stiffness": [1.0, 1.0, 1.0]}
    assert changed_parts(model_form(resolved), other) == ["rig.bearings"]


def test_a_model_form_that_has_the_sources_in_it_still_holds(database):
    """Models were described so once: the SHA-256 of a part with its sources, without what is assumed of it."""
    resolved = database.manifest.resolved
    once = {
        name: hashlib.sha256(json.dumps(_without_assumed(resolved["rig"][name.split(".")[1]]), sort_keys=True).encode())
        for name in model_form(resolved)
    }
    form = {name: digest.hexdigest() for name, digest in once.items()}
    assert form != model_form(resolved)
    assert changed_parts(form, resolved) == []


def _without_assumed(value):
    if isinstance(value, dict):
        return {key: _without_assumed(item) for key, item in value.items() if key != "assumed"}
    return [_without_assumed(item) for item in value] if isinstance(value, list) else value


def test_s6_holds_out_whole_rigs_of_an_ensemble_and_specimens():
    rows = pd.concat([a_sweep(losses=(0.1,), shifts=(0.0,), counts=(1,)).assign(rig_member=m) for m in range(1, 8)])
    split = make_split("S6", rows, seed=3, folds=3)
    sides = {fold: rows[split.folds(rows) == fold] for fold in (TRAINING, TEST)}
    trained, unseen = (set(sides[fold]["rig_member"]) for fold in (TRAINING, TEST))
    assert (len(trained), len(unseen)) == (5, 2)
    assert not trained & unseen
    assert not set(sides[TRAINING]["specimen"]) & set(sides[TEST]["specimen"])
    assert split.text.startswith("unknown rig: members ")
    assert split.hash == make_split("S6", rows, seed=3, folds=3).hash
    assert {frozenset(make_split("S6", rows, seed=seed, folds=3).table.query("fold == 'test'")["rig_member"])
            for seed in range(6)} != {frozenset(unseen)}  # fmt: skip


def test_s7_holds_out_operating_points_between_the_others_and_specimens():
    places = [(100.0 * k, 10.0 * (5 * k % 11)) for k in range(1, 11)]
    rows = a_sweep(losses=(0.1,), shifts=(0.0,), counts=(1,))
    rows = pd.concat([rows.assign(speed_rpm=speed, torque=torque) for speed, torque in places])
    split = make_split("S7", rows, seed=3, folds=3)
    sides = {fold: rows[split.folds(rows) == fold] for fold in (TRAINING, TEST)}
    trained, unseen = ({*zip(side["speed_rpm"], side["torque"], strict=True)} for side in sides.values())
    assert (len(trained), len(unseen)) == (7, 3)
    assert trained | unseen == set(places)
    assert not set(sides[TRAINING]["specimen"]) & set(sides[TEST]["specimen"])
    for axis in range(2):
        lowest, *_, highest = sorted(place[axis] for place in trained)
        assert all(lowest < place[axis] < highest for place in unseen)
    other = make_split("S7", rows, seed=3, folds=3, held_out=1)
    asked = rows[other.folds(rows) == TEST]
    assert not unseen & {*zip(asked["speed_rpm"], asked["torque"], strict=True)}


ENSEMBLE_GRID = """tooth = [1, 4]
stiffness_loss = [0.4]

[sweep.ensemble]
members = 2
values = [{ "meshes.main.stiffness" = 3.0e8 }, { "meshes.main.stiffness" = 1.5e8 }]
"""


def test_a_bank_of_known_rigs_has_no_template_of_the_unknown_one(make_database):
    database = make_database(specimens=3, healthy=2, grid=ENSEMBLE_GRID)
    rows = usable_rows(database, "location")
    assert set(rows["rig_member"]) == {1, 2}
    known = TemplateBank.of(database, cases=rows[rows["rig_member"] == 2])
    assert [len(point.severity) for point in TemplateBank.of(database, cases=rows).points] == [4]
    assert [len(point.severity) for point in known.points] == [2]
