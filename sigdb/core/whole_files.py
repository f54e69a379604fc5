"""Files that are written whole or not at all, however the process ends."""

import os
import secrets
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from glob import escape
from pathlib import Path

TEMPORARY = ".tmp"
"""End of the name of a file that is being written."""

_ABANDONED = 24 * 3600.0
"""Age in s after which a file that is being written belongs to a process that was stopped."""

_MOST_LETTERS = 40
"""Letters of a file's name that its temporary name begins with."""


Content = str | bytes | memoryview | Callable[[Path], object]
"""A text, which is written as UTF-8, bytes, or a function that writes the file of the name that it is called with."""


def publish(path: Path, content: Content, *, clear: bool = True) -> None:
    """Write a file under a temporary name in the same folder, flush it to the disk, and rename it.

    At every instant the old file, the whole new file or no file is there. Links are followed. A pipe or a device is
    written to directly.

    Parameters
    ----------
    path : pathlib.Path
        The file; its folder is made if it does not exist.
    content : str or bytes or callable
        Its content.
    clear : bool
        Whether files of this name that stopped processes left a day ago are deleted.

    Raises
    ------
    OSError
        Names the file, if it cannot be written.
    """
    publish_all({path: content}, clear=clear)


def publish_all(contents: Mapping[Path, Content], *, clear: bool = True) -> None:
    """Write files that belong together, and rename them when all of them are written.

    The last one stands for all: it is absent while the others change, so that it never stands among files of another
    time.

    Parameters
    ----------
    contents : mapping
        The content of each file.
    clear : bool
        Whether files of these names that stopped processes left a day ago are deleted.

    Raises
    ------
    OSError
        Names the file that cannot be written.
    """
    written: dict[Path, Path] = {}
    with ExitStack() as stack:
        for named, content in contents.items():
            path = named.resolve() if named.is_symlink() else named
            try:
                if path.exists() and not path.is_file() and not path.is_dir():
                    _write(path, content)
                    continue
                make_folder(path.parent)
                temporary = path.with_name(f"{_begin(path)}{os.getpid()}.{secrets.token_hex(4)}{TEMPORARY}")
                stack.callback(temporary.unlink, missing_ok=True)
                _write(temporary, content)
                with temporary.open("rb+") as file:  # Windows flushes only files that are open for writing
                    os.fsync(file.fileno())
            except OSError as error:
                raise _of_file(error, path) from None
            written[path] = temporary
        if len(written) > 1 and (last := list(written)[-1]).is_file():
            last.unlink()
        for path, temporary in written.items():
            try:
                temporary.replace(path)
            except OSError as error:
                raise _of_file(error, path) from None
            if clear:
                _clear(path)
    for folder in {path.parent for path in written}:
        _sync_folder(folder)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it; the name of each new one is flushed to the disk in the folder above it."""
    new = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for place in reversed(new):
        _sync_folder(place.parent)


def _write(path: Path, content: Content) -> None:
    if callable(content):
        content(path)
    else:
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def _begin(path: Path) -> str:
    """Return the begin of the names under which a file is written."""
    return f".{path.name[:_MOST_LETTERS]}."


def _clear(path: Path) -> None:
    """Delete what stopped processes have left of a file."""
    for left in path.parent.glob(f"{escape(_begin(path))}*{TEMPORARY}"):
        if time.time() - left.stat().st_mtime > _ABANDONED:
            left.unlink(missing_ok=True)


def _of_file(error: OSError, path: Path) -> OSError:
    """Return an error of the system that names a file, rather than its temporary name."""
    return OSError(error.errno, error.strerror or str(error), str(path))


def _sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk, where the system opens folders; Windows does not."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except PermissionError:
        return
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
