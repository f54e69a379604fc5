"""Tables of detection: receiver operating characteristics, and detection against stiffness loss."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.metrics.detection import RATES, is_resolved, roc
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.probability_of_detection import LOSS_COLUMNS, RATE, Pod, detection_by_loss

BOUND = "bound"
"""Name of the Bayes rule among the estimators of a table."""


def detection_tables(evaluated: Mapping[str, Evaluated], bound: Bound | None) -> dict[str, pd.DataFrame]:
    """Return the tables ``roc``, ``pod`` and ``pod_curve`` of the estimators that have a score of damage.

    Parameters
    ----------
    evaluated
        Evaluated rows by estimator.
    bound
        Bound of the rows, whose characteristic goes into ``roc``; None without one.
    """
    scored = {name: each for name, each in evaluated.items() if each.score is not None}
    tables = {"roc": by_estimator({name: _roc(each) for name, each in scored.items()})}
    if bound is not None and len(tables["roc"]):
        best = _bound_roc(bound, next(iter(scored.values())))
        tables["roc"] = pd.concat([tables["roc"], best.assign(estimator=BOUND)], ignore_index=True)
    pods = {name: pod for name, each in scored.items() if (pod := _pod(each)) is not None}
    if pods:
        levels = {name: pod.levels.assign(false_alarm_rate=pod.rate) for name, pod in pods.items()}
        tables["pod"] = by_estimator(levels)
        tables["pod_curve"] = by_estimator({name: _curve(pod) for name, pod in pods.items()})
    return tables


def by_estimator(frames: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return frames one below the other, with the name of the estimator in each row."""
    named = [frame.assign(estimator=name) for name, frame in frames.items() if len(frame)]
    return pd.concat(named, ignore_index=True) if named else pd.DataFrame()


def _roc(evaluated: Evaluated) -> pd.DataFrame:
    return pd.DataFrame() if evaluated.score is None else roc(evaluated.score, evaluated.healthy, evaluated.specimens)


def _bound_roc(bound: Bound, evaluated: Evaluated) -> pd.DataFrame:
    """Return the characteristic of the Bayes rule on the rows inside the law."""
    inside = evaluated.select(evaluated.rows.index.isin(bound.rows.index))
    return roc(bound.rows.loc[inside.rows.index, "log_odds"].to_numpy(), inside.healthy, inside.specimens)


def _pod(evaluated: Evaluated) -> Pod | None:
    """Return detection by loss at the false-alarm rate of a90, or at the least that the healthy rows resolve."""
    rate = next((rate for rate in (RATE, *RATES) if is_resolved(rate, int(evaluated.healthy.sum()))), None)
    if rate is None or evaluated.score is None or not set(LOSS_COLUMNS) <= set(evaluated.rows):
        return None
    return detection_by_loss(evaluated.score, evaluated.rows, evaluated.specimens, rate=rate)


def _curve(pod: Pod) -> pd.DataFrame:
    """Return the fitted curve and its lower bound over the range of losses."""
    if pod.curve is None:
        return pd.DataFrame()
    a = np.linspace(pod.levels["stiffness_loss"].min(), pod.levels["stiffness_loss"].max(), 101)
    return pd.DataFrame({"stiffness_loss": a, "fitted": pod.curve.probability(a), "bound": pod.curve.bound(a)})
