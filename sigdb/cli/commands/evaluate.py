"""``sigdb evaluate``."""

import json
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from sigdb.recognition import Evaluation

FOUND = 1
"""Exit code where a model is better than is possible."""


@click.command()
@click.argument("model")
@click.argument("database", metavar="DB")
@click.option(
    "--report",
    metavar="DIR",
    type=click.Path(),
    help="Write a page with pictures, index.html, and all numbers, evaluation.json, into this folder.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the result is written.",
)
def evaluate(model: str, database: str, report: str | None, form: str) -> int:
    """Evaluate a model's folder on the rows of a database that it has not seen.

    On the database that it was trained on these are the cases that its split held out, on another one all rows of
    other specimens. The result has the baselines that were trained on the same rows, the best possible answer, and the
    criteria of the database's recipe. The exit code is 1 if the model is better than the best possible answer, which no
    honest model is.
    """
    from sigdb.cli.rows import print_evaluation
    from sigdb.database import open as open_database
    from sigdb.pipeline import evaluate_model
    from sigdb.recognition import EvaluationError, load_model

    evaluation = evaluate_model(load_model(model), open_database(database))
    if form == "table":
        print_evaluation(evaluation)
    else:
        click.echo(json.dumps(_rows(evaluation), indent=1))
    if report is not None:
        from sigdb.report import write_evaluation_report

        page = write_evaluation_report(evaluation, report, title=f"{model} on {database}")
        click.echo(f"report: {page}", err=True)
    try:
        evaluation.check()
    except EvaluationError as error:
        click.echo(f"sigdb: {error}", err=True)
        return FOUND
    return 0


def _rows(evaluation: "Evaluation") -> list[dict[str, object]]:
    """Return a row for each metric of each estimator, and of the bound."""
    facts = evaluation.as_json()
    estimators = facts["metrics"] | ({"bound": facts["bound"]} if facts["bound"] is not None else {})
    return [
        {"estimator": name, "metric": metric} | ends
        for name, metrics in estimators.items()
        for metric, ends in metrics.items()
    ]
