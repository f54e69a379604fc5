"""The Bayes rules of location and of severity: their answers to averages, and the losses of these answers."""

from collections.abc import Iterable, Mapping
from typing import Protocol

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import QUANTITIES
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.metrics.location_and_severity import location_values
from sigdb.recognition.templates.posterior import Posterior

_ROW = ["tooth", "teeth", "specimen"]


class BayesRule(Protocol):
    """The best possible answers to one question.

    Attributes
    ----------
    name
        Name by which functions select the rule.
    losses
        Losses of a row that the rule minimises on average.
    damaged_only
        Whether it is for damaged rows only.
    """

    name: str
    losses: tuple[str, ...]
    damaged_only: bool

    def answer(self, point: OperatingPoint, rows: pd.DataFrame, posterior: Posterior) -> pd.DataFrame:
        """Return the columns of :attr:`Bound.rows` and the losses, a row for each row of ``rows``."""
        ...

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the value of each row by metric."""
        ...


class LocationRule:
    """The rule that names the most probable tooth, or none."""

    name = "location"
    losses: tuple[str, ...] = ("error", "log_loss")
    damaged_only = False

    def answer(self, point: OperatingPoint, rows: pd.DataFrame, posterior: Posterior) -> pd.DataFrame:
        """Return predicted tooth, log odds of damage, risk, entropy, losses and the scores of all teeth."""
        true, predicted = rows["tooth"].to_numpy(), posterior.tooth
        scores = {f"score_{tooth}": score for tooth, score in enumerate(posterior.location.T)}
        return rows[_ROW].assign(
            predicted=predicted,
            log_odds=posterior.log_odds,
            risk=posterior.risk,
            entropy=posterior.entropy,
            error=(predicted != true).astype(float),
            log_loss=-posterior.location[np.arange(len(rows)), true],
            **scores,
        )

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the values of location, and the log loss."""
        values = location_values(answers["predicted"].to_numpy(int), answers)
        return values | {"log_loss": losses["log_loss"].to_numpy()}


class SeverityRule:
    """The rule that gives the posterior's median, its mean or the posterior itself."""

    name = "severity"
    losses: tuple[str, ...] = tuple(
        f"{kind}_{quantity}" for kind in ("absolute", "square", "crps") for quantity in QUANTITIES
    )
    damaged_only = True

    def answer(self, point: OperatingPoint, rows: pd.DataFrame, posterior: Posterior) -> pd.DataFrame:
        """Return mean, median, 5 and 95 % quantiles of each quantity, and the losses."""
        columns: dict[str, FloatArray] = {}
        for quantity in QUANTITIES:
            # Templates with a pattern have no severity; they have no share in the rows either.
            level = np.nan_to_num(point.hypotheses.cases[quantity].to_numpy(float))
            true, mean, median = rows[quantity].to_numpy(float), posterior.mean(level), posterior.median(level)
            columns |= {
                f"mean_{quantity}": mean,
                f"median_{quantity}": median,
                f"low_{quantity}": posterior.quantile(level, (1 - COVERAGE) / 2),
                f"high_{quantity}": posterior.quantile(level, (1 + COVERAGE) / 2),
                f"absolute_{quantity}": np.abs(median - true),
                f"square_{quantity}": (mean - true) ** 2,
                f"crps_{quantity}": posterior.crps(level, true),
            }
        return rows[_ROW].assign(**columns)

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return absolute error and CRPS of each row, and the error whose root mean square is a metric."""
        errors = {f"rmse_{quantity}": np.sqrt(losses[f"square_{quantity}"].to_numpy()) for quantity in QUANTITIES}
        means = {
            f"{metric}_{quantity}": losses[f"{loss}_{quantity}"].to_numpy()
            for loss, metric in (("absolute", "mae"), ("crps", "crps"))
            for quantity in QUANTITIES
        }
        return means | errors


LOCATION_RULE, SEVERITY_RULE = LocationRule(), SeverityRule()
RULES: Mapping[str, BayesRule] = {rule.name: rule for rule in (LOCATION_RULE, SEVERITY_RULE)}
"""Bayes rules by name."""


def apply_rule(
    rule: BayesRule, point: OperatingPoint, parts: Iterable[tuple[pd.DataFrame, FloatArray]]
) -> pd.DataFrame:
    """Apply a rule to averages of one operating point.

    Parameters
    ----------
    rule
        A Bayes rule.
    point
        Operating point of the averages.
    parts
        Rows with their averages (rows, n).
    """
    return pd.concat(rule.answer(point, rows, point.posterior(x, rows)) for rows, x in parts)
