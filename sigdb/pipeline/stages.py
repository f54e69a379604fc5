"""Stages of a run: what one made is kept while it is as it was made, and what it was made from is the same."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sigdb.core import DatabaseError, __version__
from sigdb.database import KINDS, Database, Store, sealed_json, unsealed


@dataclass(frozen=True, kw_only=True)
class Stage:
    """Something that a run makes, with a receipt that is written when all of it is there.

    Nothing need be deleted before it is made again, or when a run is stopped: a receipt counts only while each file
    has the content that it tells of.

    Attributes
    ----------
    out
        Folder of the run.
    name
        Path of what is made, below that folder.
    inputs
        All that determines it, by name: what JSON can hold, and tells apart.
    """

    out: Path
    name: str
    inputs: Mapping[str, Any]

    @property
    def path(self) -> Path:
        """What is made: a file or a folder."""
        return self.out / self.name

    @property
    def files(self) -> dict[str, str]:
        """SHA-256 by name of what was made; empty where there is no receipt."""
        return dict(self._receipt().get("files", {}))

    def is_unchanged(self) -> bool:
        """Whether it is there as it was made, from these inputs."""
        receipt = self._receipt()
        return bool(receipt) and receipt["inputs"] == self._inputs and receipt["files"] == self._found(receipt["files"])

    def finish(self, files: Iterable[Path]) -> None:
        """Write the receipt of what has been made."""
        names = sorted(path.relative_to(self.out).as_posix() for path in files)
        content = {"inputs": self._inputs, "files": self._found(names)}
        Store.at(self.out).put(self._receipt_name, sealed_json(content))

    @property
    def _inputs(self) -> Any:
        """The inputs as JSON gives them back."""
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

    def _found(self, names: Iterable[str]) -> dict[str, str]:
        """SHA-256 of those files that are there."""
        paths = {name: self.out / name for name in names}
        return {name: _sha256(path) for name, path in paths.items() if path.is_file()}


def run_stage(stage: Stage, make: Callable[[], Iterable[Path]], on_stage: Callable[[str], Any], did: str) -> None:
    """Have a stage made, unless it is unchanged, and say which.

    Parameters
    ----------
    stage
        What is made.
    make
        Makes it, and gives its files.
    on_stage
        Called with a sentence at the end.
    did
        The word for its being made.
    """
    if stage.is_unchanged():
        on_stage(f"{stage.path}: unchanged")
        return
    stage.finish(make())
    on_stage(f"{stage.path}: {did}")


def content_of(database: Database) -> dict[str, Any]:
    """What a finished database holds: its plans, its rows, and a SHA-256 over those of all its files."""
    files = [file for kind in KINDS for receipt in database.receipts(kind) for file in receipt.files]
    listed = "\n".join(f"{file.path} {file.sha256}" for file in sorted(files, key=lambda file: file.path))
    return {
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
"""Another version may make something else of the same inputs."""
