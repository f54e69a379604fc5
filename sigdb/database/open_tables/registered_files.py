"""Registration of a table of a database: the receipts that it stands for, its log, and its names in the store."""

import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import InputError
from sigdb.database.store.receipts import TABLES_OF, FileRecord, Receipt
from sigdb.database.store.store import Store
from sigdb.database.stored_tables import StoredTables

DIGEST = "sigdb.receipts"
"""Key of the digest of the receipts in a log."""

_LOGS = re.compile(
    r"(features|signals|templates)/(_delta_log/(\d{20}(\.checkpoint)?\.(json|parquet|crc)|_last_checkpoint)"
    r"|metadata/[\w-]+(\.metadata\.json|\.avro))"
)


@dataclass(frozen=True, kw_only=True)
class OpenTable:
    """A table of a database in an open format, whose data are the Parquet files of the database.

    Attributes
    ----------
    table : str
        Table of the database: ``features``, ``signals`` or ``templates``.
    place : str
        Place by which the format's readers find it: a folder, or a name in a catalog.
    files, rows : int
        Numbers of its files and rows.
    digest : str
        SHA-256 of what the receipts state of its files.
    is_new : bool
        Whether it was registered now; False if the same files were registered before.
    """

    table: str
    place: str
    files: int
    rows: int
    digest: str
    is_new: bool

    def __str__(self) -> str:
        done = "registered" if self.is_new else "was registered before"
        return f"{self.table}: {self.rows} rows in {self.files} files, {done} as {self.place}"


@dataclass(frozen=True, kw_only=True)
class RegisteredFiles:
    """The files of a table that a registration names.

    Attributes
    ----------
    table
        Name of the table.
    folder
        Folder that holds them.
    receipts
        Receipts of its finished parts, in order.
    """

    table: str
    folder: Path
    receipts: tuple[Receipt, ...]

    @property
    def records(self) -> list[FileRecord]:
        """Records of the files, in the order of the parts."""
        return [receipt.file(self.table) for receipt in self.receipts]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return sum(receipt.rows for receipt in self.receipts)

    @property
    def digest(self) -> str:
        """Digest of the receipts."""
        return receipts_digest(self.table, self.receipts)

    def registered_as(self, place: str, *, is_new: bool) -> OpenTable:
        """Return the table that they were registered as."""
        return OpenTable(
            table=self.table,
            place=place,
            files=len(self.receipts),
            rows=self.rows,
            digest=self.digest,
            is_new=is_new,
        )


def receipts_digest(table: str, receipts: Sequence[Receipt]) -> str:
    """Return the SHA-256 of names, sizes and SHA-256s of a table's files, which follow the numbers of the parts."""
    records = [receipt.file(table) for receipt in sorted(receipts, key=lambda receipt: receipt.part)]
    return hashlib.sha256(json.dumps([[each.path, each.bytes, each.sha256] for each in records]).encode()).hexdigest()


def registered_files(tables: StoredTables) -> Iterator[RegisteredFiles]:
    """Yield the files of each table of a database that has any.

    Raises
    ------
    InputError
        If the database lies in an object store, or nothing of it is finished.
    """
    folder = tables.store.folder
    if folder is None:
        raise InputError(f"{tables.store}: tables are registered for a database in a directory; copy it into one")
    if any(receipt.is_virtual for receipt in tables.receipts("rows")):
        raise InputError(
            f"{tables.store}: its rows are virtual, and a registration needs files; make them first with: sigdb sweep "
            "RECIPE --materialise"
        )
    present = [(name, kind) for kind, names in TABLES_OF.items() for name in names if tables.receipts(kind)]
    if not present:
        raise InputError(f"{tables.store}: nothing is finished yet; run the {tables.work} that makes this database")
    for name, kind in present:
        yield RegisteredFiles(table=name, folder=folder / name, receipts=tuple(tables.receipts(kind)))


def log_files(store: Store) -> list[str]:
    """Return the names of the files of logs in a database."""
    return [name for name in store.sizes() if _LOGS.fullmatch(name)]
