"""Monitoring of a database of recordings: the history of each gear by each sensor, with results that are kept."""

import hashlib
import json
from dataclasses import replace
from os import PathLike

import pandas as pd

from sigdb.core import Answer, Note
from sigdb.database import Database
from sigdb.database import open as open_database
from sigdb.monitoring.history import GearHistory, gear_history, healthy_looks
from sigdb.monitoring.kept_histories import KeptHistories
from sigdb.monitoring.kept_results import KeptResults
from sigdb.monitoring.kept_table import kept_place
from sigdb.monitoring.looks import RecordedGear, recorded_gears
from sigdb.monitoring.settings import MonitorSettings


def monitor(
    database: Database | str | PathLike[str],
    settings: MonitorSettings | None = None,
    *,
    where: str | None = None,
) -> list[GearHistory]:
    """Return the history of each gear of each machine by each sensor.

    Parameters
    ----------
    database : Database, str or path-like
        A database of recordings, or its place.
    settings : MonitorSettings, optional
        Rate of false alarms, healthy looks and zones.
    where : str, optional
        A condition on its rows, in SQL.

    Returns
    -------
    list of GearHistory
        In the order of machine, gear and sensor.

    Raises
    ------
    InputError
        If the database holds no recordings, or none that meets the condition.

    Notes
    -----
    Histories are kept in the user's cache directory, or in that which ``SIGDB_CACHE`` names. One whose rows, settings
    and version of sigdb are as they were is taken from there. In another one, only new recordings are compared as long
    as the same looks are healthy.
    """
    opened = database if isinstance(database, Database) else open_database(database)
    settings = settings or MonitorSettings()
    stated = settings.model_dump(mode="json")
    kept = KeptHistories(kept_place("histories", stated, opened.manifest.hash, where))
    histories: dict[str, GearHistory] = {}
    for gear in recorded_gears(opened, where):
        content = hashlib.sha256(json.dumps([stated, gear.content]).encode()).hexdigest()
        histories[content] = kept[content] if content in kept else _history(gear, settings)
    kept.keep(histories)
    return list(histories.values())


def _history(gear: RecordedGear, settings: MonitorSettings) -> GearHistory:
    """Return the history of a gear; looks are compared that were not against the same healthy ones."""
    looks = gear.looks()
    healthy, _ = healthy_looks(looks, settings)
    keys = [look.key for look, good in zip(looks, healthy, strict=True) if good]
    kept = KeptResults.read(kept_place("looks", gear.place, keys))
    history = gear_history(looks, settings, place=gear.place, kept=kept)
    kept.write()
    return _with_newer(history, gear.newer_without_result(), looks[-1].name)


def _with_newer(history: GearHistory, newer: pd.DataFrame, last: str) -> GearHistory:
    """Return a history that says which newer recordings have no result; without an alarm it then has no answer."""
    if newer.empty:
        return history
    names = newer["recording"].unique()
    text = (
        f"{len(names)} newer recording{'s have' if len(names) > 1 else ' has'} no result, the last is {names[-1]}: "
        f"{newer['status'].iloc[-1]}"
    )
    note = Note(code="newer-without-result", text=f"{text}.", values={"recordings": len(names)})
    answer = history.answer
    if not answer.exit_code:
        answer = Answer.of("cannot be judged", reason=f"{text}; at {last}: {answer.sentence.removesuffix('.')}")
    return replace(history, answer=answer, notes=(*history.notes, note))
