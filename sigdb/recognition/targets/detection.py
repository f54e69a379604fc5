"""Detection: whether a gear has a damaged tooth."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import LOCATION_RULE, BayesRule
from sigdb.recognition.bound.efficiency import Columns, detection_efficiency
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.estimators.registry import make_estimators
from sigdb.recognition.metrics.detection import CALL_METRICS, RATE_METRICS, call_values, detection_at_rates
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.evaluated import OUTSIDE_METRICS, Evaluated
from sigdb.recognition.metrics.metric import Metric, estimates
from sigdb.recognition.metrics.probability_of_detection import A90_METRICS, LOSS_COLUMNS, a90_estimates
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.targets.detection_tables import detection_tables
from sigdb.recognition.targets.target import TargetText
from sigdb.recognition.templates.bank import TemplateBank


class Detection:
    """Damaged or not, at a set rate of false alarms."""

    name = "detection"
    metrics: tuple[Metric, ...] = (*CALL_METRICS, *RATE_METRICS, *A90_METRICS, *OUTSIDE_METRICS)
    noise_metrics: tuple[str, ...] = ("false_alarm_rate", "p_detected")
    pictured_metrics: tuple[str, ...] = ("p_detected", "false_alarm_rate")
    headline = "pd_at_1e-2"
    paired_metric = "p_detected"
    criteria: tuple[str, ...] = ("a90_ratio",)
    rule: BayesRule = LOCATION_RULE
    row_condition = ""
    columns: tuple[str, ...] = ()
    varying: tuple[str, ...] = ()
    damaged_only = False
    text = TargetText(
        purpose="Detects whether a gear has a damaged tooth, at a set rate of false alarms.",
        baselines="""All are set at a false-alarm rate of {rate:g}, on healthy rows of specimens that they have not
learnt from. Baselines: `nearest_template`, by how much the nearest damaged template is nearer than the healthy one;
`envelope_peak`, `na4_star` and `fm4`.""",
        failures="""The least severe cases are missed most often. The rate of false alarms holds on average over gears;
for a single gear it may differ.""",
        efficiency="""In bands of the signal-to-noise ratio of one revolution, on the rows inside the law of the
bound.""",
    )

    def labels(self, rows: pd.DataFrame) -> "pd.Series[int]":
        """Return the first damaged tooth, 0 for a healthy gear."""
        return rows["tooth"]

    def estimators(self, settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Estimator]:
        """Return the unfitted detectors by name, at the false-alarm rate of the settings."""
        return make_estimators(self.name, settings, bank)

    def values(self, evaluated: Evaluated) -> dict[str, FloatArray]:
        """Return whether damage is called, of damaged and of healthy rows."""
        return call_values(evaluated.labels, evaluated.rows) | evaluated.outside_values

    def quotients(self, evaluated: Evaluated) -> dict[str, Estimate]:
        """Return detection at set rates, and a90."""
        return score_metrics(evaluated.score, evaluated.rows, evaluated.specimens)

    def bound_values(self, bound: Bound, rows: pd.DataFrame) -> dict[str, FloatArray]:
        """Return nothing: detectors of another rate of false alarms are not bounded row by row."""
        return {}

    def bound_quotients(
        self, bound: Bound, rows: pd.DataFrame, specimens: Specimens, false_alarm_rate: float
    ) -> dict[str, Estimate]:
        """Return the metrics of the detector whose score is the log odds of the Bayes rule."""
        log_odds = bound.rows.loc[rows.index, "log_odds"].to_numpy(float)
        called = call_values((log_odds > bound_threshold(log_odds, rows, false_alarm_rate)).astype(int), rows)
        return estimates(self.metrics, called, specimens) | score_metrics(log_odds, rows, specimens)

    def tables(self, evaluated: Mapping[str, Evaluated], learner: str, bound: Bound | None) -> dict[str, pd.DataFrame]:
        """Return receiver operating characteristics, and detection against loss."""
        return detection_tables(evaluated, bound)

    def efficiency(self, evaluated: Evaluated, bound: Bound | None) -> list[Columns]:
        """Return the a90 of model and bound."""
        return [{} if bound is None else detection_efficiency(evaluated, bound)]


def bound_threshold(log_odds: FloatArray, rows: pd.DataFrame, false_alarm_rate: float) -> float:
    """Return the least threshold of the Bayes rule that at most a share of the healthy rows exceeds.

    It is set on the evaluated rows themselves: the rule follows from the law, and needs no others.

    Parameters
    ----------
    log_odds
        (rows,) logarithm of P(damage) / P(none).
    rows
        ``tooth`` of each row.
    false_alarm_rate
        The share, between 0 and 1.
    """
    healthy = np.sort(log_odds[rows["tooth"].to_numpy() == 0])[::-1]
    return float(healthy[int(false_alarm_rate * len(healthy) * (1 + 1e-12))]) if len(healthy) else np.inf


def score_metrics(score: FloatArray | None, rows: pd.DataFrame, specimens: Specimens) -> dict[str, Estimate]:
    """Return the metrics of a score of damage; none without one."""
    if score is None:
        return {}
    detected = detection_at_rates(score, (rows["tooth"] == 0).to_numpy(), specimens)
    return detected | (a90_estimates(score, rows, specimens) if set(LOSS_COLUMNS) <= set(rows) else {})
