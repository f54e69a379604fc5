"""The folder of a downloaded public set: its recordings with their facts, what is missing or changed, its ingest."""

import csv
import hashlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path, PurePosixPath
from typing import Any

from sigdb.core import InputError, OnProgress, ignore
from sigdb.ingest import IngestSummary, RecordingFacts, facts_of, ingest, pattern_expression
from sigdb.public_sets.public_set import Files, PublicSet

_LABELS = ("state", "kind", "tooth", "severity")
"""Facts that a state stands for."""


@dataclass(frozen=True, kw_only=True)
class FolderCheck:
    """Content of a folder by the description of a public set.

    Attributes
    ----------
    name
        Name of the set.
    folder
        The folder.
    recordings
        Facts of the recordings, by file.
    states
        Word for the state in the name of each recording, where the set has such words.
    others
        Files of the set that are no raw recordings, which are not ingested.
    missing
        Sentences on what the complete set has besides.
    changed
        Files whose SHA-256 is not that of the published file.
    unknown
        Files that no pattern fits.
    """

    name: str
    folder: Path
    recordings: tuple[RecordingFacts, ...]
    states: dict[str, str]
    others: tuple[str, ...]
    missing: tuple[str, ...]
    changed: tuple[str, ...]
    unknown: tuple[str, ...]


def check_folder(name: str, described: PublicSet, folder: str | Path) -> FolderCheck:
    """Return what a folder holds of a public set.

    Parameters
    ----------
    name : str
        Name of the set.
    described : PublicSet
        The set.
    folder : str or path-like
        The folder into which it was downloaded and unpacked.

    Returns
    -------
    FolderCheck
        Recordings with their facts, what is missing, and what has changed.

    Raises
    ------
    InputError
        If there is no such folder, or a name says something that is no fact of a recording.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; {described.where.text}")
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    names = [each for each in names if not any(part.startswith((".", "__MACOSX")) for part in each.split("/"))]
    recordings: list[RecordingFacts] = []
    states: dict[str, str] = {}
    others, missing, taken = list[str](), list[str](), set[str]()
    for files in described.files:
        fitting = [each for each in names if each not in taken and _match(files, each) is not None]
        taken |= set(fitting)
        if len(fitting) < files.least:
            missing.append(f"{files.least - len(fitting)} of {files.least} files {files.pattern}")
        if not files.recording:
            others += fitting
            continue
        for each in fitting:
            facts, word = _facts(name, described, files, each)
            recordings.append(facts)
            states |= {each: word} if word else {}
    return FolderCheck(
        name=name,
        folder=folder,
        recordings=tuple(recordings),
        states=states,
        others=tuple(others),
        missing=tuple(missing),
        changed=tuple(_changed(described, folder, names)),
        unknown=tuple(each for each in names if each not in taken),
    )


def _match(files: Files, name: str) -> dict[str, str] | None:
    """Return the fields of a pattern in a file's name; None if it does not fit."""
    match = pattern_expression(files.pattern).fullmatch(name if "/" in files.pattern else PurePosixPath(name).name)
    return None if match is None else match.groupdict()


def _facts(set_name: str, described: PublicSet, files: Files, name: str) -> tuple[RecordingFacts, str | None]:
    """Return the facts of a recording by its name, its kind of files and its state, and the word for the state."""
    values = {**files.facts, **(_match(files, name) or {}), "file": name, "set": set_name}
    word = values.pop("state", None)
    values.setdefault("specimen", f"{set_name} {word}" if word else set_name)
    values.setdefault("machine", set_name)
    if word is not None:
        state = described.state(word)
        if state is None:
            words = ", ".join(described.states)
            raise InputError(f"{name}: {word!r} is no state of {described.title}; known: {words}")
        labels = {"state": state.state or word, "kind": state.kind, "tooth": state.tooth, "severity": state.severity}
        values |= {key: str(value) for key, value in labels.items() if value is not None}
    if any(key in values for key in _LABELS):
        values["label_trust"] = described.label_trust
    return facts_of(values, RecordingFacts, owner=f"{name} of {described.title}"), word


def _changed(described: PublicSet, folder: Path, names: list[str]) -> Iterator[str]:
    for name in names:
        expected = described.sha256.get(PurePosixPath(name).name)
        if expected is not None and hashlib.sha256((folder / name).read_bytes()).hexdigest() != expected:
            yield name


def ingest_set(
    described: PublicSet,
    check: FolderCheck,
    out: str | PathLike[str],
    *,
    settings: dict[str, Any] | None = None,
    jobs: int = -1,
    on_progress: OnProgress = ignore,
) -> IngestSummary:
    """Make a database of the recordings of a public set, or go on with one.

    Parameters
    ----------
    described : PublicSet
        The set.
    check : FolderCheck
        Content of its folder.
    out : str or path-like
        Place of the database.
    settings : dict, optional
        Settings of an ingest that replace those of the set, or that no cited page states.
    jobs : int
        Number of worker processes; -1 for one on each core.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever recordings are finished.

    Returns
    -------
    IngestSummary
        Counts of recordings, rows and failures.

    Raises
    ------
    InputError
        If the folder holds no recording of the set, or a setting is missing.
    """
    if not check.recordings:
        kinds = ", ".join(files.pattern for files in described.files if files.recording)
        why = f"it should hold {kinds}" if kinds else "no cited page states raw recordings of it"
        raise InputError(f"{check.folder}: holds no recording of {described.title}; {why}; {described.where.text}")
    stated = described.ingest_settings(settings)
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "recordings.csv"
        write_table(check.recordings, table)
        return ingest(check.folder, out, table=table, settings=stated, jobs=jobs, on_progress=on_progress)


def write_table(recordings: tuple[RecordingFacts, ...], path: Path) -> None:
    """Write facts of recordings as the table that an ingest reads."""
    rows = [facts.model_dump(exclude_none=True) for facts in recordings]
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
