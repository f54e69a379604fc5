"""The record of a search in a folder: a line of JSON for each finished part, so that a stopped search goes on."""

import json
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from sigdb.core import InputError, JsonValue, json_text, plain, publish

FILE = "search.jsonl"
"""Name of the record in the folder."""


class SearchRecord:
    """Finished parts of a search by name, kept in a folder if there is one.

    Parameters
    ----------
    folder : path or None
        Folder of the search; None keeps nothing.
    inputs
        All that decides the result; a folder keeps the search of one set of inputs.

    Raises
    ------
    InputError
        If the folder holds the search of other inputs, or a record that this version did not write.
    """

    def __init__(self, folder: Path | None, inputs: Mapping[str, object]) -> None:
        self._parts: dict[str, Any] = {}
        self._path = folder / FILE if folder is not None else None
        if self._path is None:
            return
        digest = sha256(json_text(inputs).encode()).hexdigest()
        if self._path.exists():
            self._read(self._path, digest)
        else:
            publish(self._path, json_text({"inputs": digest}, indent=None))

    def _read(self, path: Path, digest: str) -> None:
        text = path.read_text(encoding="utf-8", errors="replace")
        whole = text[: text.rfind("\n") + 1]
        try:
            head, *parts = (json.loads(line) for line in whole.splitlines())
            inputs = head["inputs"]
            self._parts = {part["name"]: part["part"] for part in parts}
        except (ValueError, KeyError, TypeError):
            raise InputError(f"{path} is no record of a search; remove it, or choose another folder") from None
        if inputs != digest:
            raise InputError(
                f"{path.parent} holds the search of another rig, other targets or another seed; choose another folder"
            )
        if whole != text:  # the last line was cut off
            publish(path, whole)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the finished parts."""
        return tuple(self._parts)

    def part(self, name: str, make: Callable[[], object]) -> Any:
        """Return a part as plain values, from the record or made and recorded now."""
        if name not in self._parts:
            value: JsonValue = plain(make())
            if self._path is not None:
                with self._path.open("a", encoding="utf-8") as record:
                    record.write(json_text({"name": name, "part": value}, indent=None))
            self._parts[name] = value
        return self._parts[name]
