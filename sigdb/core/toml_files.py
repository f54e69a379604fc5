"""TOML files of people: read within limits, so that a hostile or mistaken file is a sentence and not a hang."""

import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from sigdb.core.errors import InputError

_MOST_BYTES = 16_000_000
"""Size of a TOML file; long tables of cases are CSV or Parquet files."""
_MOST_DEPTH = 64
"""Tables and arrays within each other, and parts of a dotted key."""
_MOST_INTEGER = 2**63 - 1
_KEY = re.compile(r"[\w\-\"'.\[\] \t]*")
"""The text before ``=`` of a line that is a dotted key."""


def check_file(path: Path, *, most_bytes: int | None = None) -> None:
    """Refuse what is no regular file, such as a pipe or a device, and a file that is too large.

    Parameters
    ----------
    path : path-like
        The file; links are followed.
    most_bytes : int, optional
        Largest size, if there is one.

    Raises
    ------
    InputError
        Names the file, its size and the limit.
    OSError
        If the system refuses to describe the file.
    """
    try:
        status = path.stat()
    except ValueError:  # a zero byte
        raise InputError(f"{str(path)!r} cannot be the name of a file; remove the control characters") from None
    if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: not a regular file but a pipe or a device; copy its content to a file")
    if most_bytes is not None and status.st_size > most_bytes:
        raise InputError(f"{path}: {status.st_size} bytes are more than the {most_bytes} that such a file may have")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file as a dictionary.

    Parameters
    ----------
    path : path-like
        The file: regular, in UTF-8, at most 16 MB.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        If the file is missing, cannot be read, is malformed, is nested deeper than 64 tables and arrays, or holds a
        whole number that takes more than 64 bits.
    """
    try:
        check_file(path, most_bytes=_MOST_BYTES)
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start}); TOML files are UTF-8") from None
    _check_keys(text, path)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}{_remedy(str(error), text)}") from None
    except RecursionError:
        raise _too_deep(path) from None
    except ValueError:
        raise InputError(f"{path}: not valid TOML: a number has more than 4300 digits") from None
    _check_content(content, path)
    return content


def _remedy(problem: str, text: str) -> str:
    """Return the end of a message about text that is not TOML: the remedy of a usual mistake, or nothing."""
    place = re.search(r"at line (\d+), column (\d+)", problem)
    lines = text.replace("\r\n", "\n").split("\n")
    if place is None or int(place[1]) > len(lines):
        return ""
    line = lines[int(place[1]) - 1]
    key, equals, _ = line.partition("=")
    rest = line[int(place[2]) - 1 :]
    word = re.match(r"[^\W\d][\w./:-]*", rest)
    if problem.startswith("Invalid value") and word:
        if word[0].lower() in ("true", "false"):
            return f"; write {word[0].lower()}"
        alone = equals and line[len(key) + 1 : int(place[2]) - 1].strip() == ""
        return f'; text needs quotes: {key.strip() + " = " if alone else ""}"{word[0]}"'
    comma = re.search(r"=\s*(-?\d+),(\d+)\s*(#.*)?$", line)
    if comma:
        return f"; numbers have a decimal point: {key.strip()} = {comma[1]}.{comma[2]}"
    if "\\" in line and not problem.startswith("Invalid value"):
        return "; write the folders of a path with /, or put it in single quotes"
    return ""


def _check_keys(text: str, path: Path) -> None:
    """Refuse a dotted key of very many parts, which takes the parser minutes."""
    for number, line in enumerate(text.splitlines(), 1):
        key = line.partition("=")[0]
        if key.count(".") > _MOST_DEPTH and _KEY.fullmatch(key):
            raise InputError(f"{path}: line {number}: a key has more than {_MOST_DEPTH} parts; shorten it")


def _check_content(content: dict[str, Any], path: Path) -> None:
    """Refuse values that are nested too deeply, and whole numbers beyond 64 bits, which TOML does not have."""
    pending: list[tuple[object, str, int]] = [(content, "", 0)]
    while pending:
        value, key, depth = pending.pop()
        if depth > _MOST_DEPTH:
            raise _too_deep(path)
        if isinstance(value, dict):
            pending += ((item, f"{key}.{name}" if key else name, depth + 1) for name, item in value.items())
        elif isinstance(value, list):
            pending += ((item, key, depth + 1) for item in value)
        elif isinstance(value, int) and abs(value) > _MOST_INTEGER:
            raise InputError(f"{path}: {key}: a whole number of TOML is at most {_MOST_INTEGER}; give a smaller one")


def _too_deep(path: Path) -> InputError:
    return InputError(f"{path}: tables or arrays are nested more than {_MOST_DEPTH} deep; write them flat")
