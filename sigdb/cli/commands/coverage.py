"""``sigdb coverage``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sigdb.cli.options.recordings import jobs_option

if TYPE_CHECKING:
    from sigdb.sweep import Coverage


def format_option(command: Any) -> Any:
    """``--format`` of a study of coverage."""
    forms, said = click.Choice(["table", "json"]), "How the result is written."
    return click.option("--format", "form", type=forms, default="table", show_default=True, help=said)(command)


@click.command()
@click.argument("database", metavar="DB")
@click.option("--cases", type=click.IntRange(1), default=200, show_default=True, help="Random cases, about.")
@click.option("--sensor", help="Sensor; the first stored one if left out.")
@click.option("--seed", type=click.IntRange(0), help="Seed of the cases; a fresh one if left out.")
@click.option("--out", type=click.Path(path_type=Path), help="Draw the match into this picture file.")
@jobs_option
@format_option
def coverage(
    database: str, cases: int, sensor: str | None, seed: int | None, out: Path | None, jobs: int, form: str
) -> None:
    """Tell how well a database stands for what lies between its cases.

    Random cases between those of the database are simulated and compared with its templates. The threshold of 'outside
    the database', which sigdb match uses, is stored.
    """
    from sigdb.cli.progress import show_progress
    from sigdb.pipeline import draw_coverage
    from sigdb.report import check_picture
    from sigdb.sweep import coverage as study

    if out is not None:
        check_picture(out)
    with show_progress() as on_progress:
        found = study(database, cases=cases, sensor=sensor, seed=seed, jobs=jobs, on_progress=on_progress)
    click.echo(json.dumps(coverage_facts(found), indent=1) if form == "json" else coverage_text(database, found))
    if out is not None:
        click.echo(f"{draw_coverage(found, out, database)}: the match of {len(found.cases)} cases", err=form == "json")


def coverage_facts(found: "Coverage") -> dict[str, Any]:
    """A study of coverage as plain values."""
    record = found.record
    facts = {"threshold": record.threshold, "sensor": record.sensor, **record.details, "failed": found.failed}
    return facts | {"coarse": found.coarse.to_dict("records")}


def coverage_text(database: str, found: "Coverage") -> str:
    """A study of coverage as text."""
    details, match = found.record.details, found.cases["match"]
    return "\n".join(
        [
            f"{database}: {details['cases']} random cases between its own, sensor {found.record.sensor}",
            f"match with the nearest template: least {match.min():.3f}, 5 % below {match.quantile(0.05):.3f}, "
            f"median {match.median():.3f}; {details['share_above_0.97']:.1%} of the cases at 0.97 or above",
            f"separation from it, in deviations of an average's noise: median {details['separation_median']:.1f}, "
            f"greatest {details['separation_greatest']:.1f}",
            f"threshold of 'outside the database': a misfit of {found.record.threshold:.3g} (exceeded by 1 % of "
            f"{details['rows']} measured rows, or fewer); stored",
            *([f"{found.failed} more cases have no result"] if found.failed else []),
            "",
            found.coarse.to_string(index=False, float_format="{:.4g}".format) if len(found.coarse) else "",
        ]
    ).rstrip()
