"""``sigdb run``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.recordings import jobs_option

if TYPE_CHECKING:
    from sigdb.pipeline import ModelResult
    from sigdb.recognition import Estimate

FOUND = 1
"""Exit code where a model is better than is possible."""


@click.command()
@click.argument("recipe", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for all that is made; data/RECIPE if left out.")
@jobs_option
def run(recipe: Path, out: Path | None, jobs: int) -> int:
    """Make all that a recipe asks for: its database, models with their reports, figures.

    Stopped at any instant, the same command goes on. What is there already, of the same inputs, is kept. The exit code
    is 1 if a model is better than the best possible answer, which no honest model is.
    """
    from sigdb.cli.progress import show_progress
    from sigdb.pipeline import load_recipe, run_recipe
    from sigdb.report import claims_text

    with show_progress() as on_progress:
        made = run_recipe(
            load_recipe(recipe),
            out or Path("data") / recipe.stem,
            jobs=jobs,
            on_stage=click.echo,
            on_progress=on_progress,
        )
    if made.claims is not None:
        click.echo(f"\n{claims_text(made.claims)}", nl=False)
    if made.results:
        click.echo(f"\n{_table(made.results)}")
    above = [result for result in made.results if result.above]
    for result in above:
        click.echo(
            f"sigdb: {result.page}: the model {result.model} is better than the best possible answer "
            f"({', '.join(result.above)})",
            err=True,
        )
    return FOUND if above else 0


def _table(results: Sequence["ModelResult"]) -> str:
    from sigdb.recognition import TITLES
    from sigdb.report import table, word

    rows = [
        {
            "target": one.target,
            "split": one.split,
            "metric": TITLES[one.metric],
            "value": _digits(one.value),
            "bound": _digits(one.bound),
            "page": one.page,
        }
        for one in results
    ]
    columns = {"target": "target", "split": "split", "metric": "metric", "model": "value"}
    columns |= {"bound": "bound", "report": "page"}
    return table([(head, word(key)) for head, key in columns.items()], rows)


def _digits(estimate: "Estimate | None") -> str | None:
    """Return an estimate to three digits: some are thousandths."""
    if estimate is None:
        return None
    return f"{estimate.value:.3g} [{estimate.low:.3g}, {estimate.high:.3g}]"
