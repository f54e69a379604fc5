"""Dates and clock times in columns of a text, as seconds since the first row."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.text.fields import DATE, MOMENT, MONTHS, NOON, TIME

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

DAY = 86_400.0
"""Length of a day in s."""

HOUR = 3600.0
"""Length of an hour in s."""

LONGEST_STEP = 3600.0
"""Longest step in s of dates whose order of day and month is found from their course."""

_ORDERS = {"d": "day", "m": "month", "y": "year"}
_FOREIGN_MONTHS = {"mär": "Mar", "mrz": "Mar", "mai": "May", "okt": "Oct", "dez": "Dec"}
_MONTH = re.compile(rf"({MONTHS})", re.IGNORECASE)
_ZONE = re.compile(r"\s*(z|utc|gmt|[+-]\d{2}(:?\d{2})?)$", re.IGNORECASE)
_FRACTION = (r"(:\d{2}:\d{2})($|[^\d.:])", r"\1.0\2")
"""Pattern of a clock time without a fraction, and the text with one."""

_ISO = re.compile(r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}:\d{2}(\.\d{1,9})?(Z|[+-]\d{2}:?\d{2})?")
_NORMAL_FORM = (
    (r"(?i)([a-z]{3})[a-z]*\.?", r"\1"),
    (r"^(\d{4})(\d{2})(\d{2})T(\d{2})(\d{2})(\d{2})", r"\1-\2-\3 \4:\5:\6"),
    (r"^(\d{4})(\d{2})(\d{2}) (\d{1,2}:)", r"\1-\2-\3 \4"),
    (r"^(?:\d{4}[: ])?(\d{3})[: ](\d{1,2}:\d{2}:\d{2}(?:[.,]|$))", r"\1 days \2"),
    (r"(\d)(?:T|_|, *| {2,})(\d{1,2}:\d{2})", r"\1 \2"),
    (r"(:\d{2}),(\d)", r"\1.\2"),
    (r"(:\d{2}:\d{2}):(\d{3})($|\D)", r"\1.\2\3"),
    (r"(?i)\s*([ap])\.?m\.?", r" \1m"),
)
"""Patterns and what replaces them: months of three letters, the day of the year of IRIG, a blank before the time, a
point, AM or PM."""

_ELAPSED = re.compile(r"(\d{1,4}) days? \+?(?=\d)")
"""The days before a time, as pandas writes durations."""


@dataclass(frozen=True, kw_only=True)
class ClockColumn:
    """Dates and clock times of a table.

    Attributes
    ----------
    columns
        Positions of the columns: of the date and the time, or of both in one.
    name
        Name of the column of times.
    """

    columns: tuple[int, ...]
    name: str


def clock_columns(kinds: str, names: tuple[str, ...]) -> list[ClockColumn]:
    """Return the columns of clock times; a date, a time and a mark of noon in neighbouring columns belong together."""
    clocks: list[ClockColumn] = []
    taken: set[int] = set()
    for i, kind in enumerate(kinds):
        if kind not in TIME + MOMENT:
            continue
        columns = [i]
        if kind == TIME:
            dates = [k for k in (i - 1, i + 1) if 0 <= k < len(kinds) and kinds[k] == DATE and k not in taken]
            columns = [*dates[:1], i]
        after = max(columns) + 1
        if after < len(kinds) and kinds[after] == NOON:
            columns.append(after)
        taken |= set(columns)
        clocks.append(ClockColumn(columns=tuple(columns), name=names[i]))
    return clocks


def elapsed_seconds(texts: "pa.ChunkedArray", *, name: str, first: int) -> tuple[FloatArray, Note]:
    """Return dates and clock times as seconds since the first row, and a note on the start.

    Parameters
    ----------
    texts
        (n,) clock times as the file writes them.
    name
        Name of their column.
    first
        Number of lines before the first row.

    Returns
    -------
    seconds
        (n,) s; nan where a time is missing.
    note
        The note that states the date and time of the first row.

    Raises
    ------
    InputError
        If a row has no time in the format of the others, or the order of day and month matters and is not certain.
    """
    plain = _normal(texts)
    filled = (plain != "").to_numpy()
    if not filled.any():
        return np.full(len(plain), np.nan), _start_note(name, "", "")
    for fractions in (False, True):
        plain = plain.str.replace(*_FRACTION, regex=True) if fractions else plain
        parsed = [(style, _parsed(plain, style)) for style in _formats(str(plain.iloc[int(np.argmax(filled))]))]
        whole = [(style, seconds) for style, seconds in parsed if not np.isnan(seconds[filled]).any()]
        if whole:
            break
    if not whole:
        failed = [np.isnan(seconds) & filled for _, seconds in parsed] or [filled]
        at = int(np.argmax(min(failed, key=np.count_nonzero)))
        raise InputError(
            f"line {first + at + 1}, column {name}: {str(texts[at])[:40]!r} is no date or clock time like the others; "
            "mend it, or leave it empty"
        )
    start = str(texts[int(np.argmax(filled))]).strip()
    seconds, order = _certain(whole, name=name, text=start)
    style = whole[0][0]
    if style.startswith(("%H", "%I", "%M")):
        seconds = _going_on(seconds, HOUR if style.startswith("%M") else DAY)
    return seconds, _start_note(name, start, order)


def _start_note(name: str, start: str, order: str) -> Note:
    text = f"{name} holds clock times, read as seconds since the first row, {start}{order}"
    return Note(code="clock-times", text=text, values={"column": name, "start": start})


def _normal(texts: "pa.ChunkedArray") -> "pd.Series[str]":
    """Return clock times with point, one blank between date and time, English months, AM or PM, and a fraction."""
    import pyarrow as pa
    from pyarrow import compute

    plain = compute.utf8_trim_whitespace(compute.fill_null(texts.cast(pa.string()), ""))
    first = next((text for value in plain if (text := str(value))), "")
    if not _ISO.fullmatch(first):
        if _MONTH.search(first):
            for word, month in _FOREIGN_MONTHS.items():
                plain = compute.replace_substring_regex(plain, f"(?i){word}[a-zä]*", month)
        for pattern, replacement in _NORMAL_FORM:
            if re.search(pattern, first):
                plain = compute.replace_substring_regex(plain, pattern, replacement)
                first = re.sub(pattern, replacement, first)
    series = plain.to_pandas()
    return series.fillna("")


def _formats(text: str) -> list[str]:
    """Return the formats that a clock time may have, for ``pandas.to_datetime``."""
    if iso := _ISO.fullmatch(text):
        return ["ISO8601%z" if iso[2] else "ISO8601"]
    if _ELAPSED.match(text):
        return ["days"]
    zone = _ZONE.search(text)
    zone = zone if zone and ":" in text[: zone.start()] else None
    body = text[: zone.start()] if zone else text
    noon = body.lower().endswith((" am", " pm"))
    body = body[:-3] if noon else body
    day, blank, hour = body.rpartition(" ")
    if ":" not in hour:
        return []
    hours = _hour_format(hour, noon=noon)
    end = "" if zone is None else " %z" if zone[0].startswith(" ") else "%z"
    return [f"{style}{blank}{hours}{end}" for style in (_day_formats(day) if day else [""])]


def _hour_format(hour: str, *, noon: bool) -> str:
    style = "%I" if noon else "%H"
    if hour.count(":") == 1:
        style = "%M:%S.%f" if "." in hour or "," in hour else f"{style}:%M"
    else:
        style = f"{style}:%M:%S.%f" if "." in hour else f"{style}:%M:%S"
    return f"{style} %p" if noon else style


def _day_formats(day: str) -> list[str]:
    mark = next((sign for sign in "-/." if sign in day), " ")
    parts = re.split(r"[-/. ,]+", day.strip())
    if len(parts) != 3:
        return []
    if any(part.isalpha() for part in parts):
        year = "%Y" if len(parts[2]) == 4 else "%y"
        order = ["%b", "%d"] if parts[0].isalpha() else ["%d", "%b"]
        return [re.sub(r"[^-/. ,]+", "{}", day).format(*order, year)]
    if len(parts[0]) == 4:
        return [mark.join(("%Y", "%m", "%d"))]
    year = "%Y" if len(parts[2]) == 4 else "%y"
    styles = [mark.join(("%d", "%m", year))]
    if mark != ".":
        styles.append(mark.join(("%m", "%d", year)))
    if year == "%y" and mark != ".":
        styles.append(mark.join(("%y", "%m", "%d")))
    return styles


def _parsed(texts: "pd.Series[str]", style: str) -> FloatArray:
    """Return times in s since the first; nan where a text does not have the format."""
    import pandas as pd

    zone = "%z" in style
    if style == "days":
        return _of_day(texts)
    if style.startswith("%H:%M:%S"):
        seconds = _parsed("2000-01-01 " + texts.where(texts != "", None), f"%Y-%m-%d {style}")
        return _of_day(texts) if np.isnan(seconds[(texts != "").to_numpy()]).any() else seconds
    style = "ISO8601" if style.startswith("ISO") else style
    if zone and style != "ISO8601":
        texts = texts.str.replace(r"(?i)(?:utc|gmt|z)$", "+0000", regex=True)
        texts = texts.str.replace(r"([+-]\d{2})$", r"\g<1>00", regex=True)
    moments = pd.to_datetime(texts, format=style, errors="coerce", utc=zone)
    values = moments.dt.tz_localize(None) if zone else moments
    return _since_first(values.to_numpy().astype("datetime64[ns]"))


def _of_day(texts: "pd.Series[str]") -> FloatArray:
    """Return times of the day in s since the first; more than 24 hours are times that elapsed."""
    days, times = texts.str.extract(rf"^{_ELAPSED.pattern}")[0], texts.str.replace(_ELAPSED, "", regex=True)
    hours = times.str.extract(r"^(\d{1,3}):([0-5]\d):([0-5]\d(?:\.\d{1,9})?)$")
    parts = np.column_stack([days.fillna("0").to_numpy(dtype=float), hours.to_numpy(dtype=float)])
    present = np.flatnonzero(~np.isnan(parts).any(axis=1))
    since = parts - parts[present[0]] if present.size else parts
    return np.round(since @ np.array([DAY, HOUR, 60.0, 1.0]), 9)


def _since_first(moments: "np.ndarray[tuple[int], np.dtype[np.datetime64]]") -> FloatArray:
    seconds = np.full(moments.size, np.nan)
    present = np.flatnonzero(~np.isnat(moments))
    if present.size:
        seconds[present] = (moments[present] - moments[present[0]]).astype(np.int64) / 1e9
    return seconds


def _going_on(seconds: FloatArray, period: float) -> FloatArray:
    """Return times of the day, or of the hour, that go on rising after its end; the fall is nearly the whole period."""
    present = np.flatnonzero(~np.isnan(seconds))
    falls = np.cumsum(np.diff(seconds[present]) < -period * 23 / 24)
    seconds = seconds.copy()
    seconds[present[1:]] += period * falls
    return seconds


def _certain(whole: list[tuple[str, FloatArray]], *, name: str, text: str) -> tuple[FloatArray, str]:
    """Return the seconds; where several orders of day and month fit, those that rise without a leap, and the order."""
    seconds = whole[0][1]
    if all(np.array_equal(seconds, other, equal_nan=True) for _, other in whole[1:]):
        return seconds, ""
    smooth = [pair for pair in whole if _rises_without_leap(pair[1])]
    if len(smooth) != 1:
        raise InputError(
            f"column {name}: {text!r} may have the day or the month first; write dates as 2024-12-31, or remove the "
            "column and give sampling_rate"
        )
    style, seconds = smooth[0]
    return seconds, f", with the {_ORDERS[style[1]]} first"


def _rises_without_leap(seconds: FloatArray) -> bool:
    steps = np.diff(seconds[~np.isnan(seconds)])
    return bool(steps.size and steps.min() >= 0 and steps.max() <= LONGEST_STEP)
