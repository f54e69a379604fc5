"""Facts of the rows of a database of recordings, kept in the user's cache so that only new parts are read."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.database import Database
from sigdb.monitoring.kept_table import keep_table, kept_place, kept_table


def row_facts(database: Database, columns: Sequence[str], where: str | None = None) -> pd.DataFrame:
    """Return columns of the rows of a database, in the order of their ids.

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
    files = {str(part): receipt.sha256_of("features") for part, receipt in receipts.items()}
    place = kept_place("rows", database.manifest.hash, *columns)
    kept, parts = kept_table(place)
    parts = parts or {}
    same = {int(part) for part, sha256 in parts.items() if files.get(part) == sha256}
    part_rows = database.manifest.part_rows
    if kept is not None and len(same) < len(parts):
        kept = kept.filter(pa.array(np.isin(kept["id"].to_numpy() // part_rows, list(same))))
    batches = list(database.scan("features", columns, receipts.keys() - same))
    tables = [table for table in (kept, pa.Table.from_batches(batches) if batches else None) if table is not None]
    table = pa.concat_tables(tables).combine_chunks().sort_by("id")
    if batches or len(same) < len(parts):
        keep_table(place, table, files)
    rows = table.to_pandas()
    if where is None:
        return rows
    chosen = [batch["id"].to_numpy() for batch in database.batches(where, table="features", columns=["id"])]
    return rows[np.isin(rows["id"], np.concatenate([[], *chosen]))]
