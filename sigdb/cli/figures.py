"""The table of figures that ``train`` and ``evaluate`` print."""

import textwrap

import click

from sigdb.recognition import Evaluation
from sigdb.recognition.card import bound_said, figure_rows
from sigdb.recognition.efficiency_table import aim_rows, efficiency_rows


def print_figures(evaluation: Evaluation) -> None:
    """Print an evaluation as aligned text."""
    click.echo(f"{evaluation.target}: {evaluation.rows} rows of {evaluation.specimens} specimens. {evaluation.split}.")
    _print_table(figure_rows(evaluation))
    click.echo(f"In brackets: 95 % interval, bootstrap over specimens. {bound_said(evaluation)}")
    if efficiency := efficiency_rows(evaluation):
        click.echo("\nAgainst the best possible, by signal-to-noise ratio of one revolution:")
        _print_table(efficiency)
    if aims := aim_rows(evaluation):
        click.echo("\nAims:")
        _print_table([aim[:-1] for aim in aims])
        for what, *_, why in aims[1:]:
            if why:
                click.echo(textwrap.fill(f"{what}: {why}", 120, subsequent_indent="  "))


def _print_table(rows: list[list[str]]) -> None:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        click.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
