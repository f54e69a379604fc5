"""The cost of a query on virtual rows: which rows and columns it would make, before any is made."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from sigdb.database.added.joined_parquet import JoinedParquet
from sigdb.database.store.checked import PartTable
from sigdb.database.store.checked_dataset import CheckedDataset, CheckedScanner
from sigdb.database.virtual.virtual_table import VirtualTable


@dataclass(frozen=True)
class QueryCost:
    """The virtual rows that a query makes.

    Attributes
    ----------
    rows : int
        Number of rows that are made; 0 if the query needs only what is stored or planned. A query that scans the rows
        twice makes them twice.
    of : int
        Number of virtual rows of the database.
    columns : tuple of str
        Columns that are made.
    seconds : float
        Time that the sweep took for all columns of these rows, in one process: the query takes that at most, on the
        same kind of machine.
    """

    rows: int
    of: int
    columns: tuple[str, ...]
    seconds: float

    def __str__(self) -> str:
        if not self.rows:
            return f"none of {self.of} virtual rows need be made"
        named = ", ".join(self.columns) if len(self.columns) <= _NAMED else f"{len(self.columns)} columns"
        return f"makes {named} of {self.rows} of {self.of} virtual rows, in at most about {self.seconds:.3g} s"


_NAMED = 6
"""Columns at most that are named one by one."""


@dataclass
class CostRecord:
    """Columns and rows that scans would make; :class:`CostDataset` adds to it."""

    rows: int = 0
    seconds: float = 0.0
    columns: dict[str, None] = field(default_factory=dict)

    def add(self, file: PartTable, columns: Sequence[str], condition: pc.Expression | None, schema: pa.Schema) -> None:
        """Add what a scan of a table of a part would make."""
        table = file.base if isinstance(file, JoinedParquet) else file
        if not isinstance(table, VirtualTable):
            return
        computed = [name for name in columns if name in table.schema.names and name not in table.planned]
        if not computed:
            return
        sizes = file.group_rows
        groups = range(len(sizes)) if condition is None else file.groups_that_may_meet(condition, schema)
        rows = sum(sizes[group] for group in groups)
        self.rows, self.seconds = self.rows + rows, self.seconds + rows * table.row_seconds
        self.columns |= dict.fromkeys(computed)


class CostDataset(CheckedDataset):
    """A table whose scans have no rows, and record what they would make.

    Parameters
    ----------
    files
        The tables of its parts.
    record
        The record.
    """

    def __init__(self, files: Sequence[PartTable], record: CostRecord) -> None:
        super().__init__(files)
        self._tables, self._record = tuple(files), record

    def scanner(
        self, columns: Sequence[str] | None = None, filter: pc.Expression | None = None, **options: Any
    ) -> CheckedScanner:
        """Return a scanner without rows."""
        wanted = self.schema.names if columns is None else list(columns)
        text = "" if filter is None else str(filter)
        read = [name for name in self.schema.names if name in wanted or name in text]
        for file in self._tables:
            self._record.add(file, read, filter, self.schema)
        return CheckedScanner(self.schema, [], wanted, None, [])
