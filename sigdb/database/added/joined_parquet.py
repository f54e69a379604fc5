"""A file of features with the files of added features of the same part, read as one table."""

from collections.abc import Sequence
from functools import cached_property

import pyarrow as pa
import pyarrow.compute as pc

from sigdb.database.added.added_set import AddedSet
from sigdb.database.store.checked import CheckedParquet, PartTable
from sigdb.database.store.store import DamagedFileError

AddedFile = tuple[AddedSet, CheckedParquet | None]
"""A set of added features, and its file of a part; None where it is not computed, or not from these averages."""


class JoinedParquet:
    """The file of a part's features, with columns of the files of added features behind its own.

    Rows of all these files are in the same order and in row groups of the same sizes. Columns of a file that does not
    exist are null.

    Parameters
    ----------
    base
        The file of features.
    added
        The files of added features.
    """

    def __init__(self, base: PartTable, added: Sequence[AddedFile]) -> None:
        self.store, self.record = base.store, base.record
        self.base, self._added = base, tuple(added)

    @property
    def schema(self) -> pa.Schema:
        """Columns of all files."""
        return self._schema

    @property
    def group_rows(self) -> list[int]:
        """Number of rows of each row group."""
        return self.base.group_rows

    @cached_property
    def _schema(self) -> pa.Schema:
        fields = [field for added, _ in self._added for field in added.schema if field.name != "id"]
        return pa.schema([*self.base.schema, *fields])

    def read(self, groups: Sequence[int] | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """Return some row groups and columns; all of them if None.

        Raises
        ------
        DamagedFileError
            If a block that is read is not as it was written, or a file has other rows.
        FileError
            If a file cannot be read.
        """
        wanted = self.schema.names if columns is None else list(columns)
        table = self.base.read(groups, [name for name in wanted if name in self.base.schema.names])
        sizes = self.base.group_rows
        rows = sum(sizes if groups is None else (sizes[group] for group in groups))
        values = dict(zip(table.column_names, table.columns, strict=True))
        for added, file in self._added:
            names = [name for name in wanted if name in added.schema.names and name not in values]
            if names:
                values |= self._columns(added, file, names, groups, rows)
        fields = [self.schema.field(name) for name in wanted]
        return pa.table([values[name] for name in wanted], schema=pa.schema(fields)) if wanted else table

    def groups_that_may_meet(self, condition: pc.Expression, schema: pa.Schema | None = None) -> list[int]:
        """Return the row groups that may hold rows that meet a condition."""
        return self.base.groups_that_may_meet(condition, schema or self.schema)

    def _columns(
        self, added: AddedSet, file: CheckedParquet | None, names: list[str], groups: Sequence[int] | None, rows: int
    ) -> dict[str, pa.ChunkedArray | pa.Array]:
        if file is None:
            return {name: pa.nulls(rows, added.schema.field(name).type) for name in names}
        table = file.read(groups, names)
        if table.num_rows != rows:
            raise DamagedFileError(file.store.name_of(file.record.path), f"has {table.num_rows} rows of {rows}")
        return {name: table[name] for name in names}
