"""The Bayes rule at work: what it says of averages, and what that loses against the truth."""

from collections.abc import Callable, Iterable, Mapping

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.recognition.templates.posterior import Posterior

LOSSES: Mapping[str, tuple[str, ...]] = {
    "location": ("error", "log_loss"),
    "severity": tuple(f"{kind}_{target}" for kind in ("absolute", "square", "crps") for target in QUANTITIES),
}
"""Losses of a row that the Bayes rule makes as small as they can be on average."""


def judge(point: OperatingPoint, parts: Iterable[tuple[pd.DataFrame, FloatArray]], target: str) -> pd.DataFrame:
    """What the Bayes rule says of averages, and its losses: the columns that :class:`Bound` names, and ``score_0`` ....

    Parameters
    ----------
    point
        Where they were taken.
    parts
        Rows with their averages (rows, n).
    target
        ``location`` or ``severity``.
    """
    return pd.concat(_JUDGE[target](point, rows, point.posterior(x, rows)) for rows, x in parts)


def _location(point: OperatingPoint, rows: pd.DataFrame, known: Posterior) -> pd.DataFrame:
    true, found = rows["tooth"].to_numpy(), known.tooth
    scores = {f"score_{tooth}": score for tooth, score in enumerate(known.location.T)}
    return rows[["tooth", "teeth", "specimen"]].assign(
        found=found,
        log_odds=known.log_odds,
        risk=known.risk,
        entropy=known.entropy,
        error=(found != true).astype(float),
        log_loss=-known.location[np.arange(len(rows)), true],
        **scores,
    )


def _severity(point: OperatingPoint, rows: pd.DataFrame, known: Posterior) -> pd.DataFrame:
    columns: dict[str, FloatArray] = {}
    for target in QUANTITIES:
        # Templates with a pattern have no severity; they have no share in the rows either.
        level = np.nan_to_num(point.hypotheses.cases[target].to_numpy(float))
        true, mean, median = rows[target].to_numpy(float), known.mean(level), known.median(level)
        columns |= {
            f"mean_{target}": mean,
            f"median_{target}": median,
            f"low_{target}": known.quantile(level, (1 - COVERAGE) / 2),
            f"high_{target}": known.quantile(level, (1 + COVERAGE) / 2),
            f"absolute_{target}": np.abs(median - true),
            f"square_{target}": (mean - true) ** 2,
            f"crps_{target}": known.crps(level, true),
        }
    return rows[["tooth", "teeth", "specimen"]].assign(**columns)


_JUDGE: dict[str, Callable[[OperatingPoint, pd.DataFrame, Posterior], pd.DataFrame]] = {
    "location": _location,
    "severity": _severity,
}
