"""Every command that pages and help show is one: its options exist and take these values."""

import re
import shlex
from pathlib import Path

import click
import pytest

from sigdb.cli.main import cli
from sigdb.cli.options import places

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^```(?:text)?[ \t]*\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
OTHER = re.compile(r"^```(?:\w|\{).*?^```[ \t]*$", re.MULTILINE | re.DOTALL)
GROUP = click.Context(cli, info_name="sigdb", **cli.context_settings | {"max_content_width": 80})
COMMANDS = cli.list_commands(GROUP)


def _shown():
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        if not {"_build", "generated"} & set(path.relative_to(ROOT).parts):
            text = re.sub(r"^```text", "```", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
            blocks = [block for found in FENCE.finditer(OTHER.sub("", text)) for block in found[1].splitlines()]
            yield from ((path.relative_to(ROOT).as_posix(), line) for line in blocks)


def _help(name):
    return click.Context(cli.get_command(GROUP, name), info_name=name, parent=GROUP).get_help()


def _examples(name):
    lines = _help(name).partition("Example:\n")[2].splitlines()
    return [line.strip() for line in lines if line.startswith("    sigdb ")]


def _parse(line):
    words = shlex.split(line, comments=True)
    words = ["sweep", *words[3:]] if words[:3] == ["python", "-m", "sigdb.sweep"] else words[1:]
    cli.make_context("sigdb", words)
    cli.get_command(GROUP, words[0]).make_context(words[0], words[1:], parent=GROUP)


LINES = [(page, line) for page, line in _shown() if re.match(r"sigdb [a-z]|python -m sigdb", line)]


@pytest.fixture(autouse=True)
def any_place(monkeypatch):
    monkeypatch.setattr(places, "check_exists", lambda path: None)
    monkeypatch.setattr(places, "check_database", lambda folder: None)


@pytest.mark.parametrize(("page", "line"), LINES, ids=lambda text: text)
def test_a_shown_command_can_be_run(page, line):
    _parse(line)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_has_an_example_that_can_be_pasted(name):
    examples = _examples(name)
    assert examples
    for line in examples:
        assert line.startswith(f"sigdb {name} ")
        _parse(line)


def test_pages_show_commands():
    assert len(LINES) > 30
    with pytest.raises(click.UsageError):
        _parse("sigdb show DB 0 --colour red")
