"""Sampling rates, starts and speeds that numbers and short texts of a file state, by their names."""

import re
from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from sigdb.recording.files.formats.rate_names import INTERVALS, RATES, plain_name
from sigdb.recording.files.time_names import seconds_of

SPEED_TO_CONFIRM = "speed-to-confirm"
"""Code of the note on a speed in the file, which may be that of another shaft."""

STARTS = {"t0", "tstart", "starttime", "starttimes", "toffset", "timeoffset", "xstart", "x0", "wfstartoffset"}
"""Names of the time of the first sample."""

_OF_ABSCISSA = {"increment": "dt", "delta": "dt", "step": "dt", "interval": "dt", "start": "t0", "startvalue": "t0"}
"""Names below an abscissa, and the names that they stand for."""

_ABSCISSAS = {"x", "xvalues", "xaxis", "time", "t", "abscissa", "wf", "xdata"}

RATE_UNITS = {
    "hz": 1.0, "khz": 1e3, "mhz": 1e6, "s/s": 1.0, "ks/s": 1e3, "ms/s": 1e6, "sa/s": 1.0, "ksa/s": 1e3, "msa/s": 1e6,
    "sps": 1.0, "ksps": 1e3, "samples/s": 1.0, "samples/sec": 1.0, "samples/second": 1.0, "samples per second": 1.0,
    "1/s": 1.0, "1/sec": 1.0, "s-1": 1.0, "s^-1": 1.0, "hertz": 1.0, "samp/s": 1.0, "pts/s": 1.0, "per second": 1.0,
}  # fmt: skip
"""Units of a sampling rate, small letters, in Hz."""

_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s].{0,20}?)?\s*")

FASTEST_SHAFT = 500.0
"""Highest speed in rev/s for which a ``rate`` is taken."""


def rate_of(name: str, value: ArrayLike) -> float | None:
    """Return the sampling rate in Hz that a number or a text of this name states; None if it states none.

    Examples
    --------
    >>> rate_of("data.Sampling_Rate", 12800), rate_of("dt", 0.001), rate_of("load", 3)
    (12800.0, 1000.0, None)
    >>> rate_of("fs_kHz", 12.8), rate_of("Sample Rate", "2000 Hz"), rate_of("ch1.x_values.increment", 0.0005)
    (12800.0, 2000.0, 2000.0)
    """
    stated = stated_rate(name, value)
    return None if stated is None or stated[1] else stated[0]


def stated_rate(name: str, value: ArrayLike) -> tuple[float, str] | None:
    """Return a sampling rate in Hz, and the rest of the name, which may be that of a channel: ``fs_vib``."""
    words, unit = _words(name)
    number = _number(value)
    split = _split(words, RATES | INTERVALS)
    if number is None or split is None or not number[0] > 0:
        return None
    stated, unit = number[0], number[1] or unit
    if split[0] in RATES:
        factor = RATE_UNITS.get(unit, None if unit else 1.0)
        return None if factor is None else (stated * factor, split[1])
    seconds = seconds_of(unit)
    if seconds is None or not stated * seconds > 0 or not np.isfinite(1 / (stated * seconds)):
        return None
    return 1 / (stated * seconds), split[1]


def start_of(name: str, value: ArrayLike) -> float | None:
    """Return the time of the first sample in s that a number of this name states; None if it states none.

    Examples
    --------
    >>> start_of("ch1.t0", 0.05), start_of("x_values.start_value", 2), start_of("start", 3)
    (0.05, 2.0, None)
    """
    words, unit = _words(name)
    number = _number(value)
    if number is None or "".join(words) not in STARTS:
        return None
    seconds = seconds_of(number[1] or unit)
    return None if seconds is None else number[0] * seconds


def speed_of(name: str, value: ArrayLike) -> float | None:
    """Return the speed in rev/min that a number of this name states; None if it states none.

    A ``rate`` of up to 500 is a speed in rev/s, as some collections of bearing measurements name it.

    Examples
    --------
    >>> speed_of("X097RPM", [[1796]]), speed_of("bearing.rate", 25), speed_of("rate", 12800), speed_of("load", 3)
    (1796.0, 1500.0, None, None)
    """
    words, unit = _words(name)
    number = _number(value)
    if number is None or not number[0] > 0:
        return None
    unit = number[1] or unit
    if words == ["rate"] and unit in ("", "hz"):
        return 60 * number[0] if number[0] <= FASTEST_SHAFT else None
    has_rpm = any(word.endswith("rpm") for word in words) and unit in ("", "rpm")
    return number[0] if has_rpm or (unit in ("rpm", "rev/min", "1/min") and "speed" in words) else None


def _number(value: ArrayLike) -> tuple[float, str] | None:
    """Return the number that a value or a text states, and the unit of the text; equal numbers are one number."""
    stored = np.asarray(value)
    if stored.dtype.kind in "iuf" and stored.size and np.all(stored == stored.flat[0]):
        number = float(stored.flat[0])
        return (number, "") if np.isfinite(number) else None
    if stored.dtype.kind not in "US" or stored.size != 1:
        return None
    item = stored.reshape(()).item()
    text = item.decode("utf-8", "replace") if isinstance(item, bytes) else str(item)
    match = _TEXT.fullmatch(text[:100])
    if match is None or not np.isfinite(float(match[1])):
        return None
    return float(match[1]), (match[2] or "").strip(" []()").lower()


def _words(name: str) -> tuple[list[str], str]:
    """Return the words of the last part of a name, and the unit at its end."""
    bracket = re.search(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$", name)
    parts = [_plain(part) for part in re.split(r"[./]", name[: bracket.start()] if bracket else name)]
    parts = [part for part in parts if part]
    if len(parts) > 1 and parts[-1] in (["value"], ["values"]):
        parts.pop()
    if not parts:
        return [], ""
    words, unit = parts[-1], bracket[1].lower() if bracket else ""
    whole = "".join(words) in RATES | INTERVALS
    if (
        len(words) > 1
        and not whole
        and (words[-1] in RATE_UNITS or words[-1] in ("s", "ms", "us", "ns", "sec"))
        and not unit
    ):
        words, unit = words[:-1], words[-1]
    if len(parts) > 1 and "".join(parts[-2]) in _ABSCISSAS and "".join(words) in _OF_ABSCISSA:
        words = [_OF_ABSCISSA["".join(words)]]
    return words, unit


def _plain(text: str) -> list[str]:
    """Return the words and numbers of a text in small letters; ``sampleRate`` is two words."""
    text = text[:200].replace("kHz", "khz").replace("MHz", "mhz")
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[^\W\d_])(?=\d)|(?<=\d)(?=[^\W\d_])", " ", text)
    return re.findall(r"[^\W_]+", re.sub(r"\bt 0\b", "t0", parted.lower()))


def _split(words: list[str], names: Collection[str]) -> tuple[str, str] | None:
    """Return the name among words, and the others: all words, or the first or the last of them."""
    for count in range(len(words), 0, -1):
        for chosen, rest in ((words[:count], words[count:]), (words[-count:], words[:-count])):
            name = plain_name("".join(chosen))
            if name in names:
                return name, " ".join(rest)
    return None


def is_of(name: str, rest: str) -> bool:
    """Return whether the rest of a name of a rate is the name of an array, or its number: ``fs1`` is of ``a1``."""
    words = _plain(re.split(r"[./]", name)[-1])
    return bool(words) and (" ".join(words) == rest or (rest.isdigit() and words[-1] == rest))
