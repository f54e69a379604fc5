"""Whether the files of a database are as they were written: seals, sizes, checksums, and nothing beside them."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import pyarrow as pa
import pyarrow.parquet as pq

from sigdb.core import CorruptionError
from sigdb.database.store.checked import block_checksums
from sigdb.database.store.manifest import MANIFEST_FILE
from sigdb.database.store.receipts import (
    KINDS,
    TABLES_OF,
    FileRecord,
    Receipt,
    finished_parts,
    part_name,
    read_receipt,
    receipt_name,
)
from sigdb.database.store.schema import SCHEMA_FILE
from sigdb.database.store.seal import unsealed
from sigdb.database.store.store import FileError, Store

_OWN = frozenset({MANIFEST_FILE, SCHEMA_FILE, "coverage.json", ".lock", ".owner"})
"""Files that are no part's."""

PartKey = tuple[str, int]
"""``templates`` or ``rows``, and the number of a part."""


@dataclass(frozen=True, kw_only=True)
class IntegrityFinding:
    """Something about a database that is not as it should be.

    Attributes
    ----------
    kind
        ``damage``: what was written is not there as it was, or is wrong; ``unfinished``: parts are not made yet;
        ``foreign``: a file that is none of the database's.
    file
        The file, by its name below the database's place; empty where there is none.
    what
        What was found.
    remedy
        What to do.
    stage, part
        The part to make again: ``templates`` or ``rows``, and its number; None where none is.
    """

    kind: Literal["damage", "unfinished", "foreign"]
    file: str
    what: str
    remedy: str
    stage: str | None = None
    part: int | None = None

    @property
    def key(self) -> PartKey | None:
        """The part to make again."""
        return None if self.stage is None or self.part is None else (self.stage, self.part)

    def __str__(self) -> str:
        return f"{self.file and self.file + ': '}{self.what}; {self.remedy}"


def damaged_part(key: PartKey, file: str, what: str) -> IntegrityFinding:
    """A finding that a part must be made again for."""
    stage, part = key
    remedy = f"make part {part} of {stage} again with --repair"
    return IntegrityFinding(kind="damage", file=file, what=what, remedy=remedy, stage=stage, part=part)


def read_all_receipts(store: Store) -> tuple[dict[PartKey, Receipt], list[IntegrityFinding]]:
    """The receipts that can be read, and what is wrong with the others."""
    receipts, findings = {}, []
    for stage in KINDS:
        for part in finished_parts(store, stage):
            try:
                receipts[stage, part] = read_receipt(store, stage, part)
            except CorruptionError:
                what = "the receipt is damaged, or that of another part"
                findings.append(damaged_part((stage, part), receipt_name(stage, part), what))
    return receipts, findings


def unsealed_or_why(store: Store, name: str) -> tuple[dict[str, Any] | None, str]:
    """The content of a sealed description, or None and why there is none."""
    try:
        return unsealed(store.get(name), name=name), ""
    except FileError as error:
        return None, error.problem


def read_file(
    store: Store, record: FileRecord, rows: int, schema: pa.Schema | None
) -> tuple[pq.ParquetFile | None, str]:
    """A part's file if it is as it was written, or None and what is wrong with it."""
    try:
        content = store.get(record.path)
    except FileError as error:
        return None, error.problem
    if len(content) != record.bytes:
        return None, f"has {len(content)} bytes, its receipt says {record.bytes}"
    if hashlib.sha256(content).hexdigest() != record.sha256:
        return None, "its bytes are not those that were written"
    if block_checksums(memoryview(content)) != record.blocks:
        return None, "the checksums of its blocks in its receipt are not its own"
    file = pq.ParquetFile(pa.BufferReader(content))
    if file.metadata.num_rows != rows:
        return None, f"has {file.metadata.num_rows} rows, its receipt says {rows}"
    if schema is not None and not file.schema_arrow.equals(schema, check_metadata=True):
        return None, "its columns are not those of schema.json"
    return file, ""


def foreign_files(store: Store, parts: Iterable[PartKey]) -> list[IntegrityFinding]:
    """Files that are neither a description nor those of a part."""
    known = _OWN | {path for stage, part in parts for path in _names(stage, part)}
    strangers = [
        IntegrityFinding(
            kind="foreign",
            file=name,
            what="is none of this database's files",
            remedy="move it away or delete it",
        )
        for name in store.sizes()
        if name not in known
    ]
    return strangers + [
        IntegrityFinding(
            kind="foreign",
            file=name,
            what="is a temporary file that a stopped sweep has left, or that a running one is writing",
            remedy="the next sweep deletes it, or --repair",
        )
        for name in store.temporary()
    ]


def _names(stage: str, part: int) -> list[str]:
    return [receipt_name(stage, part), *(part_name(table, part) for table in TABLES_OF[stage])]
