"""CMA-ES in the unit cube: a function that is not smooth, and a search that goes on."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core import InputError
from sigdb.identification import minimise

AT = np.array([0.2, 0.9, 0.5])


def steps(u):
    """A distance in steps of 0.01, without a value in a corner; its least is 0 about ``AT``."""
    return np.nan if u.sum() > 2.5 else float(np.floor(100 * np.abs(u - AT).max()) / 100)


def test_the_least_of_a_function_in_steps():
    end = minimise(steps, 3, np.random.default_rng(1), enough=0.0)
    assert end.value == 0.0
    assert_allclose(end.point, AT, atol=0.01)
    assert end.evaluations < 1000


def test_a_stopped_search_goes_on_to_the_same_end():
    values = []
    whole = minimise(steps, 3, np.random.default_rng(2), enough=0.0, on_value=values.append)
    assert len(values) == whole.evaluations
    later = []
    again = minimise(steps, 3, np.random.default_rng(2), enough=0.0, recorded=tuple(values[:50]), on_value=later.append)
    assert later == values[50:]
    assert_array_equal(again.point, whole.point)


def test_without_its_package_a_sentence_names_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    with pytest.raises(InputError, match="needs the package cma, which is not installed: pip install cma"):
        minimise(steps, 3, np.random.default_rng(1))
