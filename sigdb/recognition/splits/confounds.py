"""Confounds of measured rows: what else than damage a model could learn."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, Note
from sigdb.database import Database
from sigdb.signature import INDICATORS

_COLUMNS = ("machine", "date", "load", "set", "sensor")
"""Columns that healthy rows may show."""

_FOLDS = 5
_CLEAR = 0.15
"""Balanced accuracy above chance from which on a confound is noted."""

_LEAST = 3
"""Least number of recordings of a value, so that some remain to be tested."""


@dataclass(frozen=True, kw_only=True)
class Confound:
    """How well healthy rows alone show a column.

    Attributes
    ----------
    column
        The column; dates are split at their median into earlier and later.
    values
        Number of its values.
    recordings
        Number of recordings.
    accuracy
        Balanced accuracy of a linear classifier on recordings that it has not seen.
    """

    column: str
    values: int
    recordings: int
    accuracy: float

    @property
    def chance(self) -> float:
        """Balanced accuracy of guesses."""
        return 1 / self.values

    @property
    def note(self) -> Note:
        """The confound as a note."""
        text = (
            f"Healthy rows alone show the {self.column} with a balanced accuracy of {self.accuracy:.2f} (chance "
            f"{self.chance:.2f}) on recordings that were not learnt from: unless the split is by {self.column}, a "
            f"model may answer by the {self.column} in place of damage."
        )
        values: dict[str, float | int | str] = {"column": self.column, "accuracy": self.accuracy, "chance": self.chance}
        return Note(code="confound", text=text, values=values)


def confounds(database: Database) -> tuple[Confound, ...]:
    """Return how well the healthy rows of a database of recordings show machine, date, load, set and sensor.

    A linear classifier of the standardised logarithms of the indicators is trained for each column, on folds that keep
    averages of one recording together. Columns with fewer than two values of three recordings each are left out.

    Parameters
    ----------
    database
        A database of recordings.
    """
    rows = indicator_rows(database, "tooth = 0")
    each = (_confound(rows, column) for column in _COLUMNS)
    return tuple(confound for confound in each if confound is not None)


def _confound(rows: pd.DataFrame, column: str) -> Confound | None:
    from sklearn.linear_model import LogisticRegression
    from sklearn.metrics import balanced_accuracy_score
    from sklearn.model_selection import StratifiedGroupKFold, cross_val_predict
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    rows = rows.assign(label=rows[column].astype(str))
    rows = rows[~rows["label"].isin(["", "nan", "None", "<NA>"])]
    if column == "date" and len(rows):
        middle = sorted(rows["label"])[len(rows) // 2]
        rows = rows.assign(label=np.where(rows["label"] > middle, "later", "earlier"))
    recordings = rows.groupby("label")["recording"].nunique()
    rows = rows[rows["label"].isin(recordings.index[recordings >= _LEAST])]
    labels = rows["label"].to_numpy()
    if rows["label"].nunique() < 2:
        return None
    folds = StratifiedGroupKFold(min(_FOLDS, int(recordings[recordings >= _LEAST].min())))
    model = make_pipeline(StandardScaler(), LogisticRegression(max_iter=1000, class_weight="balanced"))
    answers = cross_val_predict(model, logarithms(rows), labels, groups=rows["recording"], cv=folds)
    accuracy = float(balanced_accuracy_score(labels, answers))
    return Confound(
        column=column, values=rows["label"].nunique(), recordings=rows["recording"].nunique(), accuracy=accuracy
    )


def measured_notes(database: Database, evaluated: pd.DataFrame) -> Iterator[Note]:
    """Yield notes on an evaluation on measured rows: confounds and labels.

    Parameters
    ----------
    database
        A database of recordings.
    evaluated
        The evaluated rows, by id.
    """
    yield from (each.note for each in confounds(database) if each.accuracy > each.chance + _CLEAR)
    yield from _label_notes(evaluated)


def _label_notes(evaluated: pd.DataFrame) -> Iterator[Note]:
    """Yield a note for each column whose every value has healthy rows only, or damaged rows only."""
    for column in ("machine", "load", "set"):
        if column not in evaluated or evaluated[column].nunique() < 2:
            continue
        kinds = (evaluated["tooth"] > 0).groupby(evaluated[column]).nunique()
        if (kinds == 1).all() and (evaluated["tooth"] > 0).nunique() == 2:
            text = (
                f"No {column} has both healthy and damaged rows, so that nothing distinguishes a model of damage from "
                f"one of the {column}."
            )
            yield Note(code="label-is-column", text=text, values={"column": column})


def indicator_rows(database: Database, where: str) -> pd.DataFrame:
    """Return recording, tooth, the columns that healthy rows may show, and the indicators of rows with a result.

    A load that is not stated is the torque.
    """
    stored = database.dataset("features").schema.names
    names = [name for name in INDICATORS if name in stored]
    columns = ", ".join(f'"{name}"' for name in ("id", "recording", "tooth", "torque", *_COLUMNS, *names))
    rows = database.sql(f"select {columns} from features where status = 'ok' and {where} order by id").set_index("id")
    return rows.assign(load=rows["load"].fillna(rows["torque"]))


def logarithms(rows: pd.DataFrame) -> FloatArray:
    """Return the logarithms of the indicators, (rows, k); those with a value that is none are left out."""
    values = rows[[name for name in INDICATORS if name in rows]].to_numpy(float)
    return np.log(np.maximum(np.nan_to_num(values), 1e-12))
