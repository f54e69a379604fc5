"""Looks at a gear: one recording each, with its date, its load and what is known of its health."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import pandas as pd

from sigdb.core import InputError
from sigdb.database import Database
from sigdb.diagnosis import row_signature
from sigdb.monitoring.row_facts import PLAN, row_facts
from sigdb.recording import RecordedSignature

_FACTS = (
    *(
        "id",
        "recording",
        "sha256",
        "machine",
        "gear",
        "teeth",
        "sensor",
        "channel",
        "unit",
        "date",
        "draw",
        "shaft_rpm",
    ),
    *("torque", "load", "health", "angle", "absolute", "kept", "highest_order", "presence_p", "averages", "scatter"),
    "status_code",
)
_PLACE = ["machine", "gear", "teeth", "sensor", "channel"]
"""Columns that make a history."""

_NUMBERS = ("day", "torque", "load")
_OF_A_LOOK = ("recording", "sha256", PLAN, "health", "kept", *_NUMBERS)


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
    rows = row_facts(database, _FACTS, where)
    rows = rows[rows["status_code"] == "ok"].astype({"teeth": int}).reset_index(drop=True)
    if rows.empty:
        raise InputError(f"{database.store} has no usable row{'' if where is None else f' where {where}'}")
    rows["samples"] = rows["teeth"] * int(database.manifest.resolved["signature"]["samples_per_tooth"])
    rows["day"] = _days(rows["date"])
    for place, some in rows.groupby(_PLACE, sort=True):
        looks = list(_looks(database, some.reset_index(drop=True)))
        if all(look.day is not None for look in looks):
            looks.sort(key=lambda look: (look.day or 0.0, look.name))
        yield dict(zip(_PLACE, map(str, place), strict=True)), looks


def _days(dates: pd.Series) -> pd.Series:
    """Return dates as days since 1970; nan where there is none."""
    times = pd.to_datetime(dates, errors="coerce", format="mixed", utc=True)
    return (times - pd.Timestamp("1970-01-01", tz="UTC")).dt.total_seconds() / 86400


def _looks(database: Database, rows: pd.DataFrame) -> Iterator[Look]:
    """Yield the looks of the rows of a history, one for each recording."""
    # Lists of plain values: a Series for each of ten thousand recordings takes a second.
    ids, columns = rows["id"].to_numpy(), {name: rows[name].tolist() for name in _OF_A_LOOK}
    numbers = {name: [None if math.isnan(value) else value for value in columns[name]] for name in _NUMBERS}
    by_recording: dict[str, list[int]] = {}
    for number, name in enumerate(columns["recording"]):
        by_recording.setdefault(name, []).append(number)
    for name, of_recording in by_recording.items():
        first = of_recording[0]
        yield Look(
            name=name,
            key=f"{name} {ids[first]} {len(of_recording)} {columns['sha256'][first]} {columns[PLAN][first]}",
            day=numbers["day"][first],
            torque=numbers["torque"][first],
            load=numbers["load"][first],
            health=columns["health"][first],
            kept=columns["kept"][first],
            read=partial(_read, database, rows, of_recording),
        )


def _read(database: Database, rows: pd.DataFrame, of_recording: list[int]) -> RecordedSignature:
    """Return the signature of the rows of a recording."""
    some = rows.iloc[of_recording]
    return row_signature(database, some["id"].tolist(), some.iloc[0].to_dict())
