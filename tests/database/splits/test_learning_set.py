"""Unit: inputs without labels, ids and truth, labels, and folds that share no group."""

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.database import Role, role_of
from sigdb.database.splits.kinds import make_split
from sigdb.database.splits.split import TEST, TRAINING


@pytest.fixture(scope="module")
def learning_set(database):
    return database.xy("location", folds=2)


def test_x_has_the_inputs_of_the_rows_and_nothing_else(database, learning_set):
    X, y, groups, _ = learning_set
    rows = database.features("status = 'ok'").set_index("id")
    assert X.index.tolist() == y.index.tolist() == groups.index.tolist() == rows.index.tolist()
    forbidden = {"tooth", "stiffness_loss", "specimen", "draw", "template", "snr_db", "min_compression", "status"}
    assert not forbidden & {name.partition("[")[0] for name in X.columns}
    np.testing.assert_array_equal(X["fm4"], rows["fm4"].astype(float))
    widest = max(map(len, rows["wigner_ville"]))
    cells = [np.pad(row.astype(float), (0, widest - len(row)), constant_values=np.nan) for row in rows["wigner_ville"]]
    np.testing.assert_array_equal(X[[f"wigner_ville[{i}]" for i in range(widest)]], cells)
    np.testing.assert_array_equal(y, rows["tooth"])


def test_no_specimen_is_on_both_sides_of_a_fold_and_each_is_tested_once(database, learning_set):
    _, _, groups, cv = learning_set
    assert len(cv) == 2
    for train, test in cv:
        assert not set(groups.iloc[train]) & set(groups.iloc[test])
        assert len(train) + len(test) == len(groups)
    assert sorted(np.concatenate([test for _, test in cv])) == list(range(len(groups)))


def test_the_first_fold_is_that_of_a_trained_model(database, learning_set):
    rows = database.cases("status = 'ok'").set_index("id")
    fold = make_split("S1", rows, seed=database.manifest.seed, folds=2).folds(rows)
    train, test = learning_set.cv[0]
    np.testing.assert_array_equal(train, np.flatnonzero(fold == TRAINING))
    np.testing.assert_array_equal(test, np.flatnonzero(fold == TEST))


def test_severity_is_of_damaged_rows(database):
    X, y, _, cv = database.xy("severity", folds=2, columns=["kurtosis"])
    rows = database.cases("status = 'ok' and tooth > 0").set_index("id")
    assert X.columns.tolist() == ["kurtosis"]
    assert y.index.tolist() == rows.index.tolist()
    np.testing.assert_array_equal(y["stiffness_loss"], rows["stiffness_loss"])
    assert all(np.concatenate(pair).max() < len(y) for pair in cv)


def test_averages_are_inputs_too(database):
    X = database.xy("detection", folds=2, columns=["tsa", "scatter"]).X
    stored = database.signals(X.index.to_numpy()[-1:])["tsa"]
    np.testing.assert_array_equal(X[[f"tsa[{i}]" for i in range(stored.shape[1])]].iloc[-1:], stored)
    assert X.columns[0] == "scatter"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target": "place"}, "target = 'place' does not exist; choose one of location, detection, kind, severity"),
        ({"columns": ["snr_db"]}, "snr_db has the role truth, not input"),
        ({"columns": ["tooth"]}, "tooth has the role label, not input"),
        ({"columns": ["fm5"]}, "there is no column 'fm5'; did you mean"),
        ({"columns": ["zzz"]}, r"known: (?!.*\b(tooth|snr_db|id)\b)"),
        ({"columns": "fm4"}, r"columns = 'fm4' must be a list of names, such as \['fm4'\]"),
        ({"folds": 1}, "folds = 1 must be 2 or more"),
        ({"split": "S9"}, "split = 'S9' does not exist"),
        ({"split": "machine"}, "split machine is not one of these rows"),
        ({"folds": 50}, "cannot be split into 50 folds"),
    ],
)
def test_what_cannot_be_learnt_from_is_refused(database, options, message):
    with pytest.raises(InputError, match=message):
        database.xy(**{"target": "location", "folds": 2} | options)


def test_every_column_has_a_role(database):
    """Indicators and pooled cells are inputs; all others stand in the table of roles."""
    schema = database.dataset("features").schema
    stored = dict(zip(schema.names, map(role_of, schema.names), strict=True))
    behind = schema.names[schema.names.index("scatter") :]
    assert {stored[name] for name in behind} == {Role.INPUT}
    before = {name: role for name, role in stored.items() if name not in behind}
    assert {name for name, role in before.items() if role is Role.INPUT} == {
        "teeth", "speed_rpm", "torque", "averages"
    }  # fmt: skip
    assert {name for name, role in before.items() if role is Role.TRUTH} == {
        "snr_db", "index_error", "min_compression", "min_mesh_force", "contact_loss"
    }  # fmt: skip
