"""Calibration of probabilities: log loss, Brier score, expected calibration error, reliability."""

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens
from sigdb.recognition.metrics.metric import Kind, Metric

BINS = 10
"""Bins of equal width of the probability of the answer."""

ENOUGH = 20_000
"""Fewest rows of an expected calibration error: with fewer, the noise of its bins biases it upward."""


CALIBRATION_METRICS = (
    Metric(name="log_loss", title="log loss, nats", better=-1, bounded=True),
    Metric(name="brier", title="Brier score", better=-1, bounded=True),
    Metric(name="ece", title="calibration error (ECE)", kind=Kind.QUOTIENT, better=-1),
)
"""Metrics of probabilities."""


def calibration_values(probabilities: FloatArray, true: IntArray) -> dict[str, FloatArray]:
    """Return log loss (nats) and Brier score of each row.

    The Brier score is the sum over classes of the squares of probability minus outcome.

    Parameters
    ----------
    probabilities
        (rows, classes) of each class, such as 'none' and the teeth.
    true
        (rows,) place of the true class among these.
    """
    of_truth = probabilities[np.arange(len(true)), true]
    return {
        "log_loss": -np.log(np.maximum(of_truth, np.finfo(float).tiny)),
        "brier": (probabilities**2).sum(axis=1) - 2 * of_truth + 1,
    }


def calibration_error(probabilities: FloatArray, true: IntArray, specimens: Specimens) -> Estimate:
    """Estimate the expected calibration error: the mean over rows of |share correct - mean probability| of bins.

    Unknown with fewer than :data:`ENOUGH` rows.

    References
    ----------
    Guo et al., On calibration of modern neural networks, ICML 2017, eq. 3, arXiv:1706.04599.
    """
    if len(true) < ENOUGH:
        return UNKNOWN
    confidence, correct, bins = _answers(probabilities, true)
    gaps = np.eye(BINS)[bins] * (correct - confidence)[:, None]
    return specimens.estimate(lambda gap, n: np.abs(gap).sum(axis=1) / n, gaps, np.ones(len(true)))


def reliability(probabilities: FloatArray, true: IntArray, specimens: Specimens) -> pd.DataFrame:
    """Return the mean probability of the answer and the share correct, bin by bin, without empty bins."""
    confidence, correct, bins = _answers(probabilities, true)
    table = []
    for place in np.unique(bins):
        inside = bins == place
        share = specimens.mean(np.where(inside, correct, np.nan))
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


def _answers(probabilities: FloatArray, true: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the probability of the most probable class, whether it is correct, and the bin of the probability."""
    confidence = probabilities.max(axis=1)
    correct = (probabilities.argmax(axis=1) == true).astype(float)
    return confidence, correct, np.minimum((confidence * BINS).astype(int), BINS - 1)
