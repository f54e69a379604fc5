"""Parquet: the numeric columns of a table."""

from pathlib import Path
from typing import TYPE_CHECKING

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    bounded_bytes,
    check_bytes,
    check_columns,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.settings import RecordingSettings

if TYPE_CHECKING:
    import pyarrow as pa
    from pyarrow import parquet

FOREIGN: tuple[type[Exception], ...] = (ValueError, OSError, NotImplementedError, KeyError, MemoryError)


def read_parquet(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of real numbers; the metadata ``unit`` of a field is its unit."""
    import pyarrow as pa
    from pyarrow import parquet

    data = pa.BufferReader(bounded_bytes(path))
    with parquet.ParquetFile(data, thrift_string_size_limit=2**24, thrift_container_size_limit=2**20) as file:
        check_parts(len(file.schema_arrow))
        _check_pages(file.metadata)
        numeric = [field for field in file.schema_arrow if _is_real(field.type)]
        if not numeric:
            raise InputError("holds no column of numbers")
        check_columns(len(numeric))
        check_values(len(numeric) * file.metadata.num_rows)
        check_ratio(8 * len(numeric) * file.metadata.num_rows, data.size())
        names = [field.name for field in numeric]
        if len(set(names)) < len(names):
            raise InputError("holds two columns of one name; write it again with different names")
        table = file.read(columns=names, use_threads=False)
    columns = tuple(
        DataColumn(name=field.name, values=_values(table.column(field.name)), unit=_unit(field)) for field in numeric
    )
    others = [field.name for field in file.schema_arrow if field.name not in names]
    note = Note(
        code="columns-left-out",
        text=f"{', '.join(others[:8])}: not numbers, so not a channel",
        values={"columns": len(others)},
    )
    return Contents(columns=columns, notes=(note,) if others else ())


def _check_pages(metadata: "parquet.FileMetaData") -> None:
    """Refuse groups of rows whose stated size is larger than a recording may be."""
    total = 0
    for i in range(metadata.num_row_groups):
        total += metadata.row_group(i).total_byte_size
        check_bytes(total)


def _is_real(kind: "pa.DataType") -> bool:
    from pyarrow import types

    return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind))


def _values(column: "pa.ChunkedArray") -> StoredArray:
    import pyarrow as pa

    return column.cast(pa.float64(), safe=False).to_numpy()


def _unit(field: "pa.Field") -> str:
    return str((field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace"))
