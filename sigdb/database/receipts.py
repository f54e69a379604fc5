"""Receipts: a part exists when its receipt exists, and readers follow receipts, never a glob."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from sigdb.core.errors import DatabaseError
from sigdb.database.storage import publish_json


@dataclass(frozen=True, kw_only=True)
class FileRecord:
    """A file of a part: path below the database, size in bytes, SHA-256."""

    path: str
    bytes: int
    sha256: str


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


def part_name(part: int) -> str:
    """File name of a part."""
    return f"part-{part:05d}.parquet"


def write_receipt(root: Path, receipt: Receipt) -> None:
    """Publish the receipt of a part: from now on the part exists."""
    publish_json(root / "receipts" / f"{receipt.name}-{receipt.part:05d}.json", asdict(receipt))


def read_receipts(root: Path, name: str) -> list[Receipt]:
    """Receipts of the finished parts of one kind, in order.

    Raises
    ------
    DatabaseError
        If a receipt cannot be read, or a file that it names is missing or has another size.
    """
    return [_read(root, path) for path in sorted((root / "receipts").glob(f"{name}-*.json"))]


def _read(root: Path, path: Path) -> Receipt:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        receipt = Receipt(**content | {"files": tuple(FileRecord(**record) for record in content["files"])})
    except (ValueError, TypeError, KeyError) as error:
        raise DatabaseError(
            f"{path}: not a readable receipt ({error}); delete it and run the same sweep again"
        ) from None
    for record in receipt.files:
        file = root / record.path
        size = file.stat().st_size if file.exists() else None
        if size != record.bytes:
            found = "is missing" if size is None else f"has {size} bytes"
            raise DatabaseError(
                f"{file} {found}, its receipt says {record.bytes} bytes; delete {path} and run the same sweep again"
            )
    return receipt
