"""Kinds of files that can be read, distinguished by their suffix and first bytes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import InputError
from sigdb.recording.files.formats import hdf5, mat5, numpy_files, parquet, tdms, text, uff58, wav
from sigdb.recording.files.formats.contents import Contents
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
    read
        Its reader.
    foreign
        Errors that its libraries raise on damaged files.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: Callable[[bytes], bool]
    read: Callable[[Path, RecordingSettings], Contents]
    foreign: tuple[type[Exception], ...]


def _marked(mark: bytes, *starts: int) -> Callable[[bytes], bool]:
    """Return a test for a mark at one of some places, by default at the start."""
    return lambda begin: any(begin.startswith(mark, start) for start in starts or (0,))


def _begins_like_text(begin: bytes) -> bool:
    return b"\0" not in begin or begin[:2] in (b"\xff\xfe", b"\xfe\xff")


def _begins_like_uff(begin: bytes) -> bool:
    first_line = begin.lstrip(b"\r\n").split(b"\n", 1)[0]
    return first_line.startswith(b"    -1") and first_line.strip() == b"-1"


TEXT = FileKind(
    name="text",
    suffixes=(".csv", ".txt", ".tsv", ".dat", ".asc"),
    begins=_begins_like_text,
    read=text.read_text,
    foreign=text.FOREIGN,
)
KINDS = (
    TEXT,
    FileKind(
        name="gzip",
        suffixes=tuple(f"{suffix}.gz" for suffix in TEXT.suffixes),
        begins=_marked(b"\x1f\x8b"),
        read=text.read_text,
        foreign=text.FOREIGN,
    ),
    FileKind(
        name="MAT version 5",
        suffixes=(".mat",),
        begins=lambda begin: begin[:6] == b"MATLAB" and begin[124:128] in (b"\x00\x01IM", b"\x01\x00MI"),
        read=mat5.read_mat5,
        foreign=mat5.FOREIGN,
    ),
    FileKind(
        name="HDF5",
        suffixes=(".h5", ".hdf5", ".hdf", ".mat"),
        begins=_marked(b"\x89HDF\r\n\x1a\n", 0, 512, 1024, 2048),
        read=hdf5.read_hdf5,
        foreign=hdf5.FOREIGN,
    ),
    FileKind(
        name="WAV",
        suffixes=(".wav",),
        begins=lambda begin: begin[:4] in (b"RIFF", b"RIFX", b"RF64") and begin[8:12] == b"WAVE",
        read=wav.read_wav,
        foreign=wav.FOREIGN,
    ),
    FileKind(
        name="Parquet",
        suffixes=(".parquet", ".pq"),
        begins=_marked(b"PAR1"),
        read=parquet.read_parquet,
        foreign=parquet.FOREIGN,
    ),
    FileKind(
        name="NPZ",
        suffixes=(".npz",),
        begins=_marked(b"PK\x03\x04"),
        read=numpy_files.read_npz,
        foreign=numpy_files.FOREIGN,
    ),
    FileKind(
        name="NPY",
        suffixes=(".npy",),
        begins=_marked(b"\x93NUM"),
        read=numpy_files.read_npy,
        foreign=numpy_files.FOREIGN,
    ),
    FileKind(
        name="UFF",
        suffixes=(".uff", ".unv", ".u58"),
        begins=_begins_like_uff,
        read=uff58.read_uff58,
        foreign=uff58.FOREIGN,
    ),
    FileKind(
        name="TDMS",
        suffixes=(".tdms",),
        begins=_marked(b"TDSm"),
        read=tdms.read_tdms,
        foreign=tdms.FOREIGN,
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


def file_kind(path: Path) -> FileKind:
    """Return the format of a file.

    Raises
    ------
    InputError
        If the suffix belongs to no format, or the file begins like a file of another format.
    """
    suffix = suffix_of(path)
    by_name = [kind for kind in KINDS if suffix in kind.suffixes]
    with path.open("rb") as file:
        begin = file.read(4096)
    if not begin:
        raise InputError("is empty")
    content = _by_content(begin)
    if not by_name:
        suffixes = ", ".join(dict.fromkeys(suffix for kind in KINDS for suffix in kind.suffixes))
        raise InputError(f"has the suffix {suffix or '(none)'}; known: {suffixes}")
    if content in by_name:
        return content
    names = " or ".join(kind.name for kind in by_name)
    if content is None:
        raise InputError(
            f"is {names} by its suffix {suffix}, but does not begin like it; it is damaged or another format"
        )
    raise InputError(
        f"is {names} by its suffix {suffix}, but begins like {content.name}; give it the suffix "
        f"{content.suffixes[0]}, or write it again"
    )


def _by_content(begin: bytes) -> FileKind | None:
    """Return the format of the first bytes; text only if no other format begins so."""
    return next((kind for kind in (*KINDS[1:], TEXT) if kind.begins(begin)), None)
