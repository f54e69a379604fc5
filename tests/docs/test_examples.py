"""Every example that is shown runs: the Python of pages in order, their commands, and the docstrings.

Commands that take minutes are parsed: their options exist and take these values. So are the examples of help texts.
"""

import doctest
import importlib
import inspect
import pkgutil
import re
import shlex
import shutil
from itertools import pairwise
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.cli.options import places

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^```python[ \t]*\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)


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


@pytest.mark.parametrize("name", _modules())
def test_examples_of_docstrings_give_what_they_show(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted > 0
    assert results.failed == 0


def test_the_commands_of_the_how_to_answer_as_it_shows(reader):
    page = ROOT / "docs" / "guide" / "two_recordings.md"
    for _, source in _blocks(page):
        exec(compile(source, str(page), "exec"), {})
    lines = [line for name, line in LINES if name == "docs/guide/two_recordings.md"]
    words = [shlex.split(line.partition(" --out")[0])[1:] for line in lines]
    done = [CliRunner().invoke(cli, each, catch_exceptions=False, standalone_mode=False) for each in words]
    assert [each.return_value for each in done] == [None, 1]
    shown = "One tooth stands out: 10 \u00b1 2."
    assert shown in page.read_text(encoding="utf-8")
    assert shown in " ".join(done[1].output.split())


def test_there_are_pages_with_examples():
    assert ROOT / "docs" / "guide" / "getting_started.md" in _pages()


TEXT_FENCE = re.compile(r"^```(?:text)?[ \t]*\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
OTHER_FENCE = re.compile(r"^```(?:\w|\{).*?^```[ \t]*$", re.MULTILINE | re.DOTALL)
GROUP = click.Context(cli, info_name="sigdb", **cli.context_settings | {"max_content_width": 80})
COMMANDS = cli.list_commands(GROUP)


def _shown():
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        if not {"_build", "generated"} & set(path.relative_to(ROOT).parts):
            text = re.sub(r"^```text", "```", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
            blocks = [
                block for found in TEXT_FENCE.finditer(OTHER_FENCE.sub("", text)) for block in found[1].splitlines()
            ]
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

NOT_RUN = {
    "sigdb explore": "serves a page until it is interrupted; other tests do that",
    "python -m sigdb.sweep pipelines/": "simulates for minutes",
    "python -m sigdb.sweep RECIPE --out s3://": "needs an object store",
    "sigdb query s3://": "needs an object store",
    "sigdb run pipelines/": "simulates and trains for minutes",
    "sigdb sweep pipelines/quick.toml --out DB --job": "the tests of jobs run them",
    "sigdb coverage ": "simulates 200 cases",
    "sigdb refine ": "simulates hundreds of cases",
    "sigdb train data/quick/signatures --target location --out data/quick/location": "the model that others evaluate",
    "sigdb evaluate data/quick/location data/quick/signatures --report": "the page is drawn in the tests of reports",
    "sigdb show data/quick/signatures 0 2925  ": "the same with --out runs",
    "sigdb signature new.csv ": "runs after the example in Python on the same page",
    "sigdb identify ": "the example in Python on the same page searches",
    "sigdb add-features data/quick/signatures shape:crest": "the example in Python on the same page computes them",
    'sigdb query data/quick/signatures "select tooth, avg(pass_crest)': "the columns are of the example on the page",
    "sigdb train data/quick/signatures --target detection --learner lda --column": "trains for seconds",
    "sigdb add-features signatures series:tsfresh_features": "needs tsfresh",
    "sigdb evaluate model bench.db ": "other tests evaluate a model on a database of recordings",
    "sigdb diagnose slow.csv ": "other tests diagnose several channels and speeds",
    "sigdb sweep cracks.toml ": "the tests of sizes make a database of cracks",
    "sigdb train cracks ": "the tests of sizes train on a database of cracks",
    "sigdb assess crack-depth ": "the tests of sizes answer rows of cracks",
    "sigdb diagnose run.csv ": "the example in Python on the same page makes this diagnosis",
}
"""Beginnings of commands of pages that are parsed only, each with the reason."""

WITHOUT_PAGE = (
    "sigdb signature run.csv --sampling-rate 12800",
    "sigdb signature run.csv --teeth 32",
    "sigdb describe ",
)
"""Beginnings of commands that run without --out: drawing takes seconds, and other tests draw these pages."""

HERE = {"DB": "data/quick/signatures", "signatures": "data/quick/signatures", "2925": "25"}
"""Words of pages, and what stands for them beside the small database: other folders, and a row that it has."""


@pytest.fixture
def any_place(monkeypatch):
    monkeypatch.setattr(places, "check_exists", lambda path: None)
    monkeypatch.setattr(places, "check_database", lambda folder: None)


def _not_run(line):
    return [beginning for beginning in NOT_RUN if line.startswith(beginning)]


RUN = [line for line in dict.fromkeys(line for _, line in LINES) if not _not_run(line)]


@pytest.mark.usefixtures("any_place")
@pytest.mark.parametrize(
    ("page", "line"), [(page, line) for page, line in LINES if _not_run(line)], ids=lambda text: text
)
def test_a_shown_command_can_be_parsed(page, line):
    _parse(line)


@pytest.fixture(scope="module")
def workplace(made, tmp_path_factory):
    """A copy of the reader's folder, in which one command may use what another wrote, with an average in a file."""
    folder = shutil.copytree(made, tmp_path_factory.mktemp("commands") / "reader")
    np.savetxt(folder / "average.txt", sigdb.open(folder / HERE["DB"]).signals([25])["tsa"][0])
    return folder


def _write_recording(path, words):
    """Write 40 revolutions of a mesh with noise and a tacho, of the gear and at the rate that a command names."""
    options = dict(pairwise(words))
    teeth, turns = int(options.get("--teeth", 0)), 20.0
    if "--rig" in options:
        rig = sigdb.load_transmission(options["--rig"])
        gear = rig.gears[options.get("--gear", next(iter(rig.gears)))]
        teeth, turns = gear.teeth, rig.operating.speed_rpm / 60
    rate = float(options.get("--sampling-rate", 20000))
    t = np.arange(int(40 * rate / turns)) / rate
    signal = np.cos(2 * np.pi * teeth * turns * t) + 0.1 * np.random.default_rng(0).standard_normal(t.size)
    columns = {"acceleration": signal, "tacho": (turns * t % 1 < 0.05).astype(float)}
    if "--sampling-rate" not in options:
        columns = {"time": t} | columns
    np.savetxt(path, np.column_stack(list(columns.values())), "%.8g", ",", header=",".join(columns), comments="")


@pytest.mark.parametrize("line", RUN, ids=lambda text: text)
def test_a_shown_command_runs(line, workplace, monkeypatch):
    monkeypatch.chdir(workplace)
    words = [HERE.get(word, word) for word in shlex.split(line, comments=True)[1:]]
    if line.startswith(WITHOUT_PAGE):
        del words[words.index("--out") :]
    if "run.csv" in words:
        _write_recording(workplace / "run.csv", words)
    done = CliRunner().invoke(cli, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    written = dict(pairwise(words)).get("--out") or (words[-1] if words[0] == "new-rig" else None)
    assert written is None or Path(written).exists()


def test_what_is_not_run_is_shown():
    assert [beginning for beginning in NOT_RUN if not any(line.startswith(beginning) for _, line in LINES)] == []


@pytest.mark.usefixtures("any_place")
@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_has_an_example_that_can_be_pasted(name):
    examples = _examples(name)
    assert examples
    for line in examples:
        assert line.startswith(f"sigdb {name} ")
        _parse(line)


@pytest.mark.usefixtures("any_place")
def test_pages_show_commands():
    assert len(LINES) > 30
    assert len(RUN) > 18
    with pytest.raises(click.UsageError):
        _parse("sigdb show DB 0 --colour red")
