"""The table of robustness: the outcomes of a model under each disturbance."""

from dataclasses import replace

import numpy as np
import pandas as pd

from sigdb.core import NotApplicableError, Note, OnStep, ignore
from sigdb.database import Database
from sigdb.pipeline.robustness.disturbances import DISTURBANCES
from sigdb.pipeline.robustness.nuisance_bounds import NuisanceBounds
from sigdb.pipeline.robustness.off_law_rows import CLEAN, OffLawRows, applicable
from sigdb.pipeline.robustness.outcomes import Robustness
from sigdb.recognition import Evaluation, Model, RobustnessSettings, requested_rows


def with_robustness(
    evaluation: Evaluation, model: Model, database: Database, settings: RobustnessSettings, *, on_step: OnStep = ignore
) -> Evaluation:
    """Return an evaluation with the table of robustness, where settings ask for it and it can be made.

    Parameters
    ----------
    evaluation : Evaluation
        Evaluation of the model on its database.
    model, database, settings, on_step
        As for :func:`robustness_table`.
    """
    if not settings.rows:
        return evaluation
    try:
        table = robustness_table(model, database, settings, on_step=on_step)
    except NotApplicableError as error:
        note = Note(code="no-robustness", text=f"Robustness is not tested: {error}.")
        return replace(evaluation, notes=(*evaluation.notes, note))
    return replace(evaluation, tables={**evaluation.tables, "robustness": table})


def robustness_table(
    model: Model, database: Database, settings: RobustnessSettings, *, on_step: OnStep = ignore
) -> pd.DataFrame:
    """Return the outcomes of a model under each disturbance, one row each.

    The rows are cases of the database that the model was not trained on, at some of their operating points. They are
    simulated anew with the disturbance, on gears and with noise of their own.

    Parameters
    ----------
    model : Model
        A trained model.
    database : Database
        Its database.
    settings : RobustnessSettings
        Number of rows, of operating points and of rigs, and the seed.
    on_step : callable
        Called with the name of each disturbance.

    Returns
    -------
    pandas.DataFrame
        ``disturbance``, ``text``, the outcomes of :meth:`Robustness.outcomes`, and ``loss_db``, the further noise at
        which the best possible answer (:class:`NuisanceBounds`) to the same rows has as many errors; nan where there
        is none. Where no law states the disturbance, the rows of the best answer are those without it.

    Raises
    ------
    NotApplicableError
        If the damage of a tooth is not the turned damage of another, as in trains of several meshes.
    """
    rows = _some_points(requested_rows(model, database), settings.points)
    cases = database.sql("select id, template, index_error, snr_db, tooth from cases order by id").set_index("id")
    rows = rows.join(cases[[name for name in cases if name not in rows]])
    robustness = Robustness.of(model, database, rows)
    chosen = np.sort(np.random.default_rng(settings.seed).choice(len(rows), min(settings.rows, len(rows)), False))
    off_law = OffLawRows(database, rows.iloc[chosen], database.sensors[0])
    if not off_law.plan.rig.turns_exactly(off_law.plan.gear):
        raise NotApplicableError(f"{database.store}: robustness is tested on rigs with one mesh")
    bounds = None
    if model.target == "location":
        bounds = NuisanceBounds(database, rows, database.sensors[0], settings.rigs)
    table, usual = [], None
    for number, disturbance in enumerate(DISTURBANCES):
        if not applicable(off_law, disturbance):
            continue
        on_step(f"robustness: {disturbance.name}")
        disturbed = off_law.disturbed_rows(disturbance, np.random.default_rng([settings.seed, number]))
        usual = disturbed if usual is None else usual
        outcomes = robustness.outcomes(disturbed.drop(columns=CLEAN))
        loss = np.nan
        if bounds is not None and disturbance.same_question:
            loss = bounds.loss_db(disturbance, disturbed if disturbance.is_stated else usual, outcomes["errors"])
        table.append({"disturbance": disturbance.name, "text": disturbance.text, **outcomes, "loss_db": loss})
    return pd.DataFrame(table)


def _some_points(rows: pd.DataFrame, most: int) -> pd.DataFrame:
    """Return the rows of at most so many operating points, evenly from the least speed to the greatest."""
    points = rows[["speed_rpm", "torque", "teeth"]].drop_duplicates().sort_values(["speed_rpm", "torque", "teeth"])
    chosen = points.iloc[np.unique(np.linspace(0, len(points) - 1, most).round().astype(int))]
    return rows[pd.MultiIndex.from_frame(rows[list(points)]).isin(pd.MultiIndex.from_frame(chosen))]
