"""The pages on recordings are complete: formats, extras, settings, and messages as the code writes them."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

from sigdb.recording.files.kinds import KINDS

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "guide"
READS = (GUIDE / "recordings.md").read_text(encoding="utf-8")
REFUSED = (GUIDE / "refused_recordings.md").read_text(encoding="utf-8")
FOLDERS = [ROOT / "sigdb" / name for name in ("recording", "diagnosis")]
SHORTEST = 7
"""Shortest fixed words of a message that are looked for."""


def _cells(table, column):
    rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ")]
    return [row[column].strip("| ") for row in rows[1:]]


def _formats():
    return READS.split("## Formats", 1)[1].split("\n\n", 2)[1]


def _quoted(cells):
    return [code for cell in cells for code in re.findall(r"`([^`]+)`", cell)]


def _words(node):
    """Text of a string with a zero byte for each value in it; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "\0" for part in node.values)
    return None


@cache
def _strings():
    """All strings of the code but docstrings, one a line."""
    paths = [path for folder in FOLDERS for path in folder.rglob("*.py")]
    nodes = [node for path in paths for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    texts = (_words(node) for node in nodes if id(node) not in docstrings)
    return "\n".join(text.replace("\n", " ") for text in texts if text)


MESSAGES = _quoted(cell for line in REFUSED.splitlines() if line.startswith("| `") for cell in [line.split(" | ")[0]])


def test_the_table_names_every_suffix():
    named = set(_quoted(_cells(_formats(), 1)))
    assert named == {suffix for kind in KINDS for suffix in kind.suffixes} | {".zip"}


def test_the_table_names_every_library_that_readers_need():
    needed = set(re.findall(r"which needs (\w+), which is not installed: pip install \1$", _strings(), re.MULTILINE))
    named = {code for code in _quoted(_cells(_formats(), 2)) if not code.startswith(".")}
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert named == needed
    assert needed <= {re.match(r"\w+", library)[0] for libraries in extras.values() for library in libraries}


def test_the_settings_are_on_the_page():
    assert "```{fields} sigdb.recording.files.settings.RecordingSettings" in READS


@pytest.mark.parametrize("message", MESSAGES)
def test_a_quoted_message_is_one_of_the_code(message):
    parts = [part for part in message.split("...") if part.strip(" ,;:")]
    assert max(map(len, parts)) >= SHORTEST
    assert re.search("[^\n]*".join(re.escape(part) for part in parts), _strings()), message


def test_messages_are_quoted_once():
    assert len(MESSAGES) > 50
    assert sorted(set(MESSAGES)) == sorted(MESSAGES)
