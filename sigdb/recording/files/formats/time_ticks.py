"""Dates and durations that files store as counts of a unit of time."""

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import StoredArray

TICKS = {
    "D": 86_400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12, "fs": 1e-15,
    "as": 1e-18,
}  # fmt: skip
"""Seconds of a unit of time, by its name in NumPy."""

NOT_A_TIME = np.iinfo(np.int64).min


def seconds_of_ticks(ticks: StoredArray, unit: str, *, after_first: bool, first: int | None = None) -> StoredArray:
    """Return counts of a unit of time in s, nan where they are missing; of dates after the first one, or ``first``.

    Examples
    --------
    >>> import numpy as np
    >>> seconds_of_ticks(np.array([1_700_000_000_000, 1_700_000_000_005]), "ms", after_first=True).tolist()
    [0.0, 0.005]
    """
    if unit not in TICKS:
        raise InputError(f"holds times in {unit!r}, which is no unit of seconds")
    counts = ticks.astype(np.int64).reshape(-1)
    missing = counts == NOT_A_TIME
    present = counts[~missing]
    if first in (None, NOT_A_TIME):
        first = present[0] if present.size else 0
    return np.where(missing, np.nan, (counts - np.int64(first if after_first and first else 0)) * TICKS[unit])


def seconds_of_times(times: StoredArray) -> StoredArray:
    """Return an array of ``datetime64`` or ``timedelta64`` in s, dates after the first one."""
    unit, count = np.datetime_data(times.dtype)
    ticks = times.astype(times.dtype.newbyteorder("=")).view(np.int64)
    return seconds_of_ticks(ticks, unit, after_first=times.dtype.kind == "M") * count
