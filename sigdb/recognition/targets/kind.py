"""Kind: what the damage is, such as a crack or a pit, or none."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import KIND, QUANTITIES
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import KIND_RULE, BayesRule
from sigdb.recognition.bound.efficiency import Columns, calibration_efficiency, class_efficiency
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.estimators.registry import make_estimators
from sigdb.recognition.metrics.calibration import (
    CALIBRATION_METRICS,
    calibration_error,
    calibration_values,
    reliability,
)
from sigdb.recognition.metrics.coverage import SET_METRICS, coverage_cells, set_values
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.evaluated import OUTSIDE_METRICS, Evaluated
from sigdb.recognition.metrics.location_and_severity import KIND_METRICS, kind_values
from sigdb.recognition.metrics.metric import Metric
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.targets.detection_tables import by_estimator
from sigdb.recognition.targets.target import TargetText
from sigdb.recognition.templates.bank import TemplateBank


class Kind:
    """The kind of damage of a gear, ``none`` for none; see :func:`sigdb.database.damage_kinds`."""

    name = KIND
    metrics: tuple[Metric, ...] = (*KIND_METRICS, *CALIBRATION_METRICS, *SET_METRICS, *OUTSIDE_METRICS)
    noise_metrics: tuple[str, ...] = tuple(metric.name for metric in KIND_METRICS)
    pictured_metrics: tuple[str, ...] = ("accuracy", "p_kind")
    headline = "accuracy"
    paired_metric = "accuracy"
    criteria: tuple[str, ...] = ("loss_db", "ece", "undercovered_cells")
    rule: BayesRule = KIND_RULE
    row_condition = ""
    columns: tuple[str, ...] = (KIND,)
    varying: tuple[str, ...] = (KIND,)
    damaged_only = False
    text = TargetText(
        purpose="""Names the kind of damage of the averaged gear, such as a crack or a pit, or 'none', whatever the
tooth. A tooth with several kinds has a kind of its own, which names them all; teeth that differ are a 'pattern'.""",
        baselines="Baseline: `majority`, the most frequent kind of the training rows.",
        failures="""The least severe cases are missed most often. Kinds whose signatures resemble each other are taken
for one another. Damage of a kind that was not simulated still gets one of these kinds, unless no template fits.""",
        efficiency="""In bands of the signal-to-noise ratio of one revolution, on the rows inside the law of the
bound. 'Information used' is (H - log loss) / (H - the bound's log loss), with H the entropy of the prior. 'Loss' is the
increase of the noise at which the best rule has as many errors.""",
    )

    def labels(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Return tooth and kind, with the severities for which coverage is to hold."""
        return rows[["tooth", KIND, *QUANTITIES]]

    def estimators(self, settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Estimator]:
        """Return the unfitted estimators of the kind by name."""
        return make_estimators(self.name, settings, bank)

    def values(self, evaluated: Evaluated) -> dict[str, FloatArray]:
        """Return the values of predicted kinds, of probabilities and of sets."""
        answers, true, called = evaluated.answers, evaluated.true, evaluated.labels > 0
        values = kind_values(evaluated.labels == true, true > 0, called) | evaluated.outside_values
        if answers.probabilities is not None:
            values |= calibration_values(answers.probabilities, true)
        if answers.sets is not None:
            values |= set_values(answers.sets, true)
        return values

    def quotients(self, evaluated: Evaluated) -> dict[str, Estimate]:
        """Return the calibration error."""
        probabilities = evaluated.answers.probabilities
        if probabilities is None:
            return {}
        return {"ece": calibration_error(probabilities, evaluated.true, evaluated.specimens)}

    def bound_values(self, bound: Bound, rows: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the values of the most probable kinds, and the log loss of the posterior."""
        return {str(name): value.to_numpy() for name, value in bound.values.items()}

    def bound_quotients(
        self, bound: Bound, rows: pd.DataFrame, specimens: Specimens, false_alarm_rate: float
    ) -> dict[str, Estimate]:
        """Return nothing: all metrics of the Bayes rule follow from values of rows."""
        return {}

    def tables(self, evaluated: Mapping[str, Evaluated], learner: str, bound: Bound | None) -> dict[str, pd.DataFrame]:
        """Return confusion of kinds, reliability, and coverage cell by cell."""
        model = evaluated[learner]
        tables = {"kinds": confused_kinds(model)}
        tables["reliability"] = by_estimator(
            {
                name: reliability(each.answers.probabilities, each.true, each.specimens)
                for name, each in evaluated.items()
                if each.answers.probabilities is not None
            }
        )
        if model.answers.sets is not None:
            inside = set_values(model.answers.sets, model.true)["set_coverage"]
            tables["coverage"] = coverage_cells(inside, model.rows).assign(target=KIND)
        return tables

    def efficiency(self, evaluated: Evaluated, bound: Bound | None) -> list[Columns]:
        """Return errors, information, loss in decibels and calibration error."""
        columns = calibration_efficiency(evaluated)
        return [columns if bound is None else columns | class_efficiency(evaluated, bound)]


def confused_kinds(evaluated: Evaluated) -> pd.DataFrame:
    """Return the number of rows by true ``kind`` and ``predicted`` kind."""
    classes = np.array(evaluated.answers.classes)
    rows = pd.DataFrame({KIND: evaluated.rows[KIND].to_numpy(), "predicted": classes[evaluated.labels]})
    return rows.groupby([KIND, "predicted"], as_index=False).size().rename(columns={"size": "rows"})
