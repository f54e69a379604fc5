"""What an export holds: columns under names that MATLAB takes, with unit, description and formula."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from sigdb.database.signals import list_matrix
from sigdb.database.store.schema import suffixed

if TYPE_CHECKING:
    from sigdb.database.database import Database

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
        """Its ``unit``, ``description`` or ``formula``."""
        return str((self.field.metadata or {}).get(key.encode(), b"").decode())

    def values(self, column: pa.Array) -> Any:
        """Values of a batch: a list of text, (rows, n) float32, or (rows,) float64; nan where there is none."""
        if self.is_list:
            return list_matrix(column)
        if self.is_text:
            return [value or "" for value in column.to_pylist()]
        return column.cast(pa.float64()).to_numpy(zero_copy_only=False)


def export_columns(database: "Database", *, signals: bool, sensor: str | None) -> list[ExportColumn]:
    """The columns of ``features``, and of ``signals`` if wanted: of all sensors, or of one, then without suffix."""
    columns: dict[str, ExportColumn] = {}
    for table in ("features", "signals") if signals else ("features",):
        schema = database.dataset(table).schema
        for source, name in _names(schema.names, database, sensor).items():
            if source == "id" and table == "signals":
                continue
            columns[source] = ExportColumn(name=_unique(name, columns), field=schema.field(source), table=table)
    return list(columns.values())


def export_batches(
    database: "Database", where: str | None, columns: list[ExportColumn], rows: int
) -> Iterator[dict[str, Any]]:
    """Values of the columns by name, batch by batch in the order of ids."""
    features, signals = (
        {column.field.name: column for column in columns if column.table == table} for table in ("features", "signals")
    )
    for batch in database.batches(where, columns=list(dict.fromkeys(["id", *features])), rows=rows):
        values = {column.name: column.values(batch[source]) for source, column in features.items()}
        if signals:
            found = database.signal_rows(batch["id"].to_numpy(), list(signals))
            values |= {column.name: column.values(found[source]) for source, column in signals.items()}
        yield values


def joined(parts: list[Any]) -> Any:
    """Values of batches as one: matrices of different widths are padded with nan."""
    if isinstance(parts[0], list):
        return [value for part in parts for value in part]
    if parts[0].ndim == 1:
        return np.concatenate(parts)
    whole = np.full((sum(len(part) for part in parts), max(part.shape[1] for part in parts)), np.nan, parts[0].dtype)
    for stop, part in zip(np.cumsum([len(part) for part in parts]), parts, strict=True):
        whole[stop - len(part) : stop, : part.shape[1]] = part
    return whole


def _names(names: list[str], database: "Database", sensor: str | None) -> dict[str, str]:
    """Name in the export by name of a column that is wanted."""
    if sensor is None:
        return {name: name for name in names}
    sensor, others = database.stored_sensor(sensor), database.sensors[1:]
    of_sensors = {name for name in names for other in others if suffixed(name, database.sensors, other) in names}
    suffixes = tuple(f"__{other}" for other in others)
    wanted = {suffixed(name, database.sensors, sensor): name for name in names if name in of_sensors}
    plain = {name: name for name in names if name not in of_sensors and not name.endswith(suffixes)}
    return {name: (plain | wanted)[name] for name in names if name in plain | wanted}


def _unique(name: str, columns: Mapping[str, ExportColumn]) -> str:
    """A name that MATLAB takes and no other column has."""
    plain = re.sub(r"^(?![A-Za-z])", "x", re.sub(r"\W", "_", name, flags=re.ASCII))[:_LONGEST]
    taken, number, found = {column.name for column in columns.values()}, 2, plain
    while found in taken:
        found, number = f"{plain[: _LONGEST - 4]}_{number}", number + 1
    return found
