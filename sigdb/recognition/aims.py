"""What a model should reach, whether it does, and where it does not."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from sigdb.recognition.efficiency import ERROR_RANGE, in_range
from sigdb.recognition.metrics_calibration import ENOUGH
from sigdb.recognition.metrics_coverage import ENOUGH as ENOUGH_OF_CELL
from sigdb.recognition.metrics_coverage import LEAST_COVERAGE
from sigdb.recognition.metrics_detection import NEEDED
from sigdb.recognition.noise_bands import ALL
from sigdb.recognition.pod import RATE

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
    return pd.DataFrame([asdict(one) for one in _aims(target, table, cells, " ".join(causes), bounded)])


def _aims(target: str, table: pd.DataFrame, cells: pd.DataFrame | None, causes: str, bounded: bool) -> Iterator[Aim]:
    if not bounded:
        unknown = "the bound is not known: no row follows the law that it is computed from"
        names = _OF_SEVERITY if target == "severity" else _OF_LOCATION if target == "location" else _OF_DETECTION
        yield from (Aim(what=what, aim=aim, why=unknown) for what, aim in names.items())
    elif target == "severity":
        for name, own in table.groupby("target", sort=False):
            yield _worst(f"MAE of {name} over the posterior median's", RATIO, "mae_ratio", own, causes)
    else:
        if target == "location":
            yield _worst(*list(_OF_LOCATION.items())[0], "loss_db", table, causes)
        yield _worst(*list(_OF_DETECTION.items())[0], "a90_ratio", table, causes)
    if target == "location":
        yield _worst("calibration error (ECE)", ECE, "ece", table, "")
    yield _of_cells(cells)


_OF_DETECTION = {f"a90 over the bound's at {RATE:g} false alarms": RATIO}
_OF_LOCATION = {"location, loss against the bound, dB": LOSS_DB} | _OF_DETECTION
_OF_SEVERITY = {"MAE over the posterior median's": RATIO}


def _worst(what: str, aim: float, column: str, table: pd.DataFrame, causes: str) -> Aim:
    own = table[[_judged(column, row) for _, row in table.iterrows()]] if column in table else table[:0]
    own = own if (own["band"] == ALL).all() else own[own["band"] != ALL]
    if own.empty:
        return Aim(what=what, aim=aim, why=_why_not(column, table))
    worst = own.loc[own[column].idxmax()]
    met = bool(worst[column] <= aim)
    return Aim(
        what=what,
        aim=aim,
        found=float(worst[column]),
        low=float(worst[f"{column}_low"]),
        high=float(worst[f"{column}_high"]),
        where=worst["band"],
        met=met,
        why=""
        if met
        else " ".join([_where_missed(column, own, aim), _by_how_much(column, worst, aim), causes]).strip(),
    )


def _judged(column: str, row: pd.Series) -> bool:
    """Whether a band tells."""
    if np.isnan(row[column]):
        return False
    return column != "mae_ratio" or in_range(row["bound_error"], row["chance"])


def _where_missed(column: str, own: pd.DataFrame, aim: float) -> str:
    """Which bands miss an aim, and by how much."""
    missed = own[own[column] > aim]
    said = ", ".join(
        f"{value:.3g} at {_place(band)}" for band, value in zip(missed["band"], missed[column], strict=True)
    )
    return f"Missed in {len(missed)} of {len(own)} noise bands ({said})." if len(own) > 1 else ""


def _by_how_much(column: str, worst: pd.Series, aim: float) -> str:
    if column == "ece":
        return (
            f"At {_place(worst['band'])} an answer is given {worst['confidence']:.3f} on average, and "
            f"{1 - worst['error_of_answers']:.3f} are right."
        )
    if np.isinf(worst[column]):
        return "The model's is beyond what the rows hold."
    if worst[f"{column}_low"] <= aim:
        return f"The interval [{worst[f'{column}_low']:.3g}, {worst[f'{column}_high']:.3g}] holds the aim."
    return ""


def _place(band: str) -> str:
    return "all rows" if band == ALL else band


def _why_not(column: str, table: pd.DataFrame) -> str:
    """Why no band tells of a figure."""
    if column == "ece":
        if "confidence" not in table or table["confidence"].isna().all():
            return "the model gives no probabilities"
        return f"a noise band has {table['rows'].max()} rows at most, and needs {ENOUGH}"
    if column == "a90_ratio":
        if "a90" not in table:
            return "the model gives no score of damage, or the rows have no stiffness loss"
        return (
            f"no band has the {NEEDED / RATE:.0f} healthy rows that {RATE:g} false alarms take, and a bound whose a90 "
            "is within the losses of the rows"
        )
    low, high = ERROR_RANGE
    share = table["bound_error"] / table["chance"]
    return (
        f"the bound's error is {share.min():.3g} to {share.max():.3g} of that by chance, and a loss is told between "
        f"{low:g} and {high:g}"
    )


def _of_cells(cells: pd.DataFrame | None) -> Aim:
    what = f"share of cells whose 90 % sets cover less than {LEAST_COVERAGE:g}, at 99 % confidence"
    if cells is None:
        return Aim(what=what, aim=CELLS, why="the model gives neither sets nor intervals")
    if cells.empty:
        return Aim(
            what=what, aim=CELLS, why=f"no cell of severity, noise and operating point has {ENOUGH_OF_CELL} rows"
        )
    below = cells[cells["below"]]
    share = len(below) / len(cells)
    met = share <= CELLS
    return Aim(what=what, aim=CELLS, found=share, met=met, why="" if met else _which_cells(below, len(cells)))


def _which_cells(below: pd.DataFrame, count: int) -> str:
    worst = below.loc[below["coverage"].idxmin()]
    loss = worst["stiffness_loss"]
    severity = "healthy" if np.isnan(loss) else f"loss {loss:g}"
    return (
        f"{len(below)} of {count} cells; the least is {worst['coverage']:.3f} of {worst['rows']} rows ({worst['target']}"
        f"; {severity}, {worst['snr_db']:g} dB, {worst['speed_rpm']:g} rpm, {worst['torque']:g} N m)."
    )
