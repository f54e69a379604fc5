"""Trees of boosting in a file: compiled code follows their indices without looking at them."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor

from sigdb.core import InputError, IntArray

_BOOSTING = (HistGradientBoostingClassifier, HistGradientBoostingRegressor)


def check_boosted_trees(estimators: Mapping[str, object]) -> None:
    """Refuse estimators with a tree whose nodes point outside it.

    Each child of a node comes after it, so that every path ends at a leaf. Features are columns of the rows. No node
    splits by categories, which sigdb does not use.

    Parameters
    ----------
    estimators
        Estimators of a model by name; all that they hold is searched.

    Raises
    ------
    InputError
        Names the first node that is wrong.
    """
    for part in _objects(estimators):
        if isinstance(part, _BOOSTING):
            if part._preprocessor is not None:
                raise InputError("boosting with categories, which sigdb does not make; train the model again")
            for number, tree in enumerate(tree for trees in part._predictors for tree in trees):
                _check_nodes(number, tree.nodes, part.n_features_in_)


def forget_threads(estimators: Mapping[str, object]) -> None:
    """Forget how many threads trained the trees of estimators, which changes no answer."""
    for part in _objects(estimators):
        if isinstance(part, _BOOSTING):
            part._bin_mapper.n_threads = 1


def _check_nodes(number: int, nodes: np.ndarray, features: int) -> None:
    if nodes.ndim != 1 or not nodes.size:
        raise InputError(f"tree {number} of boosting has no nodes; train the model again")
    place = np.flatnonzero(nodes["is_leaf"] == 0)
    inner = nodes[place]
    _check(number, place, inner["feature_idx"], 0, features, "the feature")
    _check(number, place, inner["is_categorical"], 0, 1, "a split by categories,")
    for side in ("left", "right"):
        _check(number, place, inner[side], place + 1, nodes.size, f"the {side} child")


def _check(number: int, place: IntArray, values: np.ndarray, least: int | IntArray, end: int, what: str) -> None:
    """Refuse values of nodes below the least one, or at the end or above."""
    values = values.astype(np.int64)
    wrong = (values < least) | (values >= end)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise InputError(
            f"node {place[at]} of tree {number} of boosting has {what} {values[at]}, which is not there; train the "
            "model again"
        )


def _objects(root: object) -> Iterator[object]:
    """Yield an object and all that it holds in attributes, dictionaries, sequences and arrays of objects, once each."""
    waiting, seen = [root], set[int]()
    while waiting:
        value: Any = waiting.pop()
        if id(value) in seen or isinstance(value, str | bytes | int | float | type):
            continue
        seen.add(id(value))
        yield value
        if isinstance(value, Mapping):
            waiting += value.values()
        elif isinstance(value, list | tuple | set):
            waiting += value
        elif isinstance(value, np.ndarray):
            waiting += value.ravel().tolist() if value.dtype.hasobject else []
        waiting += getattr(value, "__dict__", {}).values()
