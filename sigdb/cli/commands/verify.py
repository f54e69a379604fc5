"""``sigdb verify``."""

from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.options.workers import jobs_option

if TYPE_CHECKING:
    from sigdb.database import IntegrityFinding
    from sigdb.sweep import Repair


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option(
    "--deep",
    is_flag=True,
    help="Also decode all values, and compute a sample again from the recipe or the recordings, which are all read.",
)
@click.option(
    "--sample",
    type=click.IntRange(min=0),
    default=8,
    show_default=True,
    help="Templates, and blocks of 256 rows, that --deep computes again.",
)
@click.option("--repair", "mend", is_flag=True, help="Make damaged and missing parts again from the recipe in DB.")
@jobs_option
@format_option("table", "json", of="the findings")
def verify(database: str, deep: bool, sample: int, mend: bool, jobs: int, form: str) -> int:
    """Check that every byte of a database is as it was written.

    Every file is read and compared with its checksums, with its receipt and with the recipe. Findings are damage (with
    the part to make again), parts that do not exist yet, and foreign files. The exit code is 1 if there are findings,
    after --repair if findings are left.

    \b
    Example:
      sigdb verify data/quick/signatures
    """
    from sigdb.cli.progress import show_progress

    repair, verify_database = _checks(database)
    with show_progress() as on_progress:
        if mend:
            done = repair(database, deep=deep, sample=sample, jobs=jobs, on_progress=on_progress)
            findings, left = done.before, done.left
        else:
            findings = left = verify_database(database, deep=deep, sample=sample, on_progress=on_progress)
    if form == "json":
        each = dict.fromkeys([*findings, *left])
        echo_json([asdict(finding) | {"repaired": finding not in left} for finding in each])
    else:
        _print(database, findings, left)
    return ExitCode.WRONG if left else ExitCode.DONE


def _checks(database: str) -> "tuple[Callable[..., Repair], Callable[..., tuple[IntegrityFinding, ...]]]":
    """Return repair and verification of a database of a sweep, or of one of recordings."""
    from sigdb import ingest, sweep
    from sigdb.core import CorruptionError
    from sigdb.database import Store, read_manifest

    try:
        measured = read_manifest(Store.at(database)).is_measured
    except CorruptionError:
        measured = bool(Store.at(database).sizes("recordings"))
    return (ingest.repair, ingest.verify) if measured else (sweep.repair, sweep.verify)


def _print(database: str, findings: "tuple[IntegrityFinding, ...]", left: "tuple[IntegrityFinding, ...]") -> None:
    for finding in findings:
        if finding not in left:
            click.echo(f"{finding.kind}: {finding.file and finding.file + ': '}{finding.what}; repaired")
    for finding in left:
        click.echo(f"{finding.kind}: {finding}")
    click.echo(f"{database}: {f'{len(left)} found' if left else 'whole'}")
