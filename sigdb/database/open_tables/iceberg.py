"""Apache Iceberg: metadata in the folder of a table, and the entry of the table in a catalog."""

import json
import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import pyarrow as pa

from sigdb.core import InputError
from sigdb.database.open_tables.registered_files import DIGEST, OpenTable, RegisteredFiles, registered_files
from sigdb.database.store.schema import read_schema
from sigdb.database.store.store import Store
from sigdb.database.stored_tables import StoredTables

if TYPE_CHECKING:
    from pyiceberg.catalog import Catalog
    from pyiceberg.table import Table

_SQLITE = (".db", ".sqlite", ".sqlite3")
_METADATA = re.compile(r"[\w-]+(\.metadata\.json|\.avro)")


def register_iceberg(tables: StoredTables, catalog: str, *, namespace: str | None = None) -> tuple[OpenTable, ...]:
    """Register the tables of a database in an Iceberg catalog; see :meth:`Database.register_iceberg`."""
    every = list(registered_files(tables))
    place = namespace or re.sub(r"\W+", "_", every[0].folder.parent.name)
    if not re.fullmatch(r"\w+", place):
        raise InputError(f"namespace = {place!r} must be a name of letters, digits and underscores; give another one")
    schema = read_schema(tables.store)
    with _opened(catalog) as opened:
        opened.create_namespace_if_not_exists(place)
        old = {each.table: _owned(opened, catalog, place, each) for each in every}  # all are looked at before a change
        return tuple(
            _registered(tables.store, opened, place, each, old[each.table], schema.arrow(each.table)) for each in every
        )


@dataclass(frozen=True, kw_only=True)
class StoredMetadata:
    """The metadata file of a table that was written last.

    Attributes
    ----------
    name
        Its name in the store.
    digest
        Digest of the receipts in its current snapshot; empty without one.
    location
        Folder of the table when it was registered.
    """

    name: str
    digest: str
    location: Path

    @classmethod
    def of(cls, store: Store, table: str) -> Self | None:
        """Return that of a table of a database; None if it has none, or one that cannot be read."""
        contents = [
            (name, _read(store.get(name)))
            for name in store.sizes(f"{table}/metadata")
            if name.endswith(".metadata.json")
        ]
        if not contents:
            return None
        name, content = max(contents, key=lambda each: (each[1].get("last-updated-ms", 0), each[0]))
        current = content.get("current-snapshot-id")
        summaries = {each["snapshot-id"]: each.get("summary", {}) for each in content.get("snapshots", [])}
        digest = str(summaries.get(current, {}).get(DIGEST, ""))
        return cls(name=name, digest=digest, location=_path(str(content.get("location", ""))))

    def is_at(self, folder: Path) -> bool:
        """Return whether the table was registered at a folder."""
        return self.location == folder or (self.location.exists() and folder.samefile(self.location))


def _read(content: bytes) -> dict[str, Any]:
    try:
        read = json.loads(content)
    except ValueError:
        return {}
    return read if isinstance(read, dict) else {}


def _path(uri: str) -> Path:
    return Path(uri.removeprefix("file://"))


@contextmanager
def _opened(catalog: str) -> Iterator["Catalog"]:
    """Open a catalog by its name in pyiceberg's configuration, or the file of a SQLite catalog."""
    try:
        from pyiceberg.catalog import load_catalog
    except ImportError:
        raise InputError(
            "--iceberg needs pyiceberg, which is not installed: pip install 'pyiceberg[sql-sqlite]'"
        ) from None
    is_file = catalog.endswith(_SQLITE)
    if is_file and not Path(catalog).absolute().parent.is_dir():
        raise InputError(f"--iceberg {catalog}: its folder does not exist; make it, or give another catalog")
    options = {"type": "sql", "uri": f"sqlite:///{Path(catalog).absolute().as_posix()}"} if is_file else {}
    logger = logging.getLogger("pyiceberg")
    level = logger.level
    logger.setLevel(logging.ERROR)  # it warns of each column without statistics
    try:
        opened = load_catalog("sigdb" if is_file else catalog, **options)
    except Exception as error:  # of the client of any kind of catalog
        raise InputError(
            f"--iceberg {catalog}: the catalog cannot be opened ({str(error).splitlines()[0]}); give the name of one in"
            f" pyiceberg's configuration, or a SQLite file whose name ends in {', '.join(_SQLITE)}"
        ) from None
    try:
        yield opened
    finally:
        logger.setLevel(level)
        opened.close()


def _owned(opened: "Catalog", catalog: str, namespace: str, files: RegisteredFiles) -> "Table | str | None":
    """Return the table that a catalog has under the name of ours: its name alone if its metadata are gone.

    Raises
    ------
    InputError
        If it is another database's.
    """
    from pyiceberg.exceptions import NoSuchTableError

    name = f"{namespace}.{files.table}"
    try:
        table = opened.load_table(name)
    except NoSuchTableError:
        return None
    except OSError:  # the database was moved or deleted
        return name
    location = _path(table.location())
    if location.exists() and not (files.folder.exists() and files.folder.samefile(location)):
        raise InputError(
            f"--iceberg {catalog}: {name} is a table at {location}; give another name with --namespace, or drop it"
        )
    return table


def _registered(
    store: Store,
    opened: "Catalog",
    namespace: str,
    files: RegisteredFiles,
    old: "Table | str | None",
    schema: pa.Schema,
) -> OpenTable:
    name, stored = f"{namespace}.{files.table}", StoredMetadata.of(store, files.table)
    is_current = stored is not None and stored.digest == files.digest and stored.is_at(files.folder)
    if stored is not None and is_current:
        metadata = _uri(files.folder.parent / stored.name)
        if old is not None and not isinstance(old, str) and _path(old.metadata_location) == _path(metadata):
            return files.registered_as(name, is_new=False)
        if old is not None:
            opened.drop_table(name)
        opened.register_table(name, metadata)
        return files.registered_as(name, is_new=True)
    if old is not None:
        opened.drop_table(name)
    for path in store.sizes(f"{files.table}/metadata"):
        if _METADATA.fullmatch(path.rpartition("/")[2]):
            store.delete(path)
    table = opened.create_table(name, schema=schema, location=_uri(files.folder))
    table.add_files(
        [_uri(files.folder.parent / record.path) for record in files.records],
        snapshot_properties={DIGEST: files.digest},
        check_duplicate_files=False,
    )
    return files.registered_as(name, is_new=True)


def _uri(path: Path) -> str:
    """Return the URI of a path as pyiceberg takes it, which does not decode it."""
    return f"file://{path.as_posix()}"
