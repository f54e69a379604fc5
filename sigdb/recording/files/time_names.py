"""Names and units of columns: which of them state times, and which count samples."""

import re
import unicodedata
from dataclasses import dataclass
from typing import Literal


def _plain(text: str) -> str:
    """Return a text in small letters without accents."""
    decomposed = unicodedata.normalize("NFKD", unicodedata.normalize("NFKC", text).casefold())
    return "".join(sign for sign in decomposed if unicodedata.category(sign) != "Mn")


SECONDS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "sek": 1.0, "sekunde": 1.0, "sekunden": 1.0,
    "seconde": 1.0, "secondes": 1.0, "segundo": 1.0, "segundos": 1.0, "сек": 1.0, "\u0441": 1.0, "秒": 1.0,
    "ms": 1e-3, "msec": 1e-3, "msecs": 1e-3, "msek": 1e-3, "millis": 1e-3, "millisec": 1e-3, "millisecond": 1e-3,
    "milliseconds": 1e-3, "millisekunden": 1e-3, "мс": 1e-3, "毫秒": 1e-3,
    "us": 1e-6, "μs": 1e-6, "usec": 1e-6, "μsec": 1e-6, "usecs": 1e-6, "micros": 1e-6, "microsec": 1e-6,
    "microsecond": 1e-6, "microseconds": 1e-6, "mikrosekunden": 1e-6, "мкс": 1e-6, "微秒": 1e-6,
    "ns": 1e-9, "nsec": 1e-9, "nsecs": 1e-9, "nanos": 1e-9, "nanosecond": 1e-9, "nanoseconds": 1e-9,
    "min": 60.0, "mins": 60.0, "minute": 60.0, "minutes": 60.0, "minuten": 60.0,
    "h": 3600.0, "hr": 3600.0, "hrs": 3600.0, "hour": 3600.0, "hours": 3600.0, "stunden": 3600.0,
    "d": 86_400.0, "day": 86_400.0, "days": 86_400.0, "tage": 86_400.0,
}  # fmt: skip
"""Seconds in each unit of time, in small letters without accents."""

_ALONE = {"min", "h", "d", "hr", "day", "\u0441"}
"""Units that are no name of a column of times: ``min`` is a minimum, ``h`` a height."""

_COUNT_UNITS = {"sample", "samples", "count", "counts", "index", "pts", "points", "#", "no", "nr"}

_TIME = {_plain(word) for word in (
    "t", "time", "times", "timestamp", "timestamps", "tstamp", "datetime", "epoch", "unixtime", "utc", "elapsed",
    "zeit", "zeiten", "zeitstempel", "uhrzeit", "messzeit", "relativzeit", "temps", "tiempo", "tiempos", "tempo",
    "tempi", "tid", "tider", "tidpunkt", "tijd", "cas", "czas", "aika", "ido", "zaman", "vreme", "vrijeme",
    "laikas", "laiks", "aeg", "timp", "timpul", "denbora", "waktu", "oras", "hora", "heure", "время", "час", "χρονος",
    "时间", "時間", "时刻", "時刻", "时间戳", "시간", "समय", "เวลา", "زمن", "الزمن", "زمان", "الوقت", "זמן",
    "timeaxis", "timevector", "timevec", "timebase", "timevalues", "reltime", "abstime", "runtime",
    "xvalue", "xtime", "zeitachse", "zeitkanal",
)}  # fmt: skip
"""Words for time."""

_SHORT = {"t", "tid", "cas", "ido", "temps", "tempo", "hora", "час", "oras", "aeg"}
"""Words for time that may be names of other quantities."""

_DENOMINATORS = {"m", "mm", "cm", "km", "um", "in", "ft", "rad", "deg", "rev", "r", "u", "tr", "rotations", "per"}
"""Words before a unit of time that make it another unit, such as rad/s."""

_ABSCISSA = {"x", "xaxis", "xvalues", "xdata", "abscissa", "abscisse", "abszisse", "ascissa"}

_COUNT = {
    "index", "indices", "idx", "unnamed", "no", "nr", "num", "number", "numbers", "nummer", "numero", "sample",
    "samples", "n", "i", "k", "row", "rows", "point", "points", "pt", "pts", "id", "scan", "scans", "record", "records",
    "counter", "count", "counts", "line", "zeile", "messpunkt", "seq", "sequence", "frame", "frames", "tick", "ticks",
    "序号", "序號", "编号", "番号", "obs", "observation", "pos", "position", "lfd", "step",
}  # fmt: skip

_FILLERS = {
    "in", "of", "the", "de", "en", "du", "since", "start", "axis", "achse", "axe", "value", "values", "wert", "werte",
    "plot", "channel", "ch", "col", "column", "vector", "vec", "array", "data", "relative", "relativ", "rel",
    "abs", "absolute", "total", "sample", "sampling", "measurement", "measured", "stamp", "stamps", "elapsed", "base",
}  # fmt: skip

_POWER = re.compile(
    r"\d\s*(?:e|\^|\*\*)\s*\(?[-+\u2212]?\d|10[\u207b\u2070\u00b9\u00b2\u00b3\u2074-\u2079]|\b1\s*/\s*\d|[*\u00d7]\s*\d",
    re.IGNORECASE,
)
"""A factor in a name or unit, such as ``x1e-3`` or ``1/100``: of the numbers or of the unit, which is open."""

_PREFIX = re.compile(r"(milli|micro|mikro|nano|(?<![^\W\d_])[munµμ](?=sec))[ _-]?(s[a-z]*)", re.IGNORECASE)
"""A prefix and its unit: ``MilliSeconds`` are no seconds."""

_FUSED = re.compile(
    r"(t|time|times?tamp|zeit|temps|tiempo|tempo|elapsed|epoch)"
    r"(s|sec|secs|seconds|ms|msec|millis|us|μs|usec|micros|ns|nsec|nanos)"
)


@dataclass(frozen=True, kw_only=True)
class TimeName:
    """Meaning of a column's name and unit.

    Attributes
    ----------
    kind
        ``time`` for a name of time; ``short`` for a name such as T, which may be another quantity's; ``perhaps`` for a
        name or unit that a ramp makes a time; ``count`` for a count of samples; ``other`` for anything else.
    unit
        Unit of time that name or unit state; empty if they state none.
    """

    kind: Literal["time", "short", "perhaps", "count", "other"]
    unit: str = ""


def seconds_of(unit: str) -> float | None:
    """Return the seconds in a unit of time, 1 for no unit; None if it is a unit of something else.

    Examples
    --------
    >>> seconds_of("Seconds"), seconds_of("[ms]"), seconds_of("µs"), seconds_of(""), seconds_of("1/min")
    (1.0, 0.001, 1e-06, 1.0, None)
    """
    bare = unit.strip(" []()-.")
    if bare in ("", "1"):
        return 1.0
    words = _words(bare)
    words = words[1:] if words[:1] == ["in"] else words
    return None if len(words) != 1 or re.search(r"[/\d^*%°]", bare) else SECONDS.get(words[0])


def time_name(name: str, unit: str = "") -> TimeName:
    """Return the meaning of a column's name and unit, in many languages and spellings.

    Examples
    --------
    >>> time_name("Zeit in ms"), time_name("timeMs").unit, time_name("t / s").unit
    (TimeName(kind='time', unit='ms'), 'ms', 's')
    >>> time_name("Unnamed: 0").kind, time_name("T", "degC").kind, time_name("a1", "s").kind
    ('count', 'other', 'perhaps')
    """
    if unit.strip() == "#" or " ".join(_words(unit)) in _COUNT_UNITS:
        return TimeName(kind="count")
    if seconds_of(unit) is None or _POWER.search(name):
        return TimeName(kind="other")
    words, in_name = _without_unit(name)
    bare = unit.strip(" []()-.")
    stated = in_name if bare in ("", "1") else bare
    rest = [word for word in words if word not in _FILLERS] or [word for word in words if word in _TIME]
    if rest and all(word in _TIME for word in rest):
        return TimeName(kind="short" if set(rest) <= _SHORT and not stated else "time", unit=stated)
    if (
        stated
        or "t" in words
        or any(_sounds_like_time(word) for word in words)
        or (rest and all(word in _ABSCISSA for word in rest))
    ):
        return TimeName(kind="perhaps", unit=stated)
    counts = all(word in _COUNT | _FILLERS for word in words) and (not words or any(word in _COUNT for word in words))
    return TimeName(kind="count" if counts else "other")


def _without_unit(name: str) -> tuple[list[str], str]:
    """Return the words of the last part of a name, and the unit of time at its end."""
    parts = [words for part in re.split(r"[./\\]", name) if (words := _words(part))]
    if not parts:
        return [], ""
    if len(parts) > 1 and len(parts[-1]) == 1 and parts[-1][0] in SECONDS:
        unit = "" if parts[-2][-1] in _DENOMINATORS or re.search(r"1\s*/[^/]*$", name) else parts[-1][0]
        return parts[-2], unit
    words = parts[-1]
    if fused := _FUSED.fullmatch(words[-1]):
        return [*words[:-1], fused[1]], "" if words[-1] == "times" else fused[2]
    if words[-1] in SECONDS and (
        words[-1] not in _ALONE if len(words) == 1 else words[-2] not in _DENOMINATORS - {"in"}
    ):
        return words[:-1], words[-1]
    inside = [word for word in words if SECONDS.get(word, 1.0) < 1]
    return ([word for word in words if word != inside[0]], inside[0]) if len(inside) == 1 else (words, "")


def _words(text: str) -> list[str]:
    """Return the words of a text in small letters without accents; ``timeMs`` is two words."""
    whole = _PREFIX.sub(lambda match: f" {match[1]}{match[2]}".lower(), text[:200])
    return re.findall(r"[^\W\d_]+", _plain(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", whole)))


def _sounds_like_time(word: str) -> bool:
    return (
        word in _TIME - _SHORT or word.startswith(("time", "zeit")) or word.endswith(("time", "zeit", "时间", "時間"))
    )


_OTHER_UNITS = {
    "hz": "frequency", "khz": "frequency", "mhz": "frequency", "cpm": "frequency", "order": "order", "orders": "order",
    "deg": "angle", "°": "angle", "degree": "angle", "degrees": "angle", "rad": "angle", "rev": "angle",
}  # fmt: skip
_OTHER_WORDS = {
    "freq": "frequency", "fréq": "frequency", "frec": "frequency", "frek": "frequency", "częst": "frequency",
    "част": "frequency", "taaj": "frequency", "频率": "frequency", "周波数": "frequency",
    "order": "order", "ordnung": "order", "angle": "angle",
    "winkel": "angle", "crank": "angle", "angolo": "angle", "ángulo": "angle", "hoek": "angle",
}  # fmt: skip


_OTHER_NAMES = {
    **dict.fromkeys(("f", "ff", "fx", "hz", "fhz", "fkhz", "faxis", "fvec", "fvector", "fgrid", "fbins"), "frequency"),
    **dict.fromkeys(("w", "omega", "ω", "cpm"), "frequency"),
}  # fmt: skip
"""Whole names of an abscissa."""


def other_abscissa(name: str, unit: str) -> str:
    """Return the quantity, ``frequency``, ``order`` or ``angle``, that a column's unit or name states; "" for others.

    Examples
    --------
    >>> other_abscissa("Frequenz", ""), other_abscissa("x", "Hz"), other_abscissa("a1", "g")
    ('frequency', 'frequency', '')
    """
    last = re.split(r"[./]", name.lower())[-1].strip()
    by_name = (quantity for word, quantity in _OTHER_WORDS.items() if last.startswith(word))
    whole = re.sub(r"[\W_]", "", last)
    return _OTHER_UNITS.get(unit.strip().lower()) or _OTHER_NAMES.get(whole) or next(by_name, "")
