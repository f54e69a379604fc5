"""The files of an ingest: those of a folder or of a list, with their facts by a table or a pattern."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import InputError
from sigdb.ingest.facts.recording_facts import RecordingFacts
from sigdb.ingest.facts.recording_table import facts_by_pattern, read_table
from sigdb.ingest.plan import PlannedRecording
from sigdb.recording import RECORDING_SUFFIXES

TABLE = "recordings.csv"
"""Name of the table of a folder."""


@dataclass(frozen=True, kw_only=True)
class FoundFiles:
    """Files of an ingest.

    Attributes
    ----------
    folder
        The folder below which their names are.
    facts
        Facts by name, in order; a name may have several.
    left_out
        Names of files in the folder that table or pattern leave out.
    """

    folder: Path
    facts: dict[str, tuple[RecordingFacts, ...]]
    left_out: tuple[str, ...]


def find_files(place: Path, *, table: Path | None = None, pattern: str | None = None) -> FoundFiles:
    """Return the files to ingest.

    Parameters
    ----------
    place
        A folder, or a table of files.
    table
        Table of the files; the folder's own by default, if it has one.
    pattern
        Pattern over the names of the files; the table wins over it.

    Raises
    ------
    InputError
        If there is no file, the table names one that does not exist, or a fact is wrong.
    """
    if not place.exists():
        raise InputError(f"{place}: no such folder or list of recordings")
    if place.is_file():
        if table is not None:
            raise InputError(f"{place} is a list of recordings, and a table is given too; give one of them")
        return _listed(place.parent, place, (), pattern)
    table = table or next((path for path in [place / TABLE] if path.is_file()), None)
    names = tuple(sorted(_names(place, table)))
    if table is not None:
        return _listed(place, table, names, pattern)
    facts = facts_by_pattern(names, pattern) if pattern else [RecordingFacts(file=name) for name in names]
    return _files_of(
        place, facts, names, f"{place} holds no recording" + (f" that {pattern!r} fits" if pattern else "")
    )


def _names(folder: Path, table: Path | None) -> list[str]:
    """Return the names of the files of a folder that have the suffix of a recording."""
    databases = {path.parent for path in folder.rglob("sigdb.toml")}
    paths = (
        path for path in folder.rglob("*") if path.is_file() and path != table and databases.isdisjoint(path.parents)
    )
    names = (path.relative_to(folder).as_posix() for path in paths)
    return [
        name
        for name in names
        if name.lower().endswith(RECORDING_SUFFIXES) and not any(part.startswith(".") for part in name.split("/"))
    ]


def _listed(folder: Path, table: Path, names: Sequence[str], pattern: str | None) -> FoundFiles:
    """Return the files that a table names; facts in their names fill in what the table leaves open."""
    facts = read_table(table, RecordingFacts, needed="file")
    for each in facts:
        if not (folder / each.file).is_file():
            raise InputError(f"{table}: file {each.file!r} does not exist below {folder}")
    if pattern:
        by_name = {each.file: each for each in facts_by_pattern([each.file for each in facts], pattern)}
        facts = [_filled(each, by_name.get(each.file)) for each in facts]
    return _files_of(folder, facts, names, f"{table} names no recording")


def _filled(facts: RecordingFacts, others: RecordingFacts | None) -> RecordingFacts:
    if others is None:
        return facts
    return RecordingFacts(**others.model_dump(exclude_none=True) | facts.model_dump(exclude_none=True))


def _files_of(folder: Path, facts: Sequence[RecordingFacts], names: Sequence[str], none: str) -> FoundFiles:
    by_name: dict[str, tuple[RecordingFacts, ...]] = {}
    for each in facts:
        by_name[each.file] = (*by_name.get(each.file, ()), each)
    if not by_name:
        raise InputError(f"{none}; recordings are files that end in {', '.join(RECORDING_SUFFIXES)}")
    return FoundFiles(folder=folder, facts=by_name, left_out=tuple(name for name in names if name not in by_name))


def planned_recordings(files: FoundFiles, earlier: Sequence[PlannedRecording] = ()) -> tuple[PlannedRecording, ...]:
    """Return the files that are not planned yet, as recordings of a plan.

    Raises
    ------
    InputError
        If an earlier file has another size now.
    """
    sizes = {recording.path: recording.bytes for recording in earlier}
    specimens = {
        each.specimen: number
        for recording in earlier
        for each, number in zip(recording.facts, recording.specimens, strict=True)
        if each.specimen is not None
    }
    results = []
    for name, facts in files.facts.items():
        path = (files.folder / name).resolve()
        size = path.stat().st_size
        if str(path) in sizes:
            if sizes[str(path)] != size:
                raise InputError(
                    f"{path}: has {size} bytes, and had {sizes[str(path)]} when it was ingested; give the changed file "
                    "another name"
                )
            continue
        numbers = []
        for each in facts:
            if each.specimen is not None:
                specimens.setdefault(each.specimen, len(specimens))
            numbers.append(None if each.specimen is None else specimens[each.specimen])
        results.append(PlannedRecording(path=str(path), name=name, bytes=size, facts=facts, specimens=tuple(numbers)))
    return tuple(results)
