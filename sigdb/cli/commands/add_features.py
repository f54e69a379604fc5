"""``sigdb add-features``."""

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.options.workers import jobs_option

_REASONS = 3
"""Reasons why rows have no numbers that are printed."""

_REASONS_OF = """
select "{status}" as why, count(*) as rows from cases where "{status}" <> 'ok' group by 1 order by 2 desc, 1
"""


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("function", metavar="MODULE:FUNCTION")
@click.option("--replace", is_flag=True, help="Compute all rows again, for example after a change of the module.")
@click.option("--remove", is_flag=True, help="Remove the function's columns; its module is not needed.")
@jobs_option
@format_option("table", "json")
def add_features(database: str, function: str, replace: bool, remove: bool, jobs: int, form: str) -> int:
    """Add columns that a function of your own computes from the stored averages.

    FUNCTION is in a module in this folder or on Python's path. It takes an average, an array of the samples of one
    revolution, and returns a mapping of names to numbers. It may have parameters teeth, speed_rpm, torque, averages,
    scatter, sensor and unit, which get these facts of the row. A row for which it fails has nulls, and the column
    FUNCTION_status says why.

    The columns take part in query, export, train, evaluate and verify. The command may be stopped at any instant;
    repeated, it goes on, also with rows that the database has got since. The exit code is 1 if the function has failed
    for some rows.

    \b
    Example:
      sigdb add-features data/quick/signatures shape:crest
    """
    from sigdb.cli.progress import show_progress
    from sigdb.core import InputError
    from sigdb.sweep import add_features as add_to_database
    from sigdb.sweep import remove_features

    if remove:
        if replace:
            raise InputError("--remove and --replace are given together; give one of them")
        columns = remove_features(database, function)
        if form == "json":
            echo_json({"removed": columns})
        else:
            click.echo(f"{database}: removed {', '.join(columns)}")
        return ExitCode.DONE
    with show_progress() as on_progress:
        done = add_to_database(database, function, jobs=jobs, replace=replace, on_progress=on_progress)
    reasons = _reasons(database, done.columns[-1])
    if form == "json":
        facts = {name: getattr(done, name) for name in ("columns", "new_rows", "rows", "failed")}
        echo_json(facts | {"reasons": [{"status": why, "rows": rows} for why, rows in reasons.items()]})
    else:
        click.echo(f"{database}: {', '.join(done.columns)} of {done.rows} rows, {done.new_rows} of them computed now")
        for why, rows in list(reasons.items())[:_REASONS]:
            click.echo(f"{rows} rows without numbers: {why}")
        if len(reasons) > _REASONS:
            click.echo(f"and {len(reasons) - _REASONS} more reasons; see: select {done.columns[-1]} from cases")
    return ExitCode.WRONG if any(why != _no_average() for why in reasons) else ExitCode.DONE


def _reasons(database: str, status: str) -> dict[str, int]:
    """Return the number of rows for each reason why they have no numbers, the most frequent first."""
    from sigdb.database import open as open_database

    with open_database(database) as opened:
        rows = opened.arrow(_REASONS_OF.format(status=status))
    return dict(zip(rows["why"].to_pylist(), rows["rows"].to_pylist(), strict=True))


def _no_average() -> str:
    from sigdb.database import NO_AVERAGE

    return NO_AVERAGE
