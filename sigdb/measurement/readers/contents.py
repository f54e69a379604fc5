"""What a reader gives: the columns of a file, as they are stored."""

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """A series of numbers of a file; nan where a number is missing.

    ``values`` (n,) is of any real type; ``sampling_rate`` is Hz, where the file states one for the column.
    """

    name: str
    values: np.ndarray[Any, Any]
    unit: str = ""
    sampling_rate: float | None = None


@dataclass(frozen=True, kw_only=True)
class Contents:
    """The columns of a file, the sampling rate (Hz) that it states for all, and what was handled.

    ``named`` is False where the file gives its columns no names.
    """

    columns: tuple[Column, ...]
    sampling_rate: float | None = None
    notes: tuple[str, ...] = ()
    named: bool = True
