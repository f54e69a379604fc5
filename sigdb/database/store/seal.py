"""Text files that carry their own checksum, so that no byte of them changes unnoticed.

The first line holds the SHA-256 of all that follows it. With that line the file is still TOML or JSON.
"""

import hashlib
import json
import tomllib
from collections.abc import Mapping
from copy import deepcopy
from functools import lru_cache
from typing import Any

import tomli_w

from sigdb.database.store.store import DamagedFileError

_TOML, _JSON = 'sha256 = "{}"\n', '{{"sha256": "{}",\n'


def sealed_toml(content: Mapping[str, Any]) -> bytes:
    """Return the TOML text of a table, with its checksum in the first line."""
    return _sealed(_TOML, tomli_w.dumps(content, multiline_strings=True))


def sealed_json(content: Mapping[str, Any]) -> bytes:
    """Return the JSON text of an object that is not empty, with its checksum in the first line."""
    return _sealed(_JSON, json.dumps(content, indent=1).removeprefix("{\n") + "\n")


def unsealed(text: bytes, *, name: str) -> dict[str, Any]:
    """Return the content of a sealed file.

    Parameters
    ----------
    text
        The file.
    name
        Its name, for messages; TOML if it ends in ``.toml``, else JSON.

    Raises
    ------
    DamagedFileError
        If a byte of it has changed.
    """
    first, _, rest = text.partition(b"\n")
    line, load = (_TOML, _from_toml) if name.endswith(".toml") else (_JSON, json.loads)
    if first + b"\n" != line.format(hashlib.sha256(rest).hexdigest()).encode():
        raise DamagedFileError(name, "is damaged or was edited")
    content: dict[str, Any] = load(text.decode())
    content.pop("sha256")
    return content


def _from_toml(text: str) -> dict[str, Any]:
    """Return the content of TOML text, a copy of that of the last time: a sweep opens its database again and again."""
    return deepcopy(_parsed(text))


_parsed = lru_cache(maxsize=8)(tomllib.loads)


def _sealed(line: str, rest: str) -> bytes:
    body = rest.encode()
    return line.format(hashlib.sha256(body).hexdigest()).encode() + body
