"""Frames behind the report of an evaluation: metrics against noise, efficiency by band, and those of the target."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.noise_bands import NoiseBand, noise_bands
from sigdb.recognition.metrics.coverage import value_bands
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.targets.target import Target

AXES = ("snr_db", "averages")
"""Columns against which metrics are shown."""


def evaluation_tables(
    target: Target,
    evaluated: Mapping[str, Evaluated],
    learner: str,
    bound: Bound | None,
    bound_values: Mapping[str, FloatArray],
) -> dict[str, pd.DataFrame]:
    """Return frames by name; those for which rows or answers do not suffice are left out.

    ``snr_db``, ``averages``
        Metrics of each estimator against the axis, in bands where it has many values; and of the ``bound``.
    ``confusion``
        Location: number of rows by ``teeth``, true ``tooth`` and ``predicted`` tooth, of the model.
    ``kinds``
        Kind: number of rows by true ``kind`` and ``predicted`` kind, of the model.
    ``roc``, ``pod`` and ``pod_curve``, ``reliability``
        Location and detection: each estimator that has scores or probabilities.
    ``levels``
        Severity: bias and mean absolute error of each estimator at each true value.
    ``scatter``
        Severity: truth, estimate and interval of some rows, of the model.
    ``coverage``
        Coverage of the model's intervals, or of its sets: cell by cell.

    Parameters
    ----------
    target
        Target of the model.
    evaluated
        Evaluated rows by estimator.
    learner
        Name of the estimator that is the model.
    bound
        Bound of the rows; None without one.
    bound_values
        Value of each row (rows,) by metric of the bound; NaN outside the law.
    """
    rows, specimens = evaluated[learner].rows, evaluated[learner].specimens
    values = {name: _shown(target, target.values(each)) for name, each in evaluated.items()}
    if bound_values:
        values["bound"] = dict(bound_values)
    shares = {metric.name: not metric.continuous for metric in target.metrics}
    tables = {axis: _against(rows[axis], values, specimens, shares) for axis in AXES if axis in rows}
    tables |= target.tables(evaluated, learner, bound)
    return {name: table for name, table in tables.items() if len(table)}


def _shown(target: Target, values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    return {name: values[name] for name in target.noise_metrics if name in values}


def _against(
    axis: "pd.Series[float]",
    values: Mapping[str, Mapping[str, FloatArray]],
    specimens: Specimens,
    shares: Mapping[str, bool],
) -> pd.DataFrame:
    """Return the mean of each metric at each level of an axis; it may be a share, or not."""
    at = value_bands(axis, most=12).to_numpy()
    return pd.DataFrame(
        [
            {"estimator": name, "at": level, "rows": int((at == level).sum()), "metric": metric}
            | vars(specimens.mean(np.where(at == level, value, np.nan), may_be_share=shares.get(metric, True)))
            for name, metrics in values.items()
            for metric, value in metrics.items()
            for level in np.unique(at)
        ]
    )


def efficiency_table(target: Target, evaluated: Evaluated, bound: Bound | None = None) -> pd.DataFrame:
    """Compare a model with the Bayes rule on the same rows, in bands of noise.

    Rows outside the law are left out. Each estimate has the ends of its 95 % interval, from a bootstrap over specimens,
    as ``NAME_low`` and ``NAME_high``; NaN where the rows do not suffice.

    ==============================  ==================================================================================
    column                          of each band
    ==============================  ==================================================================================
    ``band``, ``low_db``,           signal-to-noise ratio of one revolution; ``all`` for all rows
    ``high_db``
    ``rows``, ``specimens``         numbers
    ``error``, ``bound_error``,     location: share of wrong answers of model and Bayes rule, of the most frequent
    ``chance``                      answer; severity: mean absolute errors
    ``eta_info``                    location: :func:`eta_info`, with the log losses of the same rows
    ``loss_db``                     location: :meth:`ErrorCurve.excess_db` of the paired excess ``error - bound_error``
    ``a90``, ``bound_a90``,         location, detection: a90 of both at a false-alarm rate of 1e-3, and their quotient
    ``a90_ratio``, ``a90_95_ratio``
    ``ece``                         location: expected calibration error, of 20 000 rows or more
    ``quantity``, ``mae_ratio``,    severity: MAE over that of the posterior median, CRPS over that of the posterior
    ``crps_ratio``, ``rmse_ratio``  (both by the same quantiles), RMSE over that of the posterior mean
    ==============================  ==================================================================================

    Parameters
    ----------
    target
        Target of the model.
    evaluated
        Rows by id, with the model's answers.
    bound
        Bound of these rows; without it, the table holds only what needs none.
    """
    if bound is not None:
        evaluated = evaluated.select(evaluated.rows.index.isin(bound.rows.index))
    table = pd.DataFrame(
        [
            _head(band, evaluated.rows) | dict(columns)
            for band in noise_bands(evaluated.rows["snr_db"])
            for columns in target.efficiency(evaluated.select(band.inside), bound)
        ]
    )
    if "quantity" not in table:
        return table
    order = table["quantity"].map(list(SHOWN_QUANTITIES).index).sort_values(kind="stable").index
    return table.loc[order].reset_index(drop=True)


def _head(band: NoiseBand, rows: pd.DataFrame) -> dict[str, float | str]:
    inside = rows["specimen"][band.inside]
    return {
        "band": band.name,
        "low_db": band.low,
        "high_db": band.high,
        "rows": len(inside),
        "specimens": inside.nunique(),
    }
