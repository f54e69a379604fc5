"""A table of a virtual part: columns that a query names are made from the stored templates and compared.

The rows are made by the sweep, which lies above the database. So a database knows the sweep's maker by its name alone,
and imports it when the first virtual row is read.
"""

import re
import threading
import warnings
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from functools import cached_property
from importlib import import_module
from typing import Protocol

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from pyarrow import acero

from sigdb.core import NOISE_BLOCK, IntArray
from sigdb.database.store.checked import CheckedParquet, PartTable
from sigdb.database.store.manifest import read_manifest
from sigdb.database.store.receipts import DIGESTS, Receipt
from sigdb.database.store.schema import Schema, read_schema
from sigdb.database.store.store import DamagedFileError, Store
from sigdb.database.virtual.block_digests import StoredDigests, differing_columns

_MAKER = ("sigdb.sweep", "StoredRows")
"""Package and name of the class that makes virtual rows, a :class:`RowMaker`."""


_DIGESTS_KEPT = 8
"""Parts whose digests are kept."""


class OtherBitsWarning(UserWarning):
    """Virtual rows differ in their last bits from those that the sweep made."""


class RowMaker(Protocol):
    """Makes rows of a plan from the stored templates, specimens and seeds."""

    planned: frozenset[str]
    """Columns that the plan alone determines."""

    def table(self, table: str, first: int, stop: int, columns: Sequence[str]) -> Iterator[pa.Table]:
        """Yield columns of a table of rows ``first`` to ``stop - 1``, by noise block; ``first`` begins a block."""

    def cases(self, first: int, stop: int, columns: Sequence[str]) -> pa.Table:
        """Return planned columns of rows ``first`` to ``stop - 1``."""


def _row_maker(store: Store, plan_hash: str) -> RowMaker:
    """Return the maker of the virtual rows of a plan of a database."""
    resolved = next(plan.resolved for plan in read_manifest(store).plans if plan.hash == plan_hash)
    package, name = _MAKER
    maker: RowMaker = getattr(import_module(package), name)(store, resolved)
    return maker


class RowMakers:
    """The makers of the virtual rows of a database, each made when it is first needed.

    Parameters
    ----------
    store
        Where the database lies.
    """

    def __init__(self, store: Store) -> None:
        self._store, self._lock = store, threading.Lock()
        self._makers: dict[str, RowMaker] = {}
        self.has_warned = False
        """Whether the user was warned that last bits differ."""
        self._digests: OrderedDict[str, StoredDigests] = OrderedDict()

    @cached_property
    def schema(self) -> Schema:
        """Columns of the database."""
        return read_schema(self._store)

    def digests(self, receipt: Receipt) -> StoredDigests:
        """Return the digests of a part; those of few parts are kept."""
        record = receipt.file(DIGESTS)
        with self._lock:
            if record.path not in self._digests:
                self._digests[record.path] = StoredDigests(CheckedParquet(self._store, record))
            self._digests.move_to_end(record.path)
            if len(self._digests) > _DIGESTS_KEPT:
                self._digests.popitem(last=False)
            return self._digests[record.path]

    def of(self, receipt: Receipt) -> RowMaker:
        """Return the maker of the rows of a part."""
        with self._lock:
            if receipt.plan not in self._makers:
                self._makers[receipt.plan] = _row_maker(self._store, receipt.plan)
            return self._makers[receipt.plan]


def part_table(store: Store, receipt: Receipt, table: str, makers: RowMakers | None = None) -> PartTable:
    """Return a table of a part of rows or templates.

    Parameters
    ----------
    store
        Where the database lies.
    receipt
        Receipt of the part.
    table
        Name of the table.
    makers
        Makers of the database's virtual rows, if the caller has some.
    """
    if not receipt.is_virtual:
        return CheckedParquet(store, receipt.file(table))
    return VirtualTable(store, receipt, table, makers or RowMakers(store))


class VirtualTable:
    """A table of a virtual part.

    Parameters
    ----------
    store
        Where the database lies.
    receipt
        Receipt of the part.
    table : {"features", "signals"}
        Name of the table.
    makers
        Makers of the database's virtual rows.
    group
        Rows in a row group, a multiple of a noise block.
    """

    def __init__(self, store: Store, receipt: Receipt, table: str, makers: RowMakers, group: int = NOISE_BLOCK) -> None:
        self.store, self.receipt, self.table, self.record = store, receipt, table, receipt.file(DIGESTS)
        self._makers, self._group = makers, group
        self.maker = makers.of(receipt)  # in the thread that opens the table, since it imports modules

    def in_groups(self, rows: int) -> "VirtualTable":
        """Return the table with other row groups."""
        return VirtualTable(self.store, self.receipt, self.table, self._makers, rows)

    @cached_property
    def schema(self) -> pa.Schema:
        """Columns of the table."""
        return self._makers.schema.arrow(self.table)

    @property
    def group_rows(self) -> list[int]:
        """Number of rows of each row group."""
        rows = self.receipt.rows
        return [min(self._group, rows - first) for first in range(0, rows, self._group)]

    @property
    def planned(self) -> frozenset[str]:
        """Columns that cost nothing: the plan determines them."""
        return self.maker.planned

    @property
    def row_seconds(self) -> float:
        """Seconds that the sweep took for all columns of a row, in one process."""
        return self.receipt.seconds / self.receipt.rows

    def read(self, groups: Sequence[int] | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """Return some row groups and columns; all of them if None.

        Raises
        ------
        DamagedFileError
            If rows are not those that the sweep made.

        Warns
        -----
        OtherBitsWarning
            If numbers differ in their last bits.
        """
        wanted = self.schema.names if columns is None else list(columns)
        schema = pa.schema([self.schema.field(name) for name in wanted])
        blocks = [block for start, stop in self._runs(groups) for block in self._blocks(start, stop, wanted)]
        if not wanted:  # a table without columns has a number of rows too
            sizes = self.group_rows
            rows = sum(sizes if groups is None else (sizes[group] for group in groups))
            return pa.table({"rows": np.empty(rows, np.int8)}).select([])
        return pa.concat_tables([schema.empty_table(), *blocks])

    def groups_that_may_meet(self, condition: pc.Expression, schema: pa.Schema | None = None) -> list[int]:
        """Return the row groups whose planned columns do not rule out a condition.

        The condition is evaluated with null for each column that is not planned: what is true or null then may be met.
        """
        text, schema = str(condition), schema or self.schema
        named = [name for name in schema.names if name in text]
        unknown = [name for name in named if name not in self.planned]
        if len(unknown) == len(named) or any(_asks_for_null(text, name) for name in unknown):
            return list(range(len(self.group_rows)))
        first, rows = self.receipt.first, self.receipt.rows
        cases = self.maker.cases(first, first + rows, [name for name in named if name in self.planned])
        for name in unknown:
            field = schema.field(name)
            cases = cases.append_column(field, pa.nulls(rows, field.type))
        groups: list[int] = np.unique(np.flatnonzero(_not_false(cases, condition)) // self._group).tolist()
        return groups

    def _runs(self, groups: Sequence[int] | None) -> Iterator[tuple[int, int]]:
        """Yield ids from the first to behind the last of groups that follow each other."""
        first, stop = self.receipt.first, self.receipt.first + self.receipt.rows
        if groups is None:
            yield first, stop
            return
        for run in np.split(np.asarray(groups), np.flatnonzero(np.diff(groups) != 1) + 1):
            if run.size:
                yield first + int(run[0]) * self._group, min(first + (int(run[-1]) + 1) * self._group, stop)

    def _blocks(self, start: int, stop: int, columns: Sequence[str]) -> Iterator[pa.Table]:
        """Yield the noise blocks of some rows, compared with their digests."""
        if not columns:
            return
        tables, digests = self.maker.table(self.table, start, stop, columns), self._makers.digests(self.receipt)
        for first, block in zip(range(start, stop, NOISE_BLOCK), tables, strict=True):
            near, other = differing_columns(block, first, digests)
            rows = f"rows {first} to {first + block.num_rows - 1}"
            if other:
                raise DamagedFileError(
                    self.store.name_of(self.record.path),
                    f"states other numbers than those that are made of the templates: {other[0]} of {rows}",
                    f"verify the database, and read it with the version of sigdb that made it: sigdb verify "
                    f"{self.store} --deep",
                )
            if near and not self._makers.has_warned:
                self._makers.has_warned = True
                warnings.warn(
                    f"{self.store}: virtual rows differ in their last bits from those that the sweep made, first "
                    f"{near[0]} of {rows}: this processor or another version of a library rounds otherwise",
                    OtherBitsWarning,
                    stacklevel=2,
                )
            yield block


def _asks_for_null(text: str, name: str) -> bool:
    """Return whether a condition may be true of a null in a column."""
    return re.search(rf"\b(is_null|is_valid|is_in|coalesce|if_else)\([^)]*\b{re.escape(name)}\b", text) is not None


def _not_false(cases: pa.Table, condition: pc.Expression) -> IntArray:
    """Return a mask of the rows of which a condition is true or null."""
    steps = [
        acero.Declaration("table_source", acero.TableSourceNodeOptions(cases)),
        acero.Declaration("project", acero.ProjectNodeOptions([condition], ["met"])),
    ]
    met = acero.Declaration.from_sequence(steps).to_table(use_threads=False)["met"]
    return np.asarray(pc.fill_null(met, True).to_numpy())
