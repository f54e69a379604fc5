"""The rows that a model is evaluated on."""

import pandas as pd

from sigdb.core import InputError
from sigdb.database import Database
from sigdb.recognition.splits.kinds import changed_parts, make_split, model_form
from sigdb.recognition.splits.split import TEST
from sigdb.recognition.training import Model, usable_rows


def requested_rows(model: Model, database: Database) -> pd.DataFrame:
    """The rows, by id, that :func:`evaluate` asks a model about."""
    return requested(model, database)[0]


def requested(model: Model, database: Database) -> tuple[pd.DataFrame, str]:
    """The rows that a model is asked about, and what they tell."""
    rows = usable_rows(database, model.target)
    if database.sensors[0] != model.sensor:
        raise InputError(f"the model reads {model.sensor!r}, {database.store} holds {database.sensors[0]!r} first")
    if database.manifest.hash == model.database_hash and model.split != "S1":
        rows, tells = _of_split(model, database, rows)
    else:
        rows, tells = _of_others(model, database, rows)
    if rows.empty:
        raise InputError(
            f"every specimen of {database.store} was used in training; evaluate on a database with another seed"
        )
    if model.target == "severity":
        rows = rows[rows["tooth"] > 0]
        if rows.empty:
            raise InputError(f"{database.store} has no damaged rows, and severity is judged on them")
    return rows, tells


def _of_split(model: Model, database: Database, rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Test rows of the split that the model was trained by, on the database that it was trained on."""
    split = make_split(model.split, rows, seed=model.seed, folds=model.folds)
    if split.hash != model.split_hash:
        raise InputError(
            f"{database.store} was extended since the model was trained, and the split {model.split} of its rows is "
            "another one now; train again"
        )
    return rows[split.folds(rows) == TEST], f"{split.name}, {split.tells}"


def _of_others(model: Model, database: Database, rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Rows of specimens that the model has not seen."""
    same_gears = database.manifest.seed == model.seed
    if same_gears:
        rows = rows[~rows["specimen"].isin(model.trained_on)]
    held_out = "specimens held out of training" if same_gears else "specimens of a database with another seed"
    changed = changed_parts(model.form, model_form(database.manifest.resolved))
    if changed:
        return rows, (
            f"S5, another model form: {database.store}, which differs in {', '.join(changed)}; {held_out}, the cases "
            "of that database"
        )
    same_cases = "the same cases" if database.manifest.hash == model.database_hash else "the cases of another database"
    return rows, f"S1, by specimen: {held_out}, {same_cases}"


def has_seen(model: Model, database: Database, rows: pd.DataFrame) -> bool:
    """Whether some rows are of specimens of the training, as under S0: the bound is for gears that are not known."""
    return database.manifest.seed == model.seed and bool(rows["specimen"].isin(model.trained_on).any())
