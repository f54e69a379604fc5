"""The columns of a file as a format's reader returns them, and the limits that a file must keep."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError, Note

StoredArray = NDArray[Any]
"""Numbers of the type in which a file stores them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DataColumn:
    """A series of numbers in a file.

    Attributes
    ----------
    name
        Name in the file.
    values
        (n,) numbers of any real type; nan where a number is missing.
    unit
        Unit that the file states; empty if it states none.
    sampling_rate
        Sampling rate in Hz that the file states for this column; None if it states none.
    rate_from
        Name of the entry that states that rate.
    start
        Time of the first sample in s, on a time axis that all columns of the file share; None if it is not stated.
    abscissa
        Quantity along the samples, for instance "Frequency" for a spectrum; "time" if the file states no other.
    named
        False where the reader made up the name, for instance for a column of a matrix.
    """

    name: str
    values: StoredArray
    unit: str = ""
    sampling_rate: float | None = None
    rate_from: str = "the file"
    start: float | None = None
    abscissa: str = "time"
    named: bool = True

    @property
    def numbers(self) -> FloatArray:
        """The values as float64."""
        with np.errstate(invalid="ignore"):  # bits of other floats that are no numbers
            return np.ascontiguousarray(self.values, dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Contents:
    """The columns of a file and what the file states about them.

    Attributes
    ----------
    columns
        Columns in the order of the file.
    sampling_rate
        Sampling rate in Hz that the file states for all columns; None if it states none.
    rate_from
        Name of the entry that states the rate.
    notes
        Notes on what the reader left out or changed.
    named
        False where the file gives its columns no names.
    speed_rpm
        Speed in rev/min that the file states, to be confirmed; None if it states none.
    zero_time
        Time in s after the beginning of 1970 at which the time axis of the columns is zero; None if it is not stated.
    starts_of_file
        True where the columns hold some of the samples of a file, and their starts are those of its first samples.
    """

    columns: tuple[DataColumn, ...]
    sampling_rate: float | None = None
    rate_from: str = "the file"
    notes: tuple[Note, ...] = ()
    named: bool = True
    speed_rpm: float | None = None
    zero_time: float | None = None
    starts_of_file: bool = False


MAX_BYTES = 2**30
"""Largest number of bytes of a file, before and after decompression."""

MAX_VALUES = 2**27
"""Largest number of values in all columns together: 1 GiB as float64, 40 minutes of a channel at 51.2 kHz."""

MAX_CHANNELS = 1024
"""Largest number of columns."""

MAX_PARTS = 10_000
"""Largest number of named parts of a file: variables, fields, groups, attributes."""

MAX_DEPTH = 16
"""Deepest nesting of structures."""

MAX_RATIO = 200
"""Largest ratio of expanded to compressed bytes above ``FREE_BYTES``: measured numbers do not compress further."""

FREE_BYTES = 2**25
"""Expanded size in bytes up to which any ratio is accepted."""


BLOCK_VALUES = 2**22
"""Number of values in all columns of a block, where a file is read in blocks: 32 MiB as float64."""

SHORTEST_BLOCK = 256
"""Fewest samples of the last block of a file; shorter ones belong to the block before."""


class TooLargeError(InputError):
    """A file asks for more memory than a recording may have.

    Parameters
    ----------
    message
        The message.
    in_blocks
        Whether its format is read in blocks.
    """

    def __init__(self, message: str, *, in_blocks: bool = False) -> None:
        super().__init__(message)
        self.in_blocks = in_blocks


def check_columns(columns: int) -> None:
    """Refuse more columns than ``MAX_CHANNELS``."""
    if columns > MAX_CHANNELS:
        raise InputError(f"holds {columns} columns, more than {MAX_CHANNELS}; samples of a channel run down a column")


def check_values(values: int) -> None:
    """Refuse more numbers than ``MAX_VALUES``."""
    if not 0 <= values <= MAX_VALUES:
        raise TooLargeError(
            f"says that it holds {values} numbers, more than {MAX_VALUES}; cut it into shorter recordings"
        )


def check_bytes(size: int) -> None:
    """Refuse more bytes than ``MAX_BYTES``."""
    if not 0 <= size <= MAX_BYTES:
        raise TooLargeError(f"says that it holds {size} bytes, more than {MAX_BYTES}; cut it into shorter recordings")


def check_ratio(size: int, compressed: int) -> None:
    """Refuse a file or part that expands to ``size`` bytes but is far too small for that."""
    check_bytes(size)
    check_expansion(size, compressed)


def check_expansion(size: int, compressed: int) -> None:
    """Refuse a file or part that is far too small for the ``size`` bytes to which it expands, whatever they are."""
    if size > max(FREE_BYTES, MAX_RATIO * compressed):
        raise InputError(
            f"expands {compressed} bytes to {size} or more, which measured numbers do not do; write it uncompressed"
        )


def check_parts(parts: int) -> None:
    """Refuse more named parts than ``MAX_PARTS``."""
    if parts > MAX_PARTS:
        raise InputError(f"holds more than {MAX_PARTS} parts, so it is not a recording")


def bounded_bytes(path: Path) -> bytes:
    """Return all bytes of a file that is not too large."""
    check_bytes(path.stat().st_size)
    return path.read_bytes()


def block_length(columns: int, samples: int | None) -> int:
    """Return the samples of a block: the requested ones, or those that fill it, and more than there are columns."""
    return max(max(BLOCK_VALUES // max(columns, 1), 2**12) if samples is None else samples, columns + 1)


def block_edges(total: int, length: int) -> Iterator[tuple[int, int]]:
    """Yield the first sample of each block and the sample after its last; the last block is not too short.

    Examples
    --------
    >>> list(block_edges(2100, 1000))
    [(0, 1000), (1000, 2100)]
    """
    start = 0
    while start < total:
        stop = start + length
        stop = total if total - stop < SHORTEST_BLOCK else stop
        yield start, stop
        start = stop
