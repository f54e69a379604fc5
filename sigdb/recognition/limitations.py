"""Known limitations of a model on some rows: what it does not read, and what its training has not seen."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from sigdb.core import Note
from sigdb.database import severity_levels
from sigdb.recognition.estimators.user_estimator import UserEstimator
from sigdb.recognition.evaluated_rows import Selection
from sigdb.recognition.model import Model
from sigdb.recognition.templates.bank import TemplateBank

_ALIKE = 1e-3
"""Relative difference of operating points, and of sizes of index errors, below which they count as equal."""


def limitations(model: Model, rows: pd.DataFrame, selection: Selection, index_error: float | None = None) -> list[Note]:
    """Return reasons why a model may fall short on some rows; none where there is no known reason.

    Parameters
    ----------
    model
        A trained model.
    rows
        Evaluated rows: operating point, tooth count, severities.
    selection
        How the rows were selected.
    index_error
        Root mean square of the index errors of the rows, m; None where it is not known.
    """
    bank = model.estimator.template_bank
    notes = list(_of_bank(bank, rows, index_error)) if bank is not None else []
    if bank is None and not isinstance(model.estimator, UserEstimator):
        notes.append(_features_only(model.learner))
    return [*notes, *_of_selection(selection)]


def _features_only(learner: str) -> Note:
    text = f"The learner {learner} reads pooled features, which hold less than the average that the bound reads."
    return Note(code="pooled-features", text=text, values={"learner": learner})


def _of_selection(selection: Selection) -> Iterator[Note]:
    if selection.split in ("S2", "S3", "S4", "S6", "S7"):
        text = f"The rows are of cases that training has not seen; {selection.text}."
        yield Note(code="unseen-cases", text=text, values={"split": selection.split})
    if selection.changed_parts:
        parts = ", ".join(selection.changed_parts)
        text = f"The rows are of another model form than the training rows: {parts} differ."
        yield Note(code="other-model-form", text=text, values={"parts": parts})


def _of_bank(bank: TemplateBank, rows: pd.DataFrame, index_error: float | None) -> Iterator[Note]:
    unseen = ~rows["teeth"].isin(bank.teeth)
    if unseen.any():
        counts = ", ".join(f"{count:g}" for count in np.unique(rows.loc[unseen, "teeth"]))
        text = f"The bank has no templates of {counts} teeth; it has {', '.join(map(str, bank.teeth))}."
        yield Note(code="no-templates-of-teeth", text=text, values={"teeth": counts})
    if not unseen.all():
        yield from _of_points(bank, rows[~unseen])
        yield from _of_severities(bank, rows[~unseen])
    if index_error and abs(index_error / max(bank.index_error, 1e-300) - 1) > _ALIKE:
        sizes = (1e6 * index_error, 1e6 * bank.index_error)
        text = "The index errors of the rows are {:.3g} um, those of the bank {:.3g} um.".format(*sizes)
        yield Note(code="other-index-errors", text=text, values={"rows_um": sizes[0], "bank_um": sizes[1]})


def _of_points(bank: TemplateBank, rows: pd.DataFrame) -> Iterator[Note]:
    points = rows.groupby(["speed_rpm", "torque", "teeth"]).size()
    requested = points.index.to_frame().to_numpy(float)
    stored = np.array([bank.stored_point(speed, torque, int(teeth)) for speed, torque, teeth in requested])
    away = np.abs(requested[:, :2] / stored - 1)
    off = (away > _ALIKE).any(axis=1)
    if off.any():
        speed, torque = 100 * np.average(away[off], axis=0, weights=points.to_numpy()[off])
        share = 100 * points.to_numpy()[off].sum() / len(rows)
        yield Note(
            code="off-operating-points",
            text=f"{share:.0f} % of the rows are at operating points that the bank has no templates of, nor between "
            f"its own: the nearest are {speed:.2g} % in speed and {torque:.2g} % in torque away, on average.",
            values={"share": float(share), "speed": float(speed), "torque": float(torque)},
        )


def _of_severities(bank: TemplateBank, rows: pd.DataFrame) -> Iterator[Note]:
    held = {
        tuple(row) for point in bank.points for row in np.nan_to_num(point.severity[~point.healthy]).round(9).tolist()
    }
    damaged = severity_levels(rows[rows["tooth"] > 0], bank.quantities)
    plain = damaged[damaged.iloc[:, -1].notna()].fillna(0).round(9).drop_duplicates()
    lacking = [row for row in plain.itertuples(index=False, name=None) if tuple(map(float, row)) not in held]
    if lacking:
        text = f"The rows have {len(plain)} severities; the bank has no templates of {len(lacking)} of them."
        yield Note(
            code="no-templates-of-severities",
            text="The bank has no templates of the only severity of the rows." if len(plain) == 1 else text,
            values={"severities": len(plain), "lacking": len(lacking)},
        )
