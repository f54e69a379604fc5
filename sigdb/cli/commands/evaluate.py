"""``sigdb evaluate``."""

import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE

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
@format_option("table", "json")
def evaluate(model: str, database: str, report: str | None, form: str) -> int:
    """Evaluate a model's folder on the rows of a database that the model has not seen.

    On the database of its training these are the cases that its split held out, on another database all rows of other
    specimens. The result has the baselines that were trained on the same rows, the best possible answer, and the
    criteria of the database's recipe. The exit code is 1 if the model is better than the best possible answer, which no
    honest model is.

    \b
    Example:
      sigdb evaluate data/quick/location data/quick/signatures
    """
    from sigdb.database import open as open_database
    from sigdb.pipeline import evaluate_model
    from sigdb.recognition import EvaluationError, load_model
    from sigdb.report import Terminal, evaluation_text, write_evaluation_report

    evaluation = evaluate_model(load_model(model), open_database(database))
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


def _rows(evaluation: "Evaluation") -> Iterator[dict[str, object]]:
    """Yield a row for each metric of each estimator, and of the bound."""
    facts = evaluation.as_json()
    estimators = facts["metrics"] | ({"bound": facts["bound"]} if facts["bound"] is not None else {})
    for name, metrics in estimators.items():
        for metric, estimate in metrics.items():
            yield {"estimator": name, "metric": metric} | estimate
