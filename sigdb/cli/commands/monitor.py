"""``sigdb monitor``."""

import shlex
import sys
from pathlib import Path

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option("--where", help="Only rows that meet this condition, in SQL.")
@click.option(
    "--false-alarms-a-year",
    type=click.FloatRange(0, 100, min_open=True),
    default=1.0,
    show_default=True,
    help="False alarms a year that each gear and sensor may give; the limit counts the looks.",
)
@click.option("--looks-a-year", type=click.FloatRange(0, 1e6, min_open=True), help="By default that of the dates.")
@click.option(
    "--baseline",
    type=click.IntRange(5, 1000),
    help="Number of first recordings that are healthy; by default those that are labelled so, or the first ten.",
)
@click.option(
    "--severity-limit-db",
    type=float,
    help="Difference of a tooth over that of the other teeth, dB, until which its life is given.",
)
@click.option(
    "--zones",
    nargs=3,
    type=click.FloatRange(0, min_open=True),
    metavar="A B C",
    help="Ends of the zones A, B and C that ISO 20816-9 gives for this machine, mm/s rms; signals are velocities.",
)
@format_option("table", "json")
@click.option("--out", type=click.Path(path_type=Path), help="Also write a page and its numbers into this folder.")
def monitor(
    database: str,
    where: str | None,
    false_alarms_a_year: float,
    looks_a_year: float | None,
    baseline: int | None,
    severity_limit_db: float | None,
    zones: tuple[float, float, float] | None,
    form: str,
    out: Path | None,
) -> int:
    """Monitor the gears of a database of recordings: what has changed since they were healthy.

    The exit code is 1 if the newest recording of a gear is an alarm, 3 if one cannot be judged and none is an alarm.

    \b
    Example:
      sigdb monitor machine.db --false-alarms-a-year 2 --out history
    """
    from sigdb.core import validated
    from sigdb.monitoring import MonitorSettings
    from sigdb.monitoring import monitor as monitor_database
    from sigdb.report import Terminal, monitor_text, write_monitor_report

    stated = {"false_alarms_a_year": false_alarms_a_year, "looks_a_year": looks_a_year, "baseline": baseline}
    stated["severity_limit_db"] = severity_limit_db
    settings = validated(MonitorSettings, {**stated, "zones": zones or None}, owner="monitor")
    histories = monitor_database(database, settings, where=where)
    if form == "json":
        echo_json([history.as_json() for history in histories], indent=None)
    else:
        click.echo(monitor_text(histories, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        command = shlex.join(["sigdb", *sys.argv[1:]])
        click.echo(f"page: {write_monitor_report(histories, out, command=command)}", err=True)
    codes = {history.answer.exit_code for history in histories}
    return next(code for code in (1, 3, 0) if code in codes)
