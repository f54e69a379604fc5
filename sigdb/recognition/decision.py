"""Decisions: by prevalence and costs of errors, stated when a model answers; and none for rows outside."""

import warnings
from dataclasses import dataclass, fields, replace

import numpy as np
import pandas as pd
from scipy.special import expit, logit, softmax

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.recognition.answers import Answers
from sigdb.recognition.estimators.contract import Estimator, Scorer
from sigdb.recognition.estimators.detector import Detector
from sigdb.recognition.rows.batch import Batch

NO_TOOTH, NO_KIND = -1, "outside"
"""Predictions of a model for a row that it was not trained for: of location or detection, and of kinds of damage."""


class OutsideWarning(UserWarning):
    """A model has no answer to some rows: they are outside the range of its training, or fit none of its templates."""


@dataclass(frozen=True, kw_only=True)
class Costs:
    """Costs of the errors of an answer, in any unit; a correct answer costs nothing.

    Attributes
    ----------
    false_alarm
        Cost of calling a healthy gear damaged.
    miss
        Cost of calling a damaged gear healthy.
    wrong_tooth
        Cost of naming another tooth than the damaged one.

    Examples
    --------
    A missed damage costs as much as fifty false alarms:

    >>> Costs(false_alarm=1, miss=50).miss
    50
    """

    false_alarm: float = 1.0
    miss: float = 1.0
    wrong_tooth: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, int | float) and np.isfinite(value) and value >= 0):
                raise InputError(f"costs: {field.name} = {value!r} must be a number of 0 or more")
        if not (self.false_alarm > 0 or self.miss > 0 or self.wrong_tooth > 0):
            raise InputError("costs: all are 0, so that no answer is better than another; give one above 0")

    def location(self, probabilities: FloatArray) -> IntArray:
        """Return the answers of least expected cost, (rows,): a tooth, 0 for none.

        Parameters
        ----------
        probabilities
            (rows, teeth + 1) of 'none' and of each tooth.
        """
        none, teeth = probabilities[:, :1], probabilities[:, 1:]
        damage = teeth.sum(axis=1, keepdims=True)
        of_teeth = self.false_alarm * none + self.wrong_tooth * (damage - teeth)
        return np.hstack([self.miss * damage, of_teeth]).argmin(axis=1)

    def detection(self, damage: FloatArray) -> IntArray:
        """Return 1 where calling damage costs least, else 0; (rows,), of the probability of damage (rows,)."""
        return (self.miss * damage > self.false_alarm * (1 - damage)).astype(int)


def check_decision(estimator: Estimator, prevalence: float | None, costs: Costs | None) -> None:
    """Refuse a prevalence or costs that an estimator cannot answer by.

    Raises
    ------
    InputError
        If the prevalence is not between 0 and 1, or the estimator has no use for it or for the costs.
    """
    if prevalence is None and costs is None:
        return
    if prevalence is not None and (
        isinstance(prevalence, bool) or not isinstance(prevalence, int | float) or not 0 < prevalence < 1
    ):
        raise InputError(f"prevalence = {prevalence!r} must be between 0 and 1: the share of gears that are damaged")
    if isinstance(estimator, Detector):
        if prevalence is None:
            raise InputError("costs of a model of detection need a prevalence, the share of gears that are damaged")
    elif not isinstance(estimator, Scorer):
        raise InputError("prevalence and costs are for models of location and detection; leave them out")
    elif prevalence is not None and estimator.trained_prevalence is None:
        raise InputError("prevalence: the model does not state that of its training; train it again")


def decided_answers(estimator: Estimator, batch: Batch, prevalence: float | None, costs: Costs | None) -> Answers:
    """Return the answers of an estimator, with probabilities where it has any, by a prevalence and costs.

    Sets stay as they are: their coverage holds for each label, whatever the share of the labels.

    Parameters
    ----------
    estimator
        Estimator of location, detection or severity.
    batch
        Rows.
    prevalence
        Share of damaged gears; that of the training of location if left out. A detector then answers at its rate of
        false alarms, with probabilities for even odds.
    costs
        Costs of errors; all the same if left out.
    """
    check_decision(estimator, prevalence, costs)
    answers = estimator.answer(batch)
    if isinstance(estimator, Detector):
        damage = expit(estimator.log_ratio(batch) + (0.0 if prevalence is None else logit(prevalence)))
        answers = replace(answers, probabilities=np.column_stack([1 - damage, damage]))
        return answers if prevalence is None else replace(answers, predicted=(costs or Costs()).detection(damage))
    if prevalence is not None and (trained := estimator.trained_prevalence) is not None:
        answers = with_prevalence(answers, trained, prevalence)
    if costs is not None and answers.probabilities is not None:
        return replace(answers, predicted=costs.location(answers.probabilities))
    return answers


def with_prevalence(answers: Answers, trained: float | None, prevalence: float) -> Answers:
    """Return answers of location with the log odds of damage moved from the prevalence of the training to another.

    Answers of an estimator that states no prevalence, or has no probabilities, are left as they are.
    """
    if trained is None or answers.scores is None or answers.probabilities is None or not 0 < prevalence < 1:
        return answers
    scores = answers.scores.copy()
    scores[:, 0] += logit(trained) - logit(prevalence)
    return replace(answers, predicted=scores.argmax(axis=1), scores=scores, probabilities=softmax(scores, axis=1))


def warn_of_outside(verdict: pd.DataFrame) -> None:
    """Warn of the rows of a verdict that are outside, at the call of the function that calls this one."""
    outside = verdict["outside"]
    if not outside.any():
        return
    reason = verdict["reason"][outside.to_numpy()]
    rows = "the row is" if len(verdict) == 1 else f"{outside.sum()} of {len(verdict)} rows are"
    which = "" if len(verdict) == 1 else f", such as row {reason.index[0]}"
    warnings.warn(
        f"{rows} outside the range of the model's training{which}: {reason.iloc[0]}; there is no answer to them, and "
        "assess() gives the reason for each",
        OutsideWarning,
        stacklevel=3,
    )
