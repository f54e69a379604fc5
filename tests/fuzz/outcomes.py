"""Properties that every outcome must have: refusals of one line, finite channels, and the right ones where known."""

import contextlib
import math
import signal
import warnings
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from sigdb.cli.main import cli
from sigdb.core import InputError, SigdbError
from sigdb.recording import read_recording, recorded_signature

LONGEST_LINE = 700
SECONDS = 10
"""Longest processor time of a case."""

MOST_MIB = 400
"""Largest rise of memory in a case, MiB; the files are small."""

READ, REFUSED = "read", "refused"


class TooSlowError(BaseException):
    """A case took longer than ``SECONDS``."""


class FaultError(Exception):
    """A property does not hold: its kind, and what was seen."""

    def __init__(self, kind, text):
        super().__init__(f"{kind}: {text}")
        self.kind = kind


@contextlib.contextmanager
def bounded(seconds=SECONDS, mib=MOST_MIB):
    """Bound the processor time and the rise of memory; warnings are errors."""

    def stop(number, frame):
        raise TooSlowError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    start = _restarted_peak_mib()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            yield
    except TooSlowError:
        raise FaultError("slow", f"longer than {seconds} s") from None
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    if (rise := _peak_mib() - start) > mib:
        raise FaultError("memory", f"{rise:.0f} MiB")


def _restarted_peak_mib():
    """Memory of this process in MiB, from which its peak is counted anew, where the system can do that."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return _peak_mib()


def _peak_mib():
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return 0.0
    (peak,) = (line.split()[1] for line in lines if line.startswith("VmHWM"))
    return int(peak) / 1024


def read(path, options):
    """Return what reading gives: a recording, or the line of a refusal."""
    try:
        recording = read_recording(path, **options)
    except InputError as error:
        return checked_line(str(error))
    except Exception as error:
        raise FaultError("escaped", f"{type(error).__name__}: {error}") from error
    for channel in recording.channels:
        if not np.isfinite(channel.samples).all() or not 0 < channel.sampling_rate < np.inf:
            raise FaultError("unsound", f"{channel.name} at {channel.sampling_rate} Hz")
        if not (channel.name + channel.unit).isprintable():
            raise FaultError("unsound", f"name {channel.name!r} or unit {channel.unit!r}")
    for note in recording.notes:
        checked_line(note.text)
    return recording


def answered(action, about, *, lines=False):
    """Return the outcome of an action: ``READ``, or ``REFUSED`` for an error of sigdb on one or on several lines."""
    try:
        return action()
    except SigdbError as error:
        about["line"] = (checked_lines if lines else checked_line)(str(error))
        return REFUSED
    except FaultError:
        raise
    except Exception as error:
        raise FaultError("escaped", f"{type(error).__name__}: {error}"[:2000]) from error


def checked_lines(text):
    """Return a message on settings, which has a line for each."""
    for line in text.split("\n"):
        checked_line(line[:LONGEST_LINE])
    return text


def checked_line(line):
    """Return a message; a message is one printable line."""
    if not line.isprintable() or len(line) > LONGEST_LINE or not line.strip():
        raise FaultError("message", repr(line[: 2 * LONGEST_LINE]))
    return line


def average(recording, options):
    """Compute the signature; return the line of a refusal, or None."""
    try:
        signature = recorded_signature(recording, **options)
    except InputError as error:
        return checked_lines(str(error))
    except Exception as error:
        raise FaultError("escaped", f"signature: {type(error).__name__}: {error}") from error
    if not np.isfinite(signature.tsa).all() or not 0 < signature.speed_rpm < np.inf:
        raise FaultError("unsound", f"average at {signature.speed_rpm} rpm")
    for note in signature.notes:
        checked_line(note.text)
    return None


def command(path, arguments):
    """Run ``sigdb signature``; it ends with a text, a usage error or a refusal."""
    result = CliRunner().invoke(cli, ["signature", str(path), *arguments])
    error = result.exception
    if error is not None and not isinstance(error, InputError | SystemExit):
        raise FaultError("escaped", f"command: {type(error).__name__}: {error}") from error
    if isinstance(error, SystemExit) and error.code not in (0, 2):
        raise FaultError("escaped", f"command: exit code {error.code}")
    if isinstance(error, InputError):
        checked_lines(str(error))
    for line in result.output.split("\n"):
        if not line.isprintable():
            raise FaultError("message", f"command: {line[:LONGEST_LINE]!r}")
    return error is None


def compare(expected, recording):
    """Raise a fault unless the recording has the channels, units, rates and instants that its file was written with."""
    if expected.doubts & {note.code for note in recording.notes}:
        return
    channels = [channel for channel in recording.channels if channel.name not in expected.extra]
    said = " | ".join(note.text for note in recording.notes)
    if len(channels) != len(expected.samples):
        names = [channel.name for channel in channels]
        raise FaultError("wrong channels", f"{names} in place of {list(expected.names)}; notes: {said}")
    if expected.names and {channel.name for channel in channels} == set(expected.names):
        channels.sort(key=lambda channel: expected.names.index(channel.name))  # HDF5 sorts its names
    first_instants = []
    for i, channel in enumerate(channels):
        left_out = any(note.code == "lines-left-out" for note in recording.notes)
        if not (expected.loose_names and left_out and channel.name.startswith("column")):
            _compare_names(expected, i, channel)
        rate = expected.rate if isinstance(expected.rate, float) else expected.rate[i]
        if not math.isclose(channel.sampling_rate, rate, rel_tol=expected.rate_tolerance):
            raise FaultError(
                "wrong rate", f"{channel.name} has {channel.sampling_rate:.9g} Hz in place of {rate:.9g}; notes: {said}"
            )
        lag = _lag(expected, i, channel)
        start = 0.0 if expected.starts is None else expected.starts[i]
        first_instants.append((start + lag / rate - channel.start) * rate)
    if max(first_instants) - min(first_instants) > 0.1:
        raise FaultError("wrong instants", f"samples at which channels begin: {first_instants}; notes: {said}")


def _compare_names(expected, i, channel):
    name = expected.names[i] if expected.names else channel.name
    unit = expected.units[i] if expected.units else channel.unit
    if expected.whole_names and not channel.unit and channel.name.startswith(name):
        return
    if channel.name != name:
        raise FaultError("wrong name", f"{channel.name!r} [{channel.unit}] in place of {name!r} [{unit}]")
    if channel.unit != unit:
        raise FaultError("wrong unit", f"{channel.unit!r} in place of {unit!r} of {name}")


def _lag(expected, i, channel):
    """Return the sample of the file that is the channel's first."""
    right, x = expected.samples[i], channel.samples
    missing = np.isnan(right)
    inner = missing.sum() <= 3 and not missing[0] and not missing[-1]
    one_start = expected.starts is None or len(set(expected.starts)) == 1
    fewest = right.size - expected.shorter if inner and one_start else right.size // 2
    if fewest <= x.size <= right.size:
        scale = max(float(np.nanmax(np.abs(right))), 1e-300)
        for lag in range(right.size - x.size + 1):
            part = right[lag : lag + x.size]
            if np.all((np.abs(part - x) <= expected.tolerance * scale) | np.isnan(part)):
                return lag
    raise FaultError("wrong samples", f"{channel.name}: {x[:3]} of {x.size} in place of {right[:3]} of {right.size}")
