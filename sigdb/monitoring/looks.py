"""Looks at a gear: one recording each, with its date, its load and what is known of its health."""

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import cast

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, InputError, IntArray
from sigdb.database import Database, Receipt
from sigdb.diagnosis import row_signature
from sigdb.monitoring.row_facts import row_facts
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
    *("status", "status_code", "source"),
)
_PLACE = ["machine", "gear", "teeth", "sensor", "channel"]
"""Columns that make a history."""

_NUMBERS = ("day", "torque", "load")
_OF_A_LOOK = ("recording", "sha256", "health", "kept", *_NUMBERS)


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


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedGear:
    """The recordings of a gear by a sensor in a database.

    Attributes
    ----------
    database
        The database.
    place
        Names of the machine, the gear and the sensor, as text.
    rows, numbers
        Facts of all rows in the order of their ids, and the numbers of its own among them.
    failed
        Numbers of rows without a result that may have been of it.
    parts
        Receipts of the parts of the database by their numbers.
    """

    database: Database
    place: dict[str, str]
    rows: pd.DataFrame
    numbers: IntArray
    failed: IntArray
    parts: dict[int, Receipt]

    @cached_property
    def content(self) -> str:
        """SHA-256 of what its looks depend on: its rows, and the plans and files of their parts."""
        ids = self.rows["id"].to_numpy()[np.concatenate([self.numbers, self.failed])]
        parts = [self.parts[part] for part in np.unique(ids // self.database.manifest.part_rows)]
        files = [[receipt.plan, *(file.sha256 for file in receipt.files)] for receipt in parts]
        text = json.dumps([self.database.manifest.hash, self.place, ids.tolist(), files], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def looks(self) -> list[Look]:
        """Return a look for each recording, the oldest first; in the order of their ids where one has no date."""
        looks = list(self._looks())
        if all(look.day is not None for look in looks):
            looks.sort(key=lambda look: (look.day or 0.0, look.name))
        return looks

    def newer_without_result(self) -> pd.DataFrame:
        """Return the rows without a result that are newer than the newest look, by their dates or else their ids."""
        usable, failed = (self.rows.take(numbers) for numbers in (self.numbers, self.failed))
        days, since = _days(usable["date"]), _days(failed["date"])
        dated = bool(days.notna().all() and since.notna().all())
        newer = since > days.max() if dated else failed["id"] > usable["id"].max()
        return failed[newer.to_numpy()]

    def _looks(self) -> Iterator[Look]:
        # Lists of plain values: a Series for each of ten thousand recordings takes a second.
        rows = self.rows.take(self.numbers)
        rows = rows.assign(day=_days(rows["date"]))
        ids, columns = rows["id"].tolist(), {name: rows[name].tolist() for name in _OF_A_LOOK}
        numbers = {name: [None if math.isnan(value) else value for value in columns[name]] for name in _NUMBERS}
        by_recording: dict[str, list[int]] = {}
        for number, name in enumerate(columns["recording"]):
            by_recording.setdefault(name, []).append(number)
        for name, of_recording in by_recording.items():
            first = of_recording[0]
            plan = self.parts[ids[first] // self.database.manifest.part_rows].plan
            yield Look(
                name=name,
                key=f"{name} {ids[first]} {len(of_recording)} {columns['sha256'][first]} {plan}",
                day=numbers["day"][first],
                torque=numbers["torque"][first],
                load=numbers["load"][first],
                health=columns["health"][first],
                kept=columns["kept"][first],
                read=partial(self._read, of_recording),
            )

    def _read(self, of_recording: list[int]) -> RecordedSignature:
        """Return the signature of the rows of a recording."""
        some = self.rows.iloc[self.numbers[of_recording]]
        facts = some.iloc[0].to_dict()
        samples = int(facts["teeth"]) * int(self.database.manifest.resolved["signature"]["samples_per_tooth"])
        return row_signature(self.database, some["id"].tolist(), facts | {"samples": samples})


def recorded_gears(database: Database, where: str | None = None) -> Iterator[RecordedGear]:
    """Yield each gear of each machine of a database by each sensor, in the order of their names.

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
    rows = rows.fillna({"teeth": 0}).astype({"teeth": int}).reset_index(drop=True)
    measured = (rows["source"] == "measured").to_numpy()
    has_result = (rows["status_code"] == "ok").to_numpy() & measured
    if not has_result.any():
        which = "" if where is None else f" where {where}"
        raise InputError(
            f"{database.store} has no usable row{which}: the column status says why rows have no result, and simulated "
            "rows have no revolutions to compare"
        )
    parts = {receipt.part: receipt for receipt in database.receipts("rows")}
    usable, others = np.flatnonzero(has_result), np.flatnonzero(measured & ~has_result)
    failed = rows.take(others)
    for key, numbers in sorted(rows.take(usable).groupby(_PLACE).indices.items()):
        place = dict(zip(_PLACE, map(str, cast(tuple[object, ...], key)), strict=True))
        yield RecordedGear(
            database=database,
            place=place,
            rows=rows,
            numbers=usable[np.asarray(numbers)],
            failed=others[_may_be_of(failed, place)] if others.size else others,
            parts=parts,
        )


def _may_be_of(rows: pd.DataFrame, place: dict[str, str]) -> BoolArray:
    """Return whether rows without a result are of a place: names that such a row lacks may be any."""
    may_be = np.array(rows["machine"] == place["machine"])
    for name in ("gear", "sensor", "channel"):
        may_be &= [place[name] in ("", *text.split("+")) if text else True for text in rows[name].tolist()]
    return np.asarray(may_be)


def _days(dates: pd.Series) -> pd.Series:
    """Return dates as days since 1970; nan where there is none."""
    times = pd.to_datetime(dates, errors="coerce", format="mixed", utc=True)
    return (times - pd.Timestamp("1970-01-01", tz="UTC")).dt.total_seconds() / 86400
