"""From a database to a model's folder, with the settings of the database's own recipe."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from sigdb.core import Section, validated
from sigdb.database import Database
from sigdb.recognition import (
    Evaluation,
    Model,
    RecognitionSettings,
    evaluate,
    requested_rows,
    save_model,
    train,
)

S = TypeVar("S", bound=Section)


def recipe_section(database: Database, section: type[S], name: str) -> S:
    """A section of the recipe that a database was made from; its defaults where the recipe has none."""
    text = database.manifest.recipe
    return validated(section, tomllib.loads(text).get(name, {}), owner=f"{database.store}/sigdb.toml: recipe: {name}")


def evaluate_model(model: Model, database: Database) -> Evaluation:
    """Evaluate a model with the criteria of a database's recipe.

    Parameters
    ----------
    model
        A trained model.
    database
        A finished database.
    """
    criteria = recipe_section(database, RecognitionSettings, "recognition").criteria
    return evaluate(model, database, criteria=criteria)


def train_model(
    database: Database,
    target: str,
    folder: str | Path,
    *,
    learner: str | None = None,
    false_alarm_rate: float | None = None,
    split: str = "S1",
    command: str,
    on_step: Callable[[str], Any] = lambda step: None,
    on_evaluation: Callable[[Evaluation], Any] = lambda evaluation: None,
    check: bool = True,
) -> Evaluation:
    """Train a model, evaluate it on what was held out, and write its folder.

    Parameters
    ----------
    database
        A finished database.
    target
        ``location``, ``severity`` or ``detection``.
    folder
        Folder of the model.
    learner
        Learner; that of the database's recipe if left out.
    false_alarm_rate
        Rate of false alarms of detectors and thresholds; that of the database's recipe if left out.
    split
        What is left out for the evaluation, ``S0`` to ``S4``; see :func:`sigdb.recognition.make_split`.
    command
        The command that makes it again, for the card.
    on_step
        Called with the name of each estimator before it is trained, and with a sentence on what is left out.
    on_evaluation
        Called with the evaluation once the folder is written.
    check
        Whether a model that is better than the bound is refused, once it is written.

    Raises
    ------
    EvaluationError
        If the model is better than is possible.
    """
    settings = recipe_section(database, RecognitionSettings, "recognition")
    given = {"learner": learner, "false_alarm_rate": false_alarm_rate}
    given = {name: value for name, value in given.items() if value is not None}
    settings = validated(RecognitionSettings, settings.model_dump() | given, owner="train_model")
    Path(folder).mkdir(parents=True, exist_ok=True)  # a folder that cannot be written is told before the work
    model = train(database, target, settings, split=split, on_step=on_step)
    evaluation = evaluate(model, database, criteria=settings.criteria)
    save_model(
        model,
        folder,
        evaluation=evaluation,
        probe=model.probe(database, requested_rows(model, database)),
        command=command,
    )
    on_evaluation(evaluation)
    if check:
        evaluation.check()
    return evaluation
