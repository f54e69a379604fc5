"""Match: the templates nearest to a measured average, over all turns."""

import hashlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, InputError
from sigdb.database.limits import DEFAULT_LIMITS, QueryLimits
from sigdb.database.matching.index import RMS, MatchIndex, cached_index, index_batches
from sigdb.database.matching.nearest import Nearest, checked_average, nearest, whole_shifts
from sigdb.database.matching.outside_threshold import read_coverage
from sigdb.database.store.schema import suffixed
from sigdb.database.stored_tables import StoredTables

_INDEX_FORMAT = 2


@dataclass(frozen=True, kw_only=True)
class Match:
    """The nearest templates to an average, and whether the average is outside the database.

    :meth:`Database.match` returns it. The verdict compares the ``residual_distance`` of the nearest template with the
    threshold that ``sigdb coverage`` stored. It does not depend on a model: the verdict of ``sigdb diagnose`` compares
    the ``reduced_chi2`` of a template scorer with a threshold of its training.

    Attributes
    ----------
    table : pandas.DataFrame
        One row a template, the nearest first.
    threshold : float or None
        Greatest residual distance of a signature inside the database; None if coverage was not studied.
    """

    table: pd.DataFrame
    threshold: float | None

    @property
    def outside(self) -> bool | None:
        """Whether even the nearest template is farther than the threshold; None if there is no threshold."""
        return None if self.threshold is None else self._least > self.threshold

    @property
    def verdict(self) -> str:
        """:attr:`outside` as a sentence with its numbers."""
        if self.threshold is None:
            return "not estimated whether it is outside the database: sigdb coverage has not been run on it"
        place, side = ("outside", "above") if self.outside else ("inside", "within")
        return (
            f"{place} the database: the least residual distance {self._least:.3g} is {side} the threshold "
            f"{self.threshold:.3g}"
        )

    @property
    def _least(self) -> float:
        return float(self.table["residual_distance"].iloc[0])

    def __str__(self) -> str:
        return self.verdict


class Matcher:
    """The templates of a database, ready to be matched with averages.

    Parameters
    ----------
    tables
        The database.
    """

    def __init__(self, tables: StoredTables) -> None:
        self._tables = tables
        self._step = int(tables.manifest.resolved["signature"]["samples_per_tooth"])
        self._key = "id" if tables.manifest.is_measured else "template"
        self._view = "features" if tables.manifest.is_measured else "templates"
        self._indices: dict[tuple[str, int], MatchIndex] = {}
        self._lock = threading.Lock()

    def index(self, sensor: str, n: int) -> MatchIndex:
        """Return the templates of a sensor and of n samples, from the user's cache or the database.

        Raises
        ------
        InputError
            If no template has that length.
        """
        with self._lock:
            return self._index(sensor, n)

    def _index(self, sensor: str, n: int) -> MatchIndex:
        if (sensor, n) not in self._indices:
            tables, column = self._tables, suffixed("tsa", self._tables.sensors, sensor)
            digests = (file.sha256 for receipt in tables.receipts(_KIND[self._view]) for file in receipt.files)
            text = "\n".join([str(_INDEX_FORMAT), tables.manifest.hash, sensor, str(n), *digests])
            key = hashlib.sha256(text.encode()).hexdigest()
            self._indices[sensor, n] = cached_index(key, lambda: self._batches(column, n))
        return self._indices[sensor, n]

    def match(
        self,
        tsa: ArrayLike,
        *,
        k: int,
        sensor: str | None,
        turns: ArrayLike | None,
        where: str | None,
        limits: QueryLimits = DEFAULT_LIMITS,
    ) -> Match:
        """Return the nearest templates; see :meth:`Database.match`."""
        x = checked_average(tsa)
        if k < 1:
            raise InputError(f"k = {k} must be 1 or more: it is the number of templates to return")
        sensor = self._tables.stored_sensor(sensor)
        shifts = whole_shifts(turns, self._step, x.size)
        index = self.index(sensor, x.size)
        near = nearest(
            index, x, teeth=x.size // self._step, k=k, shifts=shifts, among=self._among(index, where, limits)
        )
        record = read_coverage(self._tables.store, self._tables.manifest)
        threshold = record.threshold if record is not None and record.sensor == sensor else None
        shared = {*self._tables.dataset("features").schema.names, "tooth"} - {"status", "status_code"}
        names = [name for name in index.cases.column_names if name in shared]
        cases = index.cases.select(names).take(pa.array(near.place)).to_pandas()
        return Match(table=_table(near, cases, self._step, threshold), threshold=threshold)

    def _among(self, index: MatchIndex, where: str | None, limits: QueryLimits) -> BoolArray:
        """Which templates of an index meet a condition."""
        if where is None:
            return np.ones(index.cases.num_rows, dtype=bool)
        with self._tables.connect({self._view: index.cases.drop_columns([RMS])}, limits) as connection:
            chosen = connection.choose(self._view, where)[self._key].to_numpy()
        among = np.isin(index.cases[self._key].to_numpy(), chosen)
        if not among.any():
            raise InputError(f"no {_NAME[self._view]} of this length meets where = {where!r}")
        return among

    def _batches(self, column: str, n: int) -> Iterator[pa.RecordBatch]:
        """Batches of the index, or an error that names the lengths of the templates.

        An extension has undamaged templates of its own. Where an operating point has one, the others are left out.
        """
        if self._tables.manifest.is_measured:
            yield from self._row_batches(column, n)
            return
        tables, step = self._tables, self._step
        scalars = [field.name for field in tables.dataset("templates").schema if not pa.types.is_list(field.type)]
        rig = ["teeth", "speed_rpm", "torque", *(name for name in scalars if "." in name)]  # swept: by dotted path
        teeth: set[int] = set()
        undamaged: set[tuple[float, ...]] = set()

        def distinct() -> Iterator[pa.RecordBatch]:
            for batch in tables.scan("templates", [*scalars, column]):
                teeth.update(batch["teeth"].filter(batch[column].is_valid()).to_pylist())
                new = np.ones(batch.num_rows, dtype=bool)
                for row in np.flatnonzero((batch["tooth"].to_numpy() == 0) & batch[column].is_valid().to_numpy(False)):
                    point = tuple(batch[name][int(row)].as_py() for name in rig)
                    new[row] = point not in undamaged
                    undamaged.add(point)
                yield batch.filter(pa.array(new))

        batches = index_batches(distinct(), column, n, n // step)
        first = next(batches, None)
        if first is None:
            lengths = ", ".join(f"{step * z} ({z} teeth)" for z in sorted(teeth)) or "none"
            raise InputError(
                f"tsa has {n} samples, and no template of {tables.store} has; lengths of its templates: {lengths}, "
                f"{step} samples a tooth"
            )
        yield first
        yield from batches

    def _row_batches(self, column: str, n: int) -> Iterator[pa.RecordBatch]:
        """Batches of the index of measured rows, which are compared as templates are."""
        tables, teeth = self._tables, n // self._step
        where = f"status = 'ok' and teeth = {teeth}"
        scalars = [each.name for each in tables.dataset("features").schema if not pa.types.is_list(each.type)]
        rows = tables.batches(where, columns=scalars)
        signals = tables.batches(where, table="signals", columns=["id", column])

        def joined() -> Iterator[pa.RecordBatch]:
            for cases, averages in zip(rows, signals, strict=True):
                yield cases.append_column(averages.schema.field(column), averages[column])

        batches = index_batches(joined(), column, n, teeth)
        first = next(batches, None)
        if first is None:
            raise InputError(f"tsa has {n} samples, and no row of {tables.store} has as many, {self._step} a tooth")
        yield first
        yield from batches


_KIND = {"templates": "templates", "features": "rows"}
"""Kind of the parts of a table."""

_NAME = {"templates": "template", "features": "row"}
"""Name of the rows that are matched, by their table."""


def _table(near: Nearest, cases: pd.DataFrame, samples_per_tooth: int, threshold: float | None) -> pd.DataFrame:
    """The table of a match from the cases of the nearest templates, in their order."""
    measured = "recording" in cases
    first, teeth = cases["tooth"].fillna(0).to_numpy(int), cases["teeth"].to_numpy(int)
    turn = near.shift / samples_per_tooth
    # A turn by half a tooth counts for the next tooth.
    tooth = np.where(first > 0, (first - 1 + np.floor(turn + 0.5).astype(int)) % teeth + 1, 0)
    distance = near.residual_distance
    outside = [None if threshold is None else bool(value > threshold) for value in distance]
    key = "id" if measured else "template"
    columns = {
        key: cases[key].to_numpy(),
        "tooth": tooth,
        "turn": turn,
        "match": near.match,
        "residual_distance": distance,
        "outside": pd.array(outside, dtype="boolean"),
    }
    others = [name for name in cases if name not in columns and name != "template"]
    return pd.DataFrame(columns | {name: cases[name].to_numpy() for name in others})
