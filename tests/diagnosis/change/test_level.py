"""The covariance of levels, against that of scikit-learn."""

import numpy as np
import pytest
from sklearn.covariance import ledoit_wolf

from sigdb.diagnosis.change.level import shrunk_covariance


@pytest.mark.parametrize(("rows", "columns"), [(24, 18), (24, 3), (2, 18), (6, 6)])
def test_the_covariance_is_that_of_ledoit_and_wolf(rows, columns):
    stream = np.random.default_rng(rows)
    x = stream.normal(size=(rows, columns)) @ stream.normal(size=(columns, columns))
    x -= x.mean(axis=0)
    assert shrunk_covariance(x) == pytest.approx(ledoit_wolf(x, assume_centered=True)[0], rel=1e-9)
