"""Location: the first damaged tooth, or none."""

from collections.abc import Mapping

import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import QUANTITIES
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import LOCATION_RULE, BayesRule
from sigdb.recognition.bound.efficiency import (
    Columns,
    calibration_efficiency,
    class_efficiency,
    detection_efficiency,
)
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.estimators.registry import make_estimators
from sigdb.recognition.metrics.calibration import (
    CALIBRATION_METRICS,
    calibration_error,
    calibration_values,
    reliability,
)
from sigdb.recognition.metrics.coverage import SET_METRICS, coverage_cells, set_values
from sigdb.recognition.metrics.detection import RATE_METRICS
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.evaluated import OUTSIDE_METRICS, Evaluated
from sigdb.recognition.metrics.location_and_severity import LOCATION_METRICS, location_values
from sigdb.recognition.metrics.metric import Metric
from sigdb.recognition.metrics.probability_of_detection import A90_METRICS
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.targets.detection import score_metrics
from sigdb.recognition.targets.detection_tables import by_estimator, detection_tables
from sigdb.recognition.targets.target import TargetText
from sigdb.recognition.templates.bank import TemplateBank


class Location:
    """The first damaged tooth of a gear, 0 for none."""

    name = "location"
    metrics: tuple[Metric, ...] = (
        *LOCATION_METRICS,
        *RATE_METRICS,
        *A90_METRICS,
        *CALIBRATION_METRICS,
        *SET_METRICS,
        *OUTSIDE_METRICS,
    )
    noise_metrics: tuple[str, ...] = tuple(metric.name for metric in LOCATION_METRICS)
    pictured_metrics: tuple[str, ...] = ("accuracy", "p_exact")
    headline = "accuracy"
    paired_metric = "accuracy"
    criteria: tuple[str, ...] = ("loss_db", "a90_ratio", "ece", "undercovered_cells")
    rule: BayesRule = LOCATION_RULE
    row_condition = ""
    columns: tuple[str, ...] = ()
    varying: tuple[str, ...] = ("tooth",)
    damaged_only = False
    text = TargetText(
        purpose="""Names the tooth of the averaged gear at which the damage begins, or 'none'. Absolute tooth
numbers need the tacho mark.""",
        baselines="""Baselines: `whitened_bank` takes the likelihoods of the templates without calibration.
`nearest_template` takes the least Euclidean distance, `envelope_peak` the tooth in whose pass the envelope of the
residual is greatest. `na4_star` and `fm4` are thresholds, which name no tooth: a damaged gear gets the most frequent
one. `majority` is the most frequent answer of the training rows. All thresholds are set at a false-alarm rate of
{rate:g}.""",
        failures="""The least severe cases are missed most often. Damage of a kind that was not simulated still gets a
tooth.""",
        efficiency="""In bands of the signal-to-noise ratio of one revolution, on the rows inside the law of the
bound. 'Information used' is (H - log loss) / (H - the bound's log loss), with H the entropy of the prior. 'Loss' is the
increase of the noise at which the best rule has as many errors.""",
    )

    def labels(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Return the first damaged tooth, 0 for none, with the severities for which coverage is to hold."""
        return rows[["tooth", *QUANTITIES]]

    def estimators(self, settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Estimator]:
        """Return the unfitted estimators of location by name."""
        return make_estimators(self.name, settings, bank)

    def values(self, evaluated: Evaluated) -> dict[str, FloatArray]:
        """Return the values of predicted teeth, of probabilities and of sets."""
        answers, rows = evaluated.answers, evaluated.rows
        values = location_values(evaluated.labels, rows) | evaluated.outside_values
        if answers.probabilities is not None:
            values |= calibration_values(answers.probabilities, evaluated.true)
        if answers.sets is not None:
            values |= set_values(answers.sets, evaluated.true)
        return values

    def quotients(self, evaluated: Evaluated) -> dict[str, Estimate]:
        """Return detection at set rates, a90 and the calibration error."""
        probabilities, rows, specimens = evaluated.answers.probabilities, evaluated.rows, evaluated.specimens
        error = {} if probabilities is None else {"ece": calibration_error(probabilities, evaluated.true, specimens)}
        return score_metrics(evaluated.score, rows, specimens) | error

    def bound_values(self, bound: Bound, rows: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the values of the most probable teeth, and the log loss of the posterior."""
        return {str(name): value.to_numpy() for name, value in bound.values.items()}

    def bound_quotients(
        self, bound: Bound, rows: pd.DataFrame, specimens: Specimens, false_alarm_rate: float
    ) -> dict[str, Estimate]:
        """Return detection at set rates and a90 by the log odds of damage."""
        return score_metrics(bound.rows.loc[rows.index, "log_odds"].to_numpy(), rows, specimens)

    def tables(self, evaluated: Mapping[str, Evaluated], learner: str, bound: Bound | None) -> dict[str, pd.DataFrame]:
        """Return confusion, detection, reliability, and coverage cell by cell."""
        model = evaluated[learner]
        tables = {"confusion": confusion(model)} | detection_tables(evaluated, bound)
        tables["reliability"] = by_estimator(
            {
                name: reliability(each.answers.probabilities, each.true, each.specimens)
                for name, each in evaluated.items()
                if each.answers.probabilities is not None
            }
        )
        if model.answers.sets is not None:
            inside = set_values(model.answers.sets, model.true)["set_coverage"]
            tables["coverage"] = coverage_cells(inside, model.rows).assign(target="tooth")
        return tables

    def efficiency(self, evaluated: Evaluated, bound: Bound | None) -> list[Columns]:
        """Return errors, information, loss in decibels, a90 and calibration error."""
        columns: dict[str, float | str] = {} if bound is None else {**detection_efficiency(evaluated, bound)}
        columns |= calibration_efficiency(evaluated)
        return [columns if bound is None else columns | class_efficiency(evaluated, bound)]


def confusion(evaluated: Evaluated) -> pd.DataFrame:
    """Return the number of rows by ``teeth``, true ``tooth`` and ``predicted`` tooth."""
    rows = evaluated.rows[["teeth", "tooth"]].assign(predicted=evaluated.labels)
    counts = rows.groupby(["teeth", "tooth", "predicted"], as_index=False).size()
    return counts.rename(columns={"size": "rows"})
