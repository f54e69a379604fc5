"""Frames behind an evaluation's report: figures against noise, by severity, curves, cells."""

from collections.abc import Iterator, Mapping
from typing import Any, cast

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.answers import Answers
from sigdb.recognition.metrics.calibration import reliability
from sigdb.recognition.metrics.coverage import coverage_cells, set_values, value_bands
from sigdb.recognition.metrics.detection import RATES, called_values, is_resolved, roc
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.location_and_severity import covered, location_values, severity_errors, severity_values
from sigdb.recognition.metrics.probability_of_detection import RATE, Pod, detection_by_loss
from sigdb.recognition.severity_quantities import QUANTITIES

AXES = ("snr_db", "averages")
"""What figures are given against."""

_SHOWN = 1500
"""Rows of the scatter of severities."""


def evaluation_tables(
    answers: Mapping[str, Answers], rows: pd.DataFrame, learner: str, bound_values: Mapping[str, FloatArray]
) -> dict[str, pd.DataFrame]:
    """Frames by name; those for which rows or answers do not suffice are left out.

    ``snr_db``, ``averages``
        Figures of each estimator against the axis, in bands where it has many values; and of the ``bound``.
    ``confusion``
        Location, not detection: number of rows by ``teeth``, true ``tooth`` and ``found``, of the model.
    ``roc``, ``pod`` and ``pod_curve``, ``reliability``
        Location: of each estimator that has scores or probabilities.
    ``levels``
        Severity: bias and mean absolute error of each estimator at each true value.
    ``scatter``
        Severity: truth, estimate and interval of some rows, of the model.
    ``coverage``
        Of the model's intervals, or of its sets: cell by cell.
    """
    detects = answers[learner].damage_only
    tables = {axis: _against(axis, answers, rows, bound_values, detects) for axis in AXES if axis in rows}
    if isinstance(answers[learner].predicted, pd.DataFrame):
        tables |= _of_severity({name: _frame(one) for name, one in answers.items()}, rows, learner)
    else:
        tables |= _of_location(answers, rows, learner)
        tables |= {"confusion": pd.DataFrame()} if detects else {}
    return {name: table for name, table in tables.items() if len(table)}


def _of_location(answers: Mapping[str, Answers], rows: pd.DataFrame, learner: str) -> dict[str, pd.DataFrame]:
    scored = {name: one.detection for name, one in answers.items() if one.detection is not None}
    sure = {name: one.probabilities for name, one in answers.items() if one.probabilities is not None}
    tables = {
        "confusion": rows[["teeth", "tooth"]]
        .assign(found=cast(IntArray, answers[learner].predicted))
        .groupby(["teeth", "tooth", "found"], as_index=False)
        .size()
        .rename(columns={"size": "rows"}),
        "roc": _each({name: roc(score, rows) for name, score in scored.items()}),
        "reliability": _each({name: reliability(one, rows) for name, one in sure.items()}),
    }
    if set(_POD_COLUMNS) <= set(rows):
        pods = {name: pod for name, score in scored.items() if (pod := _pod(score, rows))}
        tables["pod"] = _each({name: one.levels.assign(false_alarm_rate=one.rate) for name, one in pods.items()})
        tables["pod_curve"] = _each({name: _curve(one) for name, one in pods.items()})
    sets = answers[learner].sets
    if sets is not None:
        inside = set_values(sets, rows)["set_coverage"]
        tables["coverage"] = coverage_cells(inside, rows).assign(target="tooth")
    return tables


_POD_COLUMNS = ("stiffness_loss", "phase_shift_deg")


def _pod(score: FloatArray, rows: pd.DataFrame) -> Pod | None:
    """Detection by loss at a90's false-alarm rate, or at the least one that the healthy rows resolve."""
    healthy = int((rows["tooth"] == 0).sum())
    rate = next((one for one in (RATE, *RATES) if is_resolved(one, healthy)), None)
    return detection_by_loss(score, rows, rate=rate) if rate else None


def _curve(pod: Pod) -> pd.DataFrame:
    """The fitted curve and its lower bound over the range of losses."""
    if pod.curve is None:
        return pd.DataFrame()
    a = np.linspace(pod.levels["stiffness_loss"].min(), pod.levels["stiffness_loss"].max(), 101)
    return pd.DataFrame({"stiffness_loss": a, "fitted": pod.curve.probability(a), "bound": pod.curve.bound(a)})


def _frame(answers: Answers) -> pd.DataFrame:
    return cast(pd.DataFrame, answers.predicted)


def _of_severity(found: Mapping[str, pd.DataFrame], rows: pd.DataFrame, learner: str) -> dict[str, pd.DataFrame]:
    tables = {
        "levels": pd.DataFrame([one for name, some in found.items() for one in _levels(name, some, rows)]),
        "scatter": _scatter(found[learner], rows),
    }
    cells = [
        coverage_cells(covered(found[learner], rows, target), rows).assign(target=target)
        for target in QUANTITIES
        if f"{target}_low" in found[learner]
    ]
    return tables | ({"coverage": pd.concat(cells, ignore_index=True)} if cells else {})


def _levels(estimator: str, found: pd.DataFrame, rows: pd.DataFrame) -> Iterator[dict[str, Any]]:
    specimens = Specimens(rows["specimen"])
    for target in QUANTITIES:
        error, level = severity_errors(found, rows, target), value_bands(rows[target], most=12).to_numpy()
        for one in np.unique(level):
            own = np.where(level == one, error, np.nan)
            for figure, values in (("bias", own), ("mae", np.abs(own))):
                yield {"estimator": estimator, "target": target, "level": one, "figure": figure} | _ends(
                    specimens.mean(values)
                )


def _scatter(found: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    """Rows in equal steps: truth, estimate and interval of each target."""
    some = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _SHOWN)).astype(int))
    pieces = []
    for target in QUANTITIES:
        piece = {"target": target, "true": rows[target].to_numpy(float), "found": found[target].to_numpy(float)}
        piece |= {end: found[f"{target}_{end}"].to_numpy() for end in ("low", "high") if f"{target}_{end}" in found}
        pieces.append(pd.DataFrame(piece).iloc[some])
    return pd.concat(pieces, ignore_index=True)


def _against(
    axis: str,
    answers: Mapping[str, Answers],
    rows: pd.DataFrame,
    bound_values: Mapping[str, FloatArray],
    detects: bool,
) -> pd.DataFrame:
    values = {name: _values(one, rows, detects) for name, one in answers.items()}
    if bound_values:
        values["bound"] = dict(bound_values)
    at, specimens = value_bands(rows[axis], most=12).to_numpy(), Specimens(rows["specimen"])
    return pd.DataFrame(
        [
            {"estimator": name, "at": one, "rows": int((at == one).sum()), "figure": figure}
            | _ends(specimens.mean(np.where(at == one, value, np.nan)))
            for name, figures in values.items()
            for figure, value in figures.items()
            for one in np.unique(at)
        ]
    )


def _values(answers: Answers, rows: pd.DataFrame, detects: bool) -> dict[str, FloatArray]:
    if isinstance(answers.predicted, pd.DataFrame):
        values = severity_values(answers.predicted, rows)
        return {name: value for name, value in values.items() if name.startswith(("mae", "coverage", "crps"))}
    return called_values(answers.predicted, rows) if detects else location_values(answers.predicted, rows)


def _each(frames: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Frames one below the other, with the estimator of each."""
    named = [frame.assign(estimator=name) for name, frame in frames.items() if len(frame)]
    return pd.concat(named, ignore_index=True) if named else pd.DataFrame()


def _ends(figure: Estimate) -> dict[str, float]:
    return {"value": figure.value, "low": figure.low, "high": figure.high}


def records(table: pd.DataFrame | None) -> list[dict[str, Any]] | None:
    """Rows of a table as dictionaries that JSON can hold; None for what is not known."""
    if table is None:
        return None
    rows = table.astype(object).to_dict("records")
    return [{str(name): _plain(value) for name, value in row.items()} for row in rows]


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value
