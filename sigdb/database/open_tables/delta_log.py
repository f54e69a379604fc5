"""Delta Lake: a log in the folder of a table, which names its Parquet files by their paths below the folder."""

import json
from typing import Any

import pyarrow as pa

from sigdb.core import InputError
from sigdb.database.open_tables.registered_files import DIGEST, OpenTable, RegisteredFiles, registered_files
from sigdb.database.store.schema import read_schema
from sigdb.database.store.store import Store
from sigdb.database.stored_tables import StoredTables


def register_delta(tables: StoredTables) -> tuple[OpenTable, ...]:
    """Register the tables of a database as Delta tables; see :meth:`Database.register_delta`."""
    schema = read_schema(tables.store)
    return tuple(_registered(tables.store, files, schema.arrow(files.table)) for files in registered_files(tables))


def _registered(store: Store, files: RegisteredFiles, schema: pa.Schema) -> OpenTable:
    if delta_digest(store, files.table) == files.digest:
        return files.registered_as(str(files.folder), is_new=False)
    try:
        from deltalake import CommitProperties, Schema
        from deltalake.transaction import AddAction, create_table_with_add_actions
    except ImportError:
        raise InputError("--delta needs deltalake, which is not installed: pip install deltalake") from None
    actions = [
        AddAction(
            path=record.path.rpartition("/")[2],
            size=record.bytes,
            partition_values={},
            modification_time=(files.folder.parent / record.path).stat().st_mtime_ns // 10**6,
            data_change=True,
            stats=json.dumps({"numRecords": receipt.rows}),
        )
        for receipt, record in zip(files.receipts, files.records, strict=True)
    ]
    create_table_with_add_actions(
        str(files.folder),
        Schema.from_arrow(schema),
        actions,
        mode="overwrite",
        name=files.table,
        description=f"{files.table} of a sigdb database; do not write to it",
        commit_properties=CommitProperties(custom_metadata={DIGEST: files.digest}),
    )
    return files.registered_as(str(files.folder), is_new=True)


def delta_digest(store: Store, table: str) -> str | None:
    """Return the digest in the last commit of a table's log: empty if it has none, None if there is no log."""
    names = [name for name in store.sizes(f"{table}/_delta_log") if name.endswith(".json")]
    if not names:
        return None
    for line in store.get(max(names)).decode(errors="replace").splitlines():
        try:
            action: Any = json.loads(line)
        except ValueError:
            return ""
        if isinstance(action, dict) and isinstance(info := action.get("commitInfo"), dict):
            return str(info.get(DIGEST, ""))
    return ""
