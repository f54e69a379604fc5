"""Stages of a run: a result is kept while its files and its inputs are unchanged."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sigdb.core import DatabaseError, OnStep, __version__
from sigdb.database import KINDS, Database, Store, sealed_json, unsealed


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A result of a run, with a receipt that is written when all of its files exist.

    Nothing need be deleted before it is made again, or when a run is interrupted: a receipt is valid only while each
    file has the checksum in it.

    Attributes
    ----------
    out
        Folder of the run.
    name
        Path of the result, below that folder.
    inputs
        Everything that determines the result, by name, as JSON can hold it.
    """

    out: Path
    name: str
    inputs: Mapping[str, Any]

    @property
    def path(self) -> Path:
        """The result: a file or a folder."""
        return self.out / self.name

    @property
    def files(self) -> dict[str, str]:
        """SHA-256 of the files of the result, by name; empty where there is no receipt."""
        return dict(self._receipt().get("files", {}))

    def is_unchanged(self) -> bool:
        """Return whether the files exist unchanged and were made from these inputs."""
        receipt = self._receipt()
        return (
            bool(receipt)
            and receipt["inputs"] == self._inputs
            and receipt["files"] == self._checksums(receipt["files"])
        )

    def finish(self, files: Iterable[Path]) -> None:
        """Write the receipt of the files."""
        names = sorted(path.relative_to(self.out).as_posix() for path in files)
        content = {"inputs": self._inputs, "files": self._checksums(names)}
        Store.at(self.out).put(self._receipt_name, sealed_json(content))

    @property
    def _inputs(self) -> Any:
        """The inputs as they return from JSON."""
        return json.loads(json.dumps({**self.inputs, "versions": _VERSIONS}))

    @property
    def _receipt_name(self) -> str:
        return f"receipts/{self.name}.json"

    def _receipt(self) -> dict[str, Any]:
        store = Store.at(self.out)
        try:
            return unsealed(store.get(self._receipt_name), name=self._receipt_name)
        except DatabaseError:
            return {}

    def _checksums(self, names: Iterable[str]) -> dict[str, str]:
        """Return the SHA-256 of those files that exist."""
        paths = {name: self.out / name for name in names}
        return {name: _sha256(path) for name, path in paths.items() if path.is_file()}


def run_stage(stage: Stage, make: Callable[[], Iterable[Path]], on_stage: OnStep, verb: str) -> None:
    """Make a stage unless it is unchanged, and report which.

    Parameters
    ----------
    stage
        The stage.
    make
        Makes the result and returns its files.
    on_stage
        Called with a sentence at the end.
    verb
        Participle for the sentence, for example ``trained``.
    """
    if stage.is_unchanged():
        on_stage(f"{stage.path}: unchanged")
        return
    stage.finish(make())
    on_stage(f"{stage.path}: {verb}")


def content_of(database: Database) -> dict[str, Any]:
    """Return the content of a finished database: its plans, its rows, and a SHA-256 over those of all its files.

    Added features stand by the hashes of their descriptions, where there are any.
    """
    files = [file for kind in KINDS for receipt in database.receipts(kind) for file in receipt.files]
    listed = "\n".join(f"{file.path} {file.sha256}" for file in sorted(files, key=lambda file: file.path))
    added = {"added": [each.hash for each in database.added]} if database.added else {}
    return added | {
        "plans": [plan.hash for plan in database.manifest.plans],
        "rows": len(database),
        "sha256": hashlib.sha256(listed.encode()).hexdigest(),
    }


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        digest = hashlib.sha256()
        for block in iter(partial(file.read, 1 << 20), b""):
            digest.update(block)
    return digest.hexdigest()


_VERSIONS = {"sigdb": __version__, "scikit-learn": version("scikit-learn")}
"""Versions that may change the result of the same inputs."""
