"""How well probabilities come true: log loss, Brier score, expected calibration error, reliability."""

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens

BINS = 10
"""Bins of equal width of the probability of the answer."""

ENOUGH = 20_000
"""Rows below which no expected calibration error is given: it is biased upward by the noise of its bins."""


def calibration_values(probabilities: FloatArray, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Of each row, log loss (nats) and Brier score, the sum over classes of squares of probability minus outcome."""
    true = rows["tooth"].to_numpy(int)
    of_truth = probabilities[np.arange(len(true)), true]
    return {
        "log_loss": -np.log(np.maximum(of_truth, np.finfo(float).tiny)),
        "brier": (probabilities**2).sum(axis=1) - 2 * of_truth + 1,
    }


def calibration_figures(probabilities: FloatArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """Log loss, Brier score, and the expected calibration error where there are :data:`ENOUGH` rows.

    Parameters
    ----------
    probabilities
        (rows, 1 + teeth) of 'none' and of each tooth.
    rows
        ``tooth`` and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    specimens = Specimens(rows["specimen"], seed=seed)
    figures = {name: specimens.mean(value) for name, value in calibration_values(probabilities, rows).items()}
    return figures | {"ece": calibration_error(probabilities, rows, specimens) if len(rows) >= ENOUGH else UNKNOWN}


def calibration_error(probabilities: FloatArray, rows: pd.DataFrame, specimens: Specimens) -> Estimate:
    """Expected calibration error of the answer: the mean over rows of |share that is right - mean probability| of bins.

    References
    ----------
    Guo et al., On calibration of modern neural networks, ICML 2017, eq. 3, arXiv:1706.04599.
    """
    confidence, right, bins = _answers(probabilities, rows)
    gaps = np.eye(BINS)[bins] * (right - confidence)[:, None]
    return specimens.figure(lambda gap, n: np.abs(gap).sum(axis=1) / n, gaps, np.ones(len(rows)))


def reliability(probabilities: FloatArray, rows: pd.DataFrame, *, seed: int = 0) -> pd.DataFrame:
    """Mean probability of the answer and the share that is right, bin by bin; bins without rows are left out."""
    specimens = Specimens(rows["specimen"], seed=seed)
    confidence, right, bins = _answers(probabilities, rows)
    table = []
    for one in np.unique(bins):
        inside = bins == one
        share = specimens.mean(np.where(inside, right, np.nan))
        table.append(
            {
                "probability": float(confidence[inside].mean()),
                "right": share.value,
                "low": share.low,
                "high": share.high,
                "rows": int(inside.sum()),
            }
        )
    return pd.DataFrame(table)


def _answers(probabilities: FloatArray, rows: pd.DataFrame) -> tuple[FloatArray, FloatArray, IntArray]:
    """Probability of the most probable class, whether it is right, and the bin of the probability."""
    confidence = probabilities.max(axis=1)
    right = (probabilities.argmax(axis=1) == rows["tooth"].to_numpy(int)).astype(float)
    return confidence, right, np.minimum((confidence * BINS).astype(int), BINS - 1)
