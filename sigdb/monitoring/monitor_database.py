"""Monitoring of a database of recordings: the history of each gear by each sensor, with results that are kept."""

import hashlib
import io
import json
from collections.abc import Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import __version__, publish
from sigdb.database import Database, cache_folder
from sigdb.database import open as open_database
from sigdb.diagnosis import LevelChange, Power
from sigdb.monitoring.history import GearHistory, gear_history, healthy_looks
from sigdb.monitoring.look_results import KeptResults, LookResult
from sigdb.monitoring.looks import Look, recorded_looks
from sigdb.monitoring.settings import MonitorSettings
from sigdb.monitoring.tooth_growth import ToothGrowth
from sigdb.prognosis import RemainingLife

_TABLES = ("exceptions", "table")
_ARRAYS = ("harmonics", "mesh_db", "sidebands_db", "band_db")
_NUMBERS = ("misfit", "rest", "pulse", "tooth", "likeness", "rms", "record_rms", "speed_rpm", "common_db",
            "na4_star", "nb4_star")  # fmt: skip


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
    Results of looks are kept in the user's cache directory, or in that which ``SIGDB_CACHE`` names, for as long as the
    same looks are healthy: only new recordings are compared.
    """
    opened = database if isinstance(database, Database) else open_database(database)
    settings = settings or MonitorSettings()
    histories = []
    for place, looks in recorded_looks(opened, where):
        file = _file(place, looks, settings)
        kept = _read(file)
        before = (len(kept.looks), kept.power_limit, kept.level_of, kept.growth_of)
        histories.append(gear_history(looks, settings, place=place, kept=kept))
        if (len(kept.looks), kept.power_limit, kept.level_of, kept.growth_of) != before:
            _write(file, kept)
    return histories


def _file(place: dict[str, str], looks: Sequence[Look], settings: MonitorSettings) -> Path:
    """Return the file of the results against the healthy looks of a place."""
    healthy, _ = healthy_looks(looks, settings)
    keys = [look.key for look, good in zip(looks, healthy, strict=True) if good]
    text = json.dumps([place, keys, __version__], sort_keys=True)
    return cache_folder() / f"monitor-{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"


def _read(file: Path) -> KeptResults:
    """Return the results in a file; none where it does not exist or is not whole."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            keys, numbers, maps = (arrays[name] for name in ("keys", "numbers", "tooth_maps"))
            facts: dict[str, Any] = json.loads(str(arrays["power"]))
            level: dict[str, Any] = json.loads(str(arrays["level"]))
            growth: dict[str, Any] = json.loads(str(arrays["growth"]))
        results = {}
        for key, row, tooth_map in zip(keys.tolist(), numbers.tolist(), maps, strict=True):
            values: dict[str, Any] = dict(zip(_NUMBERS, row, strict=True))
            values["tooth"] = int(values["tooth"])
            results[key] = LookResult(**values, tooth_map=tooth_map)
        limit = float(facts.pop("limit"))
        facts |= {name: pd.DataFrame(facts[name]) for name in _TABLES}
        of, absolute = str(level.pop("of")), bool(level.pop("absolute"))
        level |= {name: np.array(level[name]) for name in _ARRAYS}
        growth_of, life = str(growth.pop("of")), growth.pop("life")
        growth |= {"statistic": np.array(growth["statistic"]), "life": None if life is None else RemainingLife(**life)}
        return KeptResults(
            looks=results,
            power=Power(**facts),
            power_limit=limit,
            level=LevelChange(**level | {"limit": float(level["limit"])}),
            level_of=of,
            absolute=absolute,
            growth=ToothGrowth(**growth),
            growth_of=growth_of,
        )
    except (OSError, ValueError, KeyError, TypeError, EOFError):
        return KeptResults()


def _write(file: Path, kept: KeptResults) -> None:
    """Write results; a cache that cannot be written costs time only."""
    if kept.power is None or kept.level is None or kept.growth is None:
        return
    life = None if kept.growth.life is None else vars(kept.growth.life)
    growth = vars(kept.growth) | {"statistic": kept.growth.statistic.tolist(), "life": life, "of": kept.growth_of}
    results, target = kept.looks, io.BytesIO()
    tables = {name: getattr(kept.power, name).to_dict("list") for name in _TABLES}
    arrays = {name: getattr(kept.level, name).tolist() for name in _ARRAYS}
    np.savez(
        target,
        keys=np.array(list(results)),
        numbers=np.array([[getattr(each, name) for name in _NUMBERS] for each in results.values()], float),
        tooth_maps=np.array([each.tooth_map for each in results.values()]),
        power=np.array(json.dumps(vars(kept.power) | tables | {"limit": kept.power_limit})),
        growth=np.array(json.dumps(growth)),
        level=np.array(json.dumps(vars(kept.level) | arrays | {"of": kept.level_of, "absolute": kept.absolute})),
    )
    with suppress(OSError):
        publish(file, target.getvalue())
