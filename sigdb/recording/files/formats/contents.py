"""What a reader gives: the columns of a file, as they are stored."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class DataColumn:
    """A series of numbers of a file; nan where a number is missing.

    ``values`` (n,) is of any real type; ``sampling_rate`` is Hz, where the file states one for the column.
    """

    name: str
    values: np.ndarray[Any, Any]
    unit: str = ""
    sampling_rate: float | None = None


@dataclass(frozen=True, kw_only=True)
class Contents:
    """The columns of a file, the sampling rate (Hz) that it states for all and where, and what was handled.

    ``named`` is False where the file gives its columns no names.
    """

    columns: tuple[DataColumn, ...]
    sampling_rate: float | None = None
    rate_from: str = "the file"
    notes: tuple[str, ...] = ()
    named: bool = True


MAX_BYTES = 2**30
"""Most bytes of a file, and most after decompression."""

MAX_VALUES = 2**27
"""Most numbers in all columns together: 1 GiB as float64, 40 minutes of a channel at 51.2 kHz."""

MAX_CHANNELS = 1024
"""Most columns."""

MAX_PARTS = 10_000
"""Most named parts of a file: variables, fields, groups, attributes."""

MAX_DEPTH = 16
"""Most levels of structures in structures."""

MAX_RATIO = 200
"""Most bytes that a compressed byte may give, from ``FREE_BYTES`` on: measured numbers do not compress so far."""

FREE_BYTES = 2**25
"""Bytes that a compressed part may give at any ratio."""


def check_columns(columns: int) -> None:
    """Refuse more columns than ``MAX_CHANNELS``."""
    if columns > MAX_CHANNELS:
        raise InputError(f"holds {columns} columns, more than {MAX_CHANNELS}; samples of a channel run down a column")


def check_values(values: int) -> None:
    """Refuse more numbers than ``MAX_VALUES``."""
    if not 0 <= values <= MAX_VALUES:
        raise InputError(f"says that it holds {values} numbers, more than {MAX_VALUES}; cut it into shorter recordings")


def check_bytes(size: int) -> None:
    """Refuse more bytes than ``MAX_BYTES``."""
    if not 0 <= size <= MAX_BYTES:
        raise InputError(f"says that it holds {size} bytes, more than {MAX_BYTES}; cut it into shorter recordings")


def check_ratio(size: int, compressed: int) -> None:
    """Refuse what expands to ``size`` bytes from a file or part that is far too small for it."""
    check_bytes(size)
    if size > max(FREE_BYTES, MAX_RATIO * compressed):
        raise InputError(
            f"expands {compressed} bytes to {size} or more, which measured numbers do not do; write it uncompressed"
        )


def check_parts(parts: int) -> None:
    """Refuse more named parts than ``MAX_PARTS``."""
    if parts > MAX_PARTS:
        raise InputError(f"holds more than {MAX_PARTS} parts, so it is not a recording")


def bounded_bytes(path: Path) -> bytes:
    """All bytes of a file."""
    check_bytes(path.stat().st_size)
    return path.read_bytes()
