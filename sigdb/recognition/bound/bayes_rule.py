"""The Bayes rules of location, kind and severity: their answers to averages, and the losses of these answers."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, IntArray
from sigdb.database import KIND, NO_DAMAGE, SHOWN_QUANTITIES, kind_classes, places_of_kinds, severity_levels
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.metrics.location_and_severity import kind_values, location_values
from sigdb.recognition.templates.continuous_severity import SeverityMarginals
from sigdb.recognition.templates.posterior import Posterior, entropy_of, quantity_posterior, risk_of

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
    continuous
        Whether severities may lie between those of the templates, to a rule without known cells.
    """

    name: str
    losses: tuple[str, ...]
    damaged_only: bool
    continuous: bool

    def answer(self, point: OperatingPoint, rows: pd.DataFrame, posterior: Posterior) -> pd.DataFrame:
        """Return the columns of :attr:`Bound.rows` and the losses, a row for each row of ``rows``."""
        ...

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the value of each row by metric."""
        ...


class ClassRule(ABC):
    """A rule that names the most probable class, such as a tooth, or none.

    Attributes
    ----------
    name
        Name by which functions select the rule.
    """

    name: str
    losses: tuple[str, ...] = ("error", "log_loss")
    damaged_only = False
    continuous = True

    @abstractmethod
    def classes(self, point: OperatingPoint) -> Sequence[int | str]:
        """Return the classes of an operating point, none first."""

    @abstractmethod
    def true(self, point: OperatingPoint, rows: pd.DataFrame) -> IntArray:
        """Return the places (rows,) of the true classes of rows."""

    @abstractmethod
    def log_probabilities(self, point: OperatingPoint, posterior: Posterior) -> FloatArray:
        """Return the logarithm of the probability of each class, (rows, classes)."""

    @abstractmethod
    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the value of each row by metric."""

    def answer(self, point: OperatingPoint, rows: pd.DataFrame, posterior: Posterior) -> pd.DataFrame:
        """Return ``true`` and predicted class, log odds of damage, risk, entropy, losses and the scores of classes."""
        classes, true = np.array(self.classes(point)), self.true(point, rows)
        log_p = self.log_probabilities(point, posterior)
        predicted = log_p.argmax(axis=1)
        return rows[_ROW].assign(
            true=classes[true],
            predicted=classes[predicted],
            log_odds=posterior.log_odds,
            risk=risk_of(log_p),
            entropy=entropy_of(log_p),
            error=(predicted != true).astype(float),
            log_loss=-log_p[np.arange(len(rows)), true],
            **{f"score_{name}": score for name, score in zip(classes.tolist(), log_p.T, strict=True)},
        )

    def prior_log_loss(self, point: OperatingPoint) -> "pd.Series[float]":
        """Return the log loss of the prior for the requested rows of an operating point, by id."""
        rows = point.requested.rows
        return pd.Series(-self.log_probabilities(point, point.prior)[0, self.true(point, rows)], rows.index)


class LocationRule(ClassRule):
    """The rule that names the most probable tooth, or none."""

    name = "location"

    def classes(self, point: OperatingPoint) -> Sequence[int]:
        """Return 0 for none, and the teeth."""
        return range(point.hypotheses.teeth + 1)

    def true(self, point: OperatingPoint, rows: pd.DataFrame) -> IntArray:
        """Return the first damaged teeth of rows."""
        return rows["tooth"].to_numpy(int)

    def log_probabilities(self, point: OperatingPoint, posterior: Posterior) -> FloatArray:
        """Return the logarithm of the probability of none and of each tooth."""
        return posterior.location

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the values of location, and the log loss."""
        values = location_values(answers["predicted"].to_numpy(int), answers)
        return values | {"log_loss": losses["log_loss"].to_numpy()}


class KindRule(ClassRule):
    """The rule that names the most probable kind of damage, or none, whatever the tooth."""

    name = KIND
    continuous = False  # a kind is that of a template

    def classes(self, point: OperatingPoint) -> tuple[str, ...]:
        """Return ``none`` and the kinds of the hypotheses."""
        return kind_classes(point.kinds)

    def true(self, point: OperatingPoint, rows: pd.DataFrame) -> IntArray:
        """Return the places of the kinds of the rows' templates."""
        return self._of_templates(point)[rows["place"].to_numpy()]

    def log_probabilities(self, point: OperatingPoint, posterior: Posterior) -> FloatArray:
        """Return the logarithm of the probability of none and of each kind."""
        return posterior.log_classes(self._of_templates(point))

    def _of_templates(self, point: OperatingPoint) -> IntArray:
        return places_of_kinds(point.kinds, self.classes(point))

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the values of kinds, and the log loss."""
        true, predicted = (answers[name].to_numpy(str) for name in ("true", "predicted"))
        values = kind_values(predicted == true, true != NO_DAMAGE, predicted != NO_DAMAGE)
        return values | {"log_loss": losses["log_loss"].to_numpy()}


class SeverityRule:
    """The rule that gives the posterior's median, its mean or the posterior itself, given damage with the quantity."""

    name = "severity"
    losses: tuple[str, ...] = tuple(
        f"{kind}_{quantity}" for kind in ("absolute", "square", "crps") for quantity in SHOWN_QUANTITIES
    )
    damaged_only = True
    continuous = True

    def answer(self, point: OperatingPoint, rows: pd.DataFrame, posterior: Posterior) -> pd.DataFrame:
        """Return mean, median, 5 and 95 % quantiles of each quantity, and the losses."""
        true = severity_levels(rows, point.quantities)
        parts = [quantity_posterior(posterior, level) for level in point.severity.T]
        of_parts = zip(parts, true.to_numpy().T, strict=True)
        return self._answer(
            rows,
            true,
            mean=np.column_stack([part.mean for part in parts]),
            quantile=lambda p: np.column_stack([part.quantile(p) for part in parts]),
            crps=np.column_stack([part.crps(value) for part, value in of_parts]),
        )

    def answer_between(self, point: OperatingPoint, rows: pd.DataFrame, posterior: SeverityMarginals) -> pd.DataFrame:
        """Return the same of a posterior over severities between the templates."""
        true = severity_levels(rows, point.quantities)
        crps = posterior.crps(true.to_numpy())
        return self._answer(rows, true, mean=posterior.mean(), quantile=posterior.quantile, crps=crps)

    def _answer(
        self,
        rows: pd.DataFrame,
        truth: pd.DataFrame,
        *,
        mean: FloatArray,
        quantile: Callable[[float], FloatArray],
        crps: FloatArray,
    ) -> pd.DataFrame:
        """Return the columns; arrays are (rows, quantities)."""
        tail = (1 - COVERAGE) / 2
        median, low, high = (quantile(p) for p in (0.5, tail, 1 - tail))
        columns: dict[str, FloatArray] = {}
        for i, quantity in enumerate(truth):
            true = truth[quantity].to_numpy()
            columns |= {
                f"mean_{quantity}": mean[:, i],
                f"median_{quantity}": median[:, i],
                f"low_{quantity}": low[:, i],
                f"high_{quantity}": high[:, i],
                f"absolute_{quantity}": np.abs(median[:, i] - true),
                f"square_{quantity}": (mean[:, i] - true) ** 2,
                f"crps_{quantity}": crps[:, i],
            }
        return rows[_ROW].assign(**columns)

    def values(self, answers: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
        """Return absolute error and CRPS of each row, and the error whose root mean square is a metric."""
        present = [name for name in SHOWN_QUANTITIES if f"square_{name}" in losses]
        errors = {f"rmse_{quantity}": np.sqrt(losses[f"square_{quantity}"].to_numpy()) for quantity in present}
        means = {
            f"{metric}_{quantity}": losses[f"{loss}_{quantity}"].to_numpy()
            for loss, metric in (("absolute", "mae"), ("crps", "crps"))
            for quantity in present
        }
        return means | errors


LOCATION_RULE, SEVERITY_RULE, KIND_RULE = LocationRule(), SeverityRule(), KindRule()
RULES: Mapping[str, BayesRule] = {rule.name: rule for rule in (LOCATION_RULE, SEVERITY_RULE, KIND_RULE)}
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
    between = point.between
    if between is None or not isinstance(rule, SeverityRule):
        return pd.concat(rule.answer(point, rows, point.posterior(x, rows)) for rows, x in parts)
    answers = []
    for rows, x in parts:
        likelihood = point.log_likelihood(x, rows)
        for at, _, posterior in between.marginals(likelihood, point.distances(between, rows)):
            answers.append(rule.answer_between(point, rows.iloc[at], posterior))
    return pd.concat(answers)
