"""A split: a fixed, hashed table with the fold of each case."""

import hashlib
import warnings
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, InputError, IntArray
from sigdb.database.splits.names import KIND

TRAINING, TEST, ASIDE = "training", "test", "aside"
"""Folds of a case. Cases that are put aside are neither trained on nor tested."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Split:
    """A table of cases and their folds.

    Attributes
    ----------
    name
        ``S0`` to ``S4``, ``S6`` or ``S7``.
    text
        Description of the split, in a clause.
    table
        Columns that make a case in this split, and its ``fold``: ``training``, ``test`` or ``aside``. It has no ids, so
        that it holds for any order and number of rows.
    shares_specimens
        Whether training and test may share specimens, which only the sanity check S0 does.
    by_health
        Whether both folds must hold healthy and damaged rows only, and not rows of each damaged tooth: few machines
        have been recorded with all of them.

    Raises
    ------
    InputError
        If the table is ambiguous, has no training or test cases, or a specimen is on both sides.
    """

    name: str
    text: str
    table: pd.DataFrame
    shares_specimens: bool = False
    by_health: bool = False

    def __post_init__(self) -> None:
        if self.table.duplicated(self.keys).any():
            raise InputError(f"split {self.name}: a case has two folds; give every case one")
        for fold in (TRAINING, TEST):
            if not (self.table["fold"] == fold).any():
                raise InputError(f"split {self.name}: no case is in the fold {fold!r}; make a database with more cases")
        if not self.shares_specimens:
            sides = [set(self.table.loc[self.table["fold"] == fold, "specimen"]) for fold in (TRAINING, TEST)]
            if sides[0] & sides[1]:
                raise InputError(
                    f"split {self.name}: specimens {sorted(sides[0] & sides[1])} are in training and in test; "
                    "rows of one gear resemble each other, so keep each on one side"
                )

    @property
    def keys(self) -> list[str]:
        """Columns that make a case."""
        return [name for name in self.table.columns if name != "fold"]

    @property
    def hash(self) -> str:
        """SHA-256 of name and table; the order of its rows does not matter."""
        text = self.table.sort_values(self.keys).to_csv(index=False, lineterminator="\n")
        return hashlib.sha256(f"{self.name}\n{text}".encode()).hexdigest()

    def folds(self, rows: pd.DataFrame) -> np.ndarray:
        """Return the fold of each row, (rows,).

        Raises
        ------
        InputError
            If a row is of a case that is not in the table.
        """
        folds = rows[self.keys].merge(self.table, how="left", on=self.keys)["fold"]
        if folds.isna().any():
            case = rows[self.keys].iloc[int(folds.isna().to_numpy().argmax())].to_dict()
            raise InputError(f"split {self.name} does not hold the case {case}; make it from the rows it is used on")
        return folds.to_numpy(str)

    def check_classes(self, rows: pd.DataFrame) -> None:
        """Refuse a split whose training or test lacks a tooth, a kind of damage or 'none' that its rows have.

        Raises
        ------
        InputError
            Names the missing classes.
        """
        folds = self.folds(rows)
        for fold, what in ((TRAINING, "training"), (TEST, "held-out")):
            inside = folds == fold
            alike = rows["teeth"].isin(rows["teeth"][inside].unique()).to_numpy()
            labels = rows["tooth"].clip(upper=1) if self.by_health else rows["tooth"]
            check_classes(labels[alike], inside[alike], what)
            if KIND in rows and (fold == TRAINING or not self.by_health):
                check_classes(rows.loc[alike, KIND], inside[alike], what)


def specimen_folds(seed: int, specimens: ArrayLike, folds: int, labels: ArrayLike | None = None) -> dict[int, int]:
    """Return the fold of each specimen: a fixed table, drawn from a hash of the database's seed and its number.

    Specimens are dealt in the order of their hashes by scikit-learn's ``StratifiedGroupKFold``, so that each fold holds
    the classes in like shares. Where every specimen has every case that is dealing in turn.

    Parameters
    ----------
    seed
        Seed of the database.
    specimens
        (rows,) specimen of each row.
    folds
        Number of folds.
    labels
        (rows,) class of each row; all the same if left out.

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
    specimens = np.asarray(specimens)
    labels = np.zeros(len(specimens), int) if labels is None else np.asarray(labels)
    names = sorted({int(number) for number in np.unique(specimens)}, key=lambda number: _digest(f"{seed}/{number}"))
    if len(names) < folds:
        raise InputError(
            f"{len(names)} specimens cannot be split into {folds} folds; make a database with {folds} specimens or more"
        )
    dealt: dict[int, int] = {}
    place = {name: i for i, name in enumerate(names)}
    order = np.asarray(pd.Series(specimens).map(place), np.int64)
    for fold, (_, test) in enumerate(_deals(folds, labels, order)):
        dealt |= {names[i]: fold for i in np.unique(order[test])}
    return dealt


def _deals(folds: int, labels: IntArray, groups: IntArray) -> list[tuple[IntArray, IntArray]]:
    from sklearn.model_selection import StratifiedGroupKFold  # imports all of scikit-learn

    if folds < 2:
        raise InputError(f"folds = {folds} must be 2 or more: one part is held out, and the others are trained on")
    with warnings.catch_warnings():
        # Of a class with fewer rows than folds; whether a fold lacks a class is checked where it matters.
        warnings.filterwarnings("ignore", "The least populated class", UserWarning)
        try:
            return list(StratifiedGroupKFold(folds).split(labels, labels, groups))
        except ValueError as error:
            raise InputError(f"the rows cannot be split into {folds} folds: {error}; choose fewer folds") from None


def check_classes(labels: pd.Series, inside: BoolArray, what: str) -> None:
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
