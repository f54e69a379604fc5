"""What a model should reach, whether it does, and where it does not."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from sigdb.recognition.bound.efficiency import ALL
from sigdb.recognition.bound.error_curve import ERROR_RANGE
from sigdb.recognition.metrics.calibration import ENOUGH
from sigdb.recognition.metrics.coverage import ENOUGH as ENOUGH_OF_CELL
from sigdb.recognition.metrics.coverage import LEAST_COVERAGE
from sigdb.recognition.metrics.detection import NEEDED
from sigdb.recognition.metrics.probability_of_detection import RATE
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.recognition.templates.bank import TemplateBank, bank_of
from sigdb.recognition.training import Model

LOSS_DB, RATIO, ECE, CELLS = 0.25, 1.05, 0.01, 0.01
"""Aims: loss against the Bayes rule, dB; errors and a90 over the bound's; calibration error; share of cells."""


@dataclass(frozen=True, kw_only=True)
class Aim:
    """One aim.

    Attributes
    ----------
    what
        The figure, in words.
    aim
        What it is not to exceed.
    found, low, high
        Its value where it is worst, and the interval; nan where it cannot be judged.
    where
        The noise band where it is worst.
    met
        Whether it is kept; None where it cannot be judged.
    why
        Why it is missed, or cannot be judged; else empty.
    """

    what: str
    aim: float
    found: float = np.nan
    low: float = np.nan
    high: float = np.nan
    where: str = ""
    met: bool | None = None
    why: str = ""


def aims(
    target: str, table: pd.DataFrame, cells: pd.DataFrame | None, causes: Sequence[str] = (), *, bounded: bool = True
) -> pd.DataFrame:
    """The aims of a model, one a row: the attributes of :class:`Aim`.

    Each is judged in every noise band where that can be done, and by the worst; over all rows where it can be in none.
    Against the bound that is where its error is between 0.02 and 0.8 of that by chance.

    Parameters
    ----------
    target
        Of the model.
    table
        Of :func:`against_bound`.
    cells
        Coverage by cell, see :func:`coverage_cells`; None where the model gives neither sets nor intervals.
    causes
        Sentences on what sets the model back (:func:`causes`); they go with aims against the bound that are missed.
    bounded
        Whether the bound is known.
    """
    unknown = _NO_BOUND if not bounded else _ALL_ALIKE if table.empty else ""
    against = [
        _worst(name, *aim, own, causes) if not unknown else Aim(what=name, aim=aim[1], why=unknown)
        for aim in _AGAINST_BOUND[target]
        for name, own in _named(_WORDS[aim[0]], table)
    ]
    calibration = [_worst(_WORDS["ece"], "ece", ECE, table)] if target == "location" else []
    sets = [] if target == "detection" else [_of_cells(cells)]
    return pd.DataFrame([asdict(one) for one in (*against, *calibration, *sets)])


_AGAINST_BOUND = {
    "location": (("loss_db", LOSS_DB), ("a90_ratio", RATIO)),
    "detection": (("a90_ratio", RATIO),),
    "severity": (("mae_ratio", RATIO),),
}
_WORDS = {
    "loss_db": "location, loss against the bound, dB",
    "a90_ratio": f"a90 over the bound's, at a false-alarm rate of {RATE:g}",
    "mae_ratio": "MAE over the posterior median's",
    "ece": "calibration error (ECE)",
    "cells": f"share of cells where 90 % sets cover less than {LEAST_COVERAGE:g} (99 % confidence)",
}
_NO_BOUND = "the bound is not known: no row follows a law that it could be computed from"
_ALL_ALIKE = "all rows have the same severity, so that there is nothing to tell"


def _named(words: str, table: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """A figure's name and rows, for each target of severity."""
    if "target" not in table:
        return [(words, table)]
    return [(f"{name}, {words}", own) for name, own in table.groupby("target", sort=False)]


def _worst(what: str, column: str, aim: float, table: pd.DataFrame, causes: Sequence[str] = ()) -> Aim:
    own = table[_tells(column, table)]
    own = own if (own["band"] == ALL).all() else own[own["band"] != ALL]
    if own.empty:
        return Aim(what=what, aim=aim, why=_why_not(column, table))
    worst = own.to_dict("records")[int(own[column].argmax())]
    value, low, high = (float(worst[f"{column}{end}"]) for end in ("", "_low", "_high"))
    met = value <= aim
    why = () if met else (_where_missed(column, own, aim), *_more(column, worst, aim), *causes)
    return Aim(what=what, aim=aim, found=value, low=low, high=high, where=worst["band"], met=met, why=" ".join(why))


def _tells(column: str, table: pd.DataFrame) -> pd.Series:
    """Whether each band tells of a figure."""
    if column not in table:
        return pd.Series(False, table.index)
    low, high = ERROR_RANGE
    known = table[column].notna()
    return known & (table["bound_error"] / table["chance"]).between(low, high) if column == "mae_ratio" else known


def _where_missed(column: str, own: pd.DataFrame, aim: float) -> str:
    missed = own[own[column] > aim]
    said = ", ".join(
        f"{_number(value)} at {band}" for band, value in zip(missed["band"], missed[column], strict=True) if band != ALL
    )
    return f"Missed in {len(missed)} of {len(own)} noise bands: {said}." if said else "Missed over all rows."


def _more(column: str, worst: dict[Hashable, Any], aim: float) -> Iterator[str]:
    """What else the worst band tells."""
    if column == "ece":
        right = 1 - worst["error_of_answers"]
        yield f"There the answers are given {worst['confidence']:.3f} on average, and {right:.3f} of them are right."
    elif np.isinf(worst[column]):
        yield "There the model's figure is beyond what the rows hold."
    elif worst[f"{column}_low"] <= aim:
        yield f"The interval there, {worst[f'{column}_low']:.3g} to {worst[f'{column}_high']:.3g}, holds the aim."


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "more than can be told"


def _why_not(column: str, table: pd.DataFrame) -> str:
    """Why no band tells of a figure."""
    if column == "ece":
        most = table["rows"].max()
        return (
            f"a noise band has {most} rows at most, and needs {ENOUGH}" if "confidence" in table else _NO_PROBABILITIES
        )
    if column == "a90_ratio":
        return _NO_A90.format(NEEDED / RATE, RATE) if "a90" in table else _NO_SCORES
    share, (low, high) = table["bound_error"] / table["chance"], ERROR_RANGE
    return (
        f"the bound's error is {share.min():.2g} to {share.max():.2g} of that by chance, and the aim is for {low:g} to "
        f"{high:g}"
    )


_NO_PROBABILITIES = "the model gives no probabilities"
_NO_SCORES = "the model gives no score of damage, or the rows have no losses"
_NO_A90 = (
    "no band has the {:.0f} healthy rows that a rate of {:g} takes, and a bound that finds a loss within those of the "
    "rows with a probability of 0.9"
)


def _of_cells(cells: pd.DataFrame | None) -> Aim:
    if cells is None or cells.empty:
        few = f"no cell of severity, noise and operating point has {ENOUGH_OF_CELL} rows"
        return Aim(what=_WORDS["cells"], aim=CELLS, why="the model gives no sets" if cells is None else few)
    below = cells[cells["below"].astype(bool)]
    share = len(below) / len(cells)
    why = "" if share <= CELLS else _least(below.to_dict("records")[int(below["coverage"].argmin())], below, cells)
    return Aim(what=_WORDS["cells"], aim=CELLS, found=share, met=share <= CELLS, why=why)


def _least(worst: dict[Hashable, Any], below: pd.DataFrame, cells: pd.DataFrame) -> str:
    where = ", ".join(said.format(worst[name]) for name, said in _CELL_WORDS.items() if name in worst)
    return (
        f"{len(below)} of {len(cells)} cells; the least coverage is {worst['coverage']:.3f}, of {worst['rows']} rows "
        f"({worst['target']}; {where})."
    )


_CELL_WORDS = {
    "stiffness_loss": "loss {:g}",
    "damaged_teeth": "{:g} damaged teeth",
    "snr_db": "{:g} dB",
    "speed_rpm": "{:g} rpm",
    "torque": "{:g} N m",
}


_ALIKE = 1e-3
"""Relative difference of operating points, and of sizes of index errors, below which they count as the same."""


def causes(model: Model, rows: pd.DataFrame, split: str, index_error: float | None = None) -> list[str]:
    """Sentences, none where nothing is found.

    Parameters
    ----------
    model
        A trained model.
    rows
        The rows that it is asked about: operating point, tooth count, severities.
    split
        How they were chosen, see :class:`Evaluation`.
    index_error
        Size of the index errors of the rows, m, root mean square, where it is known.
    """
    bank = bank_of(model.estimators[model.learner])
    found = list(_of_bank(bank, rows, index_error)) if bank is not None else [_READS.format(model.learner)]
    return [*found, *_of_split(split)]


_READS = "The learner {} reads pooled features of an average, which hold less than the average that the bound reads."


def _of_split(split: str) -> Iterator[str]:
    name, _, tells = split.partition(", ")
    if name in ("S2", "S3", "S4"):
        yield f"The rows are of cases that training has not seen ({tells.partition(':')[0]})."
    if name == "S5":
        parts = tells.partition("differs in ")[2].partition(";")[0]
        yield f"The rows are of another model form than the training rows: {parts} differ."


def _of_bank(bank: TemplateBank, rows: pd.DataFrame, index_error: float | None) -> Iterator[str]:
    unseen = ~rows["teeth"].isin(bank.teeth)
    if unseen.any():
        counts = ", ".join(f"{one:g}" for one in np.unique(rows.loc[unseen, "teeth"]))
        yield f"The bank has no templates of {counts} teeth; it has {', '.join(map(str, bank.teeth))}."
    known = rows[~unseen]
    if len(known):
        yield from _of_points(bank, known)
        yield from _of_severities(bank, known)
    if index_error and abs(index_error / max(bank.index_error, 1e-300) - 1) > _ALIKE:
        sizes = (1e6 * index_error, 1e6 * bank.index_error)
        yield "The index errors of the rows are {:.3g} um, those of the bank {:.3g} um.".format(*sizes)


def _of_points(bank: TemplateBank, rows: pd.DataFrame) -> Iterator[str]:
    points = rows.groupby(["speed_rpm", "torque", "teeth"]).size()
    asked = points.index.to_frame().to_numpy(float)
    nearest = [bank.points[place] for place in bank.nearest(*asked.T)]
    away = np.abs(asked[:, :2] / [[one.speed_rpm, one.torque] for one in nearest] - 1)
    off = (away > _ALIKE).any(axis=1)
    if off.any():
        speed, torque = 100 * np.average(away[off], axis=0, weights=points.to_numpy()[off])
        share = 100 * points.to_numpy()[off].sum() / len(rows)
        yield (
            f"{share:.0f} % of the rows are at operating points that the bank has no templates of: the nearest "
            f"are {speed:.2g} % in speed and {torque:.2g} % in torque away, on average."
        )


def _of_severities(bank: TemplateBank, rows: pd.DataFrame) -> Iterator[str]:
    held = {tuple(one) for point in bank.points for one in point.severity[~point.healthy].round(9).tolist()}
    plain = rows.loc[rows["tooth"] > 0, list(QUANTITIES)].dropna().round(9).drop_duplicates()
    lacking = [one for one in plain.itertuples(index=False, name=None) if tuple(map(float, one)) not in held]
    if lacking:
        yield f"Of the {len(plain)} severities asked about the bank has no templates of {len(lacking)}."
