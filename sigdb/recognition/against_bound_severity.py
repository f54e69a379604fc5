"""Severity beside the posterior: its median, its mean and its quantiles."""

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray
from sigdb.recognition.bayes_bound import Bound
from sigdb.recognition.bootstrap import Figure, Specimens, columns_of
from sigdb.recognition.metrics import severity_values
from sigdb.recognition.severity import TARGETS


def of_severity(found: pd.DataFrame, rows: pd.DataFrame, best: Bound) -> list[dict[str, float | str]]:
    """A row for each target that varies; see :func:`against_bound`."""
    specimens = Specimens(rows["specimen"])
    known = best.rows.loc[rows.index]
    ours, bound = severity_values(found, rows), severity_values(posterior_answers(known), rows)
    return [
        {"target": target} | _beside(target, ours, bound, known[f"mean_{target}"].to_numpy(), rows, specimens)
        for target in TARGETS
        if rows[target].nunique() > 1
    ]


def posterior_answers(rows: pd.DataFrame) -> pd.DataFrame:
    """The posterior's median and interval of each target, as a model would answer.

    Scored by the same quantiles as a model, so that the two CRPS are of one kind.

    Parameters
    ----------
    rows
        :attr:`Bound.rows` of severity.
    """
    ends = {"": "median", "_low": "low", "_high": "high"}
    return pd.DataFrame(
        {f"{target}{end}": rows[f"{kind}_{target}"] for target in TARGETS for end, kind in ends.items()}
    )


def _beside(
    target: str,
    ours: dict[str, FloatArray],
    bound: dict[str, FloatArray],
    mean: FloatArray,
    rows: pd.DataFrame,
    specimens: Specimens,
) -> dict[str, float]:
    true = rows[target].to_numpy(float)
    error, best = ours[f"mae_{target}"], bound[f"mae_{target}"]
    return {"chance": float(np.abs(true - np.median(true)).mean())} | columns_of(
        error=specimens.mean(error),
        bound_error=specimens.mean(best),
        mae_ratio=_ratio(specimens, error, best),
        crps_ratio=_ratio(specimens, ours[f"crps_{target}"], bound[f"crps_{target}"]),
        rmse_ratio=specimens.figure(lambda a, b: np.sqrt(a / b), error**2, (mean - true) ** 2),
    )


def _ratio(specimens: Specimens, model: FloatArray, bound: FloatArray) -> Figure:
    return specimens.figure(np.divide, model, bound)
