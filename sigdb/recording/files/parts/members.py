"""The files of a folder or of a ZIP archive. An archive is read in memory; nothing is written to the disk."""

import io
import re
import stat
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import check_bytes, check_ratio

MAX_FILES = 1000
"""Largest number of files of a recording."""

IGNORED = re.compile(r"(\..*|desktop\.ini|thumbs\.db|readme.*|licen[cs]e.*|changelog.*|.*\.toml)", re.IGNORECASE)
"""Names of files that are no recordings."""

MARK = b"PK\x03\x04"


@dataclass(frozen=True)
class MemoryFile:
    """A file in memory, with those methods of a path that readers use."""

    path: PurePosixPath
    data: bytes

    @property
    def name(self) -> str:
        """The name with its suffix."""
        return self.path.name

    @property
    def stem(self) -> str:
        """The name without its suffix."""
        return self.path.stem

    @property
    def suffixes(self) -> list[str]:
        """All suffixes."""
        return self.path.suffixes

    def read_bytes(self) -> bytes:
        """Return the content."""
        return self.data

    def open(self, mode: str = "rb") -> BinaryIO:
        """Return the content as an open file."""
        return io.BytesIO(self.data)

    def stat(self) -> "FileSize":
        """Return the size."""
        return FileSize(len(self.data))

    def __str__(self) -> str:
        return str(self.path)


@dataclass(frozen=True)
class FileSize:
    """Size of a file, bytes."""

    st_size: int


def is_archive(path: Path) -> bool:
    """Return whether a file is a ZIP archive by its suffix and its first bytes."""
    if path.suffix.lower() != ".zip":
        return False
    with path.open("rb") as file:
        return file.read(4) == MARK


def folder_files(path: Path) -> tuple[list[Path], list[str]]:
    """Return the files of a folder in natural order, and the names of what was left out.

    Raises
    ------
    InputError
        If there is none, or more than a recording may have.
    """
    names: list[Path] = []
    left_out: list[str] = []
    for member in path.iterdir():
        if len(names) + len(left_out) > 2 * MAX_FILES:
            raise _too_many()
        is_file = stat.S_ISREG(member.stat().st_mode) if member.exists() else False
        if not is_file or IGNORED.fullmatch(member.name):
            left_out += [] if member.name.startswith(".") else [member.name]
        else:
            names.append(member)
    _check_number(len(names), left_out)
    check_bytes(sum(member.stat().st_size for member in names))
    return sorted(names, key=lambda member: natural_order(member.name)), sorted(left_out, key=natural_order)


def archive_files(path: Path) -> tuple[Iterator[MemoryFile], list[str]]:
    """Return the files of a ZIP archive in natural order, and the names of what was left out.

    Raises
    ------
    InputError
        If the archive is damaged or encrypted, holds an archive, or expands beyond the limits.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise InputError(f"cannot be read as ZIP ({error})") from None
    if len(members) > 2 * MAX_FILES:
        raise _too_many()
    chosen = [member for member in members if not member.is_dir() and not _is_ignored(member.filename)]
    left_out = [member.filename for member in members if not member.is_dir() and _is_ignored(member.filename)]
    _check_number(len(chosen), left_out)
    names = [member.filename for member in chosen]
    if len(set(names)) < len(names):
        raise InputError("holds two files of one name; pack it again")
    for member in chosen:
        if member.flag_bits & 1:
            raise InputError(f"is encrypted ({member.filename}); pack it again without a password")
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise InputError(f"holds {member.filename} in a compression that is not read; pack it again by deflate")
    check_ratio(sum(member.file_size for member in chosen), path.stat().st_size)
    chosen.sort(key=lambda member: natural_order(member.filename))
    return _expanded(path, chosen), left_out


def _expanded(path: Path, members: list[zipfile.ZipInfo]) -> Iterator[MemoryFile]:
    try:
        with zipfile.ZipFile(path) as archive:
            for member in members:
                with archive.open(member) as file:
                    data = file.read(member.file_size + 1)
                if len(data) != member.file_size:
                    raise InputError(f"is damaged: {member.filename} has not the size that the archive states")
                if data[:4] == MARK and not PurePosixPath(member.filename).suffix.lower() == ".npz":
                    raise InputError(f"holds the archive {member.filename}; unpack that first")
                yield MemoryFile(PurePosixPath(member.filename.replace("\\", "/")), data)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"is damaged ({error}); copy it again") from None


def _is_ignored(name: str) -> bool:
    path = PurePosixPath(name.replace("\\", "/"))
    return bool(IGNORED.fullmatch(path.name)) or "__MACOSX" in path.parts


def _check_number(files: int, left_out: list[str]) -> None:
    if files > MAX_FILES:
        raise _too_many()
    if not files:
        others = f": {', '.join(left_out[:5])}" if left_out else ""
        raise InputError(f"holds no files of a recording{others}")


def _too_many() -> InputError:
    return InputError(f"holds more than {MAX_FILES} files; join them into fewer, or give a folder with fewer")


def natural_order(name: str) -> list[tuple[int, int, str]]:
    """Return a key that sorts names with the numbers in them by value.

    Examples
    --------
    >>> sorted(["run10.csv", "run2.csv"], key=natural_order)
    ['run2.csv', 'run10.csv']
    """
    return [
        (0, int(part), part) if part.isdecimal() and part.isascii() and len(part) < 20 else (1, 0, part.lower())
        for part in re.split(r"(\d+)", name)
        if part
    ]
