"""Every Python example that is shown runs: those of the pages in order, and those of the docstrings."""

import doctest
import importlib
import inspect
import pkgutil
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^```python[ \t]*\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
RUN = {
    "README.md": ("query", "card", "modes"),
    "docs/guide/getting_started.md": ("query",),
    "docs/guide/diagnosis.md": ("signature",),
}
"""Commands of pages that are run too; tests/docs/test_commands.py parses all of them."""


def _blocks(path):
    """Python blocks of a page with the number of the line before each."""
    text = path.read_text(encoding="utf-8")
    return [(text[: match.start(1)].count("\n"), match.group(1)) for match in FENCE.finditer(text)]


def _pages():
    everything = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    ours = [path for path in everything if not {"_build", "generated"} & set(path.relative_to(ROOT).parts)]
    return [path for path in ours if _blocks(path)]


def _modules():
    found = pkgutil.walk_packages(sigdb.__path__, "sigdb.")
    names = ["sigdb", *(module.name for module in found if not module.name.endswith("__main__"))]
    return [name for name in names if ">>>" in inspect.getsource(importlib.import_module(name))]


@pytest.mark.parametrize("page", _pages(), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_examples_of_a_page_run_in_order(page, reader):
    names = {"__name__": "__main__"}
    for line, source in _blocks(page):
        # Empty lines in front: a traceback then names the line of the page.
        exec(compile("\n" * line + source, str(page), "exec"), names)
    # Commands of the page that are quick, with the files that its examples have made.
    for command in RUN.get(page.relative_to(ROOT).as_posix(), ()):
        (line,) = re.findall(rf"^sigdb {command} .*$", page.read_text(encoding="utf-8"), re.MULTILINE)
        done = CliRunner().invoke(cli, shlex.split(line, comments=True)[1:], catch_exceptions=False)
        assert done.exit_code == 0, done.output


@pytest.mark.parametrize("name", _modules())
def test_examples_of_docstrings_give_what_they_show(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted > 0
    assert results.failed == 0


def test_there_are_pages_with_examples():
    assert ROOT / "docs" / "guide" / "getting_started.md" in _pages()
