"""``sigdb coverage``."""

import json
from typing import TYPE_CHECKING

import click

from sigdb.cli.workers import jobs_option

if TYPE_CHECKING:
    from sigdb.sweep.coverage import Coverage


@click.command()
@click.argument("database", metavar="DB")
@click.option("--cases", type=click.IntRange(1), default=200, show_default=True, help="Random cases, about.")
@click.option("--sensor", help="Sensor; the first stored one if left out.")
@click.option("--seed", type=click.IntRange(0), help="Seed of the cases; one more than the database's if left out.")
@jobs_option
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the result is written.",
)
def coverage(database: str, cases: int, sensor: str | None, seed: int | None, jobs: int, form: str) -> None:
    """Tell how well a database stands for what lies between its cases.

    Random cases between those of the database are simulated and compared with its templates. The threshold of 'outside
    the database', which sigdb match uses, is stored.
    """
    from sigdb.cli.progress import show_progress
    from sigdb.sweep import coverage as study

    with show_progress() as on_progress:
        found = study(database, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress)
    if form == "json":
        facts = {"threshold": found.record.threshold, "sensor": found.record.sensor, **found.record.details}
        click.echo(json.dumps(facts | {"coarse": found.coarse.to_dict("records")}, indent=1))
        return
    click.echo(coverage_text(database, found))


def coverage_text(database: str, found: "Coverage") -> str:
    """A study of coverage as text."""
    details, match = found.record.details, found.cases["match"]
    above = details["share_above_0.97"]
    return "\n".join(
        [
            f"{database}: {details['cases']} random cases between its own, sensor {found.record.sensor}",
            f"match with the nearest template: least {match.min():.3f}, 5 % below {match.quantile(0.05):.3f}, "
            f"median {match.median():.3f}; {above:.1%} of the cases at 0.97 or above",
            f"separation from it, in deviations of an average's noise: median {details['separation_median']:.1f}, "
            f"greatest {details['separation_greatest']:.1f}",
            f"threshold of 'outside the database': a misfit of {found.record.threshold:.3g} (exceeded by 1 % of "
            f"{details['rows']} measured rows, or fewer); stored",
            *([f"{found.failed} more cases have no result"] if found.failed else []),
            "",
            found.coarse.to_string(index=False, float_format="{:.4g}".format) if len(found.coarse) else "",
        ]
    ).rstrip()
