"""Receipts: a part exists when its receipt exists, and readers follow receipts, never a glob."""

import re
from collections.abc import Container
from dataclasses import asdict, dataclass

from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.database.store.store import DamagedFileError, Store

KINDS = ("templates", "rows")

TABLES_OF = {"templates": ("templates",), "rows": ("features", "signals")}
"""Tables of the files of a part, by kind of part."""


@dataclass(frozen=True, kw_only=True)
class FileRecord:
    """A file of a part: its name, size in bytes, SHA-256, and the CRC-32 of each of its blocks (base64)."""

    path: str
    bytes: int
    sha256: str
    blocks: str


@dataclass(frozen=True, kw_only=True)
class Receipt:
    """The record of a finished part.

    Attributes
    ----------
    name
        ``templates`` or ``rows``.
    part
        Number of the part.
    plan
        Hash of the plan that the part belongs to, by which a part of another database is recognised.
    first, rows
        First id and number of rows.
    failed
        Number of rows without a result; their status says why.
    files
        Records of its files.
    host, seconds, versions
        The machine, the time that the work took, and versions of the libraries.
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

    @property
    def path(self) -> str:
        """Name of the receipt's file."""
        return receipt_name(self.name, self.part)

    def file(self, table: str) -> FileRecord:
        """Return the record of the part's file of a table."""
        return next(file for file in self.files if file.path.startswith(f"{table}/"))


def part_name(table: str, part: int) -> str:
    """Return the name of a part's file of a table."""
    return f"{table}/part-{part:05d}.parquet"


def receipt_name(name: str, part: int) -> str:
    """Return the name of a receipt."""
    return f"receipts/{name}-{part:05d}.json"


def write_receipt(store: Store, receipt: Receipt) -> None:
    """Publish the receipt of a part, with which the part begins to exist."""
    store.put(receipt.path, sealed_json(asdict(receipt)))


def finished_parts(store: Store, name: str) -> list[int]:
    """Return the numbers of the parts of a kind that have a receipt, in order; other files do not count."""
    matches = (re.fullmatch(rf"receipts/{name}-(\d+)\.json", path) for path in store.sizes("receipts"))
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
        content = unsealed(store.get(path), name=file)
        receipt = Receipt(**content | {"files": tuple(FileRecord(**record) for record in content["files"])})
    except DamagedFileError as error:
        raise error.with_remedy(repair(store)) from None
    except (ValueError, TypeError, KeyError):
        raise DamagedFileError(file, "is not a receipt", repair(store)) from None
    if receipt.path != path:
        raise DamagedFileError(file, f"is a copy of {receipt.path}", repair(store))
    return receipt


def read_receipts(store: Store, name: str, plans: Container[str]) -> list[Receipt]:
    """Return the receipts of the finished parts of a kind, in order.

    Parameters
    ----------
    store
        Where the database lies.
    name
        ``templates`` or ``rows``.
    plans
        Hashes of the database's plans; parts of other plans do not belong to it.

    Raises
    ------
    CorruptionError
        If a receipt cannot be read, or a file that it names is missing or has another size.
    """
    every = (read_receipt(store, name, part) for part in finished_parts(store, name))
    receipts = [receipt for receipt in every if receipt.plan in plans]
    sizes = {path: size for table in TABLES_OF[name] for path, size in store.sizes(table).items()} if receipts else {}
    for record in (record for receipt in receipts for record in receipt.files):
        if sizes.get(record.path) != record.bytes:
            fault = f"has {sizes[record.path]} bytes" if record.path in sizes else "is missing"
            problem = f"{fault}, its receipt says {record.bytes} bytes"
            raise DamagedFileError(store.name_of(record.path), problem, repair(store))
    return receipts


def repair(store: Store) -> str:
    """Return the remedy for a damaged part."""
    return f"make it again with: sigdb verify {store} --repair"
