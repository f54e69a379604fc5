"""Batches of rows: a frame of scalars, with the arrays of each tooth count as one matrix."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, IntArray, check_unmasked
from sigdb.recognition.noise.noise_shape import RowNoise

Column: TypeAlias = str
"""Name of a column of the table ``features``, or ``tsa``, the average."""

Matrices: TypeAlias = Mapping[int, FloatArray]
"""By tooth count, the arrays of its rows, (rows, n), in the order of the rows."""

ROWS_AT_ONCE = 4096
"""Rows whose arrays are in memory at once."""

POINT: tuple[Column, ...] = ("speed_rpm", "torque", "teeth")
"""Columns of an operating point and tooth count."""

NOISE: tuple[Column, ...] = ("averages", "scatter")
"""Columns that the noise of an average is estimated from."""

TSA: Column = "tsa"
CELLS: Column = "wigner_ville"
BY_ORDER: Column = "noise"
"""Columns of arrays: the average, its pooled Wigner-Ville cells, and its noise by order."""


class Reducer(Protocol):
    """A transformation of averages to a few numbers, which rows keep instead of their averages."""

    column: str
    """Name that the numbers are kept under."""

    def transform(self, X: "Batch") -> FloatArray:
        """Return the numbers, (rows, k), of rows with their averages."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Batch:
    """Rows with their arrays.

    Attributes
    ----------
    table
        Frame of scalars, one row each.
    tsa
        Averages by tooth count, from the tacho mark, unit of the signal; None if they were not read.
    features
        Pooled Wigner-Ville cells by tooth count, (rows, teeth * bands); None if they were not read.
    noise_by_order
        Standard deviation of white noise with the density of the average's noise at orders 0, 1, 2 ..., by tooth count,
        (rows, n / 2 + 1); None for noise that is white.
    reduced
        By the name of a :class:`Reducer`, what it makes of the averages, (rows, k).
    """

    table: pd.DataFrame
    tsa: Matrices | None = None
    features: Matrices | None = None
    noise_by_order: Matrices | None = None
    reduced: Mapping[str, FloatArray] = field(default_factory=dict)

    @classmethod
    def from_rows(cls, X: "Rows", reads: Iterable[Column] = ()) -> "Batch":
        """Convert a frame whose cells hold arrays, as a database returns it; a batch is returned as it is.

        Parameters
        ----------
        X
            Rows of ``Database.features()``, with ``tsa`` of ``Database.signals()`` where averages are read.
        reads
            Columns that are needed. Arrays of other columns are not converted.

        Raises
        ------
        InputError
            If X is neither, lacks a column, has no rows, a row has no result, or arrays of one tooth count differ in
            length.
        """
        if isinstance(X, Batch):
            return X
        reads = frozenset(reads)
        lacking = [name for name in sorted(reads, key=_place) if not hasattr(X, "columns") or name not in X.columns]
        if lacking:
            raise InputError(
                f"X lacks the columns {lacking}; give rows of Database.features(), with tsa of Database.signals() "
                "where averages are read"
            )
        if X.empty:
            raise InputError("X has no rows; give at least one")
        arrays = [name for name in (TSA, CELLS, BY_ORDER) if name in X.columns]
        tsa, cells = (_from_cells(X, name) if name in reads else None for name in (TSA, CELLS))
        noise = _from_cells(X, BY_ORDER) if TSA in reads and BY_ORDER in X.columns else None
        return cls(table=X.drop(columns=arrays), tsa=tsa, features=cells, noise_by_order=noise)

    def __len__(self) -> int:
        return len(self.table)

    @property
    def index(self) -> pd.Index:
        """Ids of the rows."""
        return self.table.index

    def column(self, name: Column) -> FloatArray:
        """Return a column of scalars, (rows,) float64."""
        return self.table[name].to_numpy(float)

    def take(self, places: ArrayLike) -> "Batch":
        """Return some of the rows: by their places, in the order of these, or by whether each is one of them."""
        at = np.asarray(places)
        at = np.flatnonzero(at) if at.dtype == bool else at
        some = {name: self._taken(matrices, at) for name, matrices in self._arrays.items()}
        reduced = {name: values[at] for name, values in self.reduced.items()}
        return replace(self, table=self.table.iloc[at], reduced=reduced, **some)

    def by_teeth(self) -> list[tuple[int, IntArray]]:
        """Return the tooth counts, each with the places of its rows."""
        return [(int(count), np.flatnonzero(self._teeth == count)) for count in np.unique(self._teeth)]

    def averages(self) -> Iterator[tuple[int, IntArray, FloatArray]]:
        """Yield each tooth count, the places of its rows, and their averages, (rows, n) float64.

        Raises
        ------
        InputError
            If an average has another number of samples than a multiple of the tooth count.
        """
        return self._by_teeth(self.tsa, TSA)

    def cells(self) -> Iterator[tuple[int, IntArray, FloatArray]]:
        """Yield each tooth count, the places of its rows, and their pooled cells, (rows, teeth * bands) float64.

        Raises
        ------
        InputError
            If the number of cells is not a multiple of the tooth count.
        """
        return self._by_teeth(self.features, CELLS)

    def reduce(self, reducer: Reducer) -> FloatArray:
        """Return what a reducer makes of the averages, (rows, k): as it is kept here, else computed now."""
        kept = self.reduced.get(reducer.column)
        return reducer.transform(self) if kept is None else kept

    def operating_point(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return speed (rpm), torque (N m) and tooth count of each row, (rows,) each."""
        speed_rpm, torque, teeth = (self.column(name) for name in POINT)
        return speed_rpm, torque, teeth

    def noise(self) -> FloatArray:
        """Return the standard deviation of the noise of each average, (rows,), in the unit of the signal.

        It is estimated from the scatter between the revolutions, ``scatter / sqrt(averages)``. nan where a row has no
        scatter above 0, or the columns are missing.
        """
        if not set(NOISE) <= set(self.table.columns):
            return np.full(len(self), np.nan)
        noise = self.column("scatter") / np.sqrt(self.column("averages"))
        return np.where(noise > 0, noise, np.nan)

    def row_noise(self) -> RowNoise:
        """Return the noise of each average with its shape; white where it is not known order by order."""
        by_order = self.noise_by_order or {}
        return RowNoise(self.noise(), {teeth: (at, by_order[teeth]) for teeth, at in self.by_teeth() if by_order})

    def noise_db(self, reference: ArrayLike = 1.0) -> FloatArray:
        """Return the level of that noise, (rows,) dB, ``10 log10(noise^2 / reference)``; nan where it is not known.

        Its standard error is ``10 / ln 10 sqrt(2 / (n (m - 1)))`` dB, 0.02 dB for n = 768 samples and m = 102
        revolutions: as good as known.

        Parameters
        ----------
        reference
            A variance, such as that of the healthy clean average; one, or (rows,).
        """
        return np.asarray(10 * np.log10(self.noise() ** 2 / np.asarray(reference, float)))

    @property
    def _arrays(self) -> dict[str, Matrices]:
        return {name: array for name in _ARRAYS if (array := getattr(self, name)) is not None}

    @cached_property
    def _teeth(self) -> IntArray:
        return self.table["teeth"].to_numpy(int)

    @cached_property
    def _rank(self) -> IntArray:
        """(rows,) place of each row among those of its tooth count."""
        rank = np.empty(len(self), int)
        for _, at in self.by_teeth():
            rank[at] = np.arange(len(at))
        return rank

    def _taken(self, matrices: Matrices, at: IntArray) -> Matrices:
        counts = self._teeth[at]
        return {int(count): matrices[count][self._rank[at[counts == count]]] for count in np.unique(counts)}

    def _by_teeth(self, matrices: Matrices | None, name: Column) -> Iterator[tuple[int, IntArray, FloatArray]]:
        if matrices is None:
            raise InputError(f"the rows were read without {name!r}; read it from the database first")
        for teeth, matrix in sorted(matrices.items()):
            if matrix.shape[1] % teeth:
                raise InputError(
                    f"{name} holds {matrix.shape[1]} values, which do not fit {teeth} teeth and as many values each"
                )
            yield teeth, np.flatnonzero(self._teeth == teeth), matrix.astype(float)


_ARRAYS = ("tsa", "features", "noise_by_order")

Rows: TypeAlias = pd.DataFrame | Batch
"""Rows as estimators take them: a frame as a database returns it, or a batch."""


def _place(name: Column) -> int:
    """Return the place of a column in messages."""
    order = ("teeth", "speed_rpm", "torque", *NOISE, CELLS, TSA, BY_ORDER)
    return order.index(name) if name in order else len(order)


def _from_cells(X: pd.DataFrame, name: Column) -> dict[int, FloatArray]:
    """Return a column of arrays as a matrix for each tooth count."""
    if X[name].isna().any():
        raise InputError("X has rows without a result; keep rows whose status is 'ok'")
    arrays, teeth = X[name].to_numpy(), X["teeth"].to_numpy(int)
    return {int(count): _stacked(list(arrays[teeth == count]), name, count) for count in np.unique(teeth)}


def _stacked(arrays: list[FloatArray], name: Column, teeth: int) -> FloatArray:
    check_unmasked("X", name, arrays)
    lengths = sorted({np.size(array) for array in arrays})
    if len(lengths) > 1:
        raise InputError(f"{name} of gears of {teeth} teeth has {lengths} values; give arrays of one length")
    return np.stack(arrays).reshape(len(arrays), -1)
