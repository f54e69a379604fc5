"""``sigdb train``."""

import shlex
import sys
from typing import TYPE_CHECKING

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.names import NameChoice
from sigdb.cli.options.places import DATABASE

if TYPE_CHECKING:
    from sigdb.recognition import Evaluation


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option(
    "--target", type=NameChoice("sigdb.recognition", "TARGET_NAMES"), required=True, help="Question to answer."
)
@click.option("--out", required=True, type=click.Path(), help="Folder for the model.")
@click.option(
    "--learner",
    type=NameChoice("sigdb.recognition", "LEARNERS"),
    help="Learner of the model; by default that of the database's recipe, or templates where the database has a bank. "
    "All learners are trained and compared.",
)
@click.option(
    "--false-alarm-rate",
    type=float,
    help="False-alarm rate of detectors and of the baselines' thresholds; by default that of the recipe, or 0.01.",
)
@click.option(
    "--split",
    type=NameChoice("sigdb.database", "SPLIT_NAMES"),
    help="Cases held out: new noise only (S0); specimens (S1), and with them severities between (S2) or beyond (S3) "
    "those of training, or a tooth count (S4), or rigs of an ensemble (S6), or operating points (S7). Recordings: a "
    "part of the recordings, machines, loads or sets. By default S1, for recordings recording.",
)
@click.option(
    "--allow-leak",
    is_flag=True,
    help="Allow the split random of recordings, in which averages of one recording are in training and in test. Card "
    "and page say so.",
)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="NAME",
    help="Further column that lda and boosting read: an indicator, an added feature, the MODULE:FUNCTION that added "
    "features, or 'added' for all that were added; may be given several times.",
)
def train(
    database: str,
    target: str,
    out: str,
    learner: str | None,
    false_alarm_rate: float | None,
    split: str | None,
    allow_leak: bool,
    columns: tuple[str, ...],
) -> int:
    """Train a model on a database, one fold of specimens held out, and write its folder with a card.

    The exit code is 1 if the model is better than the best possible answer, which no honest model is.

    \b
    Example:
      sigdb train data/quick/signatures --target location --out location
    """
    from sigdb.database import open as open_database
    from sigdb.pipeline import train_model
    from sigdb.recognition import EvaluationError
    from sigdb.report import Terminal, evaluation_text

    words = ["sigdb", "train", database, "--target", target, "--out", out, *(["--learner", learner] if learner else [])]
    words += ["--false-alarm-rate", f"{false_alarm_rate:g}"] if false_alarm_rate is not None else []
    words += ["--split", split] if split not in (None, "S1") else []
    words += ["--allow-leak"] if allow_leak else []
    words += [word for name in columns for word in ("--column", name)]

    def show(evaluation: "Evaluation") -> None:
        click.echo(evaluation_text(evaluation, terminal=Terminal.of(sys.stdout)), nl=False)
        click.echo(f"model and card: {out}")

    try:
        train_model(
            open_database(database),
            target,
            out,
            learner=learner,
            false_alarm_rate=false_alarm_rate,
            split=split,
            allow_leak=allow_leak,
            columns=columns or None,
            command=shlex.join(words),
            on_step=lambda step: click.echo(f"training {target}: {step}", err=True),
            on_evaluation=show,
        )
    except EvaluationError as error:
        click.echo(f"sigdb: {error}", err=True)
        return ExitCode.WRONG
    return ExitCode.DONE
