"""Attributes of HDF5 files that state facts about a recording, read without the risks of a damaged file."""

import re
from collections.abc import Mapping
from datetime import UTC, datetime
from mmap import mmap
from types import ModuleType
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sigdb.recording.files.formats.contents import check_parts
from sigdb.recording.files.formats.hdf5_dataset import check_storage
from sigdb.recording.files.formats.hdf5_heap import HeapTexts
from sigdb.recording.files.formats.stated_facts import ABSCISSA_UNITS, UNITS, ArrayFacts
from sigdb.recording.files.formats.stated_rates import rate_of, start_of
from sigdb.recording.files.time_names import seconds_of

if TYPE_CHECKING:
    import h5py

LONGEST_TEXT = 1000
"""Largest size of a text attribute, bytes."""

DATES = {"start", "starttime", "starts", "tstart", "timestart", "wfstarttime", "startdate", "datetime", "timestamp"}
"""Names of attributes with the date and time of the first sample."""

AttributeValue: TypeAlias = str | int | float


class AttributeReader:
    """Reader of attributes that are one number or one short text.

    ``unread`` becomes true where a text of variable length cannot be read.
    """

    def __init__(self, h5py: ModuleType, file: "h5py.File", data: mmap) -> None:
        self._h5py, self._heap = h5py, HeapTexts(data, file.userblock_size, LONGEST_TEXT)
        self._sizes_are_known = file.id.get_create_plist().get_sizes() == (8, 8)
        self._parts = 0
        self.unread = False

    def values(self, item: "h5py.HLObject") -> dict[str, AttributeValue]:
        """Return the attributes that are one number or one short text."""
        self._parts += len(item.attrs)
        check_parts(self._parts)
        # A name that is not UTF-8 comes as bytes.
        read = {key: self._value(item, key) for key in item.attrs if isinstance(key, str)}
        return {key: value for key, value in read.items() if value is not None}

    def text(self, item: "h5py.HLObject", name: str) -> str:
        """Return a text attribute; an empty text if there is none."""
        value = self._value(item, name) if name in item.attrs else None
        return value if isinstance(value, str) else ""

    def scalar_text(self, item: "h5py.Dataset") -> str:
        """Return the text in a dataset of one short text; an empty text if it is none."""
        if item.shape not in ((), (1,)) or item.is_virtual or item.external:
            return ""
        if item.dtype.kind == "S" and item.dtype.itemsize <= LONGEST_TEXT:
            check_storage(item)
            return _as_text(item[()])
        place = item.id.get_offset() if self._is_variable_text(item.dtype) else None
        return self._checked(self._heap.at(place)) or "" if place is not None else ""

    def _value(self, item: "h5py.HLObject", key: str) -> AttributeValue | None:
        kind = item.attrs.get_id(key)
        if kind.shape not in ((), (1,)):
            return None
        if self._is_variable_text(kind.dtype):
            return self._checked(self._heap.attribute(self._h5py.h5o.get_info(item.id).addr, key))
        if kind.dtype.kind == "S" and kind.dtype.itemsize <= LONGEST_TEXT:
            return _as_text(item.attrs[key])
        if kind.dtype.kind not in "iuf" or kind.dtype.subdtype:
            return None
        number: int | float = np.asarray(item.attrs[key]).reshape(-1)[0].item()
        return number

    def _is_variable_text(self, dtype: np.dtype) -> bool:
        text = self._h5py.check_string_dtype(dtype)
        return self._sizes_are_known and text is not None and text.length is None

    def _checked(self, text: str | None) -> str | None:
        self.unread |= text is None
        return text


def fixed_text(item: "h5py.HLObject", name: str) -> str:
    """Return a text attribute of fixed length; an empty text if there is none."""
    kind = item.attrs.get_id(name) if name in item.attrs else None
    if kind is None or kind.dtype.kind != "S" or kind.shape != () or kind.dtype.itemsize > LONGEST_TEXT:
        return ""
    return _as_text(item.attrs[name])


def _as_text(stored: object) -> str:
    value = stored.reshape(-1)[0] if isinstance(stored, np.ndarray) else stored
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return text if len(text) <= LONGEST_TEXT else ""


def facts_of(attributes: Mapping[str, AttributeValue], inherited: ArrayFacts) -> ArrayFacts:
    """Return the facts that attributes state; those that they do not state are inherited."""
    texts = {_letters(key): value.strip() for key, value in attributes.items() if isinstance(value, str)}
    rates = {key: rate for key, value in attributes.items() if (rate := rate_of(key, value)) is not None}
    agree = len({f"{rate:.9g}" for rate in rates.values()}) == 1
    source, rate = next(iter(rates.items())) if agree else (inherited.rate_from, inherited.sampling_rate)
    starts = (start for key, value in attributes.items() if (start := _start_of(key, value)) is not None)
    abscissas = (text for key, text in texts.items() if key in ABSCISSA_UNITS and text and seconds_of(text) is None)
    return ArrayFacts(
        unit=next((text for key, text in texts.items() if key in UNITS and text), inherited.unit),
        sampling_rate=rate,
        rate_from=source,
        start=next(starts, inherited.start),
        abscissa=next((f"an abscissa in {text}" for text in abscissas), inherited.abscissa),
    )


def _letters(key: str) -> str:
    return re.sub(r"[^a-z]", "", key.lower())


def _start_of(key: str, value: AttributeValue) -> float | None:
    """Return a start in s: a number, or a date and time as ISO 8601 writes it."""
    start = start_of(key, value)
    if start is not None or not isinstance(value, str) or _letters(key) not in DATES:
        return start
    try:
        date = datetime.fromisoformat(value.strip())
        return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None
