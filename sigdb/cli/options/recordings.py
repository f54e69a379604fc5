"""Options of reading recordings and of their averages."""

import re
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any

import click

from sigdb.cli.options.quantities import Quantity
from sigdb.core import InputError

_ABOVE_ZERO = click.FloatRange(0, min_open=True)

_FILE = {
    "tacho": click.option("--tacho", metavar="CHANNEL", help="Channel of the tacho."),
    "sampling_rate": click.option(
        "--sampling-rate", type=Quantity("Hz", min=0, min_open=True), help="Hz, if the file does not state it."
    ),
    "units": click.option("--unit", "units", help="Unit of the signals, if the file does not state it."),
    "pulses_per_rev": click.option(
        "--pulses-per-rev", type=click.IntRange(1), help="Pulses of the tacho per revolution of its shaft."
    ),
    "tacho_kind": click.option(
        "--tacho-kind",
        type=click.Choice(["waveform", "pulse-times", "counts", "angle", "speed"]),
        help="Quantity that the tacho holds; by default a waveform with pulses.",
    ),
    "threshold": click.option("--threshold", type=float, help="Level of the tacho at which a pulse begins."),
    "hysteresis": click.option(
        "--hysteresis", type=_ABOVE_ZERO, help="Depth to which the tacho must return before its next pulse."
    ),
    "edge": click.option("--edge", type=click.Choice(["rising", "falling"]), help="Edge of the tacho that counts."),
    "ratio": click.option(
        "--ratio",
        metavar="RATIO",
        help="Revolutions of the averaged shaft per revolution of the tacho's shaft: a number, or a fraction as 19/48.",
    ),
    "time": click.option("--time", metavar="COLUMN", help="Column of times; found by its name if left out."),
    "file_format": click.option("--file-format", metavar="SUFFIX", help="Format of the file, such as csv."),
    "variable": click.option("--variable", help="Array or group to read from a file that holds several."),
    "parts": click.option(
        "--parts",
        type=click.Choice(["contiguous", "channels"]),
        help="How the files of a folder or ZIP archive belong together, if they do not state it.",
    ),
}
"""Options of :func:`sigdb.read_recording`."""

_ANGLE = {
    "channel": click.option("--channel", help="Signal; by default the first one."),
    "mesh_phase": click.option(
        "--mesh-phase", is_flag=True, help="Take the angle from the phase of the mesh; no tacho is needed."
    ),
    "constant_speed": click.option(
        "--constant-speed", is_flag=True, help="Take --speed-rpm as exact and constant; no tacho and no mesh is needed."
    ),
    "speed_rpm": click.option(
        "--speed-rpm",
        type=Quantity("rpm", min=0, min_open=True),
        help="Speed, rpm: for --mesh-phase to within 5 %, for --constant-speed exactly.",
    ),
    "speed_range_rpm": click.option(
        "--speed-range",
        "speed_range_rpm",
        nargs=2,
        type=Quantity("rpm"),
        metavar="LOW HIGH",
        help="Range in which --mesh-phase searches for the speed, rpm.",
    ),
    "harmonic": click.option(
        "--harmonic",
        type=click.IntRange(1),
        help="Mesh harmonic for --mesh-phase; by default the steadiest of the first three.",
    ),
    "revolutions": click.option(
        "--revolutions", type=click.IntRange(1), help="Revolutions to average; by default all whole tooth cycles."
    ),
    "envelope_band": click.option(
        "--envelope-band",
        nargs=2,
        type=float,
        metavar="LOW HIGH",
        help="Band of the envelope spectrum, in orders of the shaft; by default the most impulsive.",
    ),
}
"""Options of :func:`sigdb.recording.recorded_signature`."""


_SPELT = {name: f"--{name.replace('_', '-')}" for name in (*_FILE, *_ANGLE)} | {
    "units": "--unit",
    "speed_range_rpm": "--speed-range",
    "samples_per_tooth": "--samples-per-tooth",
}
_WORDS = "|".join(name for name in _SPELT if "_" in name)
_ADVICE = re.compile(rf"\b(give|set|or|by|check|and) ({_WORDS}) = ")
_NAMED = re.compile(rf"(?<![\w.'\"-])(?:({_WORDS})\b(?! =|['\"])|\(({'|'.join(_SPELT)})\))")


def in_options(message: str) -> str:
    """Return a message of the library about reading and averaging in the words of the command line.

    Examples
    --------
    >>> in_options("give sampling_rate, in Hz, or pulses_per_rev = 4")
    'give --sampling-rate, in Hz, or --pulses-per-rev 4'
    """
    message = _ADVICE.sub(lambda match: f"{match[1]} {_SPELT[match[2]]} ", message)
    return _NAMED.sub(lambda match: _SPELT[match[1]] if match[1] else f"({_SPELT[match[2]]})", message)


def recording_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Add the options of a recording and of its average to a command.

    The command gets them as ``reading``, the options of a file, and ``averaging``, the options of the average.
    """
    return _with_options(command, _ANGLE)


def options_of_channels(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Add the options of :func:`recording_options` to a command, with ``channels``: any number of them."""
    of_channels = click.option(
        "--channel",
        "channels",
        multiple=True,
        help="Signal; by default the first one. Give it several times for one answer from several channels.",
    )
    return of_channels(_with_options(command, {name: each for name, each in _ANGLE.items() if name != "channel"}))


def options_of_recordings(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Add the options of :func:`recording_options` that many recordings share: not channel and length."""
    return _with_options(
        command, {name: option for name, option in _ANGLE.items() if name not in ("channel", "revolutions")}
    )


def _with_options(
    command: Callable[..., int | None], angle: Mapping[str, Callable[..., Any]]
) -> Callable[..., int | None]:
    @wraps(command)
    def call(**options: Any) -> int | None:
        reading = {name: options.pop(name) for name in _FILE}
        averaging = {name: options.pop(name) for name in angle}
        if reading["tacho"] is not None and averaging["mesh_phase"]:
            raise click.UsageError("Give either --tacho or --mesh-phase.")
        try:
            return command(reading=reading, averaging=averaging, **options)
        except InputError as error:
            raise InputError(in_options(str(error))) from None

    for option in reversed((*_FILE.values(), *angle.values())):
        call = option(call)
    return call
