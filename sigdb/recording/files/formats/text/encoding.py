"""Text of a file: decompression, encoding, line ends; at once, or as a stream."""

import codecs
import os
import zlib
from collections.abc import Callable, Iterator
from itertools import chain
from typing import BinaryIO

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import check_expansion, check_ratio

FOREIGN: tuple[type[Exception], ...] = (zlib.error,)
"""Errors of decompression."""

_READ = 2**20
"""Bytes that are read, and expanded, at a time."""

_GZIP = b"\x1f\x8b"
_UTF16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
_WESTERN = bytes(range(256)).decode("cp1252", "replace").replace("\N{REPLACEMENT CHARACTER}", "?")
_LINE_ENDS = str.maketrans({"\x0b": " ", "\x0c": " ", "\x85": " ", "\u2028": " ", "\u2029": " "})


def encoded_text(data: bytes) -> tuple[bytes, tuple[Note, ...]]:
    """Return a text as UTF-8 without compression, byte order mark and foreign line ends, and notes on its encoding.

    Text that is neither UTF-8 nor marked as UTF-16 is taken for cp1252, the encoding of Western European Windows.

    Raises
    ------
    InputError
        If it is empty, or not text.
    """
    if data.startswith(_GZIP):
        data = _decompressed(data)
    coding = _UTF16.get(data[:2])
    if coding:
        data = data[2:].decode(coding, "replace").encode("utf-8", "replace")
    data = data.removeprefix(b"\xef\xbb\xbf")
    if not data.strip():
        raise InputError("is empty")
    if b"\0" in data[:65536]:
        raise InputError("is not text: it holds zero bytes; write it as UTF-8")
    notes: tuple[Note, ...] = ()
    if not coding and not _is_utf8(data):
        data = data.decode("latin-1").translate(_WESTERN).encode()
        text = "the text is not UTF-8 and was read as cp1252 (Western European); save it as UTF-8 if names look wrong"
        notes = (Note(code="text-encoding", text=text, values={"encoding": "cp1252"}),)
    if not data.isascii():
        data = data.replace("\N{MINUS SIGN}".encode(), b"-")
    return data if b"\n" in data else data.replace(b"\r", b"\n"), notes


class TextStream:
    """A text file of any size: gzipped text is expanded, UTF-16 becomes UTF-8, other text is unchanged.

    Parameters
    ----------
    file
        The file.
    """

    def __init__(self, file: BinaryIO) -> None:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        stored = iter(lambda: file.read(_READ), b"")
        expanded = _begun(stored, (_GZIP,), lambda chunks: _expanded(chunks, size, check_expansion))
        self._chunks = _begun(expanded, tuple(_UTF16), _as_utf8)
        self._held = b""

    def read(self, size: int) -> bytes:
        """Return the next bytes: as many as ``size``, fewer at the end of the text.

        Raises
        ------
        InputError
            If the file is cut short, or expands to far more than measured numbers do.
        """
        parts, held = [self._held], len(self._held)
        while held < size and (chunk := next(self._chunks, None)) is not None:
            parts.append(chunk)
            held += len(chunk)
        data = b"".join(parts)
        self._held = data[size:]
        return data[:size]


def decoded(line: bytes) -> str:
    """Return a line without line ends inside it."""
    return line.decode("utf-8", "replace").translate(_LINE_ENDS).rstrip("\r\n")


def _is_utf8(data: bytes) -> bool:
    try:
        return data.isascii() or bool(data.decode())
    except UnicodeDecodeError:
        return False


def _decompressed(data: bytes) -> bytes:
    """Return the text of all members of a gzip file, as far as the limits allow."""
    chunks = (data[start : start + _READ] for start in range(0, len(data), _READ))
    return b"".join(_expanded(chunks, len(data), check_ratio))


def _expanded(chunks: Iterator[bytes], compressed: int, check: Callable[[int, int], None]) -> Iterator[bytes]:
    """Yield the text of all members of a gzip file of ``compressed`` bytes; bytes after them are left out.

    ``check`` refuses an expanded size for that of the file.
    """
    member = zlib.decompressobj(wbits=31)
    size, held = 0, b""
    for chunk in chunks:
        held += chunk
        while held or not member.eof:
            if member.eof:
                if len(held) < 2:
                    break
                if not held.startswith(_GZIP):
                    return
                member = zlib.decompressobj(wbits=31)
            part = member.decompress(held, _READ)
            held = member.unused_data if member.eof else member.unconsumed_tail
            size += len(part)
            check(size, compressed)
            if part:
                yield part
            if not held and len(part) < _READ:
                break
    if not member.eof:
        raise InputError("ends in the middle of its gzip data; copy it again")


def _begun(
    chunks: Iterator[bytes], marks: tuple[bytes, ...], convert: Callable[[Iterator[bytes]], Iterator[bytes]]
) -> Iterator[bytes]:
    """Yield chunks that are not empty, converted if the first begins with a mark."""
    begin = b""
    while len(begin) < 2 and (chunk := next(chunks, b"")):
        begin += chunk
    whole = (chunk for chunk in chain((begin,), chunks) if chunk)
    yield from convert(whole) if begin.startswith(marks) else whole


def _as_utf8(chunks: Iterator[bytes]) -> Iterator[bytes]:
    """Yield a text in UTF-16, which begins with its byte order mark, as UTF-8."""
    decoder = codecs.getincrementaldecoder("utf-16")("replace")
    for chunk in chunks:
        yield decoder.decode(chunk).encode("utf-8", "replace")
    yield decoder.decode(b"", final=True).encode("utf-8", "replace")
