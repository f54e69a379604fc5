"""The files of an ingest: those of a folder or of a list, with their facts by a table or a pattern."""

import os
from collections.abc import Container, Iterable, Sequence
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
        Facts by name, in order; a name may have several, and one that was ingested earlier has none.
    left_out
        Names of files in the folder that table or pattern leave out.
    """

    folder: Path
    facts: dict[str, tuple[RecordingFacts, ...]]
    left_out: tuple[str, ...]

    @property
    def ingested_paths(self) -> set[str]:
        """Full paths of those that were ingested earlier."""
        root = self.folder.resolve()
        return {_full_path(root, name) for name, facts in self.facts.items() if not facts}

    @property
    def new_paths(self) -> list[Path]:
        """Full paths of the others."""
        root = self.folder.resolve()
        return [Path(_full_path(root, name)).resolve() for name, facts in self.facts.items() if facts]


def find_files(
    place: Path, *, table: Path | None = None, pattern: str | None = None, earlier_paths: Container[str] = ()
) -> FoundFiles:
    """Return the files to ingest.

    Parameters
    ----------
    place
        A folder, or a table of files.
    table
        Table of the files; the folder's own by default, if it has one.
    pattern
        Pattern over the names of the files; the table wins over it.
    earlier_paths
        Full paths of files that were ingested earlier: their facts are not read again.

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
        return _listed(place.parent, place, (), pattern, earlier_paths)
    table = table or next((path for path in [place / TABLE] if path.is_file()), None)
    names = tuple(sorted(_names(place, table)))
    if table is not None:
        return _listed(place, table, names, pattern, earlier_paths)
    ingested, new = _split(place, names, earlier_paths)
    facts = facts_by_pattern(new, pattern) if pattern else [RecordingFacts(file=name) for name in new]
    why = f"{place} holds no recording" + (f" that {pattern!r} fits" if pattern else "")
    return _files_of(place, facts, ingested, names, why)


def _split(folder: Path, names: Iterable[str], earlier_paths: Container[str]) -> tuple[list[str], list[str]]:
    """Return the names of files of earlier paths, and of the others."""
    root = folder.resolve()
    ingested: list[str] = []
    new: list[str] = []
    for name in names:
        (ingested if _full_path(root, name) in earlier_paths else new).append(name)
    return ingested, new


def _full_path(root: Path, name: str) -> str:
    """Return the path of a file below a folder without links, as the list of recordings has it."""
    # A Path, or a join, for each of ten thousand names takes long.
    return f"{root}{os.sep}{name}" if name[:1].isalnum() and ":" not in name else str(root / name)


def _names(folder: Path, table: Path | None) -> list[str]:
    """Return the names of the files of a folder that have the suffix of a recording."""
    names: list[str] = []
    for place, folders, files in os.walk(folder):
        if "sigdb.toml" in files:  # a database
            folders.clear()
            continue
        folders[:] = [each for each in folders if not each.startswith(".")]
        below = Path(place).relative_to(folder).as_posix()
        prefix = "" if below == "." else f"{below}/"
        names += [
            f"{prefix}{name}"
            for name in files
            if name.lower().endswith(RECORDING_SUFFIXES) and not name.startswith(".")
        ]
    if table is None:
        return names
    return [name for name in names if not name.endswith(table.name) or (folder / name).resolve() != table.resolve()]


def _listed(
    folder: Path, table: Path, names: Sequence[str], pattern: str | None, earlier_paths: Container[str]
) -> FoundFiles:
    """Return the files that a table names; facts in their names fill in what the table leaves open."""
    root = folder.resolve()
    ingested: list[str] = []

    def is_new(file: str) -> bool:
        if _full_path(root, file) not in earlier_paths:
            return True
        ingested.append(file)
        return False

    facts = read_table(table, RecordingFacts, needed="file", wanted=is_new)
    for each in facts:
        if not (folder / each.file).is_file():
            raise InputError(f"{table}: file {each.file!r} does not exist below {folder}")
    if pattern:
        by_name = {each.file: each for each in facts_by_pattern([each.file for each in facts], pattern)}
        facts = [_filled(each, by_name.get(each.file)) for each in facts]
    return _files_of(folder, facts, ingested, names, f"{table} names no recording")


def _filled(facts: RecordingFacts, others: RecordingFacts | None) -> RecordingFacts:
    if others is None:
        return facts
    return RecordingFacts(**others.model_dump(exclude_none=True) | facts.model_dump(exclude_none=True))


def _files_of(
    folder: Path, facts: Sequence[RecordingFacts], ingested: Sequence[str], names: Sequence[str], none: str
) -> FoundFiles:
    by_name: dict[str, tuple[RecordingFacts, ...]] = dict.fromkeys(ingested, ())
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
        each["specimen"]: number
        for recording in earlier
        for each, number in zip(recording.stated, recording.specimens, strict=True)
        if "specimen" in each
    }
    root = files.folder.resolve()
    results = []
    for name, facts in files.facts.items():
        path = _full_path(root, name)
        path = path if path in sizes else str(Path(path).resolve())
        try:
            size = os.stat(path).st_size  # noqa: PTH116 - a Path takes long
        except OSError as error:
            if path in sizes:
                raise InputError(f"{path}: cannot be read ({error.strerror or error}); put it back") from None
            size = 0  # a row without result says why
        if path in sizes:
            if sizes[path] != size:
                raise InputError(
                    f"{path}: has {size} bytes, and had {sizes[path]} when it was ingested; give the changed file "
                    "another name"
                )
            continue
        numbers = []
        for each in facts:
            if each.specimen is not None:
                specimens.setdefault(each.specimen, len(specimens))
            numbers.append(None if each.specimen is None else specimens[each.specimen])
        stated = tuple(each.model_dump(mode="json", exclude_none=True, exclude={"file"}) for each in facts)
        results.append(PlannedRecording(path=path, name=name, bytes=size, stated=stated, specimens=tuple(numbers)))
    return tuple(results)
