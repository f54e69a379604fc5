"""The table of figures that ``train`` and ``evaluate`` print."""

import click

from sigdb.recognition import Evaluation
from sigdb.recognition.card import bound_said, figure_rows


def print_figures(evaluation: Evaluation) -> None:
    """Print an evaluation as aligned text."""
    rows = figure_rows(evaluation)
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    click.echo(f"{evaluation.target}: {evaluation.rows} rows of {evaluation.specimens} specimens. {evaluation.split}.")
    for row in rows:
        click.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
    click.echo(f"In brackets: 95 % interval, bootstrap over specimens. {bound_said(evaluation)}")
