"""Parts of added features: a function's numbers of the averages of a part of rows."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from sigdb.database.added.added_set import NO_AVERAGE, AddedSet
from sigdb.database.added.feature_function import FACTS, FeatureFunction, LoadedFunction, NoNumbersError, importable
from sigdb.database.store.checked import PartTable
from sigdb.database.store.receipts import Receipt, read_receipt
from sigdb.database.store.schema import suffixed
from sigdb.database.store.store import Store
from sigdb.database.store.writer import ROW_GROUP, write_part
from sigdb.database.virtual.virtual_table import part_table


@dataclass(frozen=True, kw_only=True)
class AddedWork:
    """Work of a process: the set to compute, and its function.

    Attributes
    ----------
    added
        The set.
    function
        Its function.
    units
        Unit of each stored sensor.
    """

    added: AddedSet
    function: FeatureFunction
    units: Mapping[str, str]


def make_added_part(work: AddedWork, store: Store, part: int) -> Receipt:
    """Compute the numbers of the rows of a part, and write them."""
    started = time.perf_counter()
    rows = read_receipt(store, "rows", part)
    groups = range(-(-rows.rows // ROW_GROUP["signals"]))
    pieces = ({work.added.table: table} for table in added_tables(work, store, rows, groups))
    return write_part(
        store,
        work.added.kind,
        part,
        pieces,
        plan=work.added.hash,
        first=rows.first,
        started=started,
        status=work.added.status,
        source=rows.sha256_of("signals"),
    )


def added_tables(work: AddedWork, store: Store, rows: Receipt, groups: Sequence[int]) -> Iterator[pa.Table]:
    """Yield the added columns of some row groups of averages of a part."""
    features, signals = (part_table(store, rows, table) for table in ("features", "signals"))
    sensors = work.added.sensors
    with importable(work.function.folder):
        function = work.function.load()
        facts = _facts(features, sensors)
        columns = [suffixed("tsa", sensors, sensor) for sensor in sensors]
        for group in groups:
            first = group * ROW_GROUP["signals"]
            averages = signals.read([group], ["id", *columns])
            yield _table(work, function, averages, facts.slice(first, averages.num_rows))


def probed_names(
    function: LoadedFunction, averages: pa.Table, sensors: Sequence[str], units: Mapping[str, str]
) -> tuple[list[str], str]:
    """Return the names of a function's numbers of some rows, and why it gave none for the first row that has none.

    A function may give other names for other tooth counts, so the rows should be of all of them.

    Parameters
    ----------
    function
        The function.
    averages
        Facts of the rows, with the averages of the first sensor in ``tsa``.
    sensors, units
        Stored sensors, and unit of each.
    """
    names, why = dict[str, None](), ""
    for i, row in enumerate(averages.drop_columns(["tsa"]).to_pylist()):
        try:
            names |= dict.fromkeys(_numbers(function, averages["tsa"][i], row, sensors, sensors[0], units))
        except NoNumbersError as error:
            why = why or str(error)
    return list(names), why


def _facts(features: PartTable, sensors: Sequence[str]) -> pa.Table:
    """Return the facts of the rows of a part that a function may take."""
    scatter = [suffixed("scatter", sensors, sensor) for sensor in sensors]
    return features.read(None, [name for name in (*FACTS, *scatter[1:]) if name in features.schema.names])


def _numbers(
    function: LoadedFunction,
    average: pa.ListScalar,
    row: Mapping[str, Any],
    sensors: Sequence[str],
    sensor: str,
    units: Mapping[str, str],
) -> dict[str, float]:
    """Return the numbers of one average of a row."""
    facts = {name: row.get(name) for name in FACTS}
    facts |= {"sensor": facts["sensor"] or sensor, "unit": facts["unit"] or units[sensor]}  # a measured row has its own
    facts["scatter"] = row.get(suffixed("scatter", sensors, sensor))
    values = {name: float("nan") if value is None else value for name, value in facts.items()}
    return function.numbers(average.values.to_numpy(zero_copy_only=False), values)


def _table(work: AddedWork, function: LoadedFunction, averages: pa.Table, facts: pa.Table) -> pa.Table:
    """Return the added columns of rows: null where there is no number, and a status."""
    added, count = work.added, averages.num_rows
    values = {column.name: np.full(count, np.nan) for column in added.columns if column.name != added.status}
    status = []
    for i, row in enumerate(facts.to_pylist()):
        problems = []
        for sensor in added.sensors:
            average = averages[suffixed("tsa", added.sensors, sensor)][i]
            if not average.is_valid:
                problems.append(NO_AVERAGE)
                continue
            try:
                numbers = _numbers(function, average, row, added.sensors, sensor, work.units)
                if strange := sorted(set(numbers) - set(added.names)):
                    raise NoNumbersError(f"returned the name {strange[0]!r}, which is no column of {added.title}")
            except NoNumbersError as error:
                problems.append(f"{sensor}: {error}" if len(added.sensors) > 1 else str(error))
                continue
            for name, number in numbers.items():
                values[suffixed(name, added.sensors, sensor)][i] = number
        status.append("; ".join(dict.fromkeys(problems)) or "ok")
    columns: dict[str, Any] = {"id": averages["id"]}
    columns |= {name: pa.array(numbers, pa.float64(), from_pandas=True) for name, numbers in values.items()}
    columns[added.status] = pa.array(status, pa.string())
    return pa.table([columns[field.name] for field in added.schema], schema=added.schema)
