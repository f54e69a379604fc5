"""Efficiency of a model: its errors compared with those of the Bayes rule on the same rows."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import RULES, ClassRule
from sigdb.recognition.bound.error_curve import INFORMATION_RANGE
from sigdb.recognition.bound.expected_losses import error_curve_around
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.metrics.calibration import calibration_error, calibration_values
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens, columns_of
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.location_and_severity import quantities_of, severity_values
from sigdb.recognition.metrics.probability_of_detection import LOSS_COLUMNS, Pod, detection_by_loss

Columns = Mapping[str, float | str]
"""A row of the table of efficiency."""

DRAWS = 4000
"""Rows drawn for each level of a band's error curve."""


def detection_efficiency(evaluated: Evaluated, bound: Bound) -> dict[str, float]:
    """Compare the a90 of model and bound at a false-alarm rate of 1e-3, by the same fit to the same rows.

    Where the a90 of a model is beyond the losses of the rows and the bound's is not, the quotient is infinite.

    Returns
    -------
    dict
        ``a90``, ``bound_a90``, their quotient ``a90_ratio`` and that of the confidence bounds, ``a90_95_ratio``.
    """
    rows, specimens = evaluated.rows, evaluated.specimens
    if evaluated.score is None or not set(rows) >= set(LOSS_COLUMNS):
        return {}
    model = detection_by_loss(evaluated.score, rows, specimens)
    best = detection_by_loss(bound.rows.loc[rows.index, "log_odds"].to_numpy(), rows, specimens)
    if model is None or best is None:
        return columns_of(a90=UNKNOWN, bound_a90=UNKNOWN, a90_ratio=UNKNOWN) | {"a90_95_ratio": np.nan}
    return columns_of(a90=model.a90, bound_a90=best.a90, a90_ratio=_smallest_loss_ratio(model, best, specimens)) | {
        "a90_95_ratio": model.a90_95.value / best.a90_95.value
    }


def _smallest_loss_ratio(model: Pod, bound: Pod, specimens: Specimens) -> Estimate:
    if np.isnan(model.a90.value) and not np.isnan(bound.a90.value):
        beyond = model.levels["detected"].iloc[-1] < 0.9
        return Estimate(value=np.inf, low=np.nan, high=np.nan) if beyond else UNKNOWN
    return specimens.interval(model.resampled / bound.resampled, within=(0, np.inf))


def class_efficiency(evaluated: Evaluated, bound: Bound, *, draws: int = DRAWS) -> dict[str, float]:
    """Compare the errors of model and Bayes rule of location, or of kind.

    Parameters
    ----------
    evaluated
        Rows inside the law with the model's answers.
    bound
        Bound of these rows.
    draws
        Rows drawn for each level of the noise.

    Returns
    -------
    dict
        With the keys:

        - ``error`` and ``bound_error``: shares of wrong answers;
        - ``excess``: their paired difference;
        - ``chance``: the error of the most frequent answer;
        - ``expected_error``: that of the rule;
        - ``eta_info``: :func:`eta_info` with the log losses of the same rows;
        - ``loss_db``: :meth:`ErrorCurve.excess_db` of the excess.
    """
    rows, specimens = evaluated.rows, evaluated.specimens
    wrong = (evaluated.labels != evaluated.true).astype(float)
    best_wrong = bound.losses.loc[rows.index, "error"].to_numpy()
    excess = specimens.mean(wrong - best_wrong, may_be_share=False)
    rule = RULES[bound.target]
    if not isinstance(rule, ClassRule):
        raise TypeError(f"the rule of {bound.target} names no classes")
    points = _requested(bound.points, rows)
    curve = error_curve_around(points, (excess.low, excess.high), draws=draws, rule=rule)
    value, low, high = curve.excess_db([excess.value, excess.low, excess.high]).tolist()
    return {"chance": curve.chance, "expected_error": curve.origin} | columns_of(
        error=specimens.mean(wrong),
        bound_error=specimens.mean(best_wrong),
        excess=excess,
        eta_info=_eta_info(evaluated, bound),
        loss_db=Estimate(value=value, low=low, high=high),
    )


def _requested(points: Sequence[OperatingPoint], rows: pd.DataFrame) -> list[OperatingPoint]:
    """Return the operating points of some rows, with these rows requested."""
    requested = [point.with_request(rows.index) for point in points]
    return [point for point in requested if point.rows["requested"].any()]


def _eta_info(evaluated: Evaluated, bound: Bound) -> Estimate:
    if evaluated.answers.probabilities is None:
        return UNKNOWN
    rows = evaluated.rows
    prior = bound.prior_log_loss.loc[rows.index].to_numpy()
    bayes = bound.losses.loc[rows.index, "log_loss"].to_numpy()
    model = calibration_values(evaluated.answers.probabilities, evaluated.true)["log_loss"]
    low, high = INFORMATION_RANGE
    if not low * prior.mean() <= bayes.mean() <= high * prior.mean():
        return UNKNOWN
    return evaluated.specimens.estimate(lambda h, m, b: (h - m) / (h - b), prior, model, bayes)


def calibration_efficiency(evaluated: Evaluated) -> dict[str, float]:
    """Return ``ece``, the mean probability of the answers (``confidence``) and the share that is wrong.

    That share is ``error_of_answers``. Without probabilities there is ``ece`` only, as unknown.
    """
    probabilities, true = evaluated.answers.probabilities, evaluated.true
    if probabilities is None:
        return columns_of(ece=UNKNOWN)
    return {
        "confidence": float(probabilities.max(axis=1).mean()),
        "error_of_answers": float((probabilities.argmax(axis=1) != true).mean()),
    } | columns_of(ece=calibration_error(probabilities, true, evaluated.specimens))


def severity_efficiency(evaluated: Evaluated, bound: Bound) -> list[Columns]:
    """Compare the errors of each quantity that varies with those of the posterior.

    Returns
    -------
    list of dict
        ``quantity``; ``error``, ``bound_error`` and ``chance``, mean absolute errors; ``mae_ratio`` over the posterior
        median, ``crps_ratio`` over the posterior (both by the same quantiles), ``rmse_ratio`` over the posterior mean.
    """
    rows = evaluated.rows
    best = bound.rows.loc[rows.index]
    values = severity_values(evaluated.severities, rows), severity_values(posterior_answers(best), rows)
    return [
        {
            "quantity": quantity,
            **_ratios(quantity, *values, best[f"mean_{quantity}"].to_numpy(), rows, evaluated.specimens),
        }
        for quantity in quantities_of(evaluated.severities)
        if f"mean_{quantity}" in best and rows[quantity].nunique() > 1
    ]


def posterior_answers(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the posterior's median and interval of each quantity in the form of a model's answers.

    Scores then use the same quantiles as a model's, so that the two CRPS are comparable.

    Parameters
    ----------
    rows
        :attr:`Bound.rows` of severity.
    """
    ends = {"": "median", "_low": "low", "_high": "high"}
    present = [name for name in SHOWN_QUANTITIES if f"median_{name}" in rows]
    return pd.DataFrame(
        {f"{quantity}{end}": rows[f"{kind}_{quantity}"] for quantity in present for end, kind in ends.items()}
    )


def _ratios(
    quantity: str,
    model: Mapping[str, FloatArray],
    bound: Mapping[str, FloatArray],
    mean: FloatArray,
    rows: pd.DataFrame,
    specimens: Specimens,
) -> dict[str, float]:
    present = rows[quantity].notna().to_numpy()
    model, bound = ({name: value[present] for name, value in values.items()} for values in (model, bound))
    true, mean, specimens = rows[quantity].to_numpy(float)[present], mean[present], specimens.select(present)
    error, best = model[f"mae_{quantity}"], bound[f"mae_{quantity}"]
    return {"chance": float(np.abs(true - np.median(true)).mean())} | columns_of(
        error=specimens.mean(error),
        bound_error=specimens.mean(best),
        mae_ratio=specimens.estimate(np.divide, error, best),
        crps_ratio=specimens.estimate(np.divide, model[f"crps_{quantity}"], bound[f"crps_{quantity}"]),
        rmse_ratio=specimens.estimate(lambda a, b: np.sqrt(a / b), error**2, (mean - true) ** 2),
    )
