"""The covariance of levels, against that of scikit-learn."""

import numpy as np
import pytest
from sklearn.covariance import ledoit_wolf

from sigdb.diagnosis.change.level import left_out_distances, shrunk_covariance


@pytest.mark.parametrize(("rows", "columns"), [(24, 18), (24, 3), (2, 18), (6, 6)])
def test_the_covariance_is_that_of_ledoit_and_wolf(rows, columns):
    stream = np.random.default_rng(rows)
    x = stream.normal(size=(rows, columns)) @ stream.normal(size=(columns, columns))
    x -= x.mean(axis=0)
    assert shrunk_covariance(x) == pytest.approx(ledoit_wolf(x, assume_centered=True)[0], rel=1e-9)


@pytest.mark.parametrize(("rows", "columns"), [(24, 18), (24, 3), (8, 18), (40, 6)])
def test_the_distance_of_a_row_left_out_is_that_from_a_fit_to_the_others(rows, columns):
    stream = np.random.default_rng(rows)
    x = stream.normal(size=(rows, columns)) @ stream.normal(size=(columns, columns))
    x[0] *= 4
    expected = []
    for number, row in enumerate(x):
        others = np.delete(x, number, axis=0)
        off = row - others.mean(axis=0)
        covariance = ledoit_wolf(others)[0] * (1 + 1 / len(others))
        expected.append(off @ np.linalg.solve(covariance, off))
    assert left_out_distances(x) == pytest.approx(expected, rel=1e-9)
