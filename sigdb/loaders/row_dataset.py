"""A map-style dataset: inputs and labels of rows by place."""

from collections.abc import Sequence
from os import PathLike
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, IntArray, suggestion
from sigdb.database import (
    KIND,
    TEST,
    TRAINING,
    Database,
    StoredTables,
    input_tables,
    inputs,
    kind_classes,
    labels_of,
    places_of_kinds,
    row_folds,
    target_rows,
)

Labels: TypeAlias = IntArray | FloatArray
"""Labels of rows, (rows,) classes or (rows, quantities)."""


class RowDataset:
    """Rows of a database with their labels, as a training loop takes them: ``rows[i]`` is a pair of input and label.

    ``len`` is the number of rows. An index may be a number, a slice or an array of numbers; of several rows the arrays
    have a first axis for them. torch's DataLoader takes the object as a map-style dataset. Columns of signals are read
    when a row is taken, others are held in memory.

    Parameters
    ----------
    database : Database, str or path-like
        A finished database, or its place.
    target : {"location", "detection", "kind", "severity"}
        Question to answer.
    columns : sequence of str
        Input columns of ``features`` or ``signals``, in the order in which they stand in the input.
    split : str, optional
        Name of the split; see :func:`sigdb.database.make_split`. S1 if left out, of recordings ``recording``.
    fold : {"training", "test"}, optional
        Rows of this side only; all labelled rows if left out.
    folds, held_out : int
        Number of folds of specimens, and the number of the fold that is the test, from 0.
    where : str, optional
        An SQL condition on columns of ``features``; folds are made of the rows that meet it.
    allow_leak : bool
        Whether the split ``random`` of recordings may be made.

    Attributes
    ----------
    ids : ndarray of int, (rows,)
        Ids of the rows, ascending.
    labels : ndarray, (rows,) or (rows, quantities)
        Location: first damaged tooth, 0 for none. Detection: 1 for damage, 0 for none. Kind: place among ``classes``.
        Severity: relative loss of stiffness, phase shift in deg and number of damaged teeth (float32), of damaged rows
        only.
    groups : ndarray of int, (rows,)
        Specimen of each row; of a measured row its recording.
    classes : tuple of str
        Names of the kinds of damage of the target ``kind``; else empty.

    Raises
    ------
    InputError
        If target, split, fold or a column does not exist, a column is no input, no row remains, or the rows cannot be
        split so.
    DatabaseError
        If the sweep is not finished, or a part is damaged.

    Examples
    --------
    ::

        rows = sigdb.loaders.RowDataset("signatures", "location", fold="training")
        x, tooth = rows[0]
        x, tooth = rows[np.arange(256)]
    """

    def __init__(
        self,
        database: Database | str | PathLike[str],
        target: str,
        *,
        columns: Sequence[str] = ("tsa",),
        split: str = "",
        fold: str = "",
        folds: int = 5,
        held_out: int = 0,
        where: str | None = None,
        allow_leak: bool = False,
    ) -> None:
        if fold not in ("", TRAINING, TEST):
            raise InputError(f"fold = {fold!r} is not a side of a split{suggestion(fold, (TRAINING, TEST))}")
        opened = database if isinstance(database, StoredTables) else Database(database)
        self._opened: Database | None = opened
        self._store = opened.store
        self._tables = input_tables(opened, columns)
        rows, is_labelled = target_rows(opened, target, where)
        if fold:
            sides = row_folds(opened, rows, split=split, folds=folds, held_out=held_out, allow_leak=allow_leak)
            is_labelled = is_labelled & (sides == fold)
        rows = rows[is_labelled]
        if rows.empty:
            raise InputError(f"{opened.store}: no row with a label is left to learn from; choose other rows")
        self.ids: IntArray = rows.index.to_numpy(np.int64)
        self.groups: IntArray = rows["specimen"].to_numpy(np.int64)
        self.classes, self.labels = _labels(target, rows)
        self._held = {
            name: inputs(opened, self.ids, [name]).to_numpy(np.float32)
            for name, table in self._tables.items()
            if table == "features"
        }

    @property
    def database(self) -> Database:
        """The database; a process that got the dataset by pickle opens it again."""
        if self._opened is None:
            self._opened = Database(self._store)
        return self._opened

    def __getstate__(self) -> dict[str, Any]:
        # A forked process keeps the object of its parent: it reads files, and must not end the engine of queries.
        return vars(self) | {"_opened": None}

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, index: int | slice | IntArray) -> tuple[FloatArray, Any]:
        places = np.asarray(np.arange(len(self))[index])
        x = self._inputs(np.atleast_1d(places))
        return (x if places.ndim else x[0]), self.labels[places]

    def __getitems__(self, indices: Sequence[int]) -> list[tuple[FloatArray, Any]]:
        """Return pairs of several rows, which are read together; torch's DataLoader calls it."""
        x, labels = self[np.asarray(indices, np.int64)]
        return list(zip(x, labels, strict=True))

    def _inputs(self, places: IntArray) -> FloatArray:
        names = [name for name, table in self._tables.items() if table == "signals"]
        read = self.database.lists(self.ids[places], names) if names else {}
        parts = [read[name] if name in read else self._held[name][places] for name in self._tables]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)


def _labels(target: str, rows: pd.DataFrame) -> tuple[tuple[str, ...], Labels]:
    """Return the names of classes, which only kinds have, and the labels of rows."""
    if target == KIND:
        kinds = rows[KIND].tolist()
        classes = kind_classes(kinds)
        return classes, places_of_kinds(kinds, classes)
    labels = labels_of(target, rows)
    return (), np.asarray(labels, np.float32) if target == "severity" else np.asarray(labels, np.int64)
