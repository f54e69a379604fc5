"""The rows that a model is evaluated on: those of cases and specimens that its training has not seen."""

from dataclasses import dataclass

import pandas as pd

from sigdb.core import InputError
from sigdb.database import KIND, MEASURED_SENSOR, TEST, Database, changed_parts, make_split, severity_quantities
from sigdb.recognition.model import Model
from sigdb.recognition.rows.further_columns import check_columns_of
from sigdb.recognition.splits.across import check_across
from sigdb.recognition.targets.all_targets import TARGETS
from sigdb.recognition.training import usable_rows
from sigdb.transmission import SIZES


@dataclass(frozen=True, kw_only=True)
class Selection:
    """How rows were selected.

    Attributes
    ----------
    split
        Name of the split: ``S0`` to ``S4``, ``S6`` or ``S7``, or ``S5`` for another model form.
    text
        Description of the split.
    seen
        Whether some rows are of specimens of the training, as under S0; the bound is for unseen gears.
    changed_parts
        Parts of the rig and the solver that differ from those of the training, for ``S5``.
    across
        Whether a model of simulated rows meets measured ones, or the other way round.
    """

    split: str
    text: str
    seen: bool = False
    changed_parts: tuple[str, ...] = ()
    across: bool = False


def requested_rows(model: Model, database: Database, where: str | None = None) -> pd.DataFrame:
    """Return the rows, by id, that :func:`evaluate` evaluates a model on.

    Parameters
    ----------
    model
        A trained model.
    database
        A finished database with the model's sensor first.
    where
        A condition on its rows, in SQL.

    Returns
    -------
    pandas.DataFrame
        Scalars of each row: case, specimen, operating point and noise.

    Raises
    ------
    InputError
        As :func:`evaluate`.
    """
    return select_rows(model, database, where)[0]


def select_rows(model: Model, database: Database, where: str | None = None) -> tuple[pd.DataFrame, Selection]:
    """Return the rows of a database that a model is evaluated on, and how they were selected."""
    check_columns_of(model.columns, model.added, database)
    every, target = usable_rows(database, model.target, model.columns), TARGETS[model.target]
    rows = every
    if where is not None:
        rows = every[every.index.isin(database.cases(where)["id"])]
        if rows.empty:
            raise InputError(f"{database.store}: no row with a label meets {where}")
    across = database.manifest.is_measured != (model.sensor == MEASURED_SENSOR)
    if database.sensors[0] != model.sensor and not across:
        raise InputError(f"the model reads {model.sensor!r}, {database.store} holds {database.sensors[0]!r} first")
    if across:
        check_across(model, database, rows)
        selection = _across(database)
    elif database.manifest.hash == model.database_hash and model.split != "S1":
        tested, selection = _of_split(model, database, every)  # a split is one of all rows
        rows = tested[tested.index.isin(rows.index)]
        if rows.empty:
            raise InputError(f"{database.store}: no held-out row of the split {selection.split} meets {where}")
    else:
        rows, selection = _of_others(model, database, rows)
    if rows.empty:
        raise InputError(
            f"every specimen of {database.store} was used in training; evaluate on a database with another seed"
        )
    classes = model.estimator.kinds
    if unknown := sorted({*rows[KIND]} - {*classes}) if classes else []:
        listed = ", ".join(unknown)
        raise InputError(
            f"{database.store} has rows of the kinds {listed}, and the model was trained on {', '.join(classes)}; "
            "train it on all kinds, or evaluate on other rows"
        )
    if target.damaged_only:
        rows = rows[rows["tooth"] > 0]
        if rows.empty:
            raise InputError(f"{database.store} has no damaged rows, and {target.name} is evaluated on them")
    answered = getattr(model.estimator, "quantities_", ())
    if answered and (sizes := [name for name in severity_quantities(rows) if name in SIZES and name not in answered]):
        raise InputError(
            f"{database.store} has damage whose {', '.join(sizes)} is not 0, and the model answers "
            f"{', '.join(answered)}; train it on such damage too, or evaluate on other rows"
        )
    return rows, selection


def _across(database: Database) -> Selection:
    """Return the selection of all rows, where a model of simulated rows meets measured ones or the other way round."""
    kinds = ("simulated", "measured") if database.manifest.is_measured else ("measured", "simulated")
    text = "across: trained on {} rows, and tested on all {} rows of {}".format(*kinds, database.store)
    return Selection(split="S6" if database.manifest.is_measured else "S5", text=text, across=True)


def _of_split(model: Model, database: Database, rows: pd.DataFrame) -> tuple[pd.DataFrame, Selection]:
    """Return the test rows of the model's split, on the database of its training."""
    split = make_split(model.split, rows, seed=model.seed, folds=model.folds, allow_leak=True)
    if split.hash != model.split_hash:
        raise InputError(
            f"{database.store} was extended since the model was trained, and the split {model.split} of its rows is "
            "another one now; train again"
        )
    rows = rows[split.folds(rows) == TEST]
    seen = bool(rows["specimen"].isin(model.trained_on).any())
    return rows, Selection(split=split.name, text=split.text, seen=seen)


def _of_others(model: Model, database: Database, rows: pd.DataFrame) -> tuple[pd.DataFrame, Selection]:
    """Return the rows of specimens that the model has not seen."""
    same_gears = database.manifest.seed == model.seed
    if same_gears:
        rows = rows[~rows["specimen"].isin(model.trained_on)]
    held_out = "specimens held out of training" if same_gears else "specimens of a database with another seed"
    changed = changed_parts(model.form, database.manifest.resolved)
    if changed:
        text = f"another model form: {database.store}, which differs in {', '.join(changed)}; {held_out}, the cases "
        return rows, Selection(split="S5", text=f"{text}of that database", changed_parts=tuple(changed))
    same_cases = "the same cases" if database.manifest.hash == model.database_hash else "the cases of another database"
    return rows, Selection(split="S1", text=f"by specimen: {held_out}, {same_cases}")
