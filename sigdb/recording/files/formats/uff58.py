"""UFF58: time records in data sets 58 of universal files, as text or binary (58b)."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    bounded_bytes,
    check_columns,
    check_parts,
    check_values,
)
from sigdb.recording.files.formats.uff58_numbers import text_numbers
from sigdb.recording.files.formats.uff58_sets import PER_SECOND, DataSet, data_sets, length_unit, real, whole
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.files.time_base import time_base
from sigdb.recording.files.time_names import seconds_of

FOREIGN: tuple[type[Exception], ...] = ()

GENERAL, TIME_RESPONSE = 0, 1
REAL = {2: "f4", 4: "f8"}
COMPLEX = (5, 6)
UNKNOWN, TIME = 0, 17
ABSCISSAS = {18: "frequency", 19: "speed", 20: "order"}


def read_uff58(path: Path, settings: RecordingSettings) -> Contents:
    """Read each time record as a column, named by the first line of its header, or by node and direction."""
    columns: list[tuple[DataColumn, DataSet]] = []
    others: list[str] = []
    length = ""
    total = 0
    for data_set in data_sets(bounded_bytes(path)):
        check_parts(len(columns) + len(others))
        if data_set.kind == "164":
            length = length_unit(data_set)
        elif data_set.kind not in ("58", "58b"):
            others.append(f"data set {data_set.kind}")
        elif reason := _no_time_record(data_set):
            others.append(f"{data_set.title or data_set.place} {reason}")
        else:
            columns.append((_column(data_set, settings), replace(data_set, body=b"")))
            total += columns[-1][0].values.size
            check_columns(len(columns))
            check_values(total)
    if not columns:
        raise InputError(f"holds no time record (data set 58 of function type 1){_listed(others)}")
    left_out = Note(code="data-sets-left-out", text=f"left out{_listed(others)}", values={"data_sets": len(others)})
    named = _with_names([(_with_unit(column, data_set, length), data_set) for column, data_set in columns])
    return Contents(columns=named, notes=(left_out,) if others else ())


def _listed(others: list[str]) -> str:
    return f": {', '.join(others[:8])}{' ...' if len(others) > 8 else ''}" if others else ""


def _no_time_record(data_set: DataSet) -> str:
    """Return the reason why a data set 58 is no time record; empty if it is one."""
    if data_set.function_type not in (GENERAL, TIME_RESPONSE):
        return f"of function type {data_set.function_type}"
    kind, label, unit = data_set.axis(8)
    is_time = seconds_of(unit) is not None if unit else "time" in label.lower()
    if kind not in (UNKNOWN, TIME):
        return f"over {ABSCISSAS.get(kind, f'an abscissa of type {kind}')}"
    if kind == UNKNOWN and (label or unit) and not is_time:
        return f"over {label or 'a quantity'}{f' in {unit}' if unit else ''}"
    if kind == UNKNOWN and not is_time and data_set.function_type == GENERAL:
        return "of function type 0, which does not state its abscissa"
    if whole(data_set.header[6][:10]) in COMPLEX:
        return "of complex numbers"
    return ""


def _column(data_set: DataSet, settings: RecordingSettings) -> DataColumn:
    record = data_set.header[6]
    kind, count, spacing = (whole(record[i : i + 10]) for i in (0, 10, 20))
    name = data_set.title or data_set.place
    if kind not in REAL or spacing not in (0, 1):
        raise InputError(f"{name} has numbers of type {kind} and spacing {spacing}, which data sets 58 do not have")
    check_values(count)
    seconds = seconds_of(data_set.axis(8)[2]) or 1.0
    if spacing == 0:
        times, values = _pairs(data_set, kind, count, name)
        start = float(times[0]) * seconds if np.isfinite(times[0]) else None
        column = DataColumn(name=name, values=values, rate_from="its times", start=start)
        if settings.sampling_rate is not None:
            return column
        rate = time_base(times * seconds, name=f"of the times of {name}").sampling_rate
        return replace(column, sampling_rate=rate)
    start, interval = real(record[30:43]), real(record[43:56])
    stored = _stored(data_set, kind, count, name)
    column = DataColumn(name=name, values=stored, start=start * seconds if np.isfinite(start) else None)
    if not (np.isfinite(interval) and interval > 0):
        return column
    rate = _rate(interval) / seconds
    return replace(column, sampling_rate=rate, rate_from="the increment of its abscissa")


def _rate(interval: float) -> float:
    """Return one over an interval of six digits; a whole number if that has the same digits."""
    nearest = round(1 / interval) if 1e-9 < interval < 1 else 0
    step = 10.0 ** (np.floor(np.log10(interval)) - 5)
    return float(nearest) if nearest and abs(interval - 1 / nearest) < 0.501 * step else 1 / interval


def _stored(data_set: DataSet, kind: int, count: int, name: str) -> StoredArray:
    if data_set.kind == "58b":
        return _binary(data_set, np.dtype(REAL[kind]), count, name)
    return text_numbers(data_set.body, (13,) * 6 if kind == 2 else (20,) * 4, count, name)


def _pairs(data_set: DataSet, kind: int, count: int, name: str) -> tuple[FloatArray, FloatArray]:
    """Return the times and the values of a data set that stores both; times are of single precision in text."""
    if not count:
        raise InputError(f"{name} holds no numbers")
    if data_set.kind == "58b":
        size = min(data_set.size, len(data_set.body))
        time = "f4" if size < count * 2 * int(REAL[kind][1]) else REAL[kind]
        table = _binary(data_set, np.dtype([("t", time), ("x", REAL[kind])]), count, name)
        times, values = table["t"], table["x"]
    else:
        numbers = text_numbers(data_set.body, (13,) * 6 if kind == 2 else (13, 20, 13, 20), 2 * count, name)
        times, values = numbers[::2], numbers[1::2]
    return times.astype(float), values.astype(float)


def _binary(data_set: DataSet, kind: np.dtype, count: int, name: str) -> StoredArray:
    order = whole(data_set.first[7:13])
    if order not in (1, 2) or whole(data_set.first[13:19]) != 2:
        raise InputError(f"{name} is not stored as IEEE numbers")
    size = min(data_set.size, len(data_set.body))
    if size < count * kind.itemsize:
        raise InputError(f"{name} is cut short: it states {count} numbers and holds {size // kind.itemsize}")
    if size > count * kind.itemsize:
        raise InputError(f"{name} states {count} numbers and holds {size // kind.itemsize}; write the file again")
    return np.frombuffer(data_set.body, kind.newbyteorder("<" if order == 1 else ">"), count)


def _with_names(columns: list[tuple[DataColumn, DataSet]]) -> tuple[DataColumn, ...]:
    """Return the columns; those with the same title are named by the place of the response."""
    titles = Counter(column.name for column, _ in columns)
    same_title = len(titles) == 1 and len(columns) > 1
    return tuple(
        replace(column, name=data_set.place if same_title else f"{column.name} {data_set.place}")
        if titles[column.name] > 1
        else column
        for column, data_set in columns
    )


def _with_unit(column: DataColumn, data_set: DataSet, length: str) -> DataColumn:
    """Return the column with the unit of its axis, or that of a motion in the file's unit of length."""
    kind, _, unit = data_set.axis(9)
    if not unit and length and kind in PER_SECOND:
        unit = length + PER_SECOND[kind]
    return replace(column, unit=unit)
