"""``sigdb evaluate``."""

import json
from dataclasses import asdict

import click


@click.command()
@click.argument("model")
@click.argument("database", metavar="DB")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the result is written.",
)
def evaluate(model: str, database: str, form: str) -> None:
    """Evaluate a model's folder on the rows of a database whose specimens it has not seen.

    Baselines that were trained on the same rows stand beside it.
    """
    from sigdb.cli.figures import print_figures
    from sigdb.database import open as open_database
    from sigdb.recognition import evaluate as evaluate_model
    from sigdb.recognition import load_model

    evaluation = evaluate_model(load_model(model), open_database(database))
    if form == "table":
        print_figures(evaluation)
        return
    rows = [
        {"estimator": name, "figure": figure, **asdict(value)}
        for name, figures in evaluation.figures.items()
        for figure, value in figures.items()
    ]
    click.echo(json.dumps(rows, indent=1).replace("NaN", "null"))
