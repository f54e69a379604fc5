"""Files of a database: written whole or not at all."""

import hashlib
import json
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any


def publish(path: Path, write: Callable[[Path], None]) -> None:
    """Write a file under a temporary name beside it, make it durable, and rename it into place.

    A reader never sees a part of it, whenever the process or the machine stops, and two writers of the same content do
    not disturb each other.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.{secrets.token_hex(4)}.tmp")
    try:
        write(temporary)
        _sync(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    if os.name == "posix":
        _sync(path.parent)


def publish_text(path: Path, text: str) -> None:
    """Publish a text file."""
    publish(path, lambda temporary: _write_text(temporary, text))


def clear_temporary(root: Path) -> None:
    """Delete what stopped processes have left under temporary names below a directory."""
    for left in root.rglob(".*.tmp"):
        left.unlink(missing_ok=True)


def publish_bytes(path: Path, content: bytes) -> None:
    """Publish a file of bytes."""
    publish(path, lambda temporary: _write_bytes(temporary, content))


def publish_json(path: Path, content: Any) -> None:
    """Publish a JSON file."""
    publish_text(path, json.dumps(content, indent=1) + "\n")


def sha256(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write_bytes(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
