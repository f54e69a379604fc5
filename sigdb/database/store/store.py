"""The place of a database: a directory, or a prefix of an object store. Files are written whole or not at all."""

import io
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import pyarrow as pa
from pyarrow import fs

from sigdb.core import TEMPORARY, CorruptionError, DatabaseError, InputError, publish


class FileError(DatabaseError):
    """A file of a database that cannot be read.

    Parameters
    ----------
    file
        Name of the file, as a message names it.
    problem
        Problem of the file: the predicate of a sentence whose subject is ``file``.
    remedy
        Remedy; empty where the caller adds it.
    """

    def __init__(self, file: str, problem: str, remedy: str = "") -> None:
        super().__init__(f"{file} {problem}; {remedy}" if remedy else f"{file} {problem}")
        self.file, self.problem, self.remedy = file, problem, remedy

    def __reduce__(self) -> tuple[type[Self], tuple[str, str, str]]:
        return type(self), (self.file, self.problem, self.remedy)

    def with_remedy(self, remedy: str) -> Self:
        """Return the same error with another remedy."""
        return type(self)(self.file, self.problem, remedy)


class DamagedFileError(FileError, CorruptionError):
    """A file of a database that is missing, or is not as it was written."""


@dataclass(frozen=True, kw_only=True)
class Store:
    """A place for files, each named by its path below the place, with ``/`` between folders.

    Attributes
    ----------
    location
        As a user writes it: the path of a directory, or a URI such as ``s3://bucket/prefix``.
    filesystem
        The Arrow file system that holds it.
    root
        The place's path in that file system.
    """

    location: str
    filesystem: fs.FileSystem
    root: str

    @classmethod
    def at(cls, location: "str | os.PathLike[str] | Store") -> "Store":
        """Return the store at the path of a directory, or at a URI of one of Arrow's file systems.

        Raises
        ------
        InputError
            If no file system of Arrow has such a URI, or it names no place in the store.
        DatabaseError
            If an object store does not answer.
        """
        if isinstance(location, Store):
            return location
        location = os.fspath(location)
        if "://" not in location:
            return cls(location=location, filesystem=fs.LocalFileSystem(), root=_absolute(location))
        try:
            filesystem, root = fs.FileSystem.from_uri(location)
        except (ValueError, pa.ArrowException) as error:
            raise InputError(
                f"{location}: not a place for a database ({error}); give a directory or s3://BUCKET/PREFIX"
            ) from None
        except OSError as error:
            raise DatabaseError(f"{location}: cannot be reached ({_reason(error)})") from None
        if not root.strip("/"):
            raise InputError(f"{location}: names no place in the store; give for example s3://BUCKET/PREFIX")
        return cls(location=location.rstrip("/"), filesystem=filesystem, root=root.rstrip("/"))

    def __str__(self) -> str:
        return self.location

    @property
    def folder(self) -> Path | None:
        """The directory; None for an object store."""
        return Path(self.root) if isinstance(self.filesystem, fs.LocalFileSystem) else None

    def name_of(self, name: str) -> str:
        """Return the name of a file of this store for messages."""
        return str(Path(self.location, name)) if self.folder is not None else f"{self.location.split('?')[0]}/{name}"

    def size(self, name: str) -> int | None:
        """Return the size of a file in bytes, None if there is no such file."""
        with self._reading(name):
            info = self.filesystem.get_file_info(self._path(name))
        return info.size if info.is_file else None

    def sizes(self, folder: str = "") -> dict[str, int]:
        """Return the sizes in bytes of all files below a folder, by name, but for those that are being written."""
        below = self._path(folder) if folder else self.root
        select = fs.FileSelector(below, recursive=True, allow_not_found=True)
        with self._reading(folder):
            try:
                files = self.filesystem.get_file_info(select)
            except FileNotFoundError:  # a folder that a sweep makes between Arrow's two looks
                files = self.filesystem.get_file_info(select)
        return {
            name: file.size
            for name, file in sorted((file.path[len(self.root) + 1 :], file) for file in files if file.is_file)
            if not re.fullmatch(rf"(.*/)?\.[^/]*{re.escape(TEMPORARY)}", name)
        }

    def get(self, name: str) -> bytes:
        """Return the content of a file.

        Raises
        ------
        DamagedFileError
            If it is missing.
        FileError
            If it cannot be read.
        """
        with self._reading(name), self._opened(name) as file:
            return bytes(file.readall())

    def get_range(self, name: str, start: int, size: int) -> bytes:
        """Return ``size`` bytes of a file from ``start`` on, or fewer at its end."""
        with self._reading(name), self._opened(name) as file:
            return bytes(file.read_at(size, start))

    @contextmanager
    def opened_here(self, name: str) -> Iterator[io.FileIO]:
        """Open a file of a directory, without a buffer.

        Raises
        ------
        DamagedFileError
            If it is missing.
        FileError
            If it cannot be read.
        """
        with self._reading(name):
            self._check_regular(name)
            with (Path(self.root) / name).open("rb", buffering=0) as file:
                yield file

    def put(self, name: str, content: bytes | memoryview) -> None:
        """Write a file, so that at every instant the whole file, the old file or no file is there.

        In a directory it is written under a temporary name in the same folder, flushed to the disk and renamed, so that
        two writers of the same content do not disturb each other. In an object store a put is atomic.

        Raises
        ------
        DatabaseError
            If it cannot be written, for example because the disk is full.
        """
        try:
            if self.folder is not None:
                publish(self.folder / name, content, clear=False)
            else:
                with self.filesystem.open_output_stream(self._path(name)) as stream:
                    stream.write(content)
        except OSError as error:
            raise DatabaseError(
                f"{self.name_of(name)}: cannot be written ({_reason(error)}); nothing that is finished is lost; make "
                "room or give the right to write, then run the same command again"
            ) from None

    def delete(self, name: str) -> None:
        """Delete a file if it exists."""
        if self.size(name) is not None:
            self.filesystem.delete_file(self._path(name))

    def temporary(self) -> list[str]:
        """Return the names of files that are being written, or that stopped processes have left."""
        if self.folder is None:
            return []
        return sorted(left.relative_to(self.folder).as_posix() for left in self.folder.rglob(f".*{TEMPORARY}"))

    def clear_temporary(self) -> None:
        """Delete files that stopped processes have left under temporary names."""
        for left in self.temporary():
            Path(self.root, left).unlink(missing_ok=True)

    def _path(self, name: str) -> str:
        return f"{self.root}/{name}"

    def _opened(self, name: str) -> pa.NativeFile:
        """Open a file; a pipe or a device, which may never end, is refused."""
        if self.folder is not None:
            self._check_regular(name)
        return self.filesystem.open_input_file(self._path(name))

    def _check_regular(self, name: str) -> None:
        if not stat.S_ISREG((Path(self.root) / name).stat().st_mode):
            raise FileError(self.name_of(name), "is not a regular file")

    @contextmanager
    def _reading(self, name: str) -> Iterator[None]:
        try:
            yield
        except FileNotFoundError:
            raise DamagedFileError(self.name_of(name), "is missing") from None
        except OSError as error:
            raise FileError(self.name_of(name), f"cannot be read ({_reason(error)})") from None


def _absolute(location: str) -> str:
    """Return the full path with ``/`` between folders, which Arrow's file systems have on Windows too; links stay."""
    return Path(os.path.abspath(location)).as_posix()  # noqa: PTH100


def _reason(error: OSError) -> str:
    return error.strerror or str(error).splitlines()[0].partition(" (Request ID")[0]
