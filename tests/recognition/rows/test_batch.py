"""Unit: batches hold the arrays of each tooth count as one matrix, whatever the order of their rows."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core import InputError
from sigdb.recognition.rows.batch import CELLS, TSA, Batch

TEETH = np.array([3, 2, 3, 2, 2])
LENGTH = {2: 8, 3: 12}


@pytest.fixture
def frame():
    stream = np.random.default_rng(0)
    arrays = {
        name: [stream.standard_normal(LENGTH[count]).astype(np.float32) for count in TEETH] for name in (TSA, CELLS)
    }
    scalars = {"teeth": TEETH, "speed_rpm": np.arange(5.0), "averages": 4, "scatter": [2.0, 4.0, 0.0, np.nan, 6.0]}
    return pd.DataFrame(scalars | arrays, index=[7, 5, 9, 1, 3])


def by_row(batch, name):
    """Arrays of the rows, in their order."""
    arrays = [None] * len(batch)
    for _, at, matrix in {TSA: batch.averages, CELLS: batch.cells}[name]():
        for place, array in zip(at, matrix, strict=True):
            arrays[place] = array
    return arrays


@pytest.mark.parametrize("name", [TSA, CELLS])
@pytest.mark.parametrize("places", [[0, 1, 2, 3, 4], [4, 0, 3], [2, 0], [1, 1, 2]])
def test_rows_that_are_taken_keep_their_arrays(frame, name, places):
    batch = Batch.from_rows(frame, {TSA, CELLS}).take(places)
    assert batch.index.tolist() == frame.index[places].tolist()
    for array, expected in zip(by_row(batch, name), frame[name].iloc[places], strict=True):
        assert array.dtype == np.float64
        assert_array_equal(array, expected)


def test_a_mask_takes_the_same_rows_as_their_places(frame):
    batch = Batch.from_rows(frame, {TSA})
    mask = TEETH == 2
    assert_array_equal(batch.take(mask).tsa[2], batch.take(np.flatnonzero(mask)).tsa[2])


def test_a_frame_is_not_changed_and_other_arrays_are_not_converted(frame):
    before = frame.copy(deep=True)
    batch = Batch.from_rows(frame, {TSA})
    assert batch.features is None
    assert not {TSA, CELLS} & set(batch.table)
    assert list(frame) == list(before)
    assert Batch.from_rows(batch, {CELLS}) is batch


def test_what_a_reducer_made_goes_along(frame):
    class Mean:
        column = "mean"

        def transform(self, X):
            means = np.empty((len(X), 1))
            for _, at, x in X.averages():
                means[at, 0] = x.mean(axis=1)
            return means

    batch = Batch.from_rows(frame, {TSA})
    means = batch.reduce(Mean())
    assert_allclose(means[:, 0], [one.mean() for one in frame[TSA]], rtol=1e-6)
    kept = Batch(table=batch.table, reduced={"mean": -means})
    assert_array_equal(kept.take([3, 0]).reduce(Mean()), -means[[3, 0]])


def test_the_noise_is_that_of_the_average_where_it_is_known(frame):
    batch = Batch.from_rows(frame)
    assert_array_equal(batch.noise(), [1.0, 2.0, np.nan, np.nan, 3.0])
    assert_allclose(batch.noise_db(4.0), 10 * np.log10(np.array([1.0, 4.0, np.nan, np.nan, 9.0]) / 4))
    assert np.isnan(Batch(table=batch.table.drop(columns="scatter")).noise()).all()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"torque": 1.0}, r"X lacks the columns \['speed_rpm', 'tsa'\]; give rows of Database.features\(\)"),
        ({TSA: [None] * 5, "speed_rpm": 1.0}, "rows without a result"),
        ({TSA: [np.zeros(n) for n in (12, 8, 12, 8, 10)], "speed_rpm": 1.0}, r"tsa of gears of 2 teeth has \[8, 10\]"),
    ],
)
def test_rows_that_cannot_be_read_are_refused(frame, changed, message):
    with pytest.raises(InputError, match=message):
        Batch.from_rows(frame.drop(columns=[TSA, "speed_rpm"]).assign(**changed), {"speed_rpm", TSA})


def test_arrays_that_were_not_read_are_named(frame):
    with pytest.raises(InputError, match="the rows were read without 'wigner_ville'"):
        list(Batch.from_rows(frame, {TSA}).cells())
