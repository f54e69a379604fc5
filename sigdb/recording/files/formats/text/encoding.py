"""Text of a file: decompression, encoding, line ends."""

import zlib

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import FREE_BYTES, MAX_BYTES, MAX_RATIO, check_ratio

FOREIGN: tuple[type[Exception], ...] = (zlib.error,)
"""Errors of decompression."""

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
    if data[:2] == b"\x1f\x8b":
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
        text = "the text is not UTF-8 and was read as cp1252 (Western European)"
        notes = (Note(code="text-encoding", text=text, values={"encoding": "cp1252"}),)
    if not data.isascii():
        data = data.replace("\N{MINUS SIGN}".encode(), b"-")
    return data if b"\n" in data else data.replace(b"\r", b"\n"), notes


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
    most = min(MAX_BYTES, max(FREE_BYTES, MAX_RATIO * len(data)))
    parts: list[bytes] = []
    size, rest = 0, data
    while rest[:2] == b"\x1f\x8b":
        member = zlib.decompressobj(wbits=31)
        parts.append(member.decompress(rest, most - size + 1))
        size += len(parts[-1])
        check_ratio(size, len(data))
        if size > most:
            raise InputError(f"expands to more than {most} bytes; cut it into shorter recordings")
        if not member.eof:
            raise InputError("ends in the middle of its gzip data; copy it again")
        rest = member.unused_data
    return b"".join(parts)
