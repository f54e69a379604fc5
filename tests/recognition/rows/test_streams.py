"""Unit: training and evaluation hold the arrays of a bounded number of rows, drawn evenly."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from numpy.testing import assert_array_equal

from sigdb.recognition import RecognitionSettings, evaluate, train
from sigdb.recognition.rows import streams
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.rows.streams import reduce_averages
from sigdb.recognition.training import evenly_drawn, usable_rows


class Watched:
    """A database that notes how many rows of arrays are asked for at once."""

    def __init__(self, database):
        self._database, self.batch_rows, self.whole_rows = database, [], []

    def __getattr__(self, name):
        return getattr(self._database, name)

    def __len__(self):
        return len(self._database)

    def sql(self, query):
        table = self._database.sql(query)
        assert "wigner_ville" not in table
        assert "tsa" not in table
        return table

    def features(self, where=None):
        raise AssertionError("all rows with their arrays")

    def signals(self, ids, **options):
        self.whole_rows.append(np.size(ids))
        return self._database.signals(ids, **options)

    def batches(self, where=None, *, table="features", rows, **options):
        self.batch_rows += [rows] if table != "templates" else []
        return self._database.batches(where, table=table, rows=rows, **options)


@pytest.mark.parametrize(("target", "asked"), [("severity", 96), ("detection", 256)])
def test_arrays_are_read_in_bounded_batches(many_specimens, without_boosting, monkeypatch, target, asked):
    watched = Watched(many_specimens)
    monkeypatch.setattr("sigdb.recognition.rows.streams.ROWS_AT_ONCE", 50)
    monkeypatch.setattr("sigdb.recognition.training.DRAWN_ROWS", 400)
    monkeypatch.setattr("sigdb.recognition.training._check_labels", lambda *rows: None)  # these have one severity
    model = train(watched, target, RecognitionSettings(folds=3, learner="templates", false_alarm_rate=0.2))
    assert (model.rows, model.drawn_rows) == (512, 400)
    assert evaluate(model, watched, bound=False).rows == asked
    assert set(watched.batch_rows) == {50}
    assert not watched.whole_rows


def test_batches_give_the_scores_of_all_rows_at_once(database, location_model, rows):
    few = usable_rows(database, "location").iloc[3::7]
    column, scores = next(iter(location_model.reducers.items()))
    batch = reduce_averages(database, Batch(table=few), location_model.reducers, sensor=location_model.sensor)
    reads = location_model.estimators["templates"].reads
    expected = scores.transform(Batch.from_rows(rows.set_index("id").loc[few.index], reads))
    np.testing.assert_allclose(batch.reduced[column], expected, rtol=1e-9)


def test_the_draw_is_even_over_specimens_and_cases():
    specimen, case, draw = (one.ravel() for one in np.meshgrid(np.arange(40), np.arange(60), np.arange(5)))
    rows = pd.DataFrame(
        {"specimen": specimen, "draw": draw, "tooth": 1 + case % 12, "stiffness_loss": case // 12 / 10}
        | dict.fromkeys(("teeth", "damaged_teeth", "phase_shift_deg", "speed_rpm", "torque", "snr_db", "averages"), 1)
    )
    drawn = evenly_drawn(rows, 1200)
    assert len(drawn) == 1200
    assert drawn.index.is_monotonic_increasing
    # Drawn at random the 30 rows of a specimen would have a standard deviation of 5, the 20 of a case one of 4.
    for columns, each in ((["specimen"], 30), (["tooth", "stiffness_loss"], 20)):
        counts = drawn.groupby(columns).size()
        assert len(counts) == 1200 / each
        assert np.abs(counts - each).max() <= 3
    shuffled = rows.sample(frac=1, random_state=0)
    assert set(evenly_drawn(shuffled, 1200).index) == set(drawn.index)
    assert evenly_drawn(rows, len(rows)) is rows


def test_rows_without_an_array_have_nan():
    lists = pa.array([[1.0, 2.0], None, [], [3.0, 4.0]], pa.list_(pa.float64()))
    matrices = streams._matrices(lists, np.array([5, 5, 5, 5]))
    nan = np.nan
    assert_array_equal(matrices[5], [[1.0, 2.0], [nan, nan], [nan, nan], [3.0, 4.0]])
    none = {5: np.empty((1, 0))}
    assert_array_equal(streams._concatenate([none, matrices])[5][:2], [[nan, nan], [1.0, 2.0]])
