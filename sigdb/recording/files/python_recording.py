"""Python objects as recordings: arrays, pandas objects and SEP005 dictionaries."""

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from sigdb.core import InputError, Note, check_unmasked, validated
from sigdb.recording.files.assemble import assemble, with_unit
from sigdb.recording.files.formats.contents import Contents, DataColumn, StoredArray, check_columns, check_values
from sigdb.recording.files.formats.named_arrays import contents_of_arrays, not_read
from sigdb.recording.files.formats.time_ticks import seconds_of_times
from sigdb.recording.files.sampling_rates import refuse_times
from sigdb.recording.files.settings import RecordingOptions, RecordingSettings
from sigdb.recording.files.time_base import time_base
from sigdb.recording.files.time_columns import SAME, TimeColumn
from sigdb.recording.recording import Recording

if TYPE_CHECKING:
    import pandas as pd

OF_FILES = ("file_format", "variable", "separator", "decimal")
"""Options that files have only."""


def recording_from(data: object, *, source: str = "data", **options: Unpack[RecordingOptions]) -> Recording:
    """Return measured numbers in memory as a recording, with the same checks as those of a file.

    Parameters
    ----------
    data : array_like, pandas.Series, pandas.DataFrame, dict, or sequence of dict
        One of these:

        - an array (n,) of one channel, or (n, channels); masked samples are missing;
        - a dictionary of arrays by name, (n,) each or (n, channels), and of facts such as ``fs``;
        - a pandas Series or DataFrame. An index of dates, of differences of time or of seconds is the time;
        - a SEP005 dictionary, or several: ``data``, ``name``, ``unit_str``, ``fs`` or ``time``, ``start_timestamp``.
    source : str
        Name of the recording in messages and reports.
    **options
        Fields of :class:`RecordingSettings`, as for :func:`read_recording`, except those of files.

    Returns
    -------
    Recording
        Channels of float64 samples without gaps, which share no memory with ``data``.

    Raises
    ------
    InputError
        If the data are no recording. The message is one line with the reason and the remedy.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(0).normal(size=(1000, 2))
    >>> recording = recording_from(x, sampling_rate=12_800.0, names=["a1", "a2"], units="m/s^2")
    >>> [(channel.name, channel.unit, channel.duration) for channel in recording.channels]
    [('a1', 'm/s^2', 0.078125), ('a2', 'm/s^2', 0.078125)]
    >>> sep005 = {"name": "acc", "data": x[:, 0], "unit_str": "g", "fs": 2000.0}
    >>> recording_from(sep005).channels[0].sampling_rate
    2000.0
    """
    stated = {name: value for name, value in options.items() if value is not None}
    try:
        for name in OF_FILES:
            if name in stated:
                raise InputError(f"{name} is an option of files; leave it out")
        plain = {name: dict(value) if isinstance(value, Mapping) else value for name, value in stated.items()}
        settings = validated(RecordingSettings, plain, owner="recording_from")
        contents, time = _contents(data)
        if time is not None and settings.time is None:
            settings = settings.model_copy(update={"time": time})
        check_columns(len(contents.columns))
        check_values(sum(column.values.size for column in contents.columns))
        return assemble(contents, settings, source=source)
    except InputError as error:
        raise InputError(f"{source}: {error}".replace(f"{source}: {source}: ", f"{source}: ")) from None


def _contents(data: object) -> tuple[Contents, str | None]:
    """Return the columns of an object, and the name of the column that is the time whatever its values."""
    if isinstance(data, (str, bytes, os.PathLike)):
        raise InputError("is a text or a path; give read_recording a file")
    pandas = sys.modules.get("pandas")
    if pandas is not None and isinstance(data, pandas.Series):
        return _of_frame(data.to_frame("column1" if data.name is None else data.name), named=data.name is not None)
    if pandas is not None and isinstance(data, pandas.DataFrame):
        return _of_frame(data, named=True)
    if isinstance(data, Mapping):
        return (_of_sep005([data]) if "data" in data and "name" in data else _of_arrays(data)), None
    if isinstance(data, Sequence) and data and all(isinstance(part, Mapping) for part in data):
        return _of_sep005(data), None
    return contents_of_arrays({"column": _array(data, "the array")}, named=False), None


def _array(data: object, name: str) -> StoredArray:
    """Return an array of numbers that shares no memory with the data; masked numbers are nan."""
    if not isinstance(data, np.ma.MaskedArray):
        check_unmasked("", name, data)
    try:
        stored = np.ma.asarray(data) if isinstance(data, np.ma.MaskedArray) else np.asarray(data)
    except ValueError:
        raise InputError(f"{name} has rows of different lengths; give rows of one length") from None
    if stored.dtype.kind in "Mm":
        return seconds_of_times(np.asarray(stored))
    if stored.dtype.kind not in "biuf":
        raise InputError(f"{name} holds {stored.dtype}, not real numbers")
    if isinstance(stored, np.ma.MaskedArray):
        mask = np.ma.getmaskarray(stored)
        return np.where(mask, np.nan, stored.data) if mask.any() else np.array(stored.data)
    return np.array(stored)


def _of_arrays(data: Mapping[Any, Any]) -> Contents:
    """Return the columns of a dictionary of arrays, numbers and texts."""
    texts = {str(name): value for name, value in data.items() if isinstance(value, str)}
    arrays = {str(name): _array(value, str(name)) for name, value in data.items() if not isinstance(value, str)}
    return contents_of_arrays(arrays, texts=texts)


def _of_sep005(channels: Sequence[Mapping[str, Any]]) -> Contents:
    """Return the columns of SEP005 dictionaries; starts are counted from the earliest."""
    stamps = [_timestamp(channel.get("start_timestamp")) for channel in channels]
    first = min((stamp for stamp in stamps if stamp is not None), default=0.0)
    columns: list[DataColumn] = []
    notes: list[Note] = []
    for i, (channel, stamp) in enumerate(zip(channels, stamps, strict=True)):
        name = str(channel.get("name") or f"channel{i + 1}")
        if "data" not in channel:
            raise InputError(f"{name} has no data; a SEP005 dictionary holds data, name, unit_str, and fs or time")
        read = contents_of_arrays({name: _array(channel["data"], name)})
        rate, rate_from, start = _sep005_time(channel, name)
        start = start if stamp is None else stamp - first + (start or 0.0)
        unit = str(channel.get("unit_str") or "")
        columns += [
            replace(column, unit=unit, sampling_rate=rate, rate_from=rate_from, start=start) for column in read.columns
        ]
        notes += read.notes
    return Contents(columns=tuple(columns), notes=tuple(notes))


def _sep005_time(channel: Mapping[str, Any], name: str) -> tuple[float | None, str, float | None]:
    """Return the rate in Hz of a SEP005 dictionary, the entry that states it, and the first of its times in s."""
    fs = channel.get("fs")
    if fs is not None and not (isinstance(fs, (int, float, np.number)) and fs > 0):
        raise InputError(f"fs of {name} = {fs!r} must be a positive number, in Hz")
    if channel.get("time") is None:
        return (None if fs is None else float(fs)), f"fs of {name}", None
    t = _array(channel["time"], f"time of {name}").reshape(-1).astype(float)
    base = time_base(t, name=f"time of {name}", unit="s")
    refuse_times(TimeColumn(name=f"time of {name}", unit="s", size=t.size, base=base))
    if t.size not in np.shape(channel["data"]):
        raise InputError(f"{name} has {t.size} times and data of shape {np.shape(channel['data'])}; give as many")
    if fs is not None and abs(float(fs) / base.sampling_rate - 1) > SAME + base.uncertainty:
        raise InputError(
            f"{name}: fs = {float(fs):.9g} Hz, but its times give {base.sampling_rate:.9g} Hz; leave one out"
        )
    return base.sampling_rate, f"time of {name}", base.start


def _timestamp(stamp: object) -> float | None:
    """Return a date and time in s since 1970; without a zone it is taken as UTC."""
    if stamp is None or stamp == "":
        return None
    try:
        date = stamp if isinstance(stamp, datetime) else datetime.fromisoformat(str(stamp).strip())
    except ValueError:
        raise InputError(
            f"start_timestamp = {str(stamp)[:40]!r} is no date; write it like 2024-05-01T10:00:00.050"
        ) from None
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _of_frame(frame: "pd.DataFrame", *, named: bool) -> tuple[Contents, str | None]:
    """Return the columns of a table of pandas and of its index, and the name of an index of dates."""
    units = frame.attrs.get("units")
    units = units if isinstance(units, Mapping) else {}
    columns: list[DataColumn] = []
    notes: list[Note] = []
    index, is_time = _index_values(frame)
    name = "" if frame.index.name is None else str(frame.index.name)
    if isinstance(index, str):
        notes.append(not_read("the index", index))
    elif index is not None:
        name = name or ("time" if is_time else "index")
        unit = "" if frame.index.dtype.kind in "iuf" else "s"
        columns.append(with_unit(DataColumn(name=name, values=index, unit=unit)))
        name = columns[0].name
    for i, label in enumerate(frame.columns):
        title = "/".join(map(str, label)) if isinstance(label, tuple) else str(label)
        values = _series_values(frame.iloc[:, i])
        if isinstance(values, str):
            notes.append(not_read(title, values))
        else:
            unit = units.get(label, "s" if frame.dtypes.iloc[i].kind in "Mm" else "")
            columns.append(DataColumn(name=title, values=values, unit=str(unit), named=named))
    if len(columns) == (index is not None and not isinstance(index, str)):
        raise InputError(
            f"holds no column of numbers{': ' if notes else ''}{'; '.join(note.text for note in notes[:3])}"
        )
    return Contents(columns=tuple(columns), notes=tuple(notes)), name if is_time else None


def _index_values(frame: "pd.DataFrame") -> tuple[StoredArray | str | None, bool]:
    """Return the numbers of an index, or words for another; None if it counts rows. Also whether it holds times."""
    import pandas as pd

    index = frame.index
    if isinstance(index, pd.RangeIndex):
        return None, False
    if isinstance(index, pd.DatetimeIndex):
        index = index.tz_convert("UTC").tz_localize(None) if index.tz is not None else index
        return seconds_of_times(index.to_numpy()), True
    if isinstance(index, pd.TimedeltaIndex):
        return seconds_of_times(index.to_numpy()), True
    if isinstance(index, pd.MultiIndex) or not pd.api.types.is_numeric_dtype(index.dtype):
        return "not numbers, so not the time", False
    values = np.array(index.to_numpy(dtype=float, na_value=np.nan))
    is_time = np.any(values != np.round(values)) and np.all(np.diff(values) > 0)
    return values, bool(is_time)


def _series_values(series: "pd.Series") -> StoredArray | str:
    """Return the numbers of a column, or words for a column of other things."""
    import pandas as pd

    if series.dtype.kind in "Mm":
        dates = series.dt.tz_convert("UTC").dt.tz_localize(None) if getattr(series.dtype, "tz", None) else series
        return seconds_of_times(dates.to_numpy())
    if not pd.api.types.is_numeric_dtype(series.dtype) or series.dtype.kind == "c":
        return f"of type {series.dtype}, not real numbers, so not a channel"
    if series.dtype.kind in "biuf" and isinstance(series.dtype, np.dtype):
        return np.array(series.to_numpy())
    return np.array(series.to_numpy(dtype=float, na_value=np.nan))
