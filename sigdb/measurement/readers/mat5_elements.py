"""Elements of MAT-files of version 5 (MATLAB's ``-v6`` and ``-v7``), each checked against the bytes that are there.

The format is described in MathWorks, *MAT-File Format* (the level-5 part).
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sigdb.core.errors import InputError
from sigdb.measurement.readers.limits import FREE_BYTES, MAX_BYTES, MAX_RATIO, check_ratio

MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}


@dataclass(frozen=True)
class Element:
    """Type and bytes of an element; ``order`` is ``<`` or ``>``."""

    kind: int
    data: memoryview
    order: str

    def numbers(self) -> "np.ndarray[tuple[int], np.dtype[np.number]]":
        """The element as numbers of the type in which they are stored."""
        if self.kind not in NUMBERS:
            raise InputError(f"is damaged: an element of type {self.kind} where numbers belong")
        dtype = np.dtype(self.order + NUMBERS[self.kind])
        return np.frombuffer(self.data, dtype, len(self.data) // dtype.itemsize)

    def text(self) -> str:
        """The element as text."""
        coding = TEXTS.get(self.kind, "latin-1")
        ends = {"<": "-le", ">": "-be"}[self.order] if coding in ("utf-16", "utf-32") else ""
        return bytes(self.data).decode(coding + ends, "replace")


def elements(data: memoryview, order: str) -> Iterator[Element]:
    """All elements, one after the other."""
    at = 0
    while at + 8 <= len(data):
        kind, size = np.frombuffer(data, f"{order}u4", 2, at).tolist()
        small = kind >> 16
        if small:  # up to four bytes, within the tag
            if small > 4:
                raise InputError(f"is damaged: a small element of {small} bytes")
            yield Element(kind & 0xFFFF, data[at + 4 : at + 4 + small], order)
            at += 8
            continue
        if size > len(data) - at - 8:
            raise InputError(f"is cut short or damaged: an element of {size} bytes, {len(data) - at - 8} are left")
        yield Element(kind, data[at + 8 : at + 8 + size], order)
        at += 8 + (size if kind == COMPRESSED else -(-size // 8) * 8)


def unpacked(element: Element, packed: int, given: int) -> Element:
    """The element in a compressed one. ``given`` bytes have come from the file of ``packed`` bytes so far."""
    stream = zlib.decompressobj()
    most = min(MAX_BYTES, max(FREE_BYTES, MAX_RATIO * packed)) - given
    data = stream.decompress(element.data, max(most, 0) + 1)
    if len(data) > most:
        check_ratio(given + len(data), packed)
        raise InputError(f"expands to more than {MAX_BYTES} bytes; cut it into shorter recordings")
    return next(elements(memoryview(data), element.order), Element(0, memoryview(b""), element.order))
