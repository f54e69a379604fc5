"""LabVIEW measurement files (LVM)."""

import datetime
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.contents import (
    MAX_PARTS,
    Contents,
    DataColumn,
    bounded_bytes,
    check_columns,
    check_values,
)
from sigdb.recording.files.formats.text.encoding import FOREIGN, decoded, encoded_text
from sigdb.recording.files.formats.text.layout import TextLayout
from sigdb.recording.files.formats.text.values import table_values
from sigdb.recording.files.settings import RecordingSettings

__all__ = ["FOREIGN", "begins_like_lvm", "header_facts", "joined_segments", "lvm_head", "lvm_segment", "read_lvm"]

END_OF_HEADER = "***End_of_Header***"
END_MARK = END_OF_HEADER.encode()
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";", "\t": "\t", ",": ",", ";": ";"}
_MOST_HEADER_LINES = 100
_CONTINUES = 0.5
"""Distance of a segment from the end of the segment before it, in steps, up to which it continues it."""


@dataclass(frozen=True, kw_only=True)
class LvmHead:
    """Head of a file.

    Attributes
    ----------
    separator, decimal
        Sign between columns, and decimal sign.
    columns_of_x
        "no", "one" or "multi" columns of times.
    start
        Date and time of the file.
    size
        Bytes of the head.
    """

    separator: str
    decimal: str
    columns_of_x: str
    start: datetime.datetime | None
    size: int


@dataclass(frozen=True, kw_only=True)
class LvmSegment:
    """A segment of a file: facts of its header by keyword, and its columns as stored.

    Attributes
    ----------
    names, units
        Names and units of the channels.
    values
        (n,) samples of each channel.
    times
        (n,) times in s of each channel, where the file stores them.
    starts
        Time of the first sample of each channel in s, since the date and time of the file.
    steps
        Sampling interval of each channel in s; nan where it is not stated.
    abscissas
        Quantity along the samples of each channel.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[FloatArray, ...]
    times: tuple[FloatArray | None, ...]
    starts: tuple[float, ...]
    steps: tuple[float, ...]
    abscissas: tuple[str, ...]


def begins_like_lvm(begin: bytes) -> bool:
    """Return whether a file begins like a LabVIEW measurement file."""
    if begin[:2] in (b"\xff\xfe", b"\xfe\xff"):
        begin = begin.decode("utf-16", "ignore").encode()
    return begin.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"LabVIEW Measurement")


def read_lvm(path: Path, settings: RecordingSettings) -> Contents:
    """Read the channels of a LabVIEW measurement file; segments that continue each other are joined.

    Raises
    ------
    InputError
        If a header is damaged, or a segment does not continue the one before it.
    """
    del settings
    data, notes = encoded_text(bounded_bytes(path))
    head = lvm_head(data)
    columns, joined = joined_segments(_segments(data, head))
    check_columns(len(columns))
    return Contents(columns=columns, notes=(*notes, *joined))


def lvm_head(data: bytes) -> LvmHead:
    """Return the head of a file from its first bytes as UTF-8."""
    lines = data.split(b"\n", _MOST_HEADER_LINES)[:_MOST_HEADER_LINES]
    ends = [i for i, line in enumerate(lines) if line.strip().startswith(END_MARK)]
    if not ends:
        raise InputError(f"has no line {END_OF_HEADER} in its first {_MOST_HEADER_LINES} lines; it is damaged")
    facts = header_facts([decoded(line) for line in lines[: ends[0]]], None)
    separator = _SEPARATORS.get(_first(facts, "separator", "tab").lower(), "\t")
    decimal = "," if _first(facts, "decimal_separator", ".").strip() == "," else "."
    return LvmHead(
        separator=separator, decimal=decimal, columns_of_x=_first(facts, "x_columns", "One").lower(),
        start=_moment(_first(facts, "date", ""), _first(facts, "time", "")),
        size=sum(len(line) + 1 for line in lines[: ends[0] + 1]),
    )  # fmt: skip


def header_facts(lines: list[str], separator: str | None) -> dict[str, list[str]]:
    """Return the values of a header by keyword in small letters."""
    facts: dict[str, list[str]] = {}
    for line in lines:
        parts = line.split(separator) if separator else re.split(r"[\t,;]", line, maxsplit=1)
        fields = [part.strip() for part in parts]
        if fields[0]:
            facts[fields[0].lower()] = fields[1:]
    return facts


def _first(facts: dict[str, list[str]], key: str, default: str) -> str:
    values = [value for value in facts.get(key, []) if value]
    return values[0] if values else default


def _segments(data: bytes, head: LvmHead) -> list[LvmSegment]:
    """Return the segments of a file; each begins with a header of its own, or with the heads of its columns."""
    segments: list[LvmSegment] = []
    at, separator = head.size, head.separator
    while data[at:].strip():
        if len(segments) >= MAX_PARTS:
            raise InputError(f"holds more than {MAX_PARTS} segments; cut it into shorter recordings")
        end = data.find(END_MARK, at)
        if end < 0:
            raise InputError("has rows without the header of a segment; write the file again with its segment headers")
        facts = header_facts([decoded(line) for line in data[at:end].split(b"\n")], separator)
        heads_at = data.index(b"\n", end) + 1 if b"\n" in data[end:] else len(data)
        body_at = data.find(b"\n", heads_at) + 1 or len(data)
        following = data.find(END_MARK, body_at)
        stop = _before_header(data, body_at, following) if following >= 0 else len(data)
        heads = [field.strip() for field in decoded(data[heads_at:body_at]).split(separator)]
        number = data.count(b"\n", 0, body_at)
        body = data[body_at:stop]
        segments.append(lvm_segment(head, facts, heads, body, first=number))
        at = stop
    if not segments:
        raise InputError("holds no segment with samples")
    return segments


def _before_header(data: bytes, at: int, following: int) -> int:
    """Return where the header of the next segment begins: at its line of the number of channels."""
    start = data.rfind(b"\nChannels", at - 1, following)
    return start + 1 if start >= 0 else following


def lvm_segment(head: LvmHead, facts: dict[str, list[str]], heads: list[str], body: bytes, *, first: int) -> LvmSegment:
    """Return the channels of a segment.

    Parameters
    ----------
    head
        Head of the file.
    facts, heads
        Facts of the segment's header by keyword, and the heads of its columns.
    body
        Its rows.
    first
        Number of lines before them.
    """
    heads, separator, decimal, columns_of_x = [*heads], head.separator, head.decimal, head.columns_of_x
    while heads and (not heads[-1] or heads[-1].lower() == "comment"):
        heads.pop()
    multi = columns_of_x == "multi"
    places = list(range(1, len(heads), 2 if multi else 1))
    if not places or (heads[0] and not heads[0].lower().startswith(("x_value", "x value"))):
        raise InputError(f"line {first}: {heads[:1]} is no head of columns of a segment (X_Value); the file is damaged")
    facts = _over_channels(facts, len(places)) if multi else facts
    body = b"\n".join(line for line in body.split(b"\n") if line.strip()) + b"\n"
    most = max((line.count(separator.encode()) for line in body.split(b"\n")), default=0) + 1
    width = min(most, len(heads) + 2)
    check_columns(width)
    check_values(width * body.count(b"\n"))
    used = set(places) | (set(range(0, len(heads), 2)) if multi else {0})
    kinds = "".join("n" if i in used else "w" for i in range(max(width, max(used) + 1)))
    body = _padded(body, separator, len(kinds))
    layout = TextLayout(separator=separator, decimal=decimal, first=first, kinds=kinds)
    names = tuple(heads[i] if i < len(heads) and heads[i] else f"column{i + 1}" for i in range(len(kinds)))
    values, _ = table_values(body, layout, names)
    channels = range(len(places))
    x = [values[i - 1 if multi else 0] if columns_of_x != "no" else None for i in places]
    samples = [int(_number(facts, "samples", k, decimal, default=-1)) for k in channels]
    series = [_cut(values[i], n) for i, n in zip(places, samples, strict=True)]
    return LvmSegment(
        names=tuple(heads[i] for i in places),
        units=tuple(_field(facts, "y_unit_label", k) for k in channels),
        values=tuple(series),
        times=tuple(_times(t, y.size) for t, y in zip(x, series, strict=True)),
        starts=tuple(_number(facts, "x0", k, decimal, default=0.0) + _offset(facts, k, head.start) for k in channels),
        steps=tuple(_number(facts, "delta_x", k, decimal, default=np.nan) for k in channels),
        abscissas=tuple(_abscissa(_field(facts, "x_dimension", k)) for k in channels),
    )


def _over_channels(facts: dict[str, list[str]], channels: int) -> dict[str, list[str]]:
    """Return the facts with a value for each channel, also where they stand over its column, apart by empty fields."""
    apart = [values for values in facts.values() if any(values[channels:])]
    spread = apart and not any(value for values in apart for value in values[1::2])
    return {key: values[::2] for key, values in facts.items()} if spread else facts


def _abscissa(dimension: str) -> str:
    return "time" if dimension.lower() in ("", "time") else dimension


def _padded(body: bytes, separator: str, width: int) -> bytes:
    """Return rows of the same width; LabVIEW leaves empty fields and the comment at their ends away."""
    sign = separator.encode()
    widths = {line.count(sign) + 1 for line in body.split(b"\n") if line}
    if widths <= {width}:
        return body
    lines = (line.rstrip(b"\r") for line in body.split(b"\n") if line)
    return b"\n".join(line + sign * (width - 1 - line.count(sign)) for line in lines) + b"\n"


def _times(t: FloatArray | None, samples: int) -> FloatArray | None:
    return None if t is None or np.isnan(t[:samples]).any() else t[:samples]


def _cut(y: FloatArray, samples: int) -> FloatArray:
    """Return the samples that a channel has, where its column is longer."""
    return y[:samples] if 0 <= samples <= y.size else y


def _field(facts: dict[str, list[str]], key: str, at: int) -> str:
    values = facts.get(key, [])
    return values[at] if at < len(values) else ""


def _number(facts: dict[str, list[str]], key: str, at: int, decimal: str, *, default: float) -> float:
    text = _field(facts, key, at).replace(decimal, ".")
    try:
        number = float(text) if text else default
    except ValueError:
        number = np.nan
    if not np.isfinite(number) and text:
        raise InputError(f"{key} of channel {at + 1} is {text[:40]!r}, which is not a number; the file is damaged")
    return number


def _offset(facts: dict[str, list[str]], at: int, start: datetime.datetime | None) -> float:
    """Return the seconds from the date and time of the file to those of a channel."""
    moment = _moment(_field(facts, "date", at), _field(facts, "time", at))
    return 0.0 if start is None or moment is None else (moment - start).total_seconds()


def _moment(date: str, time: str) -> datetime.datetime | None:
    """Return a date as LabVIEW writes it, 2024/03/01 or with points, and a time with a fraction of any length."""
    day = re.fullmatch(r"([0-9]{4})[/.-]([0-9]{1,2})[/.-]([0-9]{1,2})", date.strip())
    hour = re.fullmatch(r"([0-9]{1,2}):([0-9]{2}):([0-9]{2})(?:[.,]([0-9]{1,20}))?", time.strip())
    if day is None or hour is None:
        return None
    micros = round(float(f"0.{hour[4] or 0}") * 1e6)
    try:
        year, month, of_month = map(int, day.groups())
        hours, minutes, seconds = map(int, hour.groups()[:3])
        whole = datetime.datetime(year, month, of_month, hours, minutes, seconds, tzinfo=datetime.UTC)
    except ValueError:
        return None
    return whole + datetime.timedelta(microseconds=micros)


def joined_segments(
    segments: list[LvmSegment], origin: float | None = None
) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the channels of segments that continue each other as columns; ``origin`` is the file's first start."""
    first = segments[0]
    for number, segment in enumerate(segments[1:], 2):
        if (segment.names, segment.steps, segment.units) != (first.names, first.steps, first.units):
            raise InputError(
                f"segment {number} has other channels than the first, {', '.join(segment.names[:4])}; cut the file in "
                "one for each segment"
            )
    columns = []
    origin = min(first.starts) if origin is None else origin
    for k, name in enumerate(first.names):
        end, step = first.starts[k], first.steps[k]
        for number, segment in enumerate(segments, 1):
            if not abs(segment.starts[k] - end) <= _CONTINUES * step and number > 1:
                raise InputError(
                    f"segment {number} of channel {name} begins {segment.starts[k] - end:.6g} s after the end of the "
                    "one before it; cut the file in one for each segment"
                )
            end = segment.starts[k] + step * segment.values[k].size
        values = np.concatenate([segment.values[k] for segment in segments]) if len(segments) > 1 else first.values[k]
        column = DataColumn(
            name=name, unit=first.units[k], values=values, start=first.starts[k] - origin, abscissa=first.abscissas[k]
        )
        columns.append(_with_rate(column, step, first.times[k]))
    text = f"{len(segments)} segments that continue each other were joined"
    joined = [Note(code="joined-segments", text=text, values={"segments": len(segments)})] if len(segments) > 1 else []
    return tuple(columns), joined


def _with_rate(column: DataColumn, step: float, times: FloatArray | None) -> DataColumn:
    """Return a column with its rate: that of Delta_X, which the stored times must not contradict."""
    measured = float(times[-1] - times[0]) / (times.size - 1) if times is not None and times.size > 2 else np.nan
    if np.isnan(step) and measured > 0 and times is not None:
        even = times[0] + measured * np.arange(times.size)
        if np.abs(times - even).max() > _CONTINUES * measured:
            raise InputError(f"channel {column.name}: its times (X_Value) are not even; resample it")
        return replace(column, sampling_rate=1 / measured, rate_from="X_Value")
    if np.isnan(step):
        return column
    if step <= 0:
        raise InputError(f"channel {column.name}: Delta_X is {step:.6g} s; give sampling_rate, or write it again")
    drift = abs(measured - step) * (column.values.size - 1)
    if times is not None and drift > step + measured + 1e-6 * abs(float(times[-1])):
        raise InputError(
            f"channel {column.name}: Delta_X states {step:.6g} s, and its times (X_Value) rise by {measured:.6g} s; "
            "write the file again"
        )
    return replace(column, sampling_rate=1 / step, rate_from="Delta_X")
