"""Integrity of a database: whether its files are as they were written, and which files do not belong to it."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import pyarrow as pa
import pyarrow.parquet as pq

from sigdb.core import CorruptionError
from sigdb.database.store.checked import block_checksums
from sigdb.database.store.manifest import MANIFEST_FILE
from sigdb.database.store.plain_lists import plain_runs
from sigdb.database.store.receipts import (
    DIGEST_SCHEMA,
    DIGESTS,
    KINDS,
    FileRecord,
    Receipt,
    finished_parts,
    part_name,
    read_receipt,
    receipt_name,
    tables_of,
)
from sigdb.database.store.schema import SCHEMA_FILE, Schema
from sigdb.database.store.seal import unsealed
from sigdb.database.store.store import FileError, Store

_DESCRIPTIONS = frozenset({MANIFEST_FILE, SCHEMA_FILE, "coverage.json", ".lock", ".owner"})
"""Files that belong to no part."""

_JOBS = ".jobs/"
"""Folder in which jobs that make a database together say that they run."""

PartKey = tuple[str, int]
"""Kind and number of a part; the kind is ``templates``, ``rows``, or that of a set of added features."""


@dataclass(frozen=True, kw_only=True)
class IntegrityFinding:
    """A fault of a database.

    Attributes
    ----------
    kind : {"damage", "unfinished", "foreign"}
        ``damage``: a file is not as it was written, or its content is wrong; ``unfinished``: parts are still to be
        computed; ``foreign``: a file does not belong to the database.
    file : str
        Name of the file below the database's place; empty if the fault is of no file.
    what : str
        The fault: the predicate of a sentence whose subject is the file.
    remedy : str
        Remedy.
    stage, part : str and int, or None
        Kind and number of the part to make again; None if there is no such part.
    """

    kind: Literal["damage", "unfinished", "foreign"]
    file: str
    what: str
    remedy: str
    stage: str | None = None
    part: int | None = None

    @property
    def key(self) -> PartKey | None:
        """The part to make again; None if there is no such part."""
        return None if self.stage is None or self.part is None else (self.stage, self.part)

    def __str__(self) -> str:
        return f"{self.file and self.file + ': '}{self.what}; {self.remedy}"


def damaged_part(key: PartKey, file: str, what: str) -> IntegrityFinding:
    """Return a finding of damage, whose remedy is to make a part again."""
    stage, part = key
    remedy = f"make part {part} of {stage} again with --repair"
    return IntegrityFinding(kind="damage", file=file, what=what, remedy=remedy, stage=stage, part=part)


def read_all_receipts(store: Store) -> tuple[dict[PartKey, Receipt], list[IntegrityFinding]]:
    """Return the receipts that can be read, and findings for the others."""
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
    """Return the content of a sealed description and an empty text, or None and what is wrong with the file."""
    try:
        return unsealed(store.get(name), name=name), ""
    except FileError as error:
        return None, error.problem


def read_part(
    store: Store, receipt: Receipt, schema: Schema | None
) -> tuple[dict[str, pq.ParquetFile], list[tuple[str, str]]]:
    """Return the undamaged files of a part, by table, and what is wrong with its other files, by name."""
    files, wrong = {}, []
    for table, record in zip(receipt.tables, receipt.files, strict=True):
        if table == DIGESTS:  # a row of each column of each block, which their check counts
            file, what = read_file(store, record, None, DIGEST_SCHEMA)
        else:
            file, what = read_file(store, record, receipt.rows, schema.arrow(table) if schema else None)
        if file is None:
            wrong.append((record.path, what))
        else:
            files[table] = file
    return files, wrong


def read_file(
    store: Store, record: FileRecord, rows: int | None, schema: pa.Schema | None
) -> tuple[pq.ParquetFile | None, str]:
    """Return a file of a part and an empty text, or None and what is wrong with the file.

    Parameters
    ----------
    store
        Where the database lies.
    record
        The file, as its receipt describes it.
    rows
        Number of rows by the receipt; None if they are not compared.
    schema
        Columns of its table by ``schema.json``; None if they are not compared.
    """
    try:
        content = store.get(record.path)
    except FileError as error:
        return None, error.problem
    if len(content) != record.bytes:
        return None, f"has {len(content)} bytes, its receipt says {record.bytes}"
    if hashlib.sha256(content).hexdigest() != record.sha256:
        return None, "its bytes are not those that were written"
    if block_checksums(memoryview(content), record.block) != record.blocks:
        return None, "the checksums of its blocks in its receipt are not its own"
    file = pq.ParquetFile(pa.BufferReader(content))
    if rows is not None and file.metadata.num_rows != rows:
        return None, f"has {file.metadata.num_rows} rows, its receipt says {rows}"
    lists = {name: [(length, missing) for _, length, missing in runs] for name, runs in record.plain.items()}
    if lists and plain_runs(file.metadata, lists) != record.plain:
        return None, "its receipt does not say where its numbers lie"
    if schema is not None and not file.schema_arrow.equals(schema, check_metadata=True):
        return None, "its columns are not those of schema.json"
    return file, ""


def foreign_files(store: Store, parts: Iterable[PartKey], descriptions: Iterable[str] = ()) -> list[IntegrityFinding]:
    """Return findings for files that are neither a description nor belong to one of the parts.

    Parameters
    ----------
    store
        Where the database lies.
    parts
        Parts that the database is to have.
    descriptions
        Names of descriptions besides those that every database may have.
    """
    expected = _DESCRIPTIONS | {path for stage, part in parts for path in _names(stage, part)} | {*descriptions}
    findings = [
        IntegrityFinding(
            kind="foreign",
            file=name,
            what="does not belong to this database",
            remedy="move it away or delete it",
        )
        for name in store.sizes()
        if name not in expected and not name.startswith(_JOBS)
    ]
    return findings + [
        IntegrityFinding(
            kind="foreign",
            file=name,
            what="is a temporary file that a stopped sweep has left, or that a running one is writing",
            remedy="the next sweep deletes it, or --repair",
        )
        for name in store.temporary()
    ]


def _names(stage: str, part: int) -> list[str]:
    tables = (*tables_of(stage), DIGESTS) if stage == "rows" else tables_of(stage)
    return [receipt_name(stage, part), *(part_name(table, part) for table in tables)]
