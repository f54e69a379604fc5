"""``sigdb modes``."""

import sys

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RIG


@click.command()
@click.argument("rig", type=RIG)
@format_option("table", "json")
@click.option("--count", type=click.IntRange(1), help="Show only that many modes, the lowest.")
def modes(rig: str, form: str, count: int | None) -> None:
    """List natural frequencies, damping ratios, and the parts that move in each mode.

    RIG is the name of a built-in rig or a TOML file.

    \b
    Example:
      sigdb modes nasa-spiral-bevel --count 10
    """
    from sigdb.report import Terminal, modes_text
    from sigdb.transmission import coupled_modes, load_transmission

    result = coupled_modes(load_transmission(rig))
    if form == "json":
        columns = ("frequency_hz", "damping_ratio", "moves")
        modes = zip(result.frequency_hz, result.damping_ratio, result.moves, strict=True)
        echo_json([dict(zip(columns, mode, strict=True)) for mode in modes][:count])
    else:
        click.echo(modes_text(result, count=count, terminal=Terminal.of(sys.stdout)), nl=False)
