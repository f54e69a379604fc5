"""``sigdb evaluate``."""

import sys
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.names import NameChoice
from sigdb.cli.options.places import DATABASE
from sigdb.core import InputError

if TYPE_CHECKING:
    from sigdb.recognition import Evaluation


@click.command()
@click.argument("model")
@click.argument("database", metavar="DB", type=DATABASE)
@click.option(
    "--report",
    metavar="DIR",
    type=click.Path(),
    help="Write a page with pictures, index.html, and all numbers, evaluation.json, into this folder.",
)
@click.option(
    "--target",
    type=NameChoice("sigdb.recognition", "TARGET_NAMES"),
    help="Question that an estimator of yours answers; by default location.",
)
@click.option(
    "--split",
    type=NameChoice("sigdb.database", "SPLIT_NAMES"),
    help="Cases that are held out of the training of an estimator of yours; by default S1, for recordings recording.",
)
@click.option(
    "--column",
    "columns",
    multiple=True,
    help="Input column of an estimator of yours, such as tsa; may be repeated. By default all of features.",
)
@click.option(
    "--drawn-rows",
    is_flag=True,
    help="Train an estimator of yours on the 25 000 rows that are drawn for the baselines, in place of all.",
)
@click.option(
    "--baselines/--no-baselines",
    default=True,
    help="Train and evaluate the learners and baselines of sigdb too.",
)
@click.option("--bound/--no-bound", default=True, help="Compute the best possible answer, which takes longest.")
@click.option("--where", help="Evaluate only on rows that meet this condition, in SQL, such as \"sensor = 'a1'\".")
@format_option("table", "json")
def evaluate(
    model: str,
    database: str,
    report: str | None,
    target: str | None,
    split: str | None,
    columns: tuple[str, ...],
    drawn_rows: bool,
    baselines: bool,
    bound: bool,
    where: str | None,
    form: str,
) -> int:
    """Evaluate a model on the rows of a database that it has not seen: a folder, or an estimator of one's own.

    MODEL is the folder of a model, or FILE.py:NAME or MODULE:NAME of a class with fit and predict (and predict_proba),
    which is first trained on the rows that the split leaves for it.

    On the database of its training these are the cases that its split held out, on another database all rows of other
    specimens. The result has the baselines that were trained on the same rows, the best possible answer, and the
    criteria of the database's recipe. A model of simulated rows is tested on measured ones as they are: one sensor, in
    its unit, with its tooth counts. The exit code is 1 if the model is better than the best possible answer, which no
    honest model is.

    \b
    Example:
      sigdb evaluate data/quick/location data/quick/signatures
      sigdb evaluate sklearn.naive_bayes:GaussianNB data/quick/signatures --column fm4 --column kurtosis
    """
    from sigdb.database import open as open_database
    from sigdb.pipeline import evaluate_model, is_user_model, load_user_model
    from sigdb.recognition import EvaluationError, load_model
    from sigdb.report import Terminal, evaluation_text, write_evaluation_report

    opened = open_database(database)
    requested = {"target": target, "split": split, "columns": columns, "drawn_rows": drawn_rows}
    options: dict[str, Any] = {name: value for name, value in requested.items() if value}
    options |= {} if baselines else {"baselines": False}
    if is_user_model(model):
        step = partial(_report_step, model)
        estimator = load_user_model(model)
        evaluation = evaluate_model(estimator, opened, **options, bound=bound, where=where, on_step=step)
    elif options:
        raise InputError(f"{_FLAGS[next(iter(options))]} is for an estimator of one's own; {model} has its own")
    else:
        evaluation = evaluate_model(load_model(model), opened, bound=bound, where=where)
    if form == "json":
        echo_json(list(_rows(evaluation)))
    else:
        click.echo(evaluation_text(evaluation, terminal=Terminal.of(sys.stdout)), nl=False)
    if report is not None:
        page = write_evaluation_report(evaluation, report, title=f"{model} on {database}")
        click.echo(f"report: {page}", err=True)
    try:
        evaluation.check()
    except EvaluationError as error:
        click.echo(f"sigdb: {error}", err=True)
        return ExitCode.WRONG
    return ExitCode.DONE


_FLAGS = {
    "target": "--target",
    "split": "--split",
    "columns": "--column",
    "drawn_rows": "--drawn-rows",
    "baselines": "--no-baselines",
}
"""Options of an estimator of one's own, by argument."""


def _report_step(model: str, step: str) -> None:
    click.echo(f"training {model}: {step}", err=True)


def _rows(evaluation: "Evaluation") -> Iterator[dict[str, object]]:
    """Yield a row for each metric of each estimator, and of the bound."""
    facts = evaluation.as_json()
    estimators = facts["metrics"] | ({"bound": facts["bound"]} if facts["bound"] is not None else {})
    for name, metrics in estimators.items():
        for metric, estimate in metrics.items():
            yield {"estimator": name, "metric": metric} | estimate
