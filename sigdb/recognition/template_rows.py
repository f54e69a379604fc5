"""Rows of a database reduced to template scores, batch by batch."""

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.database import Database
from sigdb.database.schema import suffixed
from sigdb.recognition.template_scores import SCORED, TemplateScores

_ROWS_AT_ONCE = 2048


def with_scores(database: Database, rows: pd.DataFrame, scores: TemplateScores) -> pd.DataFrame:
    """Rows, by id, with the column ``template_scores``; their averages are read and forgotten a batch at a time.

    Parameters
    ----------
    database
        Where the rows are from.
    rows
        By id, with ``teeth``, ``speed_rpm``, ``torque``, ``averages`` and ``scatter``.
    scores
        What reduces them.
    """
    tsa = suffixed("tsa", database.sensors, scores.bank.sensor)
    found: list[FloatArray] = []
    ids = []
    for batch in database.batches("status = 'ok'", table="signals", columns=["id", tsa], rows=_ROWS_AT_ONCE):
        here = batch["id"].to_numpy()
        wanted = np.isin(here, rows.index)
        if wanted.any():
            averages = pd.Series(batch[tsa].to_numpy(zero_copy_only=False)[wanted], index=here[wanted])
            found.append(scores.transform(rows.loc[here[wanted]].assign(tsa=averages)))
            ids.append(here[wanted])
    if not found:
        raise InputError(f"{database.store} has no averages of these rows; keep rows whose status is 'ok'")
    return rows.assign(**{SCORED: pd.Series(list(np.concatenate(found)), index=np.concatenate(ids))})


def with_averages(database: Database, rows: pd.DataFrame, scores: TemplateScores) -> pd.DataFrame:
    """A few rows, by id, with their averages ``tsa`` in place of what was made of them."""
    tsa = [database.signals([one], sensor=scores.bank.sensor)["tsa"][0] for one in rows.index]
    return rows.drop(columns=SCORED, errors="ignore").assign(tsa=tsa)
