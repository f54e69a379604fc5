"""TDMS files as LabVIEW writes them: numeric channels with their scales."""

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
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
from sigdb.recording.files.settings import RecordingSettings

META, NEW_LIST, RAW, INTERLEAVED, BIG, DAQMX = 1 << 1, 1 << 2, 1 << 3, 1 << 5, 1 << 6, 1 << 7
LEAD_IN = 28
NUMBERS = {
    1: "i1", 2: "i2", 3: "i4", 4: "i8", 5: "u1", 6: "u2", 7: "u4", 8: "u8", 9: "f4", 10: "f8", 0x19: "f4", 0x1A: "f8",
    0x21: "u1",
}  # fmt: skip
TEXT, TIMESTAMP = 0x20, 0x44
NO_DATA, AS_BEFORE = 0xFFFFFFFF, 0
FROM_DAQMX = (0x1269, 0x126A, 0x1369)
NOT_FINISHED = 0xFFFFFFFFFFFFFFFF

Properties = dict[str, str | float]
"""Properties of an object: texts and numbers by name."""


@dataclass(frozen=True, kw_only=True)
class Index:
    """Type of the numbers of an object in a segment, their count in a chunk, and their bytes."""

    kind: int
    count: int
    size: int


@dataclass(frozen=True, kw_only=True)
class TdmsSegment:
    """Objects with numbers in a segment, in their order, and its raw bytes."""

    order: str
    interleaved: bool
    objects: tuple[tuple[str, Index], ...]
    raw: memoryview


@dataclass
class Meta:
    """State of all objects after the segments read so far."""

    indices: dict[str, Index] = field(default_factory=dict)
    active: list[str] = field(default_factory=list)
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
        check_parts(work // 100)  # a segment repeats all objects in a few bytes
        if contents & RAW:
            if contents & DAQMX:
                raise InputError("holds raw DAQmx numbers, which are not read; save it as plain TDMS or as CSV")
            objects = tuple((name, meta.indices[name]) for name in meta.active)
            yield TdmsSegment(
                order=order, interleaved=bool(contents & INTERLEAVED), objects=objects, raw=data[start + raw_at : end]
            )
        at = end


class _Cursor:
    """A position in bytes; reading beyond their end is an error."""

    def __init__(self, data: memoryview, order: str) -> None:
        self._data, self._order, self._at = data, order, 0

    def number(self, kind: str) -> float:
        size = struct.calcsize(kind)
        self._need(size)
        (value,) = struct.unpack_from(self._order + kind, self._data, self._at)
        self._at += size
        return float(value) if kind in "fd" else int(value)

    def whole(self, kind: str) -> int:
        return int(self.number(kind))

    def text(self) -> str:
        return bytes(self.take(self.whole("I"))).decode("utf-8", "replace")

    def take(self, size: int) -> memoryview:
        self._need(size)
        self._at += size
        return self._data[self._at - size : self._at]

    def _need(self, size: int) -> None:
        if size > len(self._data) - self._at:
            raise InputError(f"is cut short or damaged: {size} bytes of its description are missing")


def _read_meta(cursor: _Cursor, meta: Meta, *, new: bool) -> None:
    if new:
        meta.active = []
    for _ in range(cursor.whole("I")):
        name = cursor.text()
        check_parts(len(meta.properties))
        index = _read_index(cursor, meta, name)
        if index is not None:
            meta.indices[name] = index
            if name not in meta.active:
                meta.active.append(name)
        elif name in meta.active:
            meta.active.remove(name)
        _read_properties(cursor, meta.properties.setdefault(name, {}))


def _read_index(cursor: _Cursor, meta: Meta, name: str) -> Index | None:
    length = cursor.whole("I")
    if length == NO_DATA:
        return None
    if length == AS_BEFORE:
        if name not in meta.indices:
            raise InputError(f"is damaged: {name} refers to a description that is not there")
        return meta.indices[name]
    if length in FROM_DAQMX:
        raise InputError("holds raw DAQmx numbers, which are not read; save it as plain TDMS or as CSV")
    kind, dimension, count = cursor.whole("I"), cursor.whole("I"), cursor.whole("Q")
    if dimension != 1:
        raise InputError(f"is damaged: {name} has {dimension} dimensions")
    return Index(kind=kind, count=count, size=count * _width(kind) if kind != TEXT else cursor.whole("Q"))


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


def without_rest(segment: TdmsSegment) -> TdmsSegment:
    """Return the segment up to its last whole chunk, or row if interleaved: a recorder may have stopped after it."""
    sizes = [index.size // max(index.count, 1) if segment.interleaved else index.size for _, index in segment.objects]
    size = sum(sizes)
    return replace(segment, raw=segment.raw[: len(segment.raw) // size * size]) if size else segment


FOREIGN: tuple[type[Exception], ...] = ()


def read_tdms(path: Path, settings: RecordingSettings) -> Contents:
    """Read channels ``group/channel``, or ``channel`` where there is one group; ``variable`` is a group.

    The sampling rate is one over the property ``wf_increment``, the unit is ``unit_string``.
    """
    meta = Meta()
    pieces: dict[str, list[StoredArray]] = {}
    torn = False
    for segment in segments(memoryview(bounded_bytes(path)), meta):
        whole = without_rest(segment)
        torn = torn or len(whole.raw) < len(segment.raw)
        for name, values in _numbers(whole):
            pieces.setdefault(name, []).append(values)
    check_columns(len(pieces))
    check_values(sum(piece.size for parts in pieces.values() for piece in parts))
    names = _channel_names(pieces, settings.variable)
    if not names:
        raise InputError("holds no numbers" + (f" in a group {settings.variable!r}" if settings.variable else ""))
    columns = tuple(_column(names[path], pieces[path], meta.properties.get(path, {})) for path in names)
    note = Note(code="last-part-left-out", text="the last part is not whole and was left out")
    return Contents(columns=columns, notes=(note,) if torn else ())


def _numbers(segment: TdmsSegment) -> list[tuple[str, StoredArray]]:
    """Return the numbers of each object in a segment, which may repeat its chunk."""
    size = sum(index.size for _, index in segment.objects)
    if not size or not len(segment.raw):
        return []
    if segment.interleaved:
        return _interleaved(segment)
    chunks = np.frombuffer(segment.raw, np.uint8).reshape(-1, size)
    arrays, at = [], 0
    for name, index in segment.objects:
        if index.kind in NUMBERS and index.size:
            part = np.ascontiguousarray(chunks[:, at : at + index.size])
            arrays.append((name, part.reshape(-1).view(segment.order + NUMBERS[index.kind])))
        at += index.size
    return arrays


def _interleaved(segment: TdmsSegment) -> list[tuple[str, StoredArray]]:
    """Return the numbers of each object where one number of each follows in turn."""
    kinds = [index.kind for _, index in segment.objects]
    if any(kind not in NUMBERS for kind in kinds):
        raise InputError("is damaged: other things than numbers are interleaved")
    check_columns(len(kinds))
    row = np.dtype([(f"f{i}", segment.order + NUMBERS[kind]) for i, kind in enumerate(kinds)])
    table = np.frombuffer(segment.raw, row, len(segment.raw) // row.itemsize)
    return [(name, table[f"f{i}"]) for i, (name, _) in enumerate(segment.objects)]


def _channel_names(paths: Iterable[str], group: str | None) -> dict[str, str]:
    """Return the channel's name for each path."""
    parts = {path: [part.replace("''", "'") for part in path.strip("/'").split("'/'")] for path in paths}
    chosen = {path: names for path, names in parts.items() if group in (None, names[0], "/".join(names))}
    same_group = len({names[0] for names in chosen.values()}) == 1
    return {path: "/".join(names[1:] if same_group and len(names) > 1 else names) for path, names in chosen.items()}


def _column(name: str, pieces: list[StoredArray], properties: Mapping[str, str | float]) -> DataColumn:
    values = pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
    interval = properties.get("wf_increment")
    is_rate = isinstance(interval, (int, float)) and 0 < interval < np.inf
    return DataColumn(
        name=name,
        values=_scaled(name, values, properties),
        unit=str(properties.get("unit_string", "")),
        sampling_rate=1 / float(interval) if is_rate and interval is not None else None,
    )


def _scaled(name: str, values: StoredArray, properties: Mapping[str, str | float]) -> StoredArray:
    """Return stored numbers as physical ones: the polynomials in the properties are applied in their order."""
    scales = properties.get("NI_Number_Of_Scales", 0)
    if not isinstance(scales, int) or not scales or properties.get("NI_Scaling_Status", "unscaled") != "unscaled":
        return values
    if not 0 < scales <= 16:
        raise InputError(f"channel {name} has {scales} scales")
    for i in range(scales):
        if f"NI_Scale[{i}]_Scale_Type" in properties:
            values = _polynomial(name, i, properties)(values.astype(float))
    return values


def _polynomial(name: str, i: int, properties: Mapping[str, str | float]) -> Callable[[FloatArray], FloatArray]:
    kind = properties[f"NI_Scale[{i}]_Scale_Type"]
    source = properties.get(f"NI_Scale[{i}]_{kind}_Input_Source", i - 1)
    if kind == "Linear":
        keys = [f"NI_Scale[{i}]_Linear_Y_Intercept", f"NI_Scale[{i}]_Linear_Slope"]
    elif kind == "Polynomial":
        count = properties.get(f"NI_Scale[{i}]_Polynomial_Coefficients_Size", 4)
        size = count if isinstance(count, int) and 0 < count <= 16 else 0
        keys = [f"NI_Scale[{i}]_Polynomial_Coefficients[{j}]" for j in range(size)]
    else:
        raise InputError(f"channel {name} has a scale of kind {kind!r}, which is not read; save it as scaled numbers")
    whole = all(isinstance(properties.get(key), (int, float)) for key in keys) and len(keys) > 0
    if source not in (i - 1, 0xFFFFFFFF) or not whole:
        raise InputError(f"channel {name} has a scale that is not complete; save it as scaled numbers")
    coefficients: FloatArray = np.array([properties[key] for key in keys], dtype=float)
    return lambda x: np.asarray(np.polynomial.polynomial.polyval(x, coefficients))
