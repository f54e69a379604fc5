"""Kinds of files that can be read, distinguished by their suffix and first bytes."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import InputError, suggestion
from sigdb.recording.files.formats import hdf5, lvm, mat4, mat5, mdf4, numpy_files, parquet, tdms, uff58, wav, xls, xlsx
from sigdb.recording.files.formats.contents import Contents
from sigdb.recording.files.formats.lvm_blocks import lvm_blocks
from sigdb.recording.files.formats.text import reader as text
from sigdb.recording.files.formats.text.text_blocks import text_blocks
from sigdb.recording.files.settings import RecordingSettings


@dataclass(frozen=True, kw_only=True)
class FileKind:
    """A format of files.

    Attributes
    ----------
    name
        Name in messages.
    suffixes
        Suffixes of its files; two formats may share one.
    begins
        Whether a file with these first 4096 bytes has the format. No other format but text begins like it.
    may_begin
        Whether a file with these first bytes may have the format, where its suffix or the user names the format.
    read
        Its reader.
    foreign
        Errors that its libraries raise on damaged files.
    blocks
        Its reader in blocks of samples, with the samples of a block or None; each block has the same columns.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: Callable[[bytes], bool]
    read: Callable[[Path, RecordingSettings], Contents]
    foreign: tuple[type[Exception], ...]
    may_begin: Callable[[bytes], bool] | None = None
    blocks: Callable[[Path, RecordingSettings, int | None], Iterator[Contents]] | None = None

    def accepts(self, begin: bytes) -> bool:
        """Return whether a file that is named as this format may have it."""
        return (self.may_begin or self.begins)(begin)


def _marked(mark: bytes, *starts: int) -> Callable[[bytes], bool]:
    """Return a test for a mark at one of some places, by default at the start."""
    return lambda begin: any(begin.startswith(mark, start) for start in starts or (0,))


def _begins_like_text(begin: bytes) -> bool:
    return b"\0" not in begin or begin[:2] in (b"\xff\xfe", b"\xfe\xff")


def _begins_like_uff(begin: bytes) -> bool:
    first_line = begin.lstrip(b"\r\n").split(b"\n", 1)[0]
    return first_line.startswith(b"    -1") and first_line.strip() == b"-1"


def _begins_like_uff_without_indent(begin: bytes) -> bool:
    return re.match(rb"\s*-1\s*\n\s*\d{1,4}b?\b", begin) is not None


def _first_member(begin: bytes) -> bytes:
    """Return the name of the first file in a ZIP; empty if it is no ZIP."""
    is_zip = begin.startswith(b"PK\x03\x04")
    return begin[30 : 30 + int.from_bytes(begin[26:28], "little")] if is_zip else b""


def _begins_like_xlsx(begin: bytes) -> bool:
    return _first_member(begin).startswith((b"[Content_Types].xml", b"_rels/", b"xl/", b"docProps/"))


TEXT = FileKind(
    name="text",
    suffixes=(".csv", ".txt", ".tsv", ".dat", ".asc"),
    begins=_begins_like_text,
    read=text.read_text,
    foreign=text.FOREIGN,
    blocks=text_blocks,
)
GZIP = FileKind(
    name="gzip",
    suffixes=tuple(f"{suffix}.gz" for suffix in TEXT.suffixes),
    begins=_marked(b"\x1f\x8b"),
    read=text.read_text,
    foreign=text.FOREIGN,
    blocks=text_blocks,
)
KINDS = (
    TEXT,
    GZIP,
    FileKind(
        name="LVM",
        suffixes=(".lvm", ".txt"),
        begins=lvm.begins_like_lvm,
        read=lvm.read_lvm,
        foreign=lvm.FOREIGN,
        blocks=lvm_blocks,
    ),
    FileKind(
        name="MAT version 5",
        suffixes=(".mat",),
        begins=lambda begin: begin[:6] == b"MATLAB" and begin[124:128] in (b"\x00\x01IM", b"\x01\x00MI"),
        read=mat5.read_mat5,
        foreign=mat5.FOREIGN,
    ),
    FileKind(
        name="MAT version 4",
        suffixes=(".mat",),
        begins=mat4.begins_like_mat4,
        read=mat4.read_mat4,
        foreign=mat4.FOREIGN,
    ),
    FileKind(
        name="HDF5",
        suffixes=(".h5", ".hdf5", ".hdf", ".mat"),
        begins=_marked(b"\x89HDF\r\n\x1a\n", 0, 512, 1024, 2048),
        read=hdf5.read_hdf5,
        foreign=hdf5.FOREIGN,
        blocks=hdf5.hdf5_blocks,
    ),
    FileKind(
        name="WAV",
        suffixes=(".wav",),
        begins=lambda begin: begin[:4] in wav.MARKS and begin[8:12] == b"WAVE",
        read=wav.read_wav,
        foreign=wav.FOREIGN,
        blocks=wav.wav_blocks,
    ),
    FileKind(
        name="Parquet",
        suffixes=(".parquet", ".pq"),
        begins=_marked(b"PAR1"),
        read=parquet.read_parquet,
        foreign=parquet.FOREIGN,
        blocks=parquet.parquet_blocks,
    ),
    FileKind(
        name="NPZ",
        suffixes=(".npz",),
        begins=lambda begin: _first_member(begin).endswith(b".npy"),
        read=numpy_files.read_npz,
        foreign=numpy_files.FOREIGN,
        may_begin=_marked(b"PK\x03\x04"),
    ),
    FileKind(
        name="XLSX",
        suffixes=(".xlsx", ".xlsm"),
        begins=_begins_like_xlsx,
        read=xlsx.read_xlsx,
        foreign=xlsx.FOREIGN,
        may_begin=_marked(b"PK\x03\x04"),
    ),
    FileKind(
        name="XLS",
        suffixes=(".xls",),
        begins=_marked(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
        read=xls.read_xls,
        foreign=xls.FOREIGN,
    ),
    FileKind(
        name="NPY",
        suffixes=(".npy",),
        begins=_marked(b"\x93NUM"),
        read=numpy_files.read_npy,
        foreign=numpy_files.FOREIGN,
        blocks=numpy_files.npy_blocks,
    ),
    FileKind(
        name="UFF",
        suffixes=(".uff", ".unv", ".u58"),
        begins=_begins_like_uff,
        read=uff58.read_uff58,
        foreign=uff58.FOREIGN,
        may_begin=_begins_like_uff_without_indent,
    ),
    FileKind(
        name="MDF",
        suffixes=(".mf4", ".mdf"),
        begins=lambda begin: begin[:8] in (b"MDF     ", b"UnFinMF "),
        read=mdf4.read_mdf4,
        foreign=mdf4.FOREIGN,
        blocks=mdf4.mdf4_blocks,
    ),
    FileKind(
        name="TDMS",
        suffixes=(".tdms",),
        begins=_marked(b"TDSm"),
        read=tdms.read_tdms,
        foreign=tdms.FOREIGN,
        blocks=tdms.tdms_blocks,
    ),
)
"""All formats. A file that begins like text is text only if it begins like no other format."""


def suffix_of(path: Path) -> str:
    """Return the suffix of a file name, with the suffix before ``.gz``.

    Examples
    --------
    >>> suffix_of(Path("run 3.v2.CSV.gz"))
    '.csv.gz'
    """
    ends = [suffix.lower() for suffix in path.suffixes]
    return "".join(ends[-2:] if ends[-1:] == [".gz"] else ends[-1:])


def file_kind(path: Path, file_format: str | None = None) -> FileKind:
    """Return the format of a file.

    The format is that of ``file_format``, else that of the suffix; the first bytes must agree. A file without a known
    suffix is recognised by its first bytes, unless they are text.

    Parameters
    ----------
    path
        The file.
    file_format
        A suffix of the format, with or without its dot, or the name of the format.

    Raises
    ------
    InputError
        If the format is not known, or the file begins like a file of another format.
    """
    with path.open("rb") as file:
        begin = file.read(4096)
    if not begin:
        raise InputError("is empty")
    content = _by_content(begin)
    if file_format is not None:
        named, reason = _by_format(file_format), f"file_format = {file_format!r}"
    else:
        suffix = suffix_of(path)
        named, reason = [kind for kind in KINDS if suffix in kind.suffixes], f"its suffix {suffix}"
    if not named:
        return _without_name(path, content)
    if content in named:
        return content
    if file_format is not None or content in (None, TEXT):
        accepting = next((kind for kind in named if kind.accepts(begin)), None)
        if accepting is not None:
            return accepting
    names = " or ".join(kind.name for kind in named)
    if content is None:
        raise InputError(f"is {names} by {reason}, but does not begin like it; it is damaged or another format")
    raise InputError(
        f"is {names} by {reason}, but begins like {content.name}; give it the suffix {content.suffixes[0]}, or "
        f"file_format = {content.suffixes[0][1:]!r}"
    )


def _by_format(file_format: str) -> list[FileKind]:
    """Return the formats with this suffix or name."""
    wanted = file_format.strip().lower().removeprefix(".")
    named = [kind for kind in KINDS if wanted == kind.name.lower() or f".{wanted}" in kind.suffixes]
    if not named:
        valid = [suffix[1:] for kind in KINDS for suffix in kind.suffixes]
        raise InputError(f"file_format = {file_format!r} is not known{suggestion(wanted, valid)}")
    return [*named, GZIP] if TEXT in named else named


def _without_name(path: Path, content: FileKind | None) -> FileKind:
    """Return the format of a file without a known suffix, by its first bytes only."""
    if content is not None and content not in (TEXT, GZIP):
        return content
    suffix = suffix_of(path) or "(none)"
    if content is None:
        suffixes = ", ".join(dict.fromkeys(suffix for kind in KINDS for suffix in kind.suffixes))
        raise InputError(f"has the suffix {suffix} and begins like no format that is read; known: {suffixes}")
    raise InputError(
        f"has the suffix {suffix}, and begins like {content.name}, as many files do; if it holds columns of numbers, "
        f"give file_format = {content.suffixes[0][1:]!r}"
    )


def _by_content(begin: bytes) -> FileKind | None:
    """Return the format of the first bytes; text only if no other format begins so."""
    return next((kind for kind in (*KINDS[1:], TEXT) if kind.begins(begin)), None)


RECORDING_SUFFIXES = tuple(sorted({suffix for kind in KINDS for suffix in kind.suffixes} | {".zip"}))
"""Suffixes of files that are read as recordings."""
