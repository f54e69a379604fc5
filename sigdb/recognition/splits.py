"""Splits by specimen: no row of a test shares a simulated case's specimen with the training set."""

import hashlib
import json

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.typing import IntArray


def specimen_folds(seed: int, specimens: IntArray, folds: int) -> dict[int, int]:
    """Fold of each specimen: a fixed table, drawn from a hash of the database's seed and the specimen's number.

    Raises
    ------
    InputError
        If there are fewer specimens than folds.

    Examples
    --------
    >>> import numpy as np
    >>> sorted(specimen_folds(1, np.arange(4), 2).values())
    [0, 0, 1, 1]
    """
    names = sorted({int(one) for one in np.unique(specimens)}, key=lambda one: _digest(f"{seed}/{one}"))
    if len(names) < folds:
        raise InputError(
            f"{len(names)} specimens cannot be split into {folds} folds; make a database with {folds} specimens or more"
        )
    return {name: i % folds for i, name in enumerate(names)}


def split_hash(folds: dict[int, int]) -> str:
    """SHA-256 of a table of folds."""
    return _digest(json.dumps(sorted(folds.items())))


def check_classes(labels: pd.Series, inside: np.ndarray, what: str) -> None:
    """Refuse a fold in which a class is missing.

    Raises
    ------
    InputError
        Names the missing classes.
    """
    lacking = set(labels) - set(labels[inside])
    if lacking:
        raise InputError(
            f"the {what} specimens have no rows of the classes {sorted(lacking)}; give every specimen every case"
        )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
