"""Files of a model folder, read with their limits: regular ones of the folder itself, of a size that models have."""

import io
import os
import stat
import zipfile
from pathlib import Path

import numpy as np

from sigdb.core import InputError

MOST_BYTES = 2**29
"""Greatest size of a file, and of the content of an archive; the reference models have 6 MB."""

MOST_TEXT = 2**26
"""Greatest size of a text: a description, or the description within ``model.skops``."""

_FREE, _RATIO = 2**25, 200
"""Size up to which an archive may expand at any ratio, and the greatest ratio above."""

_MOST_MEMBERS = 2**17
_END, _END_SIZE, _ENTRY = b"PK\x05\x06", 22, 46
"""Signature and least size of the end of a ZIP, and least size of an entry of its directory."""


def folder_file(folder: Path, name: str, *, most: int = MOST_BYTES) -> bytes:
    """Return the bytes of a file of a folder.

    Parameters
    ----------
    folder
        The folder.
    name
        Name of the file.
    most
        Greatest size in bytes.

    Raises
    ------
    InputError
        If it is a link out of the folder, no regular file (a pipe never ends), or too large.
    OSError
        If it cannot be read.
    """
    path = folder / name
    if path.is_symlink() and path.resolve().parent != folder.resolve():
        raise InputError(f"{name} is a link to a file elsewhere; put the file itself into the folder")
    # A pipe without a writer would block here.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0))
    try:
        facts = os.fstat(descriptor)
        if not stat.S_ISREG(facts.st_mode):
            raise InputError(f"{name} is not a regular file; copy the model again")
        _check_size(name, facts.st_size, most)
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            content = file.read(facts.st_size + 1)
    finally:
        os.close(descriptor)
    if len(content) != facts.st_size:
        raise InputError(f"{name} changes while it is read; wait until it is written")
    return content


def archive_members(name: str, content: bytes) -> dict[str, bytes]:
    """Return the members of a ZIP by name, in their order; nothing is expanded beyond the limits.

    Parameters
    ----------
    name
        Name of the file, for messages.
    content
        The file.

    Raises
    ------
    InputError
        If it holds more than models do, or a member twice, or an array that states another size than it has.
    zipfile.BadZipFile, zlib.error
        If it is damaged.
    """
    end = content.rfind(_END)
    directory = int.from_bytes(content[end + 12 : end + 16], "little")
    if end >= 0 and len(content) >= _END_SIZE and directory > _MOST_MEMBERS * 4 * _ENTRY:
        raise InputError(f"{name} has a directory of {directory} bytes, which no model has")
    members: dict[str, bytes] = {}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = archive.infolist()
        if len(entries) > _MOST_MEMBERS:
            raise InputError(f"{name} has {len(entries)} members, which no model has")
        total = sum(entry.file_size for entry in entries)
        _check_size(name, total, MOST_BYTES)
        if total > max(_FREE, _RATIO * len(content)):
            raise InputError(f"{name} expands {len(content)} bytes to {total}, which no model does")
        for entry in entries:
            if entry.filename in members:
                raise InputError(f"{name} holds {entry.filename} twice")
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise InputError(f"{name} holds {entry.filename} in a compression that models do not have")
            if not entry.filename.endswith(".npy"):
                _check_size(f"{entry.filename} of {name}", entry.file_size, MOST_TEXT)
            # Bounded, since a directory may state less than there is.
            with archive.open(entry) as member:
                data = member.read(entry.file_size + 1)
            if len(data) != entry.file_size:
                raise InputError(f"{entry.filename} of {name} has another size than it states")
            if entry.filename.endswith(".npy"):
                _check_array(f"{entry.filename} of {name}", data)
            members[entry.filename] = data
    return members


def _check_size(name: str, size: int, most: int) -> None:
    if size > most:
        raise InputError(f"{name} has {size} bytes, more than the {most} that a model may have")


def _check_array(name: str, data: bytes) -> None:
    """Refuse an NPY file whose header states other bytes than follow it: NumPy would allocate what is stated."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise InputError(f"{name} is of NPY version {version}, which models do not have")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    stated = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if dtype.hasobject or min(shape, default=0) < 0 or stated != len(data) - file.tell():
        raise InputError(
            f"{name} states an array of shape {shape} and type {dtype}, and holds {len(data) - file.tell()} bytes"
        )
