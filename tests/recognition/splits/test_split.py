"""Unit: specimens are split by a fixed table, and evaluation never asks about a specimen of the training."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sigdb.core.errors import DatabaseError, InputError
from sigdb.database import make_split
from sigdb.database.splits.split import check_classes, specimen_folds
from sigdb.recognition import RecognitionSettings, evaluate, train
from sigdb.recognition.estimators.contract import Scorer
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.training import usable_rows

TWO_TEETH = "tooth = [1, 6]\nstiffness_loss = [0.4]"


@given(st.integers(0, 2**31), st.sets(st.integers(0, 10**6), min_size=3, max_size=40), st.integers(2, 3))
def test_every_specimen_has_one_fold_and_folds_are_balanced(seed, names, folds):
    column = np.repeat(sorted(names), 2)
    table = specimen_folds(seed, column, folds)
    assert set(table) == names
    sizes = np.bincount(list(table.values()), minlength=folds)
    assert len(sizes) == folds
    assert np.ptp(sizes) <= 1
    assert specimen_folds(seed, column[::-1], folds) == table


def test_the_table_depends_on_the_seed_and_on_nothing_else():
    tables = [specimen_folds(seed, np.arange(20), 5) for seed in range(10)]
    assert len({tuple(sorted(table.items())) for table in tables}) == 10
    # Recorded: a table that changes lets models that were published before see their training rows again.
    assert specimen_folds(1, np.arange(6), 3) == {3: 0, 0: 1, 1: 2, 5: 0, 2: 1, 4: 2}


def test_a_class_of_two_specimens_is_dealt_to_both_sides():
    # Specimens 0 and 3 would be in folds 1 and 0 by turns, 0 and 5 too, 3 and 5 both in fold 0.
    for pair in ((0, 3), (0, 5), (3, 5), (1, 4)):
        specimens = np.repeat(np.arange(6), 4)
        labels = np.where(np.isin(specimens, pair) & (np.arange(24) % 4 == 0), 7, 0)
        table = specimen_folds(1, specimens, 2, labels)
        assert table[pair[0]] != table[pair[1]]
        assert sorted(table.values()) == [0, 0, 0, 1, 1, 1]


def test_classes_too_rare_for_any_fold_are_told():
    with pytest.raises(InputError, match=r"the rows cannot be split into 3 folds: .*; choose fewer folds"):
        specimen_folds(1, np.arange(3), 3, np.arange(3))


def test_too_few_specimens_say_how_many_are_needed():
    with pytest.raises(InputError, match="4 specimens cannot be split into 5 folds; make a database with 5 specimens"):
        specimen_folds(0, np.array([1, 2, 3, 3, 4]), 5)


def test_a_class_that_is_missing_from_a_fold_is_named():
    labels = pd.Series([0, 1, 2, 0, 1, 2])
    check_classes(labels, np.array([True, True, True, False, False, False]), "training")
    with pytest.raises(InputError, match=r"training specimens have no rows of the classes \[1\]"):
        check_classes(labels, np.array([True, False, True, True, False, False]), "training")


class WithoutRows:
    """A database of which some rows are hidden."""

    def __init__(self, database, hide):
        self._database, self._hide = database, hide

    def __getattr__(self, name):
        return getattr(self._database, name)

    def __len__(self):
        return len(self._database)

    def sql(self, query):
        rows = self._database.sql(query)
        return rows[~self._hide(rows)]


@pytest.mark.parametrize("only", range(6))
def test_training_refuses_a_fold_without_a_class(database, only):
    # Tooth 7 is in one specimen only: whichever fold has it, the other one lacks it.
    lacking = WithoutRows(database, lambda rows: (rows["tooth"] == 7) & (rows["specimen"] != only))
    with pytest.raises(InputError, match=r"the (held-out|training) specimens have no rows of the classes \[7\]"):
        train(lacking, "location", RecognitionSettings(folds=3))


def test_training_and_held_out_specimens_are_disjoint(database, location_model):
    table = specimen_folds(1, np.arange(6), 3)
    assert set(location_model.trained_on) == {one for one, fold in table.items() if fold != 0}
    split = make_split("S1", usable_rows(database, "location"), seed=1, folds=3)
    assert (location_model.split, location_model.folds, location_model.split_hash) == ("S1", 3, split.hash)
    assert location_model.rows == 4 * (24 + 8 * 12)
    assert (location_model.seed, location_model.sensor) == (1, "pinion-vertical")
    assert location_model.database_hash == database.manifest.hash


class Witness(Scorer):
    """An estimator that remembers the rows that it answers."""

    def fit(self, X, y, groups=None):
        return self

    def decision_function(self, X):
        self.seen = Batch.from_rows(X).table
        return np.zeros((len(self.seen), 2))


def evaluated(model, database):
    """The rows that a model is evaluated on, and the evaluation."""
    witness = Witness()
    evaluation = evaluate(replace(model, estimators={model.learner: witness}), database, bound=False)
    assert evaluation.rows == len(witness.seen)
    assert evaluation.specimens == witness.seen["specimen"].nunique()
    return witness.seen, evaluation


def test_evaluation_on_the_training_database_asks_about_held_out_specimens(database, location_model):
    seen, evaluation = evaluated(location_model, database)
    assert set(seen["specimen"]) == {3, 5}
    assert len(seen) == 2 * (24 + 8 * 12)
    assert "held out of training, the same cases" in evaluation.split_text


def test_evaluation_on_more_specimens_of_the_same_seed_leaves_out_the_known_ones(make_database, location_model):
    more = make_database(specimens=8, healthy=2, grid=TWO_TEETH)
    seen, evaluation = evaluated(location_model, more)
    assert set(seen["specimen"]) == {3, 5, 6, 7}
    assert len(seen) == 4 * (2 + 2)
    assert "held out of training, the cases of another database" in evaluation.split_text


def test_evaluation_on_another_seed_asks_about_all_specimens(mixed_teeth, location_model):
    seen, evaluation = evaluated(location_model, mixed_teeth)
    assert set(seen["specimen"]) == {0, 1, 2}
    assert len(seen) == len(mixed_teeth)
    assert "another seed" in evaluation.split_text


def test_evaluation_of_severity_asks_about_damaged_rows_only(database, severity_model):
    assert evaluate(severity_model, database, bound=False).rows == 2 * 8 * 12


def test_evaluation_without_unseen_specimens_is_refused(make_database, location_model):
    known = make_database(specimens=3, healthy=2, grid=TWO_TEETH)
    assert set(location_model.trained_on) >= {0, 1, 2}
    with pytest.raises(InputError, match=r"every specimen of .* was used in training; evaluate on .* another seed"):
        evaluate(location_model, known, bound=False)


def test_evaluation_on_another_sensor_is_refused(make_database, location_model):
    other = make_database(seed=3, specimens=1, healthy=1, grid=TWO_TEETH, sensor="pinion-housing-vertical")
    with pytest.raises(
        InputError, match=r"the model reads 'pinion-vertical', .* holds 'pinion-housing-vertical' first"
    ):
        evaluate(location_model, other, bound=False)


def test_training_refuses_an_unknown_target(database):
    with pytest.raises(InputError, match="target = 'wear' does not exist; choose one of location, severity"):
        train(database, "wear")


def test_training_refuses_a_database_without_healthy_rows(make_database):
    ill = make_database(specimens=3, healthy=0, grid=TWO_TEETH)
    with pytest.raises(InputError, match="has no healthy rows to learn from"):
        train(ill, "location")


def test_training_refuses_a_sweep_that_is_not_finished(database):
    class Unfinished(WithoutRows):
        lacks = "719 of 720 rows"

    with pytest.raises(DatabaseError, match="has 719 of 720 rows; finish the sweep first"):
        train(Unfinished(database, lambda rows: rows["tooth"] < 0), "location")


def test_rows_of_patterns_teach_location_but_not_severity(make_database):
    patterns = (
        f'{TWO_TEETH}\n[[sweep.grid]]\ntooth = [3]\npattern = ["pitted"]\n'
        "[sweep.patterns]\npitted = [{ stiffness_loss = 0.5, loss_extent = 0.2 }, { stiffness_loss = 0.1 }]"
    )
    database = make_database(specimens=2, healthy=1, grid=patterns)
    location, severity = (usable_rows(database, target) for target in ("location", "severity"))
    assert sorted(location["tooth"].unique()) == [0, 1, 3, 6]
    assert sorted(severity["tooth"].unique()) == [0, 1, 6]
    assert severity.loc[severity["tooth"] > 0, ["stiffness_loss", "phase_shift_deg"]].notna().all(axis=None)
