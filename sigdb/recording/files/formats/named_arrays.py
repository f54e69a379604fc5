"""Named arrays, as MAT, HDF5 and NPZ hold them, as columns."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from sigdb.core import InputError, suggestion
from sigdb.recording.files.formats.contents import Contents, DataColumn, check_columns, check_values

SHORTEST = 16
"""Arrays with fewer numbers are facts about a recording, not signals."""

RATES = {"fs", "sr", "fsamp", "samplerate", "samplingrate", "samplefrequency", "samplingfrequency"}
INTERVALS = {"dt", "timestep", "sampletime", "sampleperiod", "sampleinterval", "samplingperiod", "samplinginterval"}


def rate_of(name: str, value: Any) -> float | None:
    """The sampling rate, Hz, that a number of this name states; None if it states none.

    Examples
    --------
    >>> rate_of("data.Sampling_Rate", 12800), rate_of("dt", 0.001), rate_of("load", 3)
    (12800.0, 1000.0, None)
    """
    word = re.sub(r"[^a-z]", "", re.split(r"[./]", name)[-1].lower().removesuffix("_hz"))
    number = np.asarray(value)
    if word not in RATES | INTERVALS or number.size != 1 or number.dtype.kind not in "iuf":
        return None
    stated = float(number.reshape(()))
    if not (np.isfinite(stated) and stated > 0):
        return None
    return 1 / stated if word in INTERVALS else stated


def contents_of(
    arrays: Mapping[str, np.ndarray[Any, Any]],
    *,
    variable: str | None = None,
    left_out: tuple[str, ...] = (),
    units: Mapping[str, str] | None = None,
    rates: Mapping[str, float] | None = None,
    named: bool = True,
) -> Contents:
    """Columns of all arrays that are long enough; a matrix gives one for each of its columns.

    Parameters
    ----------
    arrays
        By name, parts of a structure or group after ``.`` or ``/``; numbers of any real type.
    variable
        The array, structure or group to take; all if left out.
    left_out
        What the file holds besides, a sentence each.
    units, rates
        Unit and sampling rate (Hz) of those arrays that state one.
    named
        False where the names were made up.
    """
    chosen = {name: values for name, values in arrays.items() if variable is None or _inside(name, variable)}
    if not chosen:
        said = "; ".join(left_out[:3])
        if variable is not None and arrays:
            raise InputError(f"holds no numbers named {variable!r}{suggestion(variable, arrays)}")
        raise InputError(f"holds no arrays of numbers{': ' if said else ''}{said}")
    notes = list(left_out if variable is None else ())
    columns: list[DataColumn] = []
    short = {name: values for name, values in chosen.items() if values.size < SHORTEST}
    for name, values in chosen.items():
        if name not in short:
            made, handled = _columns(name, values, (units or {}).get(name, ""), (rates or {}).get(name))
            columns += made
            notes += handled
    if not columns:
        raise InputError(f"holds no array of {SHORTEST} numbers or more; there are {_listed(short)}")
    check_columns(len(columns))
    check_values(sum(column.values.size for column in columns))
    rates_stated = {name: rate for name, one in arrays.items() if (rate := rate_of(name, one)) is not None}
    told = [name for name in short if name not in rates_stated]
    if told:
        notes.append(f"{_listed(told)}: fewer than {SHORTEST} numbers, so not a channel")
    if len({f"{rate:.9g}" for rate in rates_stated.values()}) > 1:
        notes.append(f"{_listed(rates_stated)} state different sampling rates, so none was taken")
        rates_stated = {}
    source, rate = next(iter(rates_stated.items()), ("the file", None))
    return Contents(columns=tuple(columns), sampling_rate=rate, rate_from=source, notes=tuple(notes), named=named)


def _columns(
    name: str, values: np.ndarray[Any, Any], unit: str, rate: float | None
) -> tuple[list[DataColumn], list[str]]:
    if values.dtype.kind == "c":
        raise InputError(f"{name} holds complex numbers; a channel is real")
    values = np.squeeze(values)
    if values.ndim > 2:
        return [], [f"{name} of shape {values.shape} is neither a series nor a matrix of columns, so not a channel"]
    if values.ndim < 2:
        return [DataColumn(name=name, values=values.reshape(-1), unit=unit, sampling_rate=rate)], []
    turned = values.shape[1] > values.shape[0]
    matrix = values.T if turned else values
    check_columns(matrix.shape[1])
    notes = [f"{name} of shape {values.shape} was read with its samples along the rows"] if turned else []
    return [
        DataColumn(name=f"{name}{i + 1}", values=matrix[:, i], unit=unit, sampling_rate=rate)
        for i in range(matrix.shape[1])
    ], notes


def _inside(name: str, variable: str) -> bool:
    return name == variable or name.startswith((f"{variable}.", f"{variable}/", f"{variable}(", f"{variable}{{"))


def _listed(names: Any) -> str:
    first = list(names)[:8]
    return ", ".join(first) + (" ..." if len(names) > len(first) else "")
