"""``sigdb modes``."""

import json
from typing import Any

import click


@click.command()
@click.argument("rig")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the result is written.",
)
@click.option("--count", type=click.IntRange(1), help="Show only that many modes, the lowest.")
def modes(rig: str, form: str, count: int | None) -> None:
    """List natural frequencies, damping, and what moves in each mode.

    RIG is the name of a built-in rig or a TOML file.
    """
    from sigdb.transmission import coupled_modes, load_transmission

    found = coupled_modes(load_transmission(rig))
    rows: list[dict[str, Any]] = [
        {"frequency_hz": float(frequency), "damping_ratio": float(ratio), "moves": moves}
        for frequency, ratio, moves in zip(found.frequency_hz, found.damping_ratio, found.moves, strict=True)
    ][:count]
    if form == "json":
        click.echo(json.dumps(rows, indent=1))
        return
    click.echo(f"{'mode':>4}  {'frequency, Hz':>13}  {'damping ratio':>13}  moves (share of kinetic energy)")
    for i, row in enumerate(rows, start=1):
        most = ", ".join(f"{name} {share:.0%}" for name, share in list(row["moves"].items())[:3] if share >= 0.05)
        click.echo(f"{i:>4}  {row['frequency_hz']:>13.1f}  {row['damping_ratio']:>z13.4f}  {most}")
