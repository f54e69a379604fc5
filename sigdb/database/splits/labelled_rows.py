"""Rows with a result whose damage is known, as splits take them."""

from collections.abc import Iterable

import pandas as pd

from sigdb.core import InputError
from sigdb.database.database import Database
from sigdb.database.splits.names import MEMBER, QUANTITIES
from sigdb.database.stored_tables import check_complete

CASE_COLUMNS = (
    *("tooth", *QUANTITIES, "specimen", "draw"),
    *("snr_db", "averages", "scatter", "teeth", "speed_rpm", "torque"),
)
"""Columns of a row that splits, estimators and evaluations need."""

_MEASURED = ("recording", "machine", "load", "set")
"""Columns by which measured rows are split."""


def labelled_rows(database: Database, condition: str = "", further: Iterable[str] = ()) -> pd.DataFrame:
    """Return the rows that have a result and a known tooth, by id, without arrays.

    The specimen of a measured row is its recording: averages of one recording are of the same teeth, mounting and day.
    A load that is not stated is the torque. A torque that is not known counts as 0, and a damaged row of an unknown
    number of damaged teeth as one of one.

    Parameters
    ----------
    database
        A finished database.
    condition
        SQL condition on further columns; all rows if left out.
    further
        Further columns of ``features`` to return.

    Raises
    ------
    DatabaseError
        If the sweep is not finished.
    InputError
        If no measured row has a result and a known tooth.
    """
    check_complete(database)
    member = (MEMBER,) if MEMBER in database.dataset("features").schema.names else ()
    measured = _MEASURED if database.manifest.is_measured else ()
    names = dict.fromkeys((*CASE_COLUMNS, *member, *measured, *further))
    columns = ", ".join(f'"{name}"' for name in names)
    where = " and ".join(filter(None, ["status = 'ok'", condition, "tooth is not null" if measured else ""]))
    rows = database.sql(f"select id, {columns} from features where {where} order by id").set_index("id")
    return _with_specimens(database, rows) if measured else rows


def _with_specimens(database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """Return measured rows with their recordings as specimens."""
    if rows.empty:
        raise InputError(f"{database.store}: no row has a result and a known tooth; enter labels with sigdb label")
    rows["specimen"] = pd.factorize(rows["recording"])[0]
    rows["load"] = rows["load"].fillna(rows["torque"])
    rows["torque"] = rows["torque"].fillna(0.0)
    rows["tooth"] = rows["tooth"].astype(int)
    rows["damaged_teeth"] = rows["damaged_teeth"].fillna((rows["tooth"] > 0).astype(float)).astype(int)
    return rows
