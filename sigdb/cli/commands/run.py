"""``sigdb run``."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.places import RECIPE
from sigdb.cli.options.workers import jobs_option

if TYPE_CHECKING:
    from sigdb.pipeline import ModelResult
    from sigdb.recognition import Estimate
    from sigdb.report import TextTable


@click.command()
@click.argument("recipe", type=RECIPE)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for all results; by default data/RECIPE.")
@jobs_option
def run(recipe: Path, out: Path | None, jobs: int) -> int:
    """Run a recipe: make its database, its models with their reports, and its pictures.

    The command may be stopped at any instant; repeated, it goes on. Results of the same inputs are kept. The exit code
    is 1 if a model is better than the best possible answer, which no honest model is.

    \b
    Example:
      sigdb run pipelines/quick.toml
    """
    from sigdb.cli.progress import show_progress
    from sigdb.pipeline import load_recipe, run_recipe
    from sigdb.report import Terminal, claims_text

    with show_progress() as on_progress:
        results = run_recipe(
            load_recipe(recipe),
            out or Path("data") / recipe.stem,
            jobs=jobs,
            on_stage=click.echo,
            on_progress=on_progress,
        )
    terminal = Terminal.of(sys.stdout)
    if results.claims is not None:
        click.echo(f"\n{claims_text(results.claims, terminal=terminal)}", nl=False)
    if results.results:
        click.echo(f"\n{_table(results.results).text(terminal, indent=2)}")
    above = [result for result in results.results if result.above]
    for result in above:
        click.echo(
            f"sigdb: {result.page}: the model {result.model} is better than the best possible answer "
            f"({', '.join(result.above)})",
            err=True,
        )
    return ExitCode.WRONG if above else ExitCode.DONE


def _table(results: Sequence["ModelResult"]) -> "TextTable":
    from sigdb.recognition import TITLES
    from sigdb.report import TextTable, word

    columns = ("target", "split", "metric", "model", "bound", "report")
    return TextTable(
        columns,
        [
            [
                result.target,
                result.split,
                TITLES[result.metric],
                _digits(result.value),
                _digits(result.bound),
                word(result.page),
            ]
            for result in results
        ],
    )


def _digits(estimate: "Estimate | None") -> str:
    """Return an estimate and its interval to three digits: some are thousandths."""
    return "-" if estimate is None else f"{estimate.value:.3g} [{estimate.low:.3g}, {estimate.high:.3g}]"
