"""Unit: trees that point outside their arrays are refused before compiled code follows them."""

from copy import deepcopy

import numpy as np
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.tree import DecisionTreeRegressor

from sigdb.core.errors import InputError
from sigdb.recognition import LocationClassifier
from sigdb.recognition.storage.skops_file import skops_bytes, skops_estimators

X = np.random.default_rng(0).normal(size=(300, 3))
BOOSTING = {"max_iter": 3, "max_leaf_nodes": 6, "early_stopping": False}


def held(scorer):
    """A scorer where an estimator of sigdb holds it."""
    one = LocationClassifier(learner="boosting")
    one.scorer_ = scorer
    return {"boosting": one}


@pytest.fixture(scope="module")
def trained():
    return HistGradientBoostingClassifier(**BOOSTING).fit(X, (X[:, 0] * X[:, 1] > 0).astype(int))


@pytest.fixture
def fitted(trained):
    """A copy, to be broken."""
    return deepcopy(trained)


def test_the_number_of_threads_changes_no_byte(fitted):
    one, other = deepcopy(fitted), deepcopy(fitted)
    one._bin_mapper.n_threads, other._bin_mapper.n_threads = 2, 3
    assert skops_bytes(held(one)) == skops_bytes(held(other))


@pytest.mark.parametrize("kind", [HistGradientBoostingClassifier, HistGradientBoostingRegressor])
def test_trees_as_they_were_trained_are_read(kind):
    fitted = kind(**BOOSTING).fit(X, (X[:, 0] * X[:, 1] > 0).astype(int))
    read = skops_estimators(skops_bytes(held(make_pipeline(StandardScaler(), fitted))))["boosting"].scorer_[1]
    np.testing.assert_array_equal(read.predict(X), fitted.predict(X))


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("left", 2**31, "the left child 2147483648,"),
        ("right", 11, "the right child 11,"),
        ("left", 0, "the left child 0,"),
        ("feature_idx", 3, "the feature 3,"),
        ("feature_idx", -1, "the feature -1,"),
        ("is_categorical", 1, "a split by categories, 1,"),
    ],
)
def test_a_node_that_points_outside_is_refused(fitted, field, value, says):
    nodes = fitted._predictors[2][0].nodes
    assert len(nodes) == 11
    assert not nodes["is_leaf"][0]
    nodes[field][0] = value
    with pytest.raises(InputError, match=rf"^node 0 of tree 2 of boosting has {says} which is not there; train the"):
        skops_estimators(skops_bytes(held([np.array([fitted, None])])))


def test_a_tree_without_nodes_is_refused(fitted):
    fitted._predictors[1][0].nodes = fitted._predictors[1][0].nodes[:0]
    with pytest.raises(InputError, match="tree 1 of boosting has no nodes"):
        skops_estimators(skops_bytes(held(fitted)))


def test_other_estimators_with_compiled_parts_are_refused():
    """Skops trusts them, and their nodes are not looked at."""
    with pytest.raises(InputError, match=r"types that are not trusted: sklearn\.tree\._classes\.DecisionTreeRegressor"):
        skops_estimators(skops_bytes(held(DecisionTreeRegressor().fit(X, X[:, 0]))))
