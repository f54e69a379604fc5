"""Detection beside the likelihood ratio: the smallest loss that is found."""

import numpy as np
import pandas as pd

from sigdb.recognition.answers import Answers
from sigdb.recognition.bayes_bound import Bound
from sigdb.recognition.bootstrap import UNKNOWN, Figure, columns_of, interval
from sigdb.recognition.pod import Pod, detection_by_loss

_COLUMNS = {"stiffness_loss", "phase_shift_deg"}


def of_detection(answers: Answers, rows: pd.DataFrame, best: Bound) -> dict[str, float]:
    """a90 at a false-alarm rate of 1e-3 of model and bound, by the same fit on the same rows, and their quotients.

    Of a model whose a90 is beyond the losses of the rows while the bound's is not, the quotient is infinite.
    """
    if answers.detection is None or not set(rows) >= _COLUMNS:
        return {}
    model = detection_by_loss(np.asarray(answers.detection), rows)
    bound = detection_by_loss(best.rows.loc[rows.index, "log_odds"].to_numpy(), rows)
    if model is None or bound is None:
        return columns_of(a90=UNKNOWN, bound_a90=UNKNOWN, a90_ratio=UNKNOWN) | {"a90_95_ratio": np.nan}
    return columns_of(a90=model.a90, bound_a90=bound.a90, a90_ratio=_smallest_loss_ratio(model, bound)) | {
        "a90_95_ratio": model.a90_95.value / bound.a90_95.value
    }


def _smallest_loss_ratio(model: Pod, bound: Pod) -> Figure:
    if np.isnan(model.a90.value) and not np.isnan(bound.a90.value):
        greatest = model.levels["found"].iloc[-1] < 0.9
        return Figure(value=np.inf, low=np.nan, high=np.nan) if greatest else UNKNOWN
    return interval(model.resampled / bound.resampled)
