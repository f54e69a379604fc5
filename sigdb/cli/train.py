"""``sigdb train``."""

import shlex

import click


@click.command()
@click.argument("database", metavar="DB")
@click.option("--target", type=click.Choice(["location", "severity"]), required=True, help="What to learn.")
@click.option("--out", required=True, type=click.Path(), help="Folder for the model.")
@click.option(
    "--learner",
    type=click.Choice(["lda", "boosting", "templates"]),
    help="Which learner is the model; that of the database's recipe if left out. All are trained and compared.",
)
def train(database: str, target: str, out: str, learner: str | None) -> None:
    """Train a model on a database, one fold of specimens held out, and write its folder with a card."""
    from sigdb.cli.figures import print_figures
    from sigdb.database import open as open_database
    from sigdb.pipeline import train_model

    words = ["sigdb", "train", database, "--target", target, "--out", out, *(["--learner", learner] if learner else [])]
    evaluation = train_model(
        open_database(database),
        target,
        out,
        learner=learner,
        command=shlex.join(words),
        on_step=lambda step: click.echo(f"training {target}: {step} ...", err=True),
    )
    print_figures(evaluation)
    click.echo(f"model and card: {out}")
