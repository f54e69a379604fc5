"""Healthy rows of a database of recordings as the healthy recordings of a diagnosis."""

import json
from collections.abc import Hashable, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, Note
from sigdb.database import Database
from sigdb.database import open as open_database
from sigdb.diagnosis.stored_reference import NOTHING, Healthy
from sigdb.recording import MeshPresence, RecordedSignature
from sigdb.signature import INDICATORS

MOST_RECORDINGS = 48
"""Greatest number of healthy recordings that are compared; of more, so many evenly over their order."""


def healthy_rows(
    location: str | PathLike[str], *, where: str | None, teeth: int, channel: str, samples: int
) -> tuple[list[Healthy], tuple[Note, ...]]:
    """Return the healthy recordings of a gear by a channel that a database holds, and notes.

    Averages of one recording count as one: their groups of revolutions are those of the recording.

    Parameters
    ----------
    location
        A database of recordings.
    where
        Condition on its rows. With one, rows of unknown health count as healthy; without, only those labelled so.
    teeth
        Tooth count of the gear.
    channel
        Channel of the recording that is diagnosed; another one is taken if the database has no other.
    samples
        Samples of an average.

    Raises
    ------
    InputError
        If no row is left, or averages have another length.
    """
    with open_database(location) as database:
        if not database.manifest.is_measured:
            raise InputError(f"{location}: a database of simulated rows has no healthy recordings; give it as --db")
        health = "health <> 'damaged'" if where else "health = 'healthy'"
        condition = f"status = 'ok' and {health} and teeth = {teeth}" + (f" and ({where})" if where else "")
        rows = _of_channel(database.cases(condition), database, channel, condition)
        names = rows.drop_duplicates("recording")["recording"].tolist()
        chosen = [names[at] for at in np.unique(np.linspace(0, len(names) - 1, MOST_RECORDINGS).round().astype(int))]
        healthy = [_healthy(database, rows[rows["recording"] == name], samples) for name in chosen]
    return healthy, tuple(_notes(location, names, chosen))


def _of_channel(rows: pd.DataFrame, database: Database, channel: str, condition: str) -> pd.DataFrame:
    if rows.empty:
        raise InputError(f"{database.store}: no row meets {condition}; label healthy rows, or give --where")
    alike = rows[(rows["channel"] == channel) | (rows["sensor"] == channel)]
    if alike.empty and rows["channel"].nunique() == 1:
        return rows
    if alike.empty:
        channels = ", ".join(sorted(rows["channel"].unique()))
        raise InputError(f"{database.store}: no healthy row is of channel {channel!r}; its channels are {channels}")
    return alike


def _notes(location: str | PathLike[str], names: Sequence[str], chosen: Sequence[str]) -> list[Note]:
    text = f"{len(chosen)} of the {len(names)} healthy recordings of {location} were compared"
    values = {"chosen": len(chosen), "recordings": len(names)}
    return [Note(code="healthy-database", text=f"{text}.", values=values)]


def _healthy(database: Database, rows: pd.DataFrame, samples: int) -> Healthy:
    """Return a recording by the rows of its averages."""
    stored = database.signal_rows(rows["id"].to_numpy(), ["id", "tsa", "noise", "groups"]).to_pydict()
    lengths = {len(tsa) for tsa in stored["tsa"]}
    if lengths != {samples}:
        raise InputError(
            f"{database.store}: its averages have {', '.join(map(str, sorted(lengths)))} samples, and that of the "
            f"recording {samples}; average with as many samples a tooth"
        )
    groups = np.concatenate([np.reshape(each, (-1, samples)) for each in stored["groups"]]).astype(float)
    first: Mapping[Hashable, Any] = rows.iloc[0].to_dict()
    weights = rows["averages"].to_numpy(float)
    noise = np.sqrt(np.average(np.square(stored["noise"]), axis=0, weights=weights) / len(rows))
    signature = _signature(first, np.average(stored["tsa"], axis=0, weights=weights), noise, groups, rows)
    return Healthy(signature=signature, torque=_number(first["torque"]), load=_number(first["load"]))


def _signature(
    first: Mapping[Hashable, Any], tsa: FloatArray, noise: FloatArray, groups: FloatArray, rows: pd.DataFrame
) -> RecordedSignature:
    empty, notes = pd.DataFrame(), json.loads(first["notes"])
    return RecordedSignature(
        source=str(first["recording"]),
        channel=str(first["channel"]),
        unit=str(first["unit"]),
        gear=first["gear"] or None,
        shaft=first["shaft"] or None,
        teeth=int(first["teeth"]),
        angle=str(first["angle"]),
        absolute=bool(first["absolute"]),
        tsa=tsa,
        scatter=float(np.sqrt(np.mean(np.square(rows["scatter"])))),
        noise=noise,
        groups=groups,
        averages=int(rows["averages"].sum()),
        dropped=0,
        cycle=None,
        speed_rpm=float(rows["shaft_rpm"].mean()),
        speed_track=empty,
        kept=float(first["kept"]),
        presence=MeshPresence(present=True, reason="stored as present", p_value=float(first["presence_p"])),
        highest_order=float(rows["highest_order"].min()),
        order_spectrum=empty,
        record_spectrum=empty,
        lines=empty,
        indicators={name: float(first[name]) for name in INDICATORS if name in first},
        intervals=empty,
        envelope=NOTHING,
        shafts=empty,
        order_map=None,
        notes=tuple(Note(code=note["code"], text=note["text"], values=note.get("values", {})) for note in notes),
    )


def _number(value: float | None) -> float | None:
    return None if value is None or np.isnan(value) else float(value)
