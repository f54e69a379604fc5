"""Verification of the registrations of a database: they are compared with its receipts and its place."""

from collections.abc import Iterable, Iterator

from sigdb.database.open_tables.delta_log import delta_digest
from sigdb.database.open_tables.iceberg import StoredMetadata
from sigdb.database.open_tables.registered_files import receipts_digest
from sigdb.database.store.integrity import IntegrityFinding
from sigdb.database.store.receipts import TABLES_OF, Receipt
from sigdb.database.store.store import Store


def check_open_tables(store: Store, receipts: Iterable[Receipt]) -> Iterator[IntegrityFinding]:
    """Yield a finding for each registration that is not that of the receipts, or of another place.

    Parameters
    ----------
    store
        Where the database lies.
    receipts
        Receipts of its finished parts.
    """
    by_kind: dict[str, list[Receipt]] = {}
    for receipt in receipts:
        by_kind.setdefault(receipt.name, []).append(receipt)
    for kind, tables in TABLES_OF.items():
        for table in tables:
            if any(receipt.is_virtual for receipt in by_kind.get(kind, [])):
                continue  # no registration can be of virtual rows
            digest = receipts_digest(table, by_kind.get(kind, []))
            yield from _delta(store, table, digest)
            yield from _iceberg(store, table, digest)


_OTHER = "registers other files than the receipts name"


def _delta(store: Store, table: str, digest: str) -> Iterator[IntegrityFinding]:
    if (registered := delta_digest(store, table)) is not None and registered != digest:
        yield _finding(f"{table}/_delta_log", _OTHER, f"sigdb export {store} --delta")


def _iceberg(store: Store, table: str, digest: str) -> Iterator[IntegrityFinding]:
    if (metadata := StoredMetadata.of(store, table)) is None:
        return
    remedy = f"sigdb export {store} --iceberg CATALOG"
    if metadata.digest != digest:
        yield _finding(metadata.name, _OTHER, remedy)
    elif store.folder is not None and not metadata.is_at(store.folder / table):
        yield _finding(metadata.name, f"registers the table at {metadata.location}, from where it was moved", remedy)


def _finding(file: str, what: str, command: str) -> IntegrityFinding:
    return IntegrityFinding(kind="unfinished", file=file, what=what, remedy=f"register it again with: {command}")
