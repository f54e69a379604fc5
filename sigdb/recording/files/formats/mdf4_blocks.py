"""Blocks of MDF version 4, and the bytes of their data: plain, in lists, compressed.

The format is described by ASAM e.V., *ASAM MDF, Measurement Data Format, Programmers Guide*.
"""

import re
import struct
import zlib
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import unescape

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import check_bytes, check_expansion, check_parts, check_ratio

HEAD = 24
FIRST_BLOCK = 64
"""Place of the first block, in bytes."""

MOST_DATA_BLOCKS = 2**18
LONGEST_TEXT = 2**16
DEFLATE, TRANSPOSED = 0, 1

_TEXT_OF_XML = re.compile(r"<TX[^<>]*>([^<>]*)</TX>")


@dataclass(frozen=True, kw_only=True)
class Block:
    """A block: its kind, such as HD, its links and its other bytes."""

    kind: str
    links: tuple[int, ...]
    body: memoryview

    def link(self, i: int) -> int:
        """Return link ``i``; 0, which is none, where the block has fewer."""
        return self.links[i] if i < len(self.links) else 0

    def unpack(self, form: str, at: int = 0) -> tuple[int, ...]:
        """Return whole numbers from byte ``at`` of the body."""
        if at + struct.calcsize(form) > len(self.body):
            raise InputError(f"is damaged: a block {self.kind} is too short")
        return struct.unpack_from(form, self.body, at)


@dataclass
class Blocks:
    """All blocks of a file, by the byte at which they begin.

    ``record_bytes`` is the size of the records so far, of all groups, which may share their data.
    """

    data: memoryview
    record_bytes: int = field(default=0, init=False)
    _read: int = field(default=0, init=False)

    def at(self, start: int, *kinds: str) -> Block:
        """Return the block at a byte, which must be of one of these kinds."""
        self._read += 1
        check_parts(self._read // 100)  # a channel has some ten blocks
        if not 0 < start <= len(self.data) - HEAD:
            raise InputError(f"is cut short or damaged: it refers to byte {start} of {len(self.data)}")
        mark, length, count = struct.unpack_from("<4s4xQQ", self.data, start)
        kind = mark[2:].decode("latin-1")
        if mark[:2] != b"##" or kind not in kinds:
            raise InputError(f"is damaged: no block {' or '.join(kinds)} begins at byte {start}")
        if not HEAD + 8 * count <= length <= len(self.data) - start:
            raise InputError(f"is cut short or damaged: the block {kind} at byte {start} is longer than the file")
        if count > MOST_DATA_BLOCKS:
            raise InputError(f"is damaged: the block {kind} at byte {start} has {count} links")
        links = struct.unpack_from(f"<{count}q", self.data, start + HEAD)
        return Block(kind=kind, links=links, body=self.data[start + HEAD + 8 * count : start + length])

    def chain(self, start: int, kind: str) -> Iterator[tuple[int, Block]]:
        """Yield a block and those that follow it by their first links, with the bytes at which they begin."""
        blocks = 0
        while start:
            block = self.at(start, kind)
            yield start, block
            start = block.link(0)
            blocks += 1
            check_parts(blocks)

    def text(self, start: int) -> str:
        """Return a text, or the text in XML; empty if there is none."""
        if not start:
            return ""
        block = self.at(start, "TX", "MD")
        text = bytes(block.body[:LONGEST_TEXT]).split(b"\0", 1)[0].decode("utf-8", "replace")
        if block.kind == "MD":
            inner = _TEXT_OF_XML.search(text)
            return unescape(inner[1]).strip() if inner else ""
        return text.strip()

    def records(self, start: int) -> "RecordBytes":
        """Return the bytes of all records of a data group.

        Raises
        ------
        InputError
            If they expand from too few, or are compressed by a method that is not known.
        """
        records = RecordBytes()
        for blocks, block in enumerate(self._data_blocks(start)):
            if blocks > MOST_DATA_BLOCKS:
                raise InputError("is damaged: a list of data has no end")
            before = records.size
            records.add(block)
            self.record_bytes += records.size - before
            check_expansion(self.record_bytes, len(self.data))
        return records

    def _data_blocks(self, start: int) -> Iterator[Block]:
        """Yield the blocks with data, in their order, that a link leads to."""
        visited: set[int] = set()
        while start:
            if start in visited:
                raise InputError("is damaged: a list of data leads back to itself")
            visited.add(start)
            block = self.at(start, "DT", "DV", "DZ", "DL", "LD", "HL")
            if block.kind == "HL":
                start = block.link(0)
                continue
            if block.kind not in ("DL", "LD"):
                yield block
                return
            if block.kind == "LD" and block.unpack("<I")[0] & 1 << 31:
                raise InputError("holds columns with invalidation bits, which are not read; save it as version 4.1")
            for link in block.links[1:]:
                if link:
                    yield self.at(link, "DT", "DV", "DZ")
            start = block.link(0)


@dataclass
class RecordBytes:
    """Bytes of records in pieces, each a block with data, which is expanded when it is read."""

    _pieces: list[Block] = field(default_factory=list)
    _ends: list[int] = field(default_factory=list)
    _expanded: tuple[int, bytes] = (-1, b"")

    @property
    def size(self) -> int:
        """Count of the bytes."""
        return self._ends[-1] if self._ends else 0

    def add(self, block: Block) -> None:
        """Add a block with data after the others."""
        size = _compression(block)[2] if block.kind == "DZ" else len(block.body)
        self._pieces.append(block)
        self._ends.append(self.size + size)

    def part(self, start: int, stop: int) -> bytes | memoryview:
        """Return the bytes from ``start`` to ``stop``; no other blocks are touched."""
        parts = []
        for i in range(bisect_right(self._ends, start), len(self._pieces)):
            begin = self._ends[i - 1] if i else 0
            if begin >= stop:
                break
            parts.append(self._bytes(i)[max(start - begin, 0) : stop - begin])
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _bytes(self, i: int) -> bytes | memoryview:
        if self._pieces[i].kind != "DZ":
            return self._pieces[i].body
        if self._expanded[0] != i:
            self._expanded = i, _expanded(self._pieces[i])
        return self._expanded[1]


def _compression(block: Block) -> tuple[int, int, int, int]:
    """Return the method of a compressed block, its parameter, and the sizes of its bytes, expanded and compressed."""
    original, method, parameter, size, compressed = struct.unpack_from(
        "<2sBxIQQ", bytes(block.body[:24]).ljust(24, b"\0")
    )
    if original not in (b"DT", b"DV") or method not in (DEFLATE, TRANSPOSED):
        raise InputError(f"is compressed by method {method}, which is not read; save it uncompressed")
    check_bytes(size)
    return method, parameter, size, compressed


def _expanded(block: Block) -> bytes:
    """Return the bytes of a compressed block."""
    method, parameter, size, compressed = _compression(block)
    packed = block.body[24 : 24 + compressed]
    check_ratio(size, len(packed))
    try:
        data = zlib.decompressobj().decompress(packed, size + 1)
    except zlib.error:
        raise InputError("is damaged: compressed data cannot be expanded; copy it again") from None
    if len(data) != size:
        raise InputError(f"is damaged: compressed data states {size} bytes and holds {len(data)}; copy it again")
    if method == TRANSPOSED and parameter > 1:
        rows = size // parameter
        whole = np.frombuffer(data, np.uint8, rows * parameter).reshape(parameter, rows).T
        data = whole.tobytes() + data[rows * parameter :]
    return data
