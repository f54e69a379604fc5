"""``sigdb label``."""

from pathlib import Path

import click

from sigdb.cli.options.places import DATABASE, RECORDING


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("findings", type=RECORDING)
def label(database: str, findings: Path) -> None:
    """Enter the findings of inspections: they become labels of the rows before them.

    FINDINGS is a CSV file with a line for each finding. Its columns are the date of the inspection; what selects rows:
    machine, specimen, gear, sensor or file; and their labels: tooth, kind, severity and others. A finding holds from
    the inspection before it on, or from the date in the column since. A finding with a file, in which * stands for any
    text, needs no date. Rows of later ingests get these labels too.

    \b
    Example:
      sigdb label machine.db inspections.csv
    """
    from sigdb.ingest import enter_findings

    rows = enter_findings(database, findings)
    hint = (
        "" if rows else "; rows need a date up to that of the finding, and its machine, specimen, gear, sensor and file"
    )
    click.echo(f"{database}: {rows} rows have new labels{hint}")
