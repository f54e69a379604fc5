"""The best possible detector, on the same rows at the same rate of false alarms."""

import numpy as np
import pandas as pd

from sigdb.recognition.bootstrap import Figure
from sigdb.recognition.metrics_detection import called_figures, detection_figures
from sigdb.recognition.pod import pod_figures


def detection_bound(log_odds: pd.Series, rows: pd.DataFrame, false_alarm_rate: float) -> dict[str, Figure]:
    """Figures of the detector by the Bayes rule's log odds of damage, as those of a model.

    Its threshold is the least that at most a share ``false_alarm_rate`` of the healthy rows exceeds, those rows
    themselves: the rule knows the law, and needs no others to set it. ``p_detected`` is no bound for a detector whose
    own rate differs.

    Parameters
    ----------
    log_odds
        By id, from ``rows`` of :class:`Bound`.
    rows
        The same rows with ``tooth``, severities and ``specimen``.
    false_alarm_rate
        Between 0 and 1.
    """
    score = log_odds.to_numpy(float)
    healthy = np.sort(score[rows["tooth"].to_numpy() == 0])[::-1]
    threshold = healthy[int(false_alarm_rate * len(healthy) * (1 + 1e-12))] if len(healthy) else np.inf
    figures = called_figures((score > threshold).astype(int), rows)
    return figures | detection_figures(score, rows) | pod_figures(score, rows)
