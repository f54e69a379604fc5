"""``sigdb coverage``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.options.workers import jobs_option

if TYPE_CHECKING:
    from sigdb.sweep import Coverage


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option("--cases", type=click.IntRange(1), default=200, show_default=True, help="Approximate number of cases.")
@click.option("--sensor", help="Sensor; by default the first stored one.")
@click.option("--seed", type=click.IntRange(0), help="Seed of the cases; by default a fresh one.")
@click.option("--out", type=click.Path(path_type=Path), help="Draw the match into this picture file.")
@jobs_option
@format_option("table", "json")
def coverage(
    database: str, cases: int, sensor: str | None, seed: int | None, out: Path | None, jobs: int, form: str
) -> None:
    """Measure how well a database represents the cases between its own.

    Random cases between those of the database are simulated and compared with its templates. The threshold of 'outside
    the database', which sigdb match uses, is stored.

    \b
    Example:
      sigdb coverage data/quick/signatures --out match.png
    """
    from sigdb.cli.progress import show_progress
    from sigdb.report import Terminal, check_picture, coverage_text
    from sigdb.sweep import coverage as study

    if out is not None:
        check_picture(out)
    with show_progress() as on_progress:
        result = study(database, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress)
    if form == "json":
        echo_json(coverage_facts(result))
    else:
        click.echo(coverage_text(result, name=database, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        from sigdb.pipeline import draw_coverage  # matplotlib starts slowly

        picture = draw_coverage(result, out, database)
        click.echo(f"{picture}: the match of {len(result.cases)} cases", err=form == "json")


def coverage_facts(coverage: "Coverage") -> dict[str, object]:
    """Return a study of the grid coverage as plain values."""
    record = coverage.record
    facts = {"threshold": record.threshold, "sensor": record.sensor, **record.details, "failed": coverage.failed}
    return facts | {"coarse": coverage.coarse.to_dict("records")}
