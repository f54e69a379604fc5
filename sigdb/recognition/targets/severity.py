"""Severity: the sizes that the damage of a gear has, such as a stiffness loss, and its number of damaged teeth."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import QUANTITIES, SHOWN_QUANTITIES, severity_levels, severity_quantities
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import SEVERITY_RULE, BayesRule
from sigdb.recognition.bound.efficiency import Columns, posterior_answers, severity_efficiency
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.estimators.registry import make_estimators
from sigdb.recognition.metrics.coverage import CELL, SEVERITY, coverage_cells, value_bands
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.evaluated import OUTSIDE_METRICS, Evaluated
from sigdb.recognition.metrics.location_and_severity import (
    SEVERITY_METRICS,
    interval_coverage,
    quantities_of,
    severity_errors,
    severity_values,
)
from sigdb.recognition.metrics.metric import Metric
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.targets.target import TargetText
from sigdb.recognition.templates.bank import TemplateBank

_MOST_SCATTERED = 1500
"""Rows of the scatter of severities."""


class Severity:
    """The severity of damage, each quantity with an interval."""

    name = "severity"
    metrics: tuple[Metric, ...] = (*SEVERITY_METRICS, *OUTSIDE_METRICS)
    noise_metrics: tuple[str, ...] = tuple(
        f"{kind}_{quantity}" for quantity in SHOWN_QUANTITIES for kind in ("mae", "crps", "coverage")
    )
    pictured_metrics: tuple[str, ...] = tuple(f"mae_{quantity}" for quantity in SHOWN_QUANTITIES)
    headline = "mae_stiffness_loss"
    paired_metric = "mae_stiffness_loss"
    criteria: tuple[str, ...] = ("mae_ratio", "undercovered_cells")
    rule: BayesRule = SEVERITY_RULE
    row_condition = "pattern = ''"
    columns: tuple[str, ...] = ()
    varying: tuple[str, ...] = tuple(SHOWN_QUANTITIES)
    damaged_only = True
    text = TargetText(
        purpose="""Estimates how severe the damage of a gear is: the sizes that the damage of its training has, each
with an interval.""",
        baselines="Baselines: `fm4`, a monotonic function of FM4; `majority`, the median of the training rows.",
        failures="""On a healthy gear its answer has no meaning. Intervals hold for each severity on average over gears;
for a single gear they may hold less often.""",
        efficiency="""In bands of the signal-to-noise ratio of one revolution, on the rows inside the law of the
bound. The mean absolute error is compared with that of the posterior's median, the CRPS with that of the same
quantiles, and the root mean square error with that of the posterior's mean.""",
    )

    def labels(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Return tooth and severity; healthy rows teach the location."""
        return pd.concat([rows[["tooth"]], severity_levels(rows, severity_quantities(rows))], axis=1)

    def estimators(self, settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Estimator]:
        """Return the unfitted estimators of severity by name."""
        return make_estimators(self.name, settings, bank)

    def values(self, evaluated: Evaluated) -> dict[str, FloatArray]:
        """Return errors, scores and coverage of each quantity."""
        return severity_values(evaluated.severities, evaluated.rows) | evaluated.outside_values

    def quotients(self, evaluated: Evaluated) -> dict[str, Estimate]:
        """Return nothing: all metrics follow from values of rows."""
        return {}

    def bound_values(self, bound: Bound, rows: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the values of the posterior; the CRPS by the same quantiles as a model's, the bias of its median."""
        values = {str(name): value.to_numpy() for name, value in bound.values.items()}
        scored = severity_values(posterior_answers(bound.rows), rows)
        return values | {name: scored[name] for name in scored if name.startswith(("crps_", "bias_"))}

    def bound_quotients(
        self, bound: Bound, rows: pd.DataFrame, specimens: Specimens, false_alarm_rate: float
    ) -> dict[str, Estimate]:
        """Return nothing, as :meth:`quotients` does."""
        return {}

    def tables(self, evaluated: Mapping[str, Evaluated], learner: str, bound: Bound | None) -> dict[str, pd.DataFrame]:
        """Return errors by true value, a scatter of estimates, and coverage cell by cell."""
        model = evaluated[learner]
        levels = [row for name, each in evaluated.items() for row in _levels(name, each)]
        tables = {"levels": pd.DataFrame(levels), "scatter": _scatter(model)}
        names = quantities_of(model.severities)
        cells = [_cells(model, quantity) for quantity in names if f"{quantity}_low" in model.severities]
        return tables | ({"coverage": pd.concat(cells, ignore_index=True)} if cells else {})

    def efficiency(self, evaluated: Evaluated, bound: Bound | None) -> list[Columns]:
        """Return errors over those of the posterior, a row for each quantity that varies."""
        return [] if bound is None else severity_efficiency(evaluated, bound)


def _cells(evaluated: Evaluated, quantity: str) -> pd.DataFrame:
    inside = interval_coverage(evaluated.severities, evaluated.rows, quantity)
    by = CELL if quantity in QUANTITIES else (quantity, "damaged_teeth", *CELL[len(SEVERITY) :])
    return coverage_cells(inside, evaluated.rows, by=by).assign(target=quantity)


def _levels(estimator: str, evaluated: Evaluated) -> Iterator[dict[str, float | str]]:
    """Yield bias and mean absolute error at each true value."""
    for quantity in quantities_of(evaluated.severities):
        error = severity_errors(evaluated.severities, evaluated.rows, quantity)
        level = value_bands(evaluated.rows[quantity], most=12).to_numpy()
        for value in np.unique(level[np.isfinite(level)]):
            inside = np.where(level == value, error, np.nan)
            for metric, values in (("bias", inside), ("mae", np.abs(inside))):
                head = {"estimator": estimator, "quantity": quantity, "level": value, "metric": metric}
                yield head | vars(evaluated.specimens.mean(values, may_be_share=quantity == "damaged_teeth"))


def _scatter(evaluated: Evaluated) -> pd.DataFrame:
    """Return truth, estimate and interval of each quantity for rows in equal steps."""
    rows, severities = evaluated.rows, evaluated.severities
    some = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _MOST_SCATTERED)).astype(int))
    pieces = []
    for quantity in quantities_of(severities):
        piece = {
            "quantity": quantity,
            "true": rows[quantity].to_numpy(float),
            "estimate": severities[quantity].to_numpy(float),
        }
        ends = [end for end in ("low", "high") if f"{quantity}_{end}" in severities]
        piece |= {end: severities[f"{quantity}_{end}"].to_numpy() for end in ends}
        pieces.append(pd.DataFrame(piece).iloc[some].dropna(subset="true"))
    return pd.concat(pieces, ignore_index=True)
