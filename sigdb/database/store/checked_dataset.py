"""A table of a database as an Arrow dataset that is scanned in the calling thread."""

from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any, NoReturn

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
from pyarrow import acero

from sigdb.core import DatabaseError, InputError
from sigdb.database.store.checked import PARQUET, PartTable

_ROWS_AT_ONCE = 8192
"""Rows that are read together, or a row group if that has more."""


class CheckedDataset(ds.FileSystemDataset):  # type: ignore[misc]
    """The files of a table as an Arrow dataset.

    Arrow's own scanner reads ahead in threads, which go on when a reader has had enough. A thread that reads by Python
    while Python ends aborts the process or hangs. So this dataset has a scanner of its own, and DuckDB uses it.

    Parameters
    ----------
    files
        The files, at least one.
    errors
        A list to which errors of reading are added, since DuckDB passes them on as text.
    """

    def __init__(self, files: Sequence[PartTable], errors: list[DatabaseError] | None = None) -> None:
        super().__init__([], files[0].schema, PARQUET)
        self._files, self._errors = tuple(files), [] if errors is None else errors

    def scanner(
        self, columns: Sequence[str] | None = None, filter: pc.Expression | None = None, **options: Any
    ) -> "CheckedScanner":
        """Return a scanner of some columns of the rows that meet a condition; other options have no effect."""
        wanted = self.schema.names if columns is None else list(columns)
        return CheckedScanner(self.schema, self._files, wanted, filter, self._errors)

    def _refused(self, *arguments: Any, **options: Any) -> NoReturn:
        """Refuse methods that Arrow computes from the files of a dataset: this one gives Arrow no files."""
        raise InputError(
            "this dataset reads its files itself, to compare them with checksums; it has to_table, to_batches, head, "
            "take, count_rows and scanner: use these, or sql"
        )

    filter = get_fragments = join = join_asof = replace_schema = sort_by = _refused
    files = property(_refused)


class CheckedScanner:
    """A scan of a dataset, as Arrow's scanners offer it.

    Attributes
    ----------
    dataset_schema
        Columns of the dataset.
    projected_schema
        Columns of the scan.
    """

    def __init__(
        self,
        schema: pa.Schema,
        files: Sequence[PartTable],
        columns: Sequence[str],
        condition: pc.Expression | None,
        errors: list[DatabaseError],
    ) -> None:
        self.dataset_schema = schema
        self.projected_schema = pa.schema([schema.field(name) for name in columns])
        self._files, self._condition, self._errors = files, condition, errors

    def to_batches(self) -> Iterator[pa.RecordBatch]:
        """Yield the rows, a few row groups at a time.

        Raises
        ------
        DatabaseError
            If a part is damaged or cannot be read.
        """
        try:
            for file in self._files:
                yield from self._batches(file)
        except DatabaseError as error:
            self._errors.append(copy(error))  # without the traceback, which holds all that is in use
            raise

    def to_reader(self) -> pa.RecordBatchReader:
        """Return the rows as a reader of batches."""
        return pa.RecordBatchReader.from_batches(self.projected_schema, self.to_batches())

    def to_table(self) -> pa.Table:
        """Return all rows."""
        return pa.Table.from_batches(self.to_batches(), self.projected_schema)

    def head(self, num_rows: int) -> pa.Table:
        """Return the first rows."""
        some: list[pa.RecordBatch] = []
        for batch in self.to_batches():
            some.append(batch)
            if sum(batch.num_rows for batch in some) >= num_rows:
                break
        return pa.Table.from_batches(some, self.projected_schema).slice(0, num_rows)

    def take(self, indices: Any) -> pa.Table:
        """Return the rows at some places."""
        return self.to_table().take(indices)

    def count_rows(self) -> int:
        """Return the number of rows."""
        return sum(batch.num_rows for batch in self.to_batches())

    def _batches(self, file: PartTable) -> Iterator[pa.RecordBatch]:
        names, condition = self.projected_schema.names, self._condition
        if condition is None:
            for groups in _runs(file.group_rows, range(len(file.group_rows))):
                yield from file.read(groups, names).to_batches()
            return
        text = str(condition)  # Arrow has no list of an expression's columns
        read = [name for name in self.dataset_schema.names if name in names or name in text]
        for groups in _runs(file.group_rows, file.groups_that_may_meet(condition)):
            yield from _filtered(file.read(groups, read), condition).select(names).to_batches()


def _runs(group_rows: Sequence[int], groups: Sequence[int]) -> Iterator[list[int]]:
    """Yield the groups in lists of about as many rows as are read together."""
    run: list[int] = []
    for group in groups:
        run.append(group)
        if sum(group_rows[i] for i in run) >= _ROWS_AT_ONCE:
            yield run
            run = []
    if run:
        yield run


def _filtered(table: pa.Table, condition: pc.Expression) -> pa.Table:
    """Return the rows of a table that meet a condition, without other threads."""
    steps = [
        acero.Declaration("table_source", acero.TableSourceNodeOptions(table)),
        acero.Declaration("filter", acero.FilterNodeOptions(condition)),
    ]
    return acero.Declaration.from_sequence(steps).to_table(use_threads=False)
