"""Looks at a gear: one recording each, with its date, its load and what is known of its health."""

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd
import pyarrow as pa

from sigdb.core import InputError
from sigdb.database import Database
from sigdb.diagnosis import row_signature
from sigdb.recording import RecordedSignature

_FACTS = (
    *("id", "recording", "machine", "gear", "teeth", "sensor", "channel", "unit", "date", "draw", "shaft_rpm"),
    *("torque", "load", "health", "angle", "absolute", "kept", "highest_order", "presence_p", "averages", "scatter"),
    "status_code",
)
_PLACE = ["machine", "gear", "teeth", "sensor", "channel"]
"""Columns that make a history."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """One recording of a gear by one sensor.

    Attributes
    ----------
    name
        The recording.
    key
        Text that differs wherever the look does, for results that are kept.
    day
        Time in days since 1970; None without a date.
    torque, load
        Torque, N m, and load in any one unit, where known.
    health
        ``healthy``, ``damaged`` or ``unknown``, by its labels.
    kept
        Standard deviation of the average over that of the record.
    read
        Returns its signature.
    """

    name: str
    key: str
    day: float | None
    torque: float | None
    load: float | None
    health: str
    kept: float
    read: Callable[[], RecordedSignature]


def recorded_looks(database: Database, where: str | None = None) -> Iterator[tuple[dict[str, str], list[Look]]]:
    """Yield the looks at each gear by each sensor of a database, the oldest first, with the names of the place.

    Parameters
    ----------
    database
        A database of recordings.
    where
        A condition on its rows, in SQL.

    Raises
    ------
    InputError
        If the database holds simulated rows, or none that meets the condition.
    """
    names = set(database.dataset("features").schema.names)
    if missing := [name for name in _FACTS if name not in names]:
        raise InputError(
            f"{database.store} has no column {missing[0]}: it is no database of recordings; make one with sigdb ingest"
        )
    batches = list(database.batches(where, table="features", columns=list(_FACTS)))
    rows = pa.Table.from_batches(batches).to_pandas() if batches else pd.DataFrame(columns=list(_FACTS))
    rows = rows[rows["status_code"] == "ok"].sort_values("id").reset_index(drop=True)
    if rows.empty:
        raise InputError(f"{database.store} has no usable row{'' if where is None else f' where {where}'}")
    samples = int(database.manifest.resolved["signature"]["samples_per_tooth"])
    rows["samples"] = rows["teeth"] * samples
    rows["day"] = (pd.to_datetime(rows["date"], errors="coerce", format="mixed", utc=True)
                   - pd.Timestamp("1970-01-01", tz="UTC")).dt.total_seconds() / 86400  # fmt: skip
    # Plain values: a table of a few rows for each of ten thousand recordings takes a second.
    by_place: dict[tuple[Any, ...], dict[str, list[dict[Hashable, Any]]]] = {}
    for row in rows.to_dict("records"):
        recordings = by_place.setdefault(tuple(row[name] for name in _PLACE), {})
        recordings.setdefault(row["recording"], []).append(row)
    for place, recorded in sorted(by_place.items()):
        looks = [_look(database, some) for some in recorded.values()]
        if all(look.day is not None for look in looks):
            looks.sort(key=lambda look: (look.day or 0.0, look.name))
        yield dict(zip(_PLACE, map(str, place), strict=True)), looks


def _look(database: Database, rows: list[dict[Hashable, Any]]) -> Look:
    first, ids = rows[0], [int(each["id"]) for each in rows]
    day, torque, load = (None if pd.isna(first[name]) else float(first[name]) for name in ("day", "torque", "load"))
    return Look(
        name=str(first["recording"]),
        key=f"{first['recording']} {ids[0]} {len(ids)}",
        day=day,
        torque=torque,
        load=load,
        health=str(first["health"]),
        kept=float(first["kept"]),
        read=partial(row_signature, database, ids, first),
    )
