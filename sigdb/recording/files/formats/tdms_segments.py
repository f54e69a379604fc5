"""Segments of TDMS files: the objects in each, their properties, and the layout of their raw numbers.

The format is described by National Instruments, *TDMS File Format Internal Structure*.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import check_parts

META, NEW_LIST, RAW, INTERLEAVED, BIG = 1 << 1, 1 << 2, 1 << 3, 1 << 5, 1 << 6
LEAD_IN = 28
NUMBERS = {
    1: "i1", 2: "i2", 3: "i4", 4: "i8", 5: "u1", 6: "u2", 7: "u4", 8: "u8", 9: "f4", 10: "f8", 0x19: "f4", 0x1A: "f8",
    0x21: "u1",
}  # fmt: skip
TEXT, TIMESTAMP = 0x20, 0x44
OTHERS = {TEXT: "text", 0x08000C: "complex numbers", 0x10000D: "complex numbers"}
NO_DATA, AS_BEFORE = 0xFFFFFFFF, 0
FORMAT_CHANGING, DIGITAL_LINE = 0x1269, 0x126A
DAQMX_NUMBERS = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8")
NOT_FINISHED = 0xFFFFFFFFFFFFFFFF


@dataclass(frozen=True, kw_only=True, order=True)
class TimeStamp:
    """Seconds since the beginning of 1904 (UTC), and the fraction in units of 2**-64 s."""

    seconds: int
    fraction: int

    def since(self, other: "TimeStamp") -> float:
        """Return the seconds from another time stamp to this one."""
        return float(self.seconds - other.seconds) + (self.fraction - other.fraction) / 2**64


Properties = dict[str, str | float | TimeStamp]
"""Properties of an object: texts, numbers and time stamps by name."""


@dataclass(frozen=True, kw_only=True)
class Scaler:
    """Place and type of the raw numbers of a DAQmx scale in the rows of a buffer; ``bit`` is that of a digital line."""

    scale: int
    kind: str
    buffer: int
    byte: int
    bit: int | None


@dataclass(frozen=True, kw_only=True)
class Index:
    """Type of the numbers of an object in a segment, their count in a chunk, and their bytes.

    Raw numbers of DAQmx have ``scalers``, and ``widths``, the bytes in a row of each buffer.
    """

    kind: int
    count: int
    size: int
    scalers: tuple[Scaler, ...] = ()
    widths: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class TdmsSegment:
    """Objects with numbers in a segment, in their order, and its raw bytes."""

    order: str
    interleaved: bool
    objects: tuple[tuple[str, Index], ...]
    raw: memoryview


@dataclass
class Meta:
    """State of all objects after the segments read so far; ``active`` states whether each has numbers."""

    indices: dict[str, Index] = field(default_factory=dict)
    active: dict[str, bool] = field(default_factory=dict)
    properties: dict[str, Properties] = field(default_factory=dict)


def segments(data: memoryview, meta: Meta) -> Iterator[TdmsSegment]:
    """Yield all segments and update ``meta`` with each."""
    at = work = 0
    while at + LEAD_IN <= len(data):
        if bytes(data[at : at + 4]) != b"TDSm":
            raise InputError(f"is damaged: no segment begins at byte {at}")
        (contents,) = struct.unpack_from("<I", data, at + 4)
        order = ">" if contents & BIG else "<"
        _, length, raw_at = struct.unpack_from(f"{order}IQQ", data, at + 8)
        start = at + LEAD_IN
        end = len(data) if length == NOT_FINISHED else min(len(data), start + length)
        if start + raw_at > end:
            raise InputError(
                f"is cut short or damaged: the segment at byte {at} states that it is longer than the file"
            )
        if contents & META:
            _read_meta(_Cursor(data[start : start + raw_at], order), meta, new=bool(contents & NEW_LIST))
        work += 1 + len(meta.active)
        check_parts((work - len(data) // 4000) // 100)  # a segment repeats all objects in a few bytes
        if contents & RAW:
            objects = tuple((name, meta.indices[name]) for name, with_data in meta.active.items() if with_data)
            yield TdmsSegment(
                order=order, interleaved=bool(contents & INTERLEAVED), objects=objects, raw=data[start + raw_at : end]
            )
        at = end


class _Cursor:
    """A position in bytes; reading beyond their end is an error."""

    def __init__(self, data: memoryview, order: str) -> None:
        self.order = order
        self._data, self._at = data, 0

    def number(self, kind: str) -> float:
        size = struct.calcsize(kind)
        self._need(size)
        (value,) = struct.unpack_from(self.order + kind, self._data, self._at)
        self._at += size
        return float(value) if kind in "fd" else int(value)

    def whole(self, kind: str) -> int:
        return int(self.number(kind))

    def text(self) -> str:
        return bytes(self.take(self.whole("I"))).decode("utf-8", "replace")

    def time_stamp(self) -> TimeStamp:
        if self.order == "<":
            fraction, seconds = self.whole("Q"), self.whole("q")
        else:
            seconds, fraction = self.whole("q"), self.whole("Q")
        return TimeStamp(seconds=seconds, fraction=fraction)

    def take(self, size: int) -> memoryview:
        self._need(size)
        self._at += size
        return self._data[self._at - size : self._at]

    def _need(self, size: int) -> None:
        if size > len(self._data) - self._at:
            raise InputError(f"is cut short or damaged: {size} bytes of its description are missing")


def _read_meta(cursor: _Cursor, meta: Meta, *, new: bool) -> None:
    if new:
        meta.active = {}
    for _ in range(cursor.whole("I")):
        name = cursor.text()
        check_parts(len(meta.properties))
        index = _read_index(cursor, meta, name)
        if index is not None:
            meta.indices[name] = index
        meta.active[name] = index is not None
        _read_properties(cursor, meta.properties.setdefault(name, {}))


def _read_index(cursor: _Cursor, meta: Meta, name: str) -> Index | None:
    length = cursor.whole("I")
    if length == NO_DATA:
        return None
    if length == AS_BEFORE:
        if name not in meta.indices:
            raise InputError(f"is damaged: {name} refers to a description that is not there")
        return meta.indices[name]
    kind, dimension, count = cursor.whole("I"), cursor.whole("I"), cursor.whole("Q")
    if dimension != 1:
        raise InputError(f"is damaged: {name} has {dimension} dimensions")
    if length in (FORMAT_CHANGING, DIGITAL_LINE):
        return _daqmx_index(cursor, name, kind, count, digital=length == DIGITAL_LINE)
    return Index(kind=kind, count=count, size=count * _width(kind) if kind != TEXT else cursor.whole("Q"))


def _daqmx_index(cursor: _Cursor, name: str, kind: int, count: int, *, digital: bool) -> Index:
    """Return the index of raw numbers of DAQmx: its scalers and the widths of the buffers follow."""
    scalers: list[Scaler] = []
    for _ in range(cursor.whole("I")):
        check_parts(len(scalers))
        code, buffer, place = cursor.whole("I"), cursor.whole("I"), cursor.whole("I")
        cursor.whole("B" if digital else "I")  # format of a sample
        if code >= len(DAQMX_NUMBERS):
            raise InputError(f"holds raw DAQmx numbers of type {code:#x} ({name}), which are not read; save it scaled")
        byte, bit = (place // 8, place % 8) if digital else (place, None)
        number = "u1" if digital else DAQMX_NUMBERS[code]
        scalers.append(Scaler(scale=cursor.whole("I"), kind=number, buffer=buffer, byte=byte, bit=bit))
    buffers = cursor.whole("I")
    check_parts(buffers)
    widths = tuple(cursor.whole("I") for _ in range(buffers))
    for scaler in scalers:
        if scaler.buffer >= buffers or scaler.byte + int(scaler.kind[1]) > widths[scaler.buffer]:
            raise InputError(f"is damaged: the raw DAQmx numbers of {name} lie outside their rows")
    return Index(kind=kind, count=count, size=0, scalers=tuple(scalers), widths=widths)


def _width(kind: int) -> int:
    if kind in NUMBERS:
        return int(NUMBERS[kind][1])
    widths = {0: 0, TIMESTAMP: 16, 0x08000C: 8, 0x10000D: 16}
    if kind not in widths:
        raise InputError(f"holds numbers of type {kind:#x}, which are not read")
    return widths[kind]


def _read_properties(cursor: _Cursor, properties: Properties) -> None:
    for _ in range(cursor.whole("I")):
        name, kind = cursor.text(), cursor.whole("I")
        if kind == TEXT:
            properties[name] = cursor.text()
        elif kind == TIMESTAMP:
            properties[name] = cursor.time_stamp()
        elif kind in NUMBERS:
            properties[name] = cursor.number(struct_code(kind))
        else:
            cursor.take(_width(kind))
        check_parts(len(properties))


def struct_code(kind: int) -> str:
    """Return the format character of :mod:`struct` for a type of numbers."""
    letter, width = NUMBERS[kind][0], NUMBERS[kind][1]
    if letter == "f":
        return {"4": "f", "8": "d"}[width]
    code = {"1": "b", "2": "h", "4": "i", "8": "q"}[width]
    return code if letter == "i" else code.upper()
