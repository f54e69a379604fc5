"""Verification of added features: descriptions, receipts and files, and a sample that is computed again."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sigdb.core import CorruptionError, DatabaseError, InputError
from sigdb.database.added.added_part import AddedWork, added_tables
from sigdb.database.added.added_set import AddedSet, add_again, added_files, file_of, is_current, read_added_set
from sigdb.database.store.checked import PartTable
from sigdb.database.store.integrity import IntegrityFinding, PartKey, damaged_part, read_file
from sigdb.database.store.receipts import ADDED, Receipt, finished_parts, part_name, read_receipt, receipt_name
from sigdb.database.store.schema import suffixed
from sigdb.database.store.store import FileError, Store
from sigdb.database.store.writer import ROW_GROUP
from sigdb.database.virtual.virtual_table import part_table


@dataclass(frozen=True, kw_only=True)
class AddedCheck:
    """The added features that a database holds, for a check.

    Attributes
    ----------
    store
        Where the database lies.
    files
        Names of the descriptions of its sets.
    """

    store: Store
    files: tuple[str, ...]

    @classmethod
    def of(cls, store: Store) -> "AddedCheck":
        """Return the check of a database."""
        return cls(store=store, files=tuple(added_files(store)))

    def parts(self, rows: Sequence[int]) -> list[PartKey]:
        """Return the parts that sets may have, where rows have these parts."""
        kinds = [f"{ADDED}.{name.removeprefix(f'{ADDED}/').removesuffix('.json')}" for name in self.files]
        return [(kind, part) for kind in kinds for part in rows]


def check_added(
    check: AddedCheck, rows: Mapping[int, Receipt], *, deep: bool, sample: int
) -> Iterator[IntegrityFinding]:
    """Yield everything in the added features of a database that is not as it should be.

    Parameters
    ----------
    check
        The added features.
    rows
        Receipts of rows, by part, that can be read.
    deep
        Whether to compute a sample again; this imports the modules of the functions.
    sample
        Number of blocks of 256 rows to compute again in each set, spread evenly.
    """
    for name in check.files:
        try:
            added = read_added_set(check.store, name)
        except FileError as error:
            what, remedy = error.problem, add_again(check.store, name)
            yield IntegrityFinding(kind="damage", file=name, what=what, remedy=remedy)
            continue
        whole: dict[int, Receipt] = {}
        yield from _check_parts(check.store, added, rows, whole)
        if deep:
            yield from _check_values(check.store, added, whole, rows, sample)


def _check_parts(
    store: Store, added: AddedSet, rows: Mapping[int, Receipt], whole: dict[int, Receipt]
) -> Iterator[IntegrityFinding]:
    """Yield the faults of the parts of a set, and collect those without any."""
    finished, missing = set(finished_parts(store, added.kind)), 0
    for part, row in rows.items():
        key = (added.kind, part)
        if part not in finished:
            missing += 1
            continue
        try:
            receipt = read_receipt(store, *key)
        except CorruptionError:
            yield damaged_part(key, receipt_name(*key), "the receipt is damaged, or that of another part")
            continue
        if receipt.plan != added.hash or not is_current(receipt, row):
            missing += 1
            continue
        file, wrong = read_file(store, file_of(added, receipt), receipt.rows, added.schema)
        if file is not None:
            wrong = _wrong_rows(file, receipt, part_table(store, row, "signals"), added)
        if wrong:
            yield damaged_part(key, file_of(added, receipt).path, wrong)
        else:
            whole[part] = receipt
    if missing:
        yield IntegrityFinding(
            kind="unfinished",
            file="",
            what=f"{missing} of {len(rows)} parts of the features that {added.title} adds are not computed from the "
            "averages that are stored now",
            remedy=f"compute them with: sigdb add-features {store} {added.title}",
        )


def _wrong_rows(file: pq.ParquetFile, receipt: Receipt, signals: PartTable, added: AddedSet) -> str:
    """Return what is wrong with the ids and statuses of a file; empty if nothing is."""
    table = file.read(columns=["id", added.status])
    try:
        ids = signals.read(None, ["id"])["id"]
    except DatabaseError:
        return ""  # the averages are damaged, which is a finding already
    if not _same(table["id"], ids):
        return "its ids are not those of the averages"
    failed = sum(status != "ok" for status in table[added.status].to_pylist())
    return "" if failed == receipt.failed else f"has {failed} rows without numbers, its receipt says {receipt.failed}"


def _check_values(
    store: Store, added: AddedSet, whole: Mapping[int, Receipt], rows: Mapping[int, Receipt], sample: int
) -> Iterator[IntegrityFinding]:
    """Yield the parts in which a block differs from what the function gives now."""
    if not whole or not sample:
        return
    function = added.made_by(str(Path.cwd()))
    try:
        function.load()
    except InputError as error:
        yield IntegrityFinding(
            kind="unfinished",
            file=added.file,
            what=f"its values cannot be computed again: {error}",
            remedy=f"verify where the module is, or {add_again(store, added.file)}",
        )
        return
    work = AddedWork(added=added, function=function, units=_units(store, added, rows))
    blocks = [
        (part, group) for part, receipt in whole.items() for group in range(-(-receipt.rows // ROW_GROUP["signals"]))
    ]
    at = np.linspace(0, len(blocks) - 1, min(sample, len(blocks))).round().astype(int)
    damaged = set[int]()
    for part, group in (blocks[i] for i in at):
        if part not in damaged and (what := _difference(store, work, whole[part], rows[part], group)):
            damaged.add(part)
            yield damaged_part((added.kind, part), part_name(added.table, part), what)


def _difference(store: Store, work: AddedWork, receipt: Receipt, rows: Receipt, group: int) -> str:
    """Return what differs in a block from what the function gives now; empty if nothing does."""
    try:
        (again,) = added_tables(work, store, rows, [group])
    except DatabaseError:
        return ""  # the averages are damaged, which is a finding already
    content = store.get(file_of(work.added, receipt).path)
    first = group * ROW_GROUP["signals"]
    stored = pq.ParquetFile(pa.BufferReader(content)).read().slice(first, again.num_rows)
    columns = [name for name in again.schema.names if not _same(stored[name], again[name])]
    if not columns:
        return ""
    ids = f"rows {receipt.first + first} to {receipt.first + first + again.num_rows - 1}"
    return f"{ids}: {columns[0]} is not what {work.added.title} gives again"


def _same(stored: pa.ChunkedArray, again: pa.ChunkedArray) -> bool:
    """Return whether two columns hold the same values; a number without a value is null in both."""
    return bool(stored.combine_chunks().equals(again.combine_chunks()))


def _units(store: Store, added: AddedSet, rows: Mapping[int, Receipt]) -> dict[str, str]:
    """Return the unit of each sensor, from the first file of averages."""
    schema = part_table(store, next(iter(rows.values())), "signals").schema
    fields = {sensor: schema.field(suffixed("tsa", added.sensors, sensor)) for sensor in added.sensors}
    return {sensor: (field.metadata or {}).get(b"unit", b"").decode() for sensor, field in fields.items()}
