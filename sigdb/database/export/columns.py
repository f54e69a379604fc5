"""Columns of an export: under names that MATLAB takes, with unit, description and formula."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias, Unpack

import numpy as np
import pyarrow as pa

from sigdb.core import FloatArray
from sigdb.database.limits import LimitOptions
from sigdb.database.signals import list_matrix
from sigdb.database.store.schema import suffixed
from sigdb.database.stored_tables import StoredTables

Values: TypeAlias = FloatArray | list[str]
"""Values of a column: (rows, n) float32 for lists, (rows,) float64 for numbers, or text."""

_LONGEST = 63
"""Characters in a MATLAB name."""


@dataclass(frozen=True, kw_only=True)
class ExportColumn:
    """A column of an export.

    Attributes
    ----------
    name
        Name in the export: letters, digits and underscores.
    field
        Arrow field that it comes from.
    table
        Table that it comes from.
    """

    name: str
    field: pa.Field
    table: str

    @property
    def is_list(self) -> bool:
        """Whether it is a matrix, one row a signature."""
        return bool(pa.types.is_list(self.field.type))

    @property
    def is_text(self) -> bool:
        """Whether it holds text."""
        return bool(pa.types.is_string(self.field.type))

    def described(self, key: str) -> str:
        """Return its ``unit``, ``description`` or ``formula``."""
        return str((self.field.metadata or {}).get(key.encode(), b"").decode())

    def values(self, column: pa.Array) -> Values:
        """Return the values of a batch; a missing number is nan, a missing text is empty."""
        if self.is_list:
            return list_matrix(column)
        if self.is_text:
            return [value or "" for value in column.to_pylist()]
        return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False))


def export_columns(tables: StoredTables, *, signals: bool, sensor: str | None) -> list[ExportColumn]:
    """Return the columns of ``features``, and of ``signals`` if wanted; those of one sensor have no suffix."""
    columns: dict[str, ExportColumn] = {}
    for table in ("features", "signals") if signals else ("features",):
        schema = tables.dataset(table).schema
        for source, name in _names(schema.names, tables, sensor).items():
            if source == "id" and table == "signals":
                continue
            columns[source] = ExportColumn(name=_unique(name, columns), field=schema.field(source), table=table)
    return list(columns.values())


def export_batches(
    tables: StoredTables, where: str | None, columns: list[ExportColumn], rows: int, **limits: Unpack[LimitOptions]
) -> Iterator[dict[str, Values]]:
    """Yield the values of the columns by name, batch by batch in the order of ids."""
    features, signals = (
        {column.field.name: column for column in columns if column.table == table} for table in ("features", "signals")
    )
    for batch in tables.batches(where, columns=list(dict.fromkeys(["id", *features])), rows=rows, **limits):
        values = {column.name: column.values(batch[source]) for source, column in features.items()}
        if signals:
            stored = tables.signal_rows(batch["id"].to_numpy(), list(signals))
            values |= {column.name: column.values(stored[source]) for source, column in signals.items()}
        yield values


def _names(names: list[str], tables: StoredTables, sensor: str | None) -> dict[str, str]:
    """Names in the export by names of the columns that are wanted."""
    if sensor is None:
        return {name: name for name in names}
    sensor, others = tables.stored_sensor(sensor), tables.sensors[1:]
    measured = {name for name in names for other in others if suffixed(name, tables.sensors, other) in names}
    suffixes = tuple(f"__{other}" for other in others)
    wanted = {suffixed(name, tables.sensors, sensor): name for name in names if name in measured}
    wanted |= {name: name for name in names if name not in measured and not name.endswith(suffixes)}
    return {name: wanted[name] for name in names if name in wanted}


def _unique(name: str, columns: Mapping[str, ExportColumn]) -> str:
    """A name that MATLAB takes and no other column has."""
    base = re.sub(r"^(?![A-Za-z])", "x", re.sub(r"\W", "_", name, flags=re.ASCII))[:_LONGEST]
    taken, number, name = {column.name for column in columns.values()}, 2, base
    while name in taken:
        name, number = f"{base[: _LONGEST - 4]}_{number}", number + 1
    return name
