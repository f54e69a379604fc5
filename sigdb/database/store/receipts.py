"""Receipts: a part exists when its receipt exists, and readers follow receipts, never a glob."""

import base64
import re
from collections.abc import Container, Iterable
from dataclasses import asdict, dataclass, field

import pyarrow as pa
from pydantic import TypeAdapter

from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.database.store.store import DamagedFileError, Store

KINDS = ("templates", "rows")

TABLES_OF = {"templates": ("templates",), "rows": ("features", "signals")}
"""Tables of the files of a part, by kind of part."""

DIGESTS = "digests"
"""Table of the one file of a virtual part of rows, whose rows are made when they are read."""

DIGEST_SCHEMA = pa.schema(
    [
        pa.field("first", pa.int64(), nullable=False),
        pa.field("column", pa.string(), nullable=False),
        pa.field("checksum", pa.uint32(), nullable=False),
        pa.field("size", pa.float64(), nullable=False),
    ]
)
"""Columns of the table ``digests``: first id of a block, column of the rows, CRC-32, and sum of absolute values."""

ADDED = "added"
"""Folder of the tables of added features; their kinds of parts begin with it and a dot."""

BLOCK = 256 * 1024
"""Bytes in a block: a thousandth of a part, and a fraction of a millisecond to check."""

SMALL_BLOCK = 8 * 1024
"""Bytes in a block of a file whose rows are read one by one: two or three rows of signals."""

PlainRuns = tuple[tuple[int, int, str], ...]
"""For each row group the first byte of its numbers, the length of its lists, and which rows lack one.

The last is a number in hexadecimal whose bit i stands for row i of the group; empty if no row lacks a list. The length
is 0 where lists differ in length.
"""


@dataclass(frozen=True, kw_only=True)
class FileRecord:
    """A file of a part.

    Attributes
    ----------
    path, bytes, sha256
        Name, size in bytes and SHA-256.
    blocks
        The CRC-32 of each of its blocks (base64).
    block
        Bytes in a block.
    plain
        By column of lists, where its numbers lie that are stored without compression, one after another.
    """

    path: str
    bytes: int
    sha256: str
    blocks: str
    block: int = BLOCK
    plain: dict[str, PlainRuns] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Receipt:
    """The record of a finished part.

    Attributes
    ----------
    name
        ``templates`` or ``rows``; ``added.`` and the name of a set of added features.
    part
        Number of the part.
    plan
        Hash of the plan that the part belongs to, by which a part of another database is recognised. For added
        features, hash of their description.
    first, rows
        First id and number of rows.
    failed
        Number of rows without a result; their status says why.
    files
        Records of its files.
    host, seconds, versions
        The machine, the time that the work took, and versions of the libraries.
    source
        For added features, SHA-256 of the file of averages that they were computed from; empty for others.
    """

    name: str
    part: int
    plan: str
    first: int
    rows: int
    failed: int
    files: tuple[FileRecord, ...]
    host: str
    seconds: float
    versions: dict[str, str]
    source: str = ""

    @property
    def path(self) -> str:
        """Name of the receipt's file."""
        return receipt_name(self.name, self.part)

    @property
    def is_virtual(self) -> bool:
        """Whether the part holds digests of its rows, which are made when they are read."""
        return any(file.path.startswith(f"{DIGESTS}/") for file in self.files)

    @property
    def tables(self) -> tuple[str, ...]:
        """Tables of the part's files."""
        return (DIGESTS,) if self.is_virtual else tables_of(self.name)

    def sha256_of(self, table: str) -> str:
        """Return the SHA-256 of the file that determines a table: that of the table, or of the digests of its rows."""
        return self.file(DIGESTS if self.is_virtual else table).sha256

    def file(self, table: str) -> FileRecord:
        """Return the record of the part's file of a table."""
        return next(file for file in self.files if file.path.startswith(f"{table}/"))


_RECEIPT = TypeAdapter(Receipt)


def tables_of(name: str) -> tuple[str, ...]:
    """Return the tables of the files of a part that stores its rows, by its kind."""
    return TABLES_OF[name] if name in TABLES_OF else (f"{ADDED}/{name.removeprefix(f'{ADDED}.')}",)


def part_name(table: str, part: int, revision: int = 0) -> str:
    """Return the name of a part's file of a table; a file that was written again with other labels has a revision."""
    return f"{table}/part-{part:05d}{f'-{revision}' if revision else ''}.parquet"


def revision_of(path: str) -> int:
    """Return the revision in the name of a part's file."""
    match = re.fullmatch(r".*/part-\d+-(\d+)\.parquet", path)
    return int(match[1]) if match else 0


def receipt_name(name: str, part: int) -> str:
    """Return the name of a receipt."""
    return f"receipts/{name}-{part:05d}.json"


def write_receipt(store: Store, receipt: Receipt) -> None:
    """Publish the receipt of a part, with which the part begins to exist."""
    content = asdict(receipt)
    if not receipt.source:
        del content["source"]
    for file in content["files"]:
        if file["block"] == BLOCK:
            del file["block"]
        if not file["plain"]:
            del file["plain"]
    store.put(receipt.path, sealed_json(content))


def finished_parts(store: Store, name: str) -> list[int]:
    """Return the numbers of the parts of a kind that have a receipt, in order; other files do not count."""
    matches = (re.fullmatch(rf"receipts/{re.escape(name)}-(\d+)\.json", path) for path in store.sizes("receipts"))
    return sorted(int(match[1]) for match in matches if match and receipt_name(name, int(match[1])) == match[0])


def read_receipt(store: Store, name: str, part: int) -> Receipt:
    """Read the receipt of a part, but not its files.

    Raises
    ------
    CorruptionError
        If it is missing, damaged, or the receipt of another part.
    """
    path = receipt_name(name, part)
    file = store.name_of(path)
    try:
        receipt = _RECEIPT.validate_python(unsealed(store.get(path), name=file))
    except DamagedFileError as error:
        raise error.with_remedy(repair(store)) from None
    except (ValueError, TypeError, KeyError):
        raise DamagedFileError(file, "is not a receipt", repair(store)) from None
    if receipt.path != path:
        raise CopiedReceiptError(file, f"is a copy of {receipt.path}", f"move it away, and then {repair(store)}")
    if why := _wrong_files(receipt):
        raise DamagedFileError(file, f"is not a receipt: {why}", repair(store))
    return receipt


class CopiedReceiptError(DamagedFileError):
    """A receipt under the name of another part's."""


def has_own_files(receipt: Receipt) -> bool:
    """Return whether the files of a receipt have the names of its part's."""
    paths, tables = [file.path for file in receipt.files], receipt.tables
    return len(paths) == len(tables) and all(
        path == part_name(table, receipt.part, revision_of(path)) for table, path in zip(tables, paths, strict=True)
    )


def _wrong_files(receipt: Receipt) -> str:
    """Return why the records of the files of a receipt cannot be right; empty if they can."""
    if not has_own_files(receipt):
        names = [part_name(table, receipt.part) for table in receipt.tables]
        return f"its files are not {' and '.join(names)}"
    if receipt.rows < 1 or receipt.first < 0:
        return f"it has {receipt.rows} rows from {receipt.first} on"
    for file in receipt.files:
        try:
            size = len(base64.b64decode(file.blocks, validate=True))
        except ValueError:
            size = -1
        if file.bytes < 1 or file.block < 1 or size != 4 * -(-file.bytes // file.block):
            return f"the checksums of the blocks of {file.path} are not those of {file.bytes} bytes"
    return ""


def read_receipts(
    store: Store, name: str, plans: Container[str], *, read_before: Iterable[Receipt] = ()
) -> list[Receipt]:
    """Return the receipts of the finished parts of a kind, in order.

    Parameters
    ----------
    store
        Where the database lies.
    name
        Kind of the parts: ``templates``, ``rows``, or ``added.`` and the name of a set of added features.
    plans
        Hashes of the database's plans; parts of other plans do not belong to it.
    read_before
        Receipts that were read before, by a caller that owns the database; they are not read again.

    Raises
    ------
    CorruptionError
        If a receipt cannot be read, or a file that it names is missing or has another size.
    """
    read = {receipt.part: receipt for receipt in read_before}
    every = (read.get(part) or _own_receipt(store, name, part) for part in finished_parts(store, name))
    receipts = [receipt for receipt in every if receipt is not None and receipt.plan in plans]
    tables = dict.fromkeys(table for receipt in receipts for table in receipt.tables)
    sizes = {path: size for table in tables for path, size in store.sizes(table).items()}
    for record in (record for receipt in receipts for record in receipt.files):
        if sizes.get(record.path) != record.bytes:
            fault = f"has {sizes[record.path]} bytes" if record.path in sizes else "is missing"
            problem = f"{fault}, its receipt says {record.bytes} bytes"
            raise DamagedFileError(store.name_of(record.path), problem, repair(store))
    return receipts


def _own_receipt(store: Store, name: str, part: int) -> Receipt | None:
    """Return the receipt of a part; None if it is a copy of another one and there is no file of the part."""
    try:
        return read_receipt(store, name, part)
    except CopiedReceiptError:
        if any(store.size(part_name(table, part)) is not None for table in (*tables_of(name), DIGESTS)):
            raise
        return None


def repair(store: Store) -> str:
    """Return the remedy for a damaged part."""
    return f"make it again with: sigdb verify {store} --repair"
