"""Unit: rows, labels and folds of a map-style dataset are those of the database."""

import pickle

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.loaders import RowDataset


def test_rows_labels_and_groups_are_those_of_the_database(database):
    rows = RowDataset(database, "location")
    cases = database.cases("status = 'ok'")
    assert len(rows) == len(cases) > 400
    assert np.array_equal(rows.ids, cases["id"])
    assert np.array_equal(rows.labels, cases["tooth"])
    assert np.array_equal(rows.groups, cases["specimen"])
    places = np.array([5, 3, 5, -1])
    x, tooth = rows[places]
    assert np.array_equal(x, database.signals(rows.ids[places])["tsa"])
    assert (x.dtype, tooth.dtype) == (np.float32, np.int64)
    assert np.array_equal(tooth, cases["tooth"].to_numpy()[places])


def test_one_row_has_no_axis_of_rows(database):
    rows = RowDataset(database, "detection")
    x, damage = rows[7]
    assert x.shape == (rows[:1][0].shape[1],)
    assert np.ndim(damage) == 0
    with pytest.raises(IndexError):
        rows[len(rows)]
    assert sum(1 for _ in rows) == len(rows)


def test_several_rows_are_read_together_for_a_loader(database, monkeypatch):
    rows, calls = RowDataset(database, "location"), []
    read = type(database).lists
    monkeypatch.setattr(type(database), "lists", lambda *given: calls.append(given) or read(*given))
    pairs = rows.__getitems__([4, 2])
    assert len(calls) == 1
    for (x, tooth), place in zip(pairs, (4, 2), strict=True):
        assert np.array_equal(x, rows[place][0])
        assert tooth == rows.labels[place]


def test_folds_are_those_of_xy(database):
    X, y, _, cv = database.xy("location", columns=["tsa"], folds=3)
    for held_out, sides in enumerate(cv):
        for fold, side in zip(("training", "test"), sides, strict=True):
            rows = RowDataset(database, "location", fold=fold, folds=3, held_out=held_out)
            assert np.array_equal(rows.ids, X.index[side])
            assert np.array_equal(rows.labels, y.iloc[side])
            assert np.array_equal(rows[:][0], X.iloc[side].to_numpy(np.float32))


def test_columns_stand_in_the_order_in_which_they_are_named(database):
    rows = RowDataset(database, "location", columns=["rms", "spectrum", "wigner_ville"])
    x, _ = rows[10:12]
    stored = database.features(f"id in ({rows.ids[10]}, {rows.ids[11]})")
    expected = np.column_stack(
        [stored["rms"], database.signals(rows.ids[10:12])["spectrum"], np.stack(stored["wigner_ville"])]
    )
    assert np.array_equal(x, expected.astype(np.float32))


def test_severity_is_of_damaged_rows_and_kind_a_place_among_classes(database):
    severity, kind = RowDataset(database, "severity"), RowDataset(database, "kind")
    cases = database.cases("status = 'ok' and tooth > 0")
    assert severity.labels.dtype == np.float32
    expected = cases[["stiffness_loss", "phase_shift_deg", "damaged_teeth"]].to_numpy(np.float32)
    assert np.array_equal(severity.labels, expected)
    assert kind.classes == ("none", "loss")
    assert np.array_equal(kind.labels, (database.cases("status = 'ok'")["tooth"] > 0).astype(int))
    assert severity.classes == ()
    sides = [RowDataset(database, "severity", fold=fold, folds=2) for fold in ("training", "test")]
    assert sorted(np.concatenate([side.ids for side in sides])) == sorted(severity.ids)


def test_another_process_opens_the_database_for_itself(database):
    rows = RowDataset(database, "location", fold="test")
    again = pickle.loads(pickle.dumps(rows))
    assert again.database is not rows.database
    assert all(np.array_equal(one, other) for one, other in zip(rows[:9], again[:9], strict=True))


def test_rows_of_two_tooth_counts_are_selected_by_a_condition(two_counts):
    rows = RowDataset(two_counts, "location", where="teeth = 11", fold="test", folds=2)
    assert rows[:][0].shape == (len(rows), 352)
    with pytest.raises(InputError, match="different lengths"):
        RowDataset(two_counts, "location")[:]


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"target": "gear"}, "cannot be learnt"),
        ({"fold": "train"}, r"fold = 'train' is not a side of a split.*training"),
        ({"columns": ["tooth"]}, "tooth has the role label, not input"),
        ({"columns": "tsa"}, "must be a list of names"),
        ({"columns": ["tsb"]}, "there is no column 'tsb'"),
        ({"where": "tooth = 99"}, "no row with a label is left"),
        ({"split": "S9", "fold": "test"}, "S9"),
    ],
)
def test_what_is_refused(database, wrong, says):
    with pytest.raises(InputError, match=says):
        RowDataset(database, **{"target": "location"} | wrong)
