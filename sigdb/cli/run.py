"""``sigdb run``."""

from pathlib import Path

import click

from sigdb.cli.workers import jobs_option


@click.command()
@click.argument("recipe", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for all that is made; data/RECIPE if left out.")
@jobs_option
def run(recipe: Path, out: Path | None, jobs: int) -> None:
    """Make all that a recipe asks for: its database, then its figures.

    Stopped at any instant, the same command goes on. Where the database is complete, only figures are drawn again.
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
