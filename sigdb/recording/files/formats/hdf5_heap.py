"""Texts of variable length in the heap of an HDF5 file.

They are read from the bytes of the file. The HDF5 library trusts the lengths there: in a damaged file it asks for
memory without bound, or searches without end. Layouts are those of the HDF5 File Format Specification, version 3.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from mmap import mmap
from typing import TypeAlias

from sigdb.recording.files.formats.contents import MAX_PARTS

ATTRIBUTE, CONTINUATION = 0x0C, 0x10

Message: TypeAlias = tuple[int, bytes]
"""Kind and data of a message in the header of an object."""


@dataclass(frozen=True)
class HeapTexts:
    """Texts of variable length in the bytes of a file.

    Attributes
    ----------
    data
        The file.
    base
        Byte from which on the addresses in the file count.
    longest
        Largest length of a text that is read, bytes.
    """

    data: mmap | bytes
    base: int
    longest: int

    def attribute(self, address: int, name: str) -> str | None:
        """Return the text of an attribute of the object with this address; None if it cannot be read."""
        wanted = name.encode()
        for kind, message in self._messages(self.base + address):
            if kind == ATTRIBUTE and (stored := _data_of_attribute(message, wanted)) is not None:
                return self._text(stored)
        return None

    def at(self, place: int) -> str | None:
        """Return the text to which the 16 bytes at a place of the file refer; None if it cannot be read."""
        return self._text(self.data[place : place + 16])

    def _text(self, reference: bytes) -> str | None:
        """Return the text that a length, the address of a heap and the number of an object in it refer to."""
        if len(reference) < 16:
            return None
        length, number = _integer(reference[:4]), _integer(reference[12:16])
        at = self.base + _integer(reference[4:12])
        if length == 0:
            return ""
        if length > self.longest or self.data[at : at + 5] != b"GCOL\x01":
            return None
        place, end = at + 16, min(at + _integer(self.data[at + 8 : at + 16]), len(self.data))
        while place + 16 <= end:
            stored = _integer(self.data[place : place + 2])
            size = _integer(self.data[place + 8 : place + 16])
            if stored == number:
                text = self.data[place + 16 : min(place + 16 + size, end)]
                return _as_text(text[:length]) if size == length else None
            if not stored:  # the free space at the end of the heap
                return None
            place += 16 + -(-size // 8) * 8
        return None

    def _messages(self, place: int) -> Iterator[Message]:
        """Yield the messages in the header of an object, of either version."""
        if self.data[place : place + 5] == b"OHDR\x02":
            yield from self._messages_2(place)
        elif self.data[place : place + 1] == b"\x01":
            blocks = [(place + 16, _integer(self.data[place + 8 : place + 12]))]
            yield from self._in_blocks(blocks, head=8, first=None, last=0)

    def _messages_2(self, place: int) -> Iterator[Message]:
        flags = self.data[place + 5] if place + 5 < len(self.data) else 0
        place += 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        blocks = [(place + width, _integer(self.data[place : place + width]))]
        yield from self._in_blocks(blocks, head=6 if flags & 4 else 4, first=b"OCHK", last=4)

    def _in_blocks(
        self, blocks: list[tuple[int, int]], *, head: int, first: bytes | None, last: int
    ) -> Iterator[Message]:
        """Yield the messages of some blocks. Blocks that continue them begin with ``first`` and end in a checksum."""
        kind_bytes = 2 if head == 8 else 1
        count = 0
        for place, length in blocks:  # grows
            at, end = place, min(place + length, len(self.data))
            while at + head <= end and count < MAX_PARTS:
                count += 1
                kind = _integer(self.data[at : at + kind_bytes])
                size = _integer(self.data[at + kind_bytes : at + kind_bytes + 2])
                message = self.data[at + head : min(at + head + size, end)]
                at += head + size
                if kind == CONTINUATION and len(message) >= 16 and len(blocks) < MAX_PARTS:
                    begin, stored = self.base + _integer(message[:8]), _integer(message[8:16])
                    skipped = len(first or b"")
                    if self.data[begin : begin + skipped] == (first or b""):
                        blocks.append((begin + skipped, max(stored - skipped - last, 0)))
                else:
                    yield kind, message


def _data_of_attribute(message: bytes, wanted: bytes) -> bytes | None:
    """Return the data in the message of an attribute of this name; None if it has another."""
    if len(message) < 8 or not 1 <= message[0] <= 3:
        return None
    sizes = [_integer(message[at : at + 2]) for at in (2, 4, 6)]
    padded = [-(-size // 8) * 8 if message[0] == 1 else size for size in sizes]
    at = 9 if message[0] == 3 else 8
    name = message[at : at + sizes[0]].split(b"\0")[0]
    return message[at + sum(padded) :] if name == wanted else None


def _integer(stored: bytes) -> int:
    return int.from_bytes(stored, "little")


def _as_text(stored: bytes) -> str:
    return stored.split(b"\0")[0].decode("utf-8", "replace")
