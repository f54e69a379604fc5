"""What sets a model back on rows, as far as numbers tell: what it reads, and what of the rows it has not seen."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from sigdb.recognition.severity import TARGETS
from sigdb.recognition.template_bank import TemplateBank, bank_of
from sigdb.recognition.training import Model

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
    plain = rows.loc[rows["tooth"] > 0, list(TARGETS)].dropna().round(9).drop_duplicates()
    lacking = [one for one in plain.itertuples(index=False, name=None) if tuple(map(float, one)) not in held]
    if lacking:
        yield f"Of the {len(plain)} severities asked about the bank has no templates of {len(lacking)}."
