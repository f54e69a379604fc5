"""Options of reading recordings and of their averages."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

_ABOVE_ZERO = click.FloatRange(0, min_open=True)

_FILE = {
    "tacho": click.option("--tacho", metavar="CHANNEL", help="Channel with the tacho."),
    "sampling_rate": click.option("--sampling-rate", type=_ABOVE_ZERO, help="Hz, where the file does not say it."),
    "units": click.option("--unit", "units", help="Unit of the signals, where the file does not say it."),
    "pulses_per_rev": click.option(
        "--pulses-per-rev", type=click.IntRange(1), help="Pulses of the tacho a revolution of its shaft."
    ),
    "ratio": click.option("--ratio", type=_ABOVE_ZERO, help="Revolutions of the averaged shaft in one of the tacho's."),
    "variable": click.option("--variable", help="Array or group of a file that holds several."),
}
"""Options of :func:`sigdb.read_recording`."""

_ANGLE = {
    "channel": click.option("--channel", help="Signal; the first one if left out."),
    "mesh_phase": click.option(
        "--mesh-phase", is_flag=True, help="Take the angle from the phase of the mesh: no tacho is needed."
    ),
    "speed_rpm": click.option("--speed-rpm", type=_ABOVE_ZERO, help="Speed for --mesh-phase, to within 5 %."),
    "speed_range_rpm": click.option(
        "--speed-range",
        "speed_range_rpm",
        nargs=2,
        type=float,
        metavar="LOW HIGH",
        help="Where to seek the speed instead, rpm.",
    ),
    "harmonic": click.option(
        "--harmonic",
        type=click.IntRange(1),
        help="Mesh harmonic for --mesh-phase; of the first three the most even if left out.",
    ),
    "revolutions": click.option(
        "--revolutions", type=click.IntRange(1), help="Revolutions to average; all whole tooth cycles else."
    ),
}
"""Options of :func:`sigdb.recording.recorded_signature`."""


def recording_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options of a recording and of its average to a command.

    The command gets them as ``reading``, the options of a file, and ``averaging``, the options of the average.
    """

    @wraps(command)
    def call(**options: Any) -> None:
        reading = {name: options.pop(name) for name in _FILE}
        averaging = {name: options.pop(name) for name in _ANGLE}
        if reading["tacho"] is not None and averaging["mesh_phase"]:
            raise click.UsageError("Give either --tacho or --mesh-phase.")
        command(reading=reading, averaging=averaging, **options)

    for option in reversed((*_FILE.values(), *_ANGLE.values())):
        call = option(call)
    return call


def _checked(context: click.Context, parameter: click.Parameter, jobs: int) -> int:
    if jobs == 0 or jobs < -1:
        raise click.BadParameter(f"{jobs}; give 1 or more, or -1 for one on each core")
    return jobs


def jobs_option(command: Any) -> Any:
    """``--jobs``."""
    said = "Worker processes; -1 for one on each core."
    return click.option("--jobs", type=int, default=-1, show_default=True, callback=_checked, help=said)(command)


def scheduler_option(command: Any) -> Any:
    """``--scheduler``."""
    said = "Let the workers of this Dask scheduler do the work."
    return click.option("--scheduler", metavar="ADDRESS", help=said)(command)
