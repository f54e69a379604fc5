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
@click.option(
    "--split",
    type=click.Choice(["S0", "S1", "S2", "S3", "S4"]),
    default="S1",
    show_default=True,
    help="What is held out: new noise only (S0); specimens (S1), and with them severities between (S2) or beyond (S3) "
    "those of training, or a tooth count (S4).",
)
def train(database: str, target: str, out: str, learner: str | None, split: str) -> None:
    """Train a model on a database, one fold of specimens held out, and write its folder with a card."""
    from sigdb.cli.figures import print_figures
    from sigdb.database import open as open_database
    from sigdb.pipeline import train_model

    words = ["sigdb", "train", database, "--target", target, "--out", out, *(["--learner", learner] if learner else [])]
    words += ["--split", split] if split != "S1" else []
    evaluation = train_model(
        open_database(database),
        target,
        out,
        learner=learner,
        split=split,
        command=shlex.join(words),
        on_step=lambda step: click.echo(f"training {target}: {step} ...", err=True),
    )
    print_figures(evaluation)
    click.echo(f"model and card: {out}")
