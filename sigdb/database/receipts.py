"""Receipts: a part exists when its receipt exists, and readers follow receipts, never a glob."""

from dataclasses import asdict, dataclass
from typing import Any

from sigdb.core.errors import DatabaseError
from sigdb.database.seal import sealed_json, unsealed
from sigdb.database.storage import Store

KINDS = ("templates", "rows")


@dataclass(frozen=True, kw_only=True)
class FileRecord:
    """A file of a part: its name, size in bytes, SHA-256, and the CRC-32 of each of its blocks (base64)."""

    path: str
    bytes: int
    sha256: str
    blocks: str


@dataclass(frozen=True, kw_only=True)
class Receipt:
    """What a part is.

    Attributes
    ----------
    name
        ``templates`` or ``rows``.
    part
        Number of the part.
    first, rows
        First id and number of rows.
    failed
        Rows that have no result; their status says why.
    files
        The files that it consists of.
    host, seconds, versions
        Where, how long and with what it was made.
    """

    name: str
    part: int
    first: int
    rows: int
    failed: int
    files: tuple[FileRecord, ...]
    host: str
    seconds: float
    versions: dict[str, str]

    @property
    def path(self) -> str:
        """Its own file's name."""
        return receipt_name(self.name, self.part)

    def file(self, table: str) -> FileRecord:
        """The part's file of a table."""
        return next(file for file in self.files if file.path.startswith(f"{table}/"))


def part_name(table: str, part: int) -> str:
    """Name of a part's file of a table."""
    return f"{table}/part-{part:05d}.parquet"


def receipt_name(name: str, part: int) -> str:
    """Name of a receipt."""
    return f"receipts/{name}-{part:05d}.json"


def write_receipt(store: Store, receipt: Receipt) -> None:
    """Publish the receipt of a part: from now on the part exists."""
    store.put(receipt.path, sealed_json(asdict(receipt)))


def read_receipt(store: Store, name: str, part: int) -> Receipt:
    """The receipt of one part; its files are not looked at.

    Raises
    ------
    DatabaseError
        If it is missing or damaged.
    """
    return _parsed(store, receipt_name(name, part))


def read_receipts(store: Store, name: str) -> list[Receipt]:
    """Receipts of the finished parts of one kind, in order.

    Raises
    ------
    DatabaseError
        If a receipt cannot be read, or a file that it names is missing or has another size.
    """
    receipts = [
        _parsed(store, path) for path in sorted(store.sizes("receipts")) if path.startswith(f"receipts/{name}-")
    ]
    if not receipts:
        return []
    sizes = {path: size for table in _TABLES[name] for path, size in store.sizes(table).items()}
    for receipt in receipts:
        for record in receipt.files:
            if sizes.get(record.path) != record.bytes:
                found = f"has {sizes[record.path]} bytes" if record.path in sizes else "is missing"
                raise DatabaseError(
                    f"{store.name_of(record.path)} {found}, its receipt says {record.bytes} bytes; {repair(store)}"
                )
    return sorted(receipts, key=lambda receipt: receipt.part)


def repair(store: Store) -> str:
    """What to do about a damaged part."""
    return f"make it again with: sigdb verify {store} --repair"


_TABLES = {"templates": ("templates",), "rows": ("features", "signals")}


def _parsed(store: Store, path: str) -> Receipt:
    try:
        content: dict[str, Any] = unsealed(store.get(path), name=store.name_of(path))
        return Receipt(**content | {"files": tuple(FileRecord(**record) for record in content["files"])})
    except (DatabaseError, ValueError, TypeError, KeyError) as error:
        raise DatabaseError(f"{error}; {repair(store)}") from None
