"""Parquet: the columns of numbers, dates and durations of a table."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    SHORTEST_BLOCK,
    Contents,
    DataColumn,
    StoredArray,
    block_length,
    bounded_bytes,
    check_bytes,
    check_columns,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.formats.named_arrays import rate_of
from sigdb.recording.files.formats.time_ticks import NOT_A_TIME, TICKS, seconds_of_ticks
from sigdb.recording.files.settings import RecordingSettings

if TYPE_CHECKING:
    import pyarrow as pa
    from pyarrow import parquet

LONGEST_NUMBER = 64
"""Length from which on a text of the metadata is no number, bytes."""

FOREIGN: tuple[type[Exception], ...] = (ValueError, OSError, NotImplementedError, KeyError, MemoryError)


def read_parquet(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of real numbers, dates and durations; these in s, dates after the first one.

    The metadata ``unit`` or ``units`` of a field is its unit; the metadata of the table may state a sampling rate.
    """
    import pyarrow as pa

    data = pa.BufferReader(bounded_bytes(path))
    with _opened(data) as file:
        numeric = _numeric(file)
        _check_pages(file.metadata)
        check_values(len(numeric) * file.metadata.num_rows)
        check_ratio(8 * len(numeric) * file.metadata.num_rows, data.size())
        table = file.read(columns=[field.name for field in numeric], use_threads=False)
        return _contents(table, numeric, file.schema_arrow)


def parquet_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the columns of real numbers, dates and durations in blocks, whatever the groups of rows.

    Parameters
    ----------
    path
        The file.
    settings
        Not used.
    samples
        Samples of a block.
    """
    import pyarrow as pa

    with pa.OSFile(str(path)) as data, _opened(data) as file:
        numeric = _numeric(file)
        for i in range(file.metadata.num_row_groups):
            group = file.metadata.row_group(i)
            check_bytes(group.total_byte_size)
            check_ratio(8 * len(numeric) * group.num_rows, data.size())
        length = block_length(len(numeric), samples)
        waiting: list[pa.RecordBatch] = []
        rows, left = 0, file.metadata.num_rows
        for batch in file.iter_batches(length, columns=[field.name for field in numeric], use_threads=False):
            waiting.append(batch)
            rows += batch.num_rows
            while rows >= length and left - length >= SHORTEST_BLOCK:
                table = pa.Table.from_batches(waiting)
                yield _contents(table.slice(0, length), numeric, file.schema_arrow)
                waiting = table.slice(length).to_batches()
                rows, left = rows - length, left - length
        if rows:
            yield _contents(pa.Table.from_batches(waiting), numeric, file.schema_arrow)


def _opened(data: "pa.NativeFile") -> "parquet.ParquetFile":
    from pyarrow import parquet

    return parquet.ParquetFile(data, thrift_string_size_limit=2**24, thrift_container_size_limit=2**20)


def _numeric(file: "parquet.ParquetFile") -> list["pa.Field"]:
    """Return the columns of real numbers, dates and durations."""
    check_parts(len(file.schema_arrow))
    numeric = [field for field in file.schema_arrow if _is_real(field.type) or _is_time(field.type)]
    if not numeric:
        raise InputError("holds no column of numbers")
    check_columns(len(numeric))
    names = [field.name for field in numeric]
    if len(set(names)) < len(names):
        raise InputError("holds two columns of one name; write it again with different names")
    return numeric


def _contents(table: "pa.Table", numeric: list["pa.Field"], schema: "pa.Schema") -> Contents:
    names = [field.name for field in numeric]
    start = _first_date(table, numeric)
    columns = tuple(
        DataColumn(
            name=_shown(field, names), values=_values(table.column(field.name)), unit=_unit(field),
            start=None if _is_time(field.type) else start,
        )
        for field in numeric
    )  # fmt: skip
    others = [field.name for field in schema if field.name not in names]
    note = Note(
        code="columns-left-out",
        text=f"{', '.join(others[:8])}: not numbers, so not a channel",
        values={"columns": len(others)},
    )
    rates = _rates(schema.metadata or {})
    source, rate = next(iter(rates.items())) if len(set(rates.values())) == 1 else ("the file", None)
    return Contents(columns=columns, sampling_rate=rate, rate_from=source, notes=(note,) if others else (), named=True)


def _first_date(table: "pa.Table", fields: list["pa.Field"]) -> float | None:
    """Return the first date in s after 1970; None unless there is a single column of dates."""
    from pyarrow import types

    dates = [field for field in fields if types.is_timestamp(field.type)]
    first = table.column(dates[0].name)[0] if len(dates) == 1 and len(table) else None
    return None if first is None or not first.is_valid else first.value * TICKS[dates[0].type.unit]


def _rates(metadata: Mapping[bytes, bytes]) -> dict[str, float]:
    """Return the sampling rates, Hz, that the metadata of a table state, by the names of their entries."""
    rates: dict[str, float] = {}
    for key, value in metadata.items():
        name, text = key.decode("utf-8", "replace"), value[:LONGEST_NUMBER].decode("utf-8", "replace")
        try:
            rate = rate_of(name, float(text)) if len(value) < LONGEST_NUMBER else None
        except ValueError:
            rate = rate_of(name, text)
        if rate is not None:
            rates[name] = rate
    return rates


def _shown(field: "pa.Field", names: list[str]) -> str:
    """Return the name of a column. pandas gives an index without a name one of its own."""
    if not re.fullmatch(r"__index_level_\d+__", field.name):
        return str(field.name)
    short = "time" if _is_time(field.type) else "index"
    return short if short not in names else str(field.name)


def _check_pages(metadata: "parquet.FileMetaData") -> None:
    """Refuse groups of rows whose stated size is larger than a recording may be."""
    total = 0
    for i in range(metadata.num_row_groups):
        total += metadata.row_group(i).total_byte_size
        check_bytes(total)


def _is_real(kind: "pa.DataType") -> bool:
    from pyarrow import types

    return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind))


def _is_time(kind: "pa.DataType") -> bool:
    from pyarrow import types

    return bool(types.is_timestamp(kind) or types.is_duration(kind))


def _values(column: "pa.ChunkedArray") -> StoredArray:
    import pyarrow as pa
    from pyarrow import types

    if not _is_time(column.type):
        return column.cast(pa.float64(), safe=False).to_numpy()
    ticks = column.cast(pa.int64(), safe=False).fill_null(NOT_A_TIME).to_numpy()
    return seconds_of_ticks(ticks, column.type.unit, after_first=types.is_timestamp(column.type))


def _unit(field: "pa.Field") -> str:
    if _is_time(field.type):
        return "s"
    metadata = field.metadata or {}
    return str(next((metadata[key] for key in (b"unit", b"units") if key in metadata), b"").decode("utf-8", "replace"))
