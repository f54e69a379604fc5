"""Criteria: limits of metrics that a recipe sets, and whether a model keeps them."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import Note
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.bound.error_curve import ERROR_RANGE
from sigdb.recognition.bound.noise_bands import ALL
from sigdb.recognition.metrics.calibration import ENOUGH
from sigdb.recognition.metrics.coverage import ENOUGH as ENOUGH_OF_CELL
from sigdb.recognition.metrics.coverage import LEAST_COVERAGE
from sigdb.recognition.metrics.detection import NEEDED
from sigdb.recognition.metrics.probability_of_detection import RATE
from sigdb.recognition.settings import CriteriaSettings
from sigdb.recognition.targets.target import Target


@dataclass(frozen=True, kw_only=True)
class CriterionResult:
    """A criterion with the value that it limits.

    Attributes
    ----------
    criterion
        Name in ``[recognition.criteria]``.
    title
        Heading for readers.
    limit
        Greatest value allowed.
    value, low, high
        Value in the worst band of noise, and its interval; NaN where it is not estimated.
    band
        That band.
    met
        Whether the limit is kept; None where the value is not estimated.
    note
        Why the limit is exceeded or the value is not estimated; None where it is kept.
    """

    criterion: str
    title: str
    limit: float
    value: float = np.nan
    low: float = np.nan
    high: float = np.nan
    band: str = ""
    met: bool | None = None
    note: Note | None = None


_TITLES = {
    "loss_db": "loss against the bound, dB",
    "a90_ratio": f"a90 over the bound's, at a false-alarm rate of {RATE:g}",
    "mae_ratio": "MAE over the posterior median's",
    "ece": "calibration error (ECE)",
    "undercovered_cells": f"share of cells where 90 % sets cover less than {LEAST_COVERAGE:g} (99 % confidence)",
}
_NEED_BOUND = ("loss_db", "a90_ratio", "mae_ratio")


def assess_criteria(
    criteria: CriteriaSettings,
    target: Target,
    metrics: Collection[str],
    efficiency: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    *,
    bounded: bool = True,
) -> tuple[CriterionResult, ...]:
    """Compare a model with the criteria that are set and apply to its target.

    A value is compared in every band of noise where it is estimated, and the worst band counts; all rows together count
    where no band suffices. Ratios to the bound are estimated where its error is between 0.02 and 0.8 of that by chance.

    Parameters
    ----------
    criteria
        Limits.
    target
        Target of the model.
    metrics
        Names of the model's metrics.
    efficiency, tables
        Table of efficiency, and tables by name, see :class:`Evaluation`.
    bounded
        Whether there is a bound.
    """
    limits = criteria.limits
    cells = tables.get("coverage", pd.DataFrame()) if any("coverage" in name for name in metrics) else None
    return tuple(
        result
        for name in target.criteria
        if name in limits
        for result in _results(name, limits[name], efficiency, cells, bounded)
    )


def _results(
    name: str, limit: float, efficiency: pd.DataFrame, cells: pd.DataFrame | None, bounded: bool
) -> Iterator[CriterionResult]:
    title = _TITLES[name]
    if name == "undercovered_cells":
        yield _assess_cells(title, limit, cells)
    elif name in _NEED_BOUND and not bounded:
        yield CriterionResult(criterion=name, title=title, limit=limit, note=_NO_BOUND)
    elif efficiency.empty:
        yield CriterionResult(criterion=name, title=title, limit=limit, note=_ONE_SEVERITY)
    elif "quantity" in efficiency:
        for quantity, table in efficiency.groupby("quantity", sort=False):
            yield _worst_band(name, f"{quantity}, {title}", limit, table)
    else:
        yield _worst_band(name, title, limit, efficiency)


_NO_BOUND = Note(code="no-bound", text="there is no bound: no row follows a law that it could be computed from")
_ONE_SEVERITY = Note(code="one-severity", text="all rows have the same severity, so that no error is to be expected")


def _worst_band(name: str, title: str, limit: float, table: pd.DataFrame) -> CriterionResult:
    bands = table[_is_estimated(name, table)]
    bands = bands if (bands["band"] == ALL).all() else bands[bands["band"] != ALL]
    if bands.empty:
        return CriterionResult(criterion=name, title=title, limit=limit, note=_why_not_estimated(name, table))
    worst = bands.iloc[int(bands[name].argmax())]
    value, low, high = (float(worst[f"{name}{end}"]) for end in ("", "_low", "_high"))
    met = value <= limit
    return CriterionResult(
        criterion=name,
        title=title,
        limit=limit,
        value=value,
        low=low,
        high=high,
        band=str(worst["band"]),
        met=met,
        note=None if met else _why_exceeded(name, bands, worst, limit),
    )


def _is_estimated(name: str, table: pd.DataFrame) -> "pd.Series[bool]":
    """Return whether each band has an estimate."""
    if name not in table:
        return pd.Series(False, table.index)
    low, high = ERROR_RANGE
    estimated = table[name].notna()
    if name != "mae_ratio":
        return estimated
    return estimated & (table["bound_error"] / table["chance"]).between(low, high)


def _why_exceeded(name: str, bands: pd.DataFrame, worst: "pd.Series[float]", limit: float) -> Note:
    exceeded = bands[bands[name] > limit]
    places = [
        f"{_number(value)} at {band}"
        for band, value in zip(exceeded["band"], exceeded[name], strict=True)
        if band != ALL
    ]
    text = (
        f"Exceeded in {len(exceeded)} of {len(bands)} noise bands: {', '.join(places)}."
        if places
        else ("Exceeded over all rows.")
    )
    values: dict[str, float | int | str] = {"bands": len(bands), "exceeded": len(exceeded), "band": str(worst["band"])}
    return Note(code="exceeded", text=" ".join((text, *_more(name, worst, limit))), values=values)


def _more(name: str, worst: "pd.Series[float]", limit: float) -> Iterator[str]:
    """Yield what else the worst band shows."""
    if name == "ece":
        correct = 1 - worst["error_of_answers"]
        yield f"There the mean probability of the answers is {worst['confidence']:.3f}, and {correct:.3f} are correct."
    elif np.isinf(worst[name]):
        yield "There the model's value is beyond the range of the rows."
    elif worst[f"{name}_low"] <= limit:
        yield f"The interval there, {worst[f'{name}_low']:.3g} to {worst[f'{name}_high']:.3g}, contains the limit."


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "beyond the range"


def _why_not_estimated(name: str, table: pd.DataFrame) -> Note:
    if name == "ece":
        return _why_no_calibration(table)
    if name == "a90_ratio":
        return _NO_A90 if "a90" in table else _NO_SCORES
    share, (low, high) = table["bound_error"] / table["chance"], ERROR_RANGE
    least, most = float(share.min()), float(share.max())
    return Note(
        code="bound-out-of-range",
        text=f"the bound's error is {least:.2g} to {most:.2g} of that by chance, and the criterion needs {low:g} to "
        f"{high:g}",
        values={"least": least, "most": most},
    )


def _why_no_calibration(table: pd.DataFrame) -> Note:
    if "confidence" not in table:
        return Note(code="no-probabilities", text="the model gives no probabilities")
    most = int(table["rows"].max())
    text = f"a noise band has {most} rows at most, and needs {ENOUGH}"
    return Note(code="few-rows", text=text, values={"rows": most, "needed": ENOUGH})


_NO_SCORES = Note(code="no-scores", text="the model gives no score of damage, or the rows have no losses")
_NO_A90 = Note(
    code="no-a90",
    text=f"no band has the {NEEDED / RATE:.0f} healthy rows that a rate of {RATE:g} needs, together with a bound that "
    "detects a loss within those of the rows with a probability of 0.9",
    values={"needed": NEEDED / RATE, "rate": RATE},
)


_NO_SETS = Note(code="no-sets", text="the model gives no sets")
_NO_CELLS = Note(
    code="no-cells",
    text=f"no cell of severity, noise and operating point has {ENOUGH_OF_CELL} rows",
    values={"needed": ENOUGH_OF_CELL},
)


def _assess_cells(title: str, limit: float, cells: pd.DataFrame | None) -> CriterionResult:
    name = "undercovered_cells"
    if cells is None or cells.empty:
        note = _NO_SETS if cells is None else _NO_CELLS
        return CriterionResult(criterion=name, title=title, limit=limit, note=note)
    below = cells[cells["below"].astype(bool)]
    share = len(below) / len(cells)
    met = share <= limit
    reason = None if met else _least_coverage(below, len(cells))
    return CriterionResult(criterion=name, title=title, limit=limit, value=share, met=met, note=reason)


def _least_coverage(below: pd.DataFrame, cells: int) -> Note:
    worst = below.iloc[int(below["coverage"].argmin())]
    where = ", ".join(_cell_texts(worst))
    return Note(
        code="undercovered",
        text=f"{len(below)} of {cells} cells; the least coverage is {worst['coverage']:.3f}, of "
        f"{worst['rows']:.0f} rows ({worst['target']}; {where}).",
        values={"below": len(below), "cells": cells, "coverage": float(worst["coverage"])},
    )


_CELL_TEXT = {
    "stiffness_loss": "loss {:g}",
    "damaged_teeth": "{:g} damaged teeth",
    "snr_db": "{:g} dB",
    "speed_rpm": "{:g} rpm",
    "torque": "{:g} N m",
}


def _cell_texts(cell: "pd.Series[float]") -> Iterator[str]:
    """Yield what a cell is of, in words."""
    for name, value in cell.items():
        if name in _CELL_TEXT and value == value:
            yield _CELL_TEXT[str(name)].format(value)
        elif name in SHOWN_QUANTITIES and value == value:
            yield f"{SHOWN_QUANTITIES[str(name)].title} {SHOWN_QUANTITIES[str(name)].text(value)}"
