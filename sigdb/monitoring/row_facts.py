"""Facts of the rows of a database of recordings, kept in the user's cache so that only new parts are read."""

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import publish
from sigdb.database import Database, cache_folder

PLAN = "plan"
"""Column with the hash of the plan of a row's part."""

_PARTS = b"parts"
"""Key of the metadata that says of which files the kept rows are."""

_SEAL = 32
"""Bytes of the SHA-256 before the rows, since Arrow may crash on a damaged file."""


def row_facts(database: Database, columns: Sequence[str], where: str | None = None) -> pd.DataFrame:
    """Return columns of the rows of a database, in the order of their ids, with the hash of their plan.

    Rows of parts whose files are as they were are taken from the user's cache.

    Parameters
    ----------
    database
        A database of recordings.
    columns
        Columns of the table ``features``, ``id`` among them.
    where
        A condition on the rows, in SQL.
    """
    receipts = {receipt.part: receipt for receipt in database.receipts("rows")}
    files = {str(part): receipt.file("features").sha256 for part, receipt in receipts.items()}
    place = _place(database, columns)
    kept, parts = _kept(place)
    same = {int(part) for part, sha256 in parts.items() if files.get(part) == sha256}
    part_rows = database.manifest.part_rows
    if kept is not None and len(same) < len(parts):
        kept = kept.filter(pa.array(np.isin(kept["id"].to_numpy() // part_rows, list(same))))
    batches = list(database.scan("features", columns, receipts.keys() - same))
    tables = [table for table in (kept, pa.Table.from_batches(batches) if batches else None) if table is not None]
    table = pa.concat_tables(tables).combine_chunks().sort_by("id")
    if batches or len(same) < len(parts):
        _keep(place, table, files)
    rows = table.to_pandas()
    if where is not None:
        chosen = [batch["id"].to_numpy() for batch in database.batches(where, table="features", columns=["id"])]
        rows = rows[np.isin(rows["id"], np.concatenate([[], *chosen]))]
    plans = {part: receipt.plan for part, receipt in receipts.items()}
    return rows.assign(**{PLAN: (rows["id"] // part_rows).map(plans)})


def _place(database: Database, columns: Sequence[str]) -> Path:
    text = json.dumps([database.manifest.plans[0].hash, *columns])
    return cache_folder() / f"monitor-rows-{hashlib.sha256(text.encode()).hexdigest()[:32]}.arrow"


def _kept(place: Path) -> tuple[pa.Table | None, dict[str, str]]:
    """Return the rows in a file, and the SHA-256 of the parts that they are of; nothing where it is not whole."""
    try:
        content = memoryview(place.read_bytes())
        if hashlib.sha256(content[_SEAL:]).digest() != content[:_SEAL]:
            return None, {}
        with pa.ipc.open_file(pa.BufferReader(content[_SEAL:])) as file:
            table = file.read_all()
        return table, json.loads(table.schema.metadata[_PARTS])
    except OSError:
        return None, {}


def _keep(place: Path, table: pa.Table, files: dict[str, str]) -> None:
    """Write rows; a cache that cannot be written costs time only."""
    sink = pa.BufferOutputStream()
    marked = table.replace_schema_metadata({_PARTS: json.dumps(files)})
    with pa.ipc.new_file(sink, marked.schema) as writer:
        writer.write_table(marked)
    with suppress(OSError):
        content = sink.getvalue().to_pybytes()
        publish(place, hashlib.sha256(content).digest() + content)
