"""``sigdb refine``."""

import sys

import click

from sigdb.cli.commands.coverage import coverage_facts
from sigdb.cli.main import ExitCode
from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.options.workers import jobs_option, scheduler_option


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option("--match", type=float, default=0.97, show_default=True, help="Required match.")
@click.option(
    "--cases",
    type=click.IntRange(1),
    default=200,
    show_default=True,
    help="Approximate number of random cases per round.",
)
@click.option("--rounds", type=click.IntRange(1), default=10, show_default=True, help="Greatest number of rounds.")
@click.option("--sensor", help="Sensor; by default the first stored one.")
@jobs_option
@scheduler_option
@format_option("table", "json")
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

    Rows that exist stay as they are. The command may be stopped at any instant; repeated, it goes on. The exit code is
    1 if the match was not reached within the rounds.

    \b
    Example:
      sigdb refine data/quick/signatures --match 0.97
    """
    from sigdb.cli.progress import show_progress
    from sigdb.report import Terminal, coverage_text
    from sigdb.sweep import refine as refine_database

    with show_progress() as on_progress:
        done = refine_database(
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
        echo_json(facts | {"coverage": coverage_facts(done.coverage)})
    else:
        reached = "reached" if done.reached else "NOT reached; run the command again, or with more --rounds"
        click.echo(f"{database}: appended {done.cases} cases, {done.rows} rows; a match of {match:g} is {reached}")
        click.echo(coverage_text(done.coverage, name=database, terminal=Terminal.of(sys.stdout)), nl=False)
    return ExitCode.DONE if done.reached else ExitCode.WRONG
