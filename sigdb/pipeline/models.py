"""Training and evaluation of models with the settings of their database's recipe."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from sigdb.core import InputError, OnStep, blocks, ignore, validated
from sigdb.database import Database, default_split
from sigdb.pipeline.recipe import recipe_section
from sigdb.pipeline.robustness.robustness import with_robustness
from sigdb.recognition import (
    Costs,
    Evaluation,
    Model,
    RecognitionSettings,
    evaluate,
    requested_rows,
    save_model,
    train,
)

_ROWS_AT_ONCE = 4096
"""Rows whose averages are in memory at once: 25 MB of 768 samples."""


def evaluate_model(model: Model | Any, database: Database, **options: Any) -> Evaluation:
    """Evaluate a model with the criteria of a database's recipe.

    Parameters
    ----------
    model
        A trained model, or an estimator of one's own.
    database
        A finished database.
    **options
        Options for an estimator of one's own, see :func:`sigdb.recognition.evaluate`.
    """
    settings = recipe_section(database, RecognitionSettings, "recognition")
    return evaluate(model, database, criteria=settings.criteria, settings=settings, **options)


def assess_rows(
    model: Model,
    database: Database,
    *,
    where: str | None = None,
    prevalence: float | None = None,
    costs: Costs | None = None,
) -> Iterator[pd.DataFrame]:
    """Yield the answers of a model to rows of a database, some rows at a time.

    Parameters
    ----------
    model
        A trained model.
    database
        A database of simulated or measured rows.
    where
        Only rows that meet this SQL condition; all that have a result if left out.
    prevalence, costs
        As of :meth:`sigdb.recognition.Model.predict`.

    Yields
    ------
    pandas.DataFrame
        By ``id``, the columns of :meth:`sigdb.recognition.Model.assess`.

    Raises
    ------
    InputError
        If no row with a result meets the condition.
    """
    rows = database.cases(where)
    rows = rows[rows["status"] == "ok"].set_index("id")
    if rows.empty:
        raise InputError(f"{database.store} has no row with a result{f' where {where}' if where else ''}")
    for some in blocks(len(rows), _ROWS_AT_ONCE):
        batch = model.read(database, rows.iloc[some])
        yield model.assess(batch, prevalence=prevalence, costs=costs).rename_axis("id")


def train_model(
    database: Database,
    target: str,
    folder: str | Path,
    *,
    learner: str | None = None,
    false_alarm_rate: float | None = None,
    split: str | None = None,
    allow_leak: bool = False,
    columns: Sequence[str] | None = None,
    command: str,
    others: Mapping[str, Database] | None = None,
    on_step: OnStep = ignore,
    on_evaluation: Callable[[Evaluation], object] = ignore,
    check: bool = True,
) -> Evaluation:
    """Train a model, evaluate it on the rows that its split holds out, and write its folder.

    Parameters
    ----------
    database : Database
        A finished database.
    target : str
        ``location``, ``severity`` or ``detection``.
    folder : str or path-like
        Folder of the model.
    learner : str, optional
        Learner; that of the database's recipe if left out.
    false_alarm_rate : float, optional
        Rate of false alarms of detectors and thresholds; that of the database's recipe if left out.
    split : str, optional
        Split of training and evaluation; see :func:`sigdb.recognition.make_split`. By default ``S1``, of recordings
        ``recording``.
    allow_leak : bool
        Whether the split ``random`` of recordings may be made.
    columns : sequence of str, optional
        Further columns that ``lda`` and ``boosting`` read: indicators, added features, or the ``MODULE:FUNCTION`` that
        added them; those of the database's recipe if left out.
    command : str
        Command that makes the model again, for its card.
    others : mapping of str to Database, optional
        By name, other databases that the model is evaluated on for its card.
    on_step : callable
        Called with the name of each estimator before it is trained, and with a sentence on each that is left out.
    on_evaluation : callable
        Called with the evaluation, and then with those on the others, once the folder is written.
    check : bool
        Whether to refuse a model that is better than the bound, once it is written.

    Returns
    -------
    Evaluation
        The evaluation of the model.

    Raises
    ------
    EvaluationError
        If the model is better than the best possible answer.
    """
    settings = recipe_section(database, RecognitionSettings, "recognition")
    options = {"learner": learner, "false_alarm_rate": false_alarm_rate, "columns": columns}
    changes = {name: value for name, value in options.items() if value is not None}
    settings = validated(RecognitionSettings, settings.model_dump() | changes, owner="train_model")
    Path(folder).mkdir(parents=True, exist_ok=True)  # a folder that cannot be written fails before the work
    split = split or default_split(database)
    model = train(database, target, settings, split=split, allow_leak=allow_leak, on_step=on_step)
    evaluation = evaluate(model, database, criteria=settings.criteria)
    elsewhere = {name: evaluate(model, other, criteria=settings.criteria) for name, other in (others or {}).items()}
    evaluation = with_robustness(evaluation, model, database, settings.robustness, on_step=on_step)
    save_model(
        model,
        folder,
        evaluation=evaluation,
        probe=model.probe(database, requested_rows(model, database)),
        command=command,
        elsewhere=elsewhere,
    )
    for each in (evaluation, *elsewhere.values()):
        on_evaluation(each)
    if check:
        evaluation.check()
    return evaluation
