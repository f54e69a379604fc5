"""Rows of averages that another program has simulated: arrays of a file, with labels of each average."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError
from sigdb.ingest.facts.recording_facts import RecordingFacts
from sigdb.ingest.facts.recording_table import facts_of
from sigdb.recording import in_si_unit
from sigdb.signature import FEATURES, features

Arrays = Mapping[str, NDArray[Any]]

_LARGEST = 2**30
"""Largest file, bytes."""

_NUMBERS = ("averages", "scatter")
"""Arrays of numbers that are no facts: revolutions of an average, and the deviation between them."""

_FACTS = tuple(name for name in RecordingFacts.model_fields if name != "file")


@dataclass(frozen=True, kw_only=True)
class AveragesFile:
    """Averages of a file with what it states of each.

    Attributes
    ----------
    tsa
        (rows, n) averages of one revolution, in the file's unit.
    facts
        (rows,) texts by fact.
    numbers
        (rows,) numbers by name.
    """

    tsa: FloatArray
    facts: dict[str, list[str]]
    numbers: dict[str, FloatArray]


def read_averages(path: Path, name: str) -> AveragesFile:
    """Return the averages in an array of a file, with the other arrays that state facts.

    NumPy archives, MAT, HDF5 and Parquet are read. An array with a number or a text for each average, and the name of a
    fact, is that fact; other arrays are left out.

    Raises
    ------
    InputError
        If the file cannot be read, lacks the array, or the arrays do not fit.
    """
    arrays = _arrays(path)
    if name not in arrays:
        raise InputError(f"{path}: has no array {name!r}; it has {', '.join(sorted(arrays)) or 'none'}")
    tsa = arrays[name]
    if tsa.dtype.kind not in "fiu" or tsa.ndim not in (1, 2) or 0 in tsa.shape:
        raise InputError(
            f"{path}: {name} has shape {tsa.shape} and type {tsa.dtype}; give averages (rows, n) of numbers"
        )
    tsa = np.atleast_2d(np.asarray(tsa, dtype=float))
    if not np.isfinite(tsa).all():
        raise InputError(f"{path}: {name} holds a value that is no finite number")
    facts: dict[str, list[str]] = {}
    numbers: dict[str, FloatArray] = {}
    for key in (*_FACTS, *_NUMBERS):
        if key not in arrays or key == name:
            continue
        values = np.ravel(arrays[key])
        if values.size not in (1, len(tsa)):
            raise InputError(f"{path}: {key} has {values.size} values, and there are {len(tsa)} averages")
        values = np.broadcast_to(values, len(tsa))
        if key in _NUMBERS:
            numbers[key] = values.astype(float)
        else:
            facts[key] = [_text(value) for value in values]
    return AveragesFile(tsa=tsa, facts=facts, numbers=numbers)


def averaged_rows(
    path: Path, name: str, common: RecordingFacts, *, teeth: str | None, samples_per_tooth: int, unit: str
) -> Iterator[dict[str, Any]]:
    """Yield the rows of the averages of a file.

    Parameters
    ----------
    path, name
        The file, and the array with averages.
    common
        Facts of all averages, where the file states none.
    teeth
        Tooth counts where no fact states them.
    samples_per_tooth
        Samples of a stored average in a tooth pass; averages of another length are resampled as the periods they are.
    unit
        Unit of the averages, where it is known.

    Raises
    ------
    InputError
        If the file cannot be read, or a fact is wrong.
    """
    from scipy.signal import resample

    file, (unit, factor) = read_averages(path, name), in_si_unit(unit)
    stated = {key: str(value) for key, value in common.model_dump(exclude_none=True).items()}
    for i, average in enumerate(file.tsa):
        stated_here = {key: texts[i] for key, texts in file.facts.items() if texts[i]}
        facts = facts_of({**stated, **stated_here}, RecordingFacts, owner=f"{path}: average {i + 1}")
        counts = facts.teeth or teeth
        if counts is None:
            raise InputError(f"{path}: the tooth count is not stated; give teeth")
        count = int(float(counts.partition("/")[0]))
        tsa = (
            np.asarray(resample(average, count * samples_per_tooth))
            if average.size != count * samples_per_tooth
            else average
        )
        values = features(tsa * factor, teeth=count)
        yield {
            **facts.labels,
            "status": "ok",
            "status_code": "ok",
            "gear": facts.gear or "",
            "sensor": facts.sensor or name,
            "channel": name,
            "teeth": count,
            "unit": unit,
            "torque": facts.torque,
            "load": facts.load,
            "speed_rpm": facts.speed_rpm,
            "shaft_rpm": facts.speed_rpm,
            "machine": facts.machine or "",
            "set": facts.set or "",
            "specimen_name": facts.specimen or "",
            "date": facts.date or "",
            "draw": i,
            "averages": int(file.numbers["averages"][i]) if "averages" in file.numbers else 1,
            "scatter": float(file.numbers["scatter"][i]) * factor if "scatter" in file.numbers else 0.0,
            "angle": "the simulation",
            "absolute": True,
            "tsa": tsa * factor,
            **{key: each.ravel() if FEATURES[key].axes else float(each) for key, each in values.items()},
        }


def _arrays(path: Path) -> Arrays:
    """Return the arrays of a file by name."""
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        raise InputError(f"{path}: averages are read from files that end in {', '.join(_READERS)}")
    if path.stat().st_size > _LARGEST:
        raise InputError(f"{path}: larger than {_LARGEST} bytes; split it")
    try:
        return _READERS[suffix](path)
    except InputError:
        raise
    except Exception as error:
        # The libraries raise errors of many kinds on damaged files.
        what = str(error).partition("\n")[0][:200]
        raise InputError(f"{path}: cannot be read ({type(error).__name__}: {what})") from None


def _npz(path: Path) -> Arrays:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored}


def _mat(path: Path) -> Arrays:
    from scipy.io import loadmat

    with path.open("rb") as file:
        is_hdf5 = b"HDF5" in file.read(1024)
    if is_hdf5:
        return {name: array.T for name, array in _hdf5(path).items()}
    return {name: array for name, array in loadmat(path).items() if isinstance(array, np.ndarray)}


def _hdf5(path: Path) -> Arrays:
    try:
        import h5py
    except ImportError:
        raise InputError(f"{path}: needs h5py, which is not installed: pip install h5py") from None
    with h5py.File(path, "r") as file:
        return {name: item[()] for name, item in file.items() if isinstance(item, h5py.Dataset)}


def _parquet(path: Path) -> Arrays:
    import pyarrow.parquet as pq

    columns = pq.read_table(path).to_pydict()
    return {name: np.array(values) for name, values in columns.items() if None not in values}


_READERS = {".npz": _npz, ".mat": _mat, ".h5": _hdf5, ".hdf5": _hdf5, ".parquet": _parquet}


def _text(value: object) -> str:
    """Return a value as a table would state it; empty for nan."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, np.ndarray):  # text of a MAT-file
        value = value.item() if value.size == 1 else "".join(map(str, value.ravel()))
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{int(value)}" if float(value).is_integer() else repr(float(value))
    return str(value).strip()
