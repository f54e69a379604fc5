"""The kinds of files that can be read, told apart by their suffix and first bytes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import InputError
from sigdb.recording.files.formats import hdf5, mat5, numpy_files, parquet, tdms, text, uff58, wav
from sigdb.recording.files.formats.contents import Contents
from sigdb.recording.files.settings import RecordingSettings

HDF5_MARK = b"\x89HDF\r\n\x1a\n"
HDF5_STARTS = (0, 512, 1024, 2048)


@dataclass(frozen=True, kw_only=True)
class FileKind:
    """A format: its name, its suffixes, its reader, and the errors that its libraries raise on damaged files."""

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, RecordingSettings], Contents]
    foreign: tuple[type[Exception], ...]


TEXT = FileKind(
    name="text", suffixes=(".csv", ".txt", ".tsv", ".dat", ".asc"), read=text.read_text, foreign=text.FOREIGN
)
GZIP = FileKind(
    name="gzip", suffixes=tuple(f"{suffix}.gz" for suffix in TEXT.suffixes), read=text.read_text, foreign=text.FOREIGN
)
MAT = FileKind(name="MAT version 5", suffixes=(".mat",), read=mat5.read_mat5, foreign=mat5.FOREIGN)
HDF5 = FileKind(name="HDF5", suffixes=(".h5", ".hdf5", ".hdf", ".mat"), read=hdf5.read_hdf5, foreign=hdf5.FOREIGN)
WAV = FileKind(name="WAV", suffixes=(".wav",), read=wav.read_wav, foreign=wav.FOREIGN)
PARQUET = FileKind(name="Parquet", suffixes=(".parquet", ".pq"), read=parquet.read_parquet, foreign=parquet.FOREIGN)
NPZ = FileKind(name="NPZ", suffixes=(".npz",), read=numpy_files.read_npz, foreign=numpy_files.FOREIGN)
NPY = FileKind(name="NPY", suffixes=(".npy",), read=numpy_files.read_npy, foreign=numpy_files.FOREIGN)
UFF = FileKind(name="UFF", suffixes=(".uff", ".unv", ".u58"), read=uff58.read_uff58, foreign=uff58.FOREIGN)
TDMS = FileKind(name="TDMS", suffixes=(".tdms",), read=tdms.read_tdms, foreign=tdms.FOREIGN)
KINDS = (TEXT, GZIP, MAT, HDF5, WAV, PARQUET, NPZ, NPY, UFF, TDMS)


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
    """Return the format of the first bytes; text if they match no other format and hold no zero bytes."""
    if begin[:2] == b"\x1f\x8b":
        return GZIP
    if any(begin[at : at + 8] == HDF5_MARK for at in HDF5_STARTS):
        return HDF5
    if begin[:6] == b"MATLAB" and begin[124:128] in (b"\x00\x01IM", b"\x01\x00MI"):
        return MAT
    if begin[:4] in (b"RIFF", b"RIFX", b"RF64") and begin[8:12] == b"WAVE":
        return WAV
    starts = {b"PAR1": PARQUET, b"PK\x03\x04": NPZ, b"\x93NUM": NPY, b"TDSm": TDMS}
    if begin[:4] in starts:
        return starts[begin[:4]]
    first_line = begin.lstrip(b"\r\n").split(b"\n", 1)[0]
    if first_line.startswith(b"    -1") and first_line.strip() == b"-1":
        return UFF
    return TEXT if b"\0" not in begin or begin[:2] in (b"\xff\xfe", b"\xfe\xff") else None
