"""A detector that knows healthy rows only: the least that a model of damage must surpass on measured rows."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, Note
from sigdb.database import Database
from sigdb.recognition.answers import Answers
from sigdb.recognition.splits.confounds import indicator_rows, logarithms
from sigdb.signature import INDICATORS

HEALTHY_ONLY = "healthy_only"
"""Its name among the estimators of an evaluation."""

_LEAST = 2 * len(INDICATORS) // 3
"""Least number of healthy rows that deviations are taken from."""


def healthy_only_answers(database: Database, evaluated: pd.DataFrame, false_alarm_rate: float) -> Answers | None:
    """Return the answers of a detector that knows healthy rows only to rows of a database of recordings.

    The score is the mean square of the standardised logarithms of the indicators, with mean and deviation of healthy
    rows of recordings that are not evaluated; where these are too few, of all healthy recordings but the row's own. The
    threshold is the quantile of the scores of healthy rows, each against those of the other recordings.

    Parameters
    ----------
    database
        A database of recordings.
    evaluated
        The evaluated rows, by id.
    false_alarm_rate
        Rate at which the threshold is set.

    Returns
    -------
    Answers or None
        1 for damage and 0 for none, with scores above 0 for damage; None where there are too few healthy rows.
    """
    rows = indicator_rows(database, "tooth is not null")
    values, recording = logarithms(rows), rows["recording"].to_numpy()
    healthy, tested = (rows["tooth"] == 0).to_numpy(), rows.index.isin(evaluated.index)
    others = healthy & ~np.isin(recording, recording[tested])
    reference = others if others.sum() >= _LEAST and len(np.unique(recording[others])) > 1 else healthy
    scores = _scores(values, recording, reference)
    if scores is None:
        return None
    threshold = float(np.quantile(scores[reference], 1 - false_alarm_rate, method="higher"))
    score = pd.Series(np.log(scores / threshold), index=rows.index).loc[evaluated.index].to_numpy()
    return Answers(predicted=(score > 0).astype(int), scores=score)


def _scores(values: FloatArray, recording: np.ndarray, reference: np.ndarray) -> FloatArray | None:
    """Return the mean squares (rows,) of values against those of the reference that are of other recordings."""
    results = np.empty(len(values))
    for name in np.unique(recording):
        of_it = recording == name
        others = values[reference & ~of_it]
        if len(others) < _LEAST:
            return None
        deviation = np.maximum(others.std(axis=0, ddof=1), 1e-12)
        results[of_it] = np.mean(((values[of_it] - others.mean(axis=0)) / deviation) ** 2, axis=1)
    return np.maximum(results, np.finfo(float).tiny)


def healthy_only_notes(answers: Answers, evaluated: pd.DataFrame) -> Iterator[Note]:
    """Yield a note on how well the detector separates damaged from healthy rows, where there are both."""
    from sklearn.metrics import roc_auc_score

    damaged = (evaluated["tooth"] > 0).to_numpy()
    if answers.scores is None or damaged.all() or not damaged.any():
        return
    area = float(roc_auc_score(damaged, answers.scores))
    text = (
        "A detector that knows healthy rows only, by the distance of the indicators from those of other healthy "
        f"recordings, separates the damaged from the healthy rows with an area under the curve of {area:.3f}."
    )
    yield Note(code="healthy-only", text=text, values={"area": area})
