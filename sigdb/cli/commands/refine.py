"""``sigdb refine``."""

import json

import click

from sigdb.cli.commands.coverage import coverage_facts, coverage_text, format_option
from sigdb.cli.options.recordings import jobs_option, scheduler_option


@click.command()
@click.argument("database", metavar="DB")
@click.option("--match", type=float, default=0.97, show_default=True, help="Least match that is asked for.")
@click.option("--cases", type=click.IntRange(1), default=200, show_default=True, help="Random cases of a round, about.")
@click.option("--rounds", type=click.IntRange(1), default=10, show_default=True, help="Append so often at most.")
@click.option("--sensor", help="Sensor; the first stored one if left out.")
@jobs_option
@scheduler_option
@format_option
def refine(
    database: str,
    match: float,
    cases: int,
    rounds: int,
    sensor: str | None,
    jobs: int,
    scheduler: str | None,
    form: str,
) -> int:
    """Append cases to a database until random cases between its own match its templates.

    Rows that are there stay as they are. Stopped at any instant, the same command goes on. Exit code 1 if the match was
    not reached in so many rounds.
    """
    from sigdb.cli.progress import show_progress
    from sigdb.sweep import refine as refined

    with show_progress() as on_progress:
        done = refined(
            database,
            match=match,
            cases=cases,
            rounds=rounds,
            sensor=sensor,
            jobs=jobs,
            scheduler=scheduler,
            on_progress=on_progress,
        )
    if form == "json":
        facts = {name: getattr(done, name) for name in ("reached", "rounds", "cases", "rows")}
        click.echo(json.dumps(facts | {"coverage": coverage_facts(done.coverage)}, indent=1))
    else:
        reached = "reached" if done.reached else "NOT reached; run the command again, or with more --rounds"
        click.echo(f"{database}: appended {done.cases} cases, {done.rows} rows; a match of {match:g} is {reached}")
        click.echo(coverage_text(database, done.coverage))
    return 0 if done.reached else 1
