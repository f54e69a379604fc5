"""``sigdb plan-measurement``."""

import shlex
import sys
from pathlib import Path

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RIG
from sigdb.cli.options.quantities import Quantity


def _noise(ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> dict[str, float]:
    """Return the noise by sensor."""
    noise: dict[str, float] = {}
    for text in texts:
        sensor, _, value = text.rpartition("=")
        try:
            noise[sensor] = float(value)
        except ValueError:
            sensor = ""
        if not sensor:
            raise click.BadParameter(f"{text!r} is not of the form SENSOR=NUMBER.", ctx, param)
    return noise


@click.command("plan-measurement")
@click.argument("rig", type=RIG)
@click.option("--gear", help="Damaged gear, which is averaged; by default the driving one of the mesh.")
@click.option(
    "--kind", default="stiffness_loss", show_default=True, help="Kind of damage: a size, such as crack_depth, in SI."
)
@click.option("--largest", metavar="QUANTITY", help="Largest size that is simulated, such as 0.5 or 2mm.")
@click.option("--damaged-teeth", type=click.IntRange(1), default=1, show_default=True, help="Damaged teeth in a row.")
@click.option("--known-tooth", is_flag=True, help="Look at one tooth that is known, not for any tooth.")
@click.option("--sensor", "sensors", multiple=True, help="Sensor, once for each; by default all of the rig.")
@click.option("--axes", is_flag=True, help="Turn each sensor to the axes x, y and z of the casing's frame.")
@click.option("--speed", "speeds", multiple=True, type=Quantity("rpm"), help="Speed at the drive, once for each, rpm.")
@click.option("--torque", "torques", multiple=True, type=Quantity("N m"), help="Torque there, once for each, N m.")
@click.option("--averages", multiple=True, type=click.IntRange(1), help="Averaged revolutions, once for each number.")
@click.option(
    "--noise",
    multiple=True,
    metavar="SENSOR=NUMBER",
    callback=_noise,
    help="Standard deviation of one revolution's noise, in the sensor's unit.",
)
@click.option("--snr-db", type=float, help="Or the signal-to-noise ratio of one revolution; 0 is assumed, dB.")
@click.option("--noise-doubt-db", type=click.FloatRange(0), help="Doubt of the noise, dB; 6 where it is assumed.")
@click.option("--index-error", type=Quantity("m", min=0), default=2e-6, show_default=True, help="Index errors, m.")
@click.option(
    "--false-alarm-rate",
    type=click.FloatRange(0, 0.5, min_open=True, max_open=True),
    default=1e-3,
    show_default=True,
    help="Probability of an alarm without damage.",
)
@click.option("--draws", type=click.IntRange(200), default=1000, show_default=True, help="Averages drawn for a size.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the draws.")
@click.option("--best", type=click.IntRange(1), default=20, show_default=True, help="Rows of the printed table.")
@click.option("--out", type=click.Path(path_type=Path), help="Also write a page with maps into this folder.")
@format_option("table", "json")
def plan_measurement(
    rig: str,
    gear: str | None,
    kind: str,
    largest: str | None,
    damaged_teeth: int,
    known_tooth: bool,
    sensors: tuple[str, ...],
    axes: bool,
    speeds: tuple[float, ...],
    torques: tuple[float, ...],
    averages: tuple[int, ...],
    noise: dict[str, float],
    snr_db: float | None,
    noise_doubt_db: float | None,
    index_error: float,
    false_alarm_rate: float,
    draws: int,
    seed: int,
    best: int,
    out: Path | None,
    form: str,
) -> None:
    """Find which sensor, speed, load and number of averages would show the smallest damage.

    RIG is the name of a built-in rig or a TOML file, with one mesh. Each combination is a row: a90 is the damage that
    the best possible test finds with a probability of 0.9.

    \b
    Example:
      sigdb plan-measurement nasa-spiral-bevel --speed 14400 --averages 102 --snr-db 0
    """
    from sigdb.cli.progress import show_progress
    from sigdb.core import validated
    from sigdb.planning import PlanSettings
    from sigdb.planning import plan_measurement as plan
    from sigdb.report import Terminal, plan_text, write_plan_report

    settings = {
        "gear": gear,
        "kind": kind,
        "largest": largest,
        "damaged_teeth": damaged_teeth,
        "tooth": "known" if known_tooth else "unknown",
        "sensors": sensors,
        "directions": "axes" if axes else "given",
        "speeds_rpm": speeds,
        "torques": torques,
        "averages": averages,
        "noise": noise,
        "snr_db": snr_db,
        "noise_doubt_db": noise_doubt_db,
        "index_error": index_error,
        "false_alarm_rate": false_alarm_rate,
        "draws": draws,
        "seed": seed,
    }
    with show_progress() as on_progress:
        result = plan(rig, validated(PlanSettings, settings, owner="plan-measurement"), on_progress=on_progress)
    if form == "json":
        echo_json(result.as_json())
    else:
        click.echo(plan_text(result, best=best, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        command = shlex.join(["sigdb", *sys.argv[1:]])
        click.echo(f"page: {write_plan_report(result, out, command=command)}", err=True)
