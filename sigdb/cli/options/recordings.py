"""The options that say how recordings are read, and where their angle is from."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from sigdb.recording import Recording


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

_ANGLE = (
    click.option("--channel", help="Signal; the first one if left out."),
    click.option("--mesh-phase", is_flag=True, help="Take the angle from the phase of the mesh: no tacho is needed."),
    click.option("--speed-rpm", type=_ABOVE_ZERO, help="Speed for --mesh-phase, to within 5 %."),
    click.option(
        "--speed-range",
        "speed_range_rpm",
        nargs=2,
        type=float,
        metavar="LOW HIGH",
        help="Where to seek the speed instead, rpm.",
    ),
    click.option(
        "--harmonic",
        type=click.IntRange(1),
        help="Mesh harmonic for --mesh-phase; of the first three the most even if left out.",
    ),
    click.option("--revolutions", type=click.IntRange(1), help="Revolutions to average; all whole tooth cycles else."),
)
"""Options of :func:`sigdb.recording.recorded_signature`."""


def recording_options(command: Any) -> Any:
    """``--tacho`` to ``--variable``, which :func:`read` takes out again, and those of the average."""
    for option in reversed((*_FILE.values(), *_ANGLE)):
        command = option(command)
    return command


def read(paths: tuple[Path, ...], options: dict[str, Any]) -> list["Recording"]:
    """Recordings by the options of their files, which are taken out of ``options``."""
    from sigdb.recording import read_recording

    given = {name: options.pop(name) for name in _FILE}
    if given["tacho"] is not None and options["mesh_phase"]:
        raise click.UsageError("Give either --tacho or --mesh-phase.")
    return [read_recording(path, **{name: one for name, one in given.items() if one is not None}) for path in paths]


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
