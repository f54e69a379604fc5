"""``sigdb verify``."""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.recordings import jobs_option

if TYPE_CHECKING:
    from sigdb.database import IntegrityFinding

FOUND = 1
"""Exit code where something is wrong."""


@click.command()
@click.argument("database", metavar="DB")
@click.option("--deep", is_flag=True, help="Decode all values, too, and make a sample again from the recipe.")
@click.option(
    "--sample",
    type=click.IntRange(min=0),
    default=8,
    show_default=True,
    help="Templates, and blocks of 256 rows, that --deep makes again.",
)
@click.option("--repair", "mend", is_flag=True, help="Make what is damaged or missing again from the recipe in DB.")
@jobs_option
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the findings are written.",
)
def verify(database: str, deep: bool, sample: int, mend: bool, jobs: int, form: str) -> int:
    """Look for any byte of a database that is not as it was written.

    Every file is read and compared with its checksums, with its receipt and with the recipe. Findings are damage (which
    says the part to make again), parts that are not made yet, and foreign files. The exit code is 1 if there are any,
    after --repair if any are left.
    """
    from sigdb.cli.progress import show_progress
    from sigdb.sweep import repair
    from sigdb.sweep import verify as verify_database

    with show_progress() as on_progress:
        if mend:
            done = repair(database, deep=deep, sample=sample, jobs=jobs, on_progress=on_progress)
            found, left = done.before, done.left
        else:
            found = left = verify_database(database, deep=deep, sample=sample, on_progress=on_progress)
    if form == "json":
        rows = [asdict(one) | {"repaired": one not in left} for one in dict.fromkeys([*found, *left])]
        click.echo(json.dumps(rows, indent=1))
    else:
        _print(database, found, left)
    return FOUND if left else 0


def _print(database: str, found: "tuple[IntegrityFinding, ...]", left: "tuple[IntegrityFinding, ...]") -> None:
    for finding in found:
        if finding not in left:
            click.echo(f"{finding.kind}: {finding.file and finding.file + ': '}{finding.what}; repaired")
    for finding in left:
        click.echo(f"{finding.kind}: {finding}")
    click.echo(f"{database}: {f'{len(left)} found' if left else 'whole'}")
