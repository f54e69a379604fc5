"""The table of recordings: a CSV file with a line for each, or a pattern over the names of files."""

import csv
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import TypeVar

from sigdb.core import InputError, suggestion, validated
from sigdb.ingest.facts.recording_facts import RecordingFacts

_FIELDS = tuple(RecordingFacts.model_fields)
_FREE = ("number", "_")
"""Fields of a pattern that are no facts."""

_LARGEST = 64 * 2**20
"""Largest table, bytes."""

F = TypeVar("F", bound=RecordingFacts)


def read_table(
    path: Path, section: type[F], *, needed: str | None = None, wanted: Callable[[str], bool] = lambda _: True
) -> list[F]:
    """Return the lines of a CSV file with a header; columns whose names begin with _ are left out.

    Parameters
    ----------
    path
        The file, text in UTF-8 with commas, semicolons or tabs.
    section
        The facts that a line holds.
    needed
        A column that the file must have.
    wanted
        Whether a line is read, by its text in the needed column.

    Raises
    ------
    InputError
        Names the file, the line, the column and what to do.
    """
    if path.stat().st_size > _LARGEST:
        raise InputError(f"{path}: larger than {_LARGEST} bytes, so no table of recordings")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text in UTF-8 (byte {error.start}); write it again as CSV in UTF-8") from None
    if not text.strip():
        raise InputError(f"{path}: is empty; write a line with the names of the columns, and one for each recording")
    head = text.partition("\n")[0]
    separator = max(",;\t", key=head.count)
    try:
        header, *lines = csv.reader(text.splitlines(), delimiter=separator, strict=True)
    except (csv.Error, ValueError) as error:
        raise InputError(f"{path}: is no table with a header ({error}); write it as CSV") from None
    names = [name.strip() for name in header]
    _check_names(names, section, needed, path)
    results, at = [], names.index(needed) if needed else 0
    for number, line in enumerate(lines, start=2):
        if len(line) > len(names):
            raise InputError(f"{path}: line {number} has {len(line)} values, the header has {len(names)} columns")
        if any(text.strip() for text in line) and wanted(line[at].strip() if at < len(line) else ""):
            results.append(facts_of(dict(zip(names, line, strict=False)), section, owner=f"{path}: line {number}"))
    return results


def _check_names(names: Sequence[str], section: type[RecordingFacts], needed: str | None, path: Path) -> None:
    if needed and needed not in names:
        raise InputError(
            f"{path}: has no column {needed}{suggestion(needed, names)}; name the columns in the first line"
        )
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: column {name!r} stands twice")
        if name not in section.model_fields and not name.startswith("_"):
            raise InputError(
                f"{path}: column {name!r} is no fact of a recording{suggestion(name, section.model_fields)}; a column "
                "whose name begins with _ is left out"
            )


def facts_of(values: Mapping[str, str], section: type[F], *, owner: str) -> F:
    """Return facts from texts; an empty text is left out, and so is 'unknown' where a number is due.

    Raises
    ------
    InputError
        If a value is none of its column.
    """
    stated: dict[str, object] = {}
    for name, text in values.items():
        text = text.strip()
        annotation = str(section.model_fields[name].annotation) if name in section.model_fields else ""
        is_text = "str" in annotation or "Literal" in annotation
        if text and not name.startswith("_") and (is_text or text.lower() != "unknown"):
            stated[name] = text if is_text else _number(text)
    return validated(section, stated, owner=owner)


def _number(text: str) -> object:
    """Return a number, whole where it is written so; a text with a unit stays."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def pattern_expression(pattern: str) -> re.Pattern[str]:
    """Return the regular expression of a pattern such as ``{state}_{load}Nm_{number}.csv``.

    A field stands for one or more characters, as few as fit, within a folder's or a file's name. ``{number}`` and
    ``{_}`` are left out, and ``*`` stands for anything.

    Raises
    ------
    InputError
        If a field is no fact of a recording or stands twice.
    """
    pieces, seen = [], set()
    for text, field in re.findall(r"([^{}]*)(?:\{([^{}]*)\})?", pattern):
        pieces.append(".*".join(re.escape(part) for part in text.split("*")))
        if not field:
            continue
        if field not in _FREE and (field not in _FIELDS or field == "file"):
            raise InputError(f"pattern {pattern!r}: {{{field}}} is no fact of a recording{suggestion(field, _FIELDS)}")
        if field in seen and field not in _FREE:
            raise InputError(f"pattern {pattern!r}: {{{field}}} stands twice")
        seen.add(field)
        pieces.append("[^/]+?" if field in _FREE else f"(?P<{field}>[^/]+?)")
    return re.compile("".join(pieces))


def facts_by_pattern(names: Iterable[str], pattern: str) -> list[RecordingFacts]:
    """Return the facts in the names of those files that a pattern fits.

    A pattern without a slash is compared with the file's name alone, another with its path below the folder.
    """
    expression, results = pattern_expression(pattern), []
    for name in names:
        match = expression.fullmatch(name if "/" in pattern else PurePosixPath(name).name)
        if match is not None:
            owner = f"{name} by the pattern {pattern!r}"
            results.append(facts_of({**match.groupdict(), "file": name}, RecordingFacts, owner=owner))
    return results
