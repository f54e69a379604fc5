"""One answer for each machine of a database, by its own templates or by trained models."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from sigdb.core import InputError
from sigdb.database import QUANTITIES, Database, suffixed
from sigdb.recognition import Model, fuse, fuse_models, load_model

_MACHINE = ("specimen", "tooth", *QUANTITIES, "pattern")
"""Columns that tell machines of a simulated database apart."""
_READ = ("speed_rpm", "torque", "teeth", "averages")


def fuse_rows(
    database: Database,
    *,
    models: Sequence[str] = (),
    by: str | None = None,
    where: str | None = None,
    sensors: Sequence[str] = (),
    over: Sequence[str] | None = None,
) -> tuple[pd.DataFrame, str]:
    """Return one answer for each machine of a database, and a sentence on them.

    Parameters
    ----------
    database
        A database with rows.
    models
        Folders or names of models, one for each sensor, see :func:`sigdb.recognition.fuse_models`; the database's own
        templates if left out, see :func:`sigdb.recognition.fuse`.
    by
        Columns that name the machine of a row, with commas between, for models. By default specimen and damage.
    where
        Only rows that meet this SQL condition.
    sensors, over
        As of :func:`sigdb.recognition.fuse`, for the database's own templates.

    Raises
    ------
    InputError
        If no row with a result meets the condition, or options of both kinds are given.
    """
    rows = database.cases(where)
    rows = rows[rows["status"] == "ok"].set_index("id")
    if rows.empty:
        raise InputError(f"{database.store} has no row with a result{f' where {where}' if where else ''}")
    if not models:
        if by is not None:
            raise InputError("--by is for models; the database's own templates know the machines")
        options = {} if over is None else {"over": over}
        fusion = fuse(database, rows.index.to_numpy(), sensors=sensors or None, **options)
        note = f"right in {fusion.accuracy} of {len(fusion.machines)} machines, by the best possible rule"
        return fusion.machines, note
    if sensors or over is not None:
        raise InputError("--sensor and --over are for the database's own templates; a model has its sensor")
    columns = [name.strip() for name in by.split(",")] if by is not None else [*_MACHINE]
    if lacking := [name for name in columns if name not in rows]:
        raise InputError(f"by = {lacking[0]!r} is no column of the rows of {database.store}")
    rows["machine"] = rows.groupby(columns, dropna=False).ngroup()
    loaded = [load_model(model) for model in models]
    answers = fuse_models([(model, _rows_of(database, model, rows)) for model in loaded])
    truth = rows.groupby("machine")[columns].first()
    both = {name: f"{name}_answer" for name in answers if name in truth}
    return truth.join(answers.rename(columns=both)), f"{len(answers)} machines"


def _rows_of(database: Database, model: Model, rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that a model reads, with the averages of its sensor."""
    sensor, ids = database.stored_sensor(model.sensor), rows.index.to_numpy()
    scatter = suffixed("scatter", database.sensors, sensor)
    measured = database.sql(f'select id, "{scatter}" as scatter from features').set_index("id")["scatter"]
    order = np.argsort(ids)
    tsa = database.signals(ids[order], sensor=sensor)["tsa"]
    table = rows[[*_READ, "machine"]].iloc[order]
    return table.assign(scatter=measured.loc[table.index].to_numpy(), tsa=list(tsa))
