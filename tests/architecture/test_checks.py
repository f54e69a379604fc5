"""The checks of names, prose, the tree and built pages find what they are to find."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

CHECKS = Path(__file__).parents[1] / "checks"

CLEAN = '''"""Averages of signals."""


def average(signal, weights):
    """Return the weighted average of a signal."""
    if not weights:
        raise ValueError("weights are empty; give at least one")
    total = sum(x * w for x, w in zip(signal, weights))
    return total / sum(weights)
'''


def findings(check, folder, *options):
    done = subprocess.run(
        [sys.executable, CHECKS / check, "--root", folder, *options], capture_output=True, text=True, check=False
    )
    assert done.returncode == bool(done.stdout.strip()) or options, done.stderr
    return done.stdout.splitlines()


@pytest.fixture
def tree(tmp_path):
    """A tree with a package and a page without offences."""
    (tmp_path / "sigdb" / "signal").mkdir(parents=True)
    (tmp_path / "docs").mkdir()
    (tmp_path / "sigdb" / "signal" / "averages.py").write_text(CLEAN)
    (tmp_path / "docs" / "page.md").write_text("# What comes out\n\nWhat does it mean? The average of a signal.\n")
    return tmp_path


def test_clean_prose_passes(tree):
    assert findings("prose.py", tree) == []


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        ("total", "found", "averages.py:8: name: found"),
        ("signal, weights", "signal, asked_weights", "averages.py:4: name: asked_weights"),
        ("Return the weighted average", "Of a signal, the average", "averages.py:5: opening: Of a signal"),
        ("Return the weighted average", "What the average of a signal is", "averages.py:5: opening: What the"),
        ("Averages of signals", "Averages beside signals", "averages.py:1: word 'beside': Averages"),
        ("Averages of signals", "Averages" + " of signals" * 23, "averages.py:1: 47 words in a sentence: Averages"),
        ("weights are empty", "no weights were told", "averages.py:7: word 'told': no weights"),
    ],
)
def test_offences_of_the_source_are_found(tree, before, after, found):
    path = tree / "sigdb" / "signal" / "averages.py"
    path.write_text(CLEAN.replace(before, after))
    assert any(found in line for line in findings("prose.py", tree))


@pytest.mark.parametrize(
    ("text", "offends"),
    [
        ("What it keeps of a signal is its mean.", True),
        ("Of a signal the mean is kept.", True),
        ("A row | that was told", True),
        ("The mean " + "and the mean " * 15 + "is kept.", True),
        ("The mean " + "and the mean " * 13 + "is kept. The rest is not.", False),
        ("```\n" + "and the mean " * 20 + "\n```", False),
        ("`told` is a column.", False),
        ("```\nOf code nothing is read.\n```", False),
    ],
)
def test_offences_of_a_page_are_found(tree, text, offends):
    (tree / "docs" / "page.md").write_text(f"# Page\n\n{text}\n")
    assert bool(findings("prose.py", tree)) == offends


def test_the_longest_sentences_come_first(tree):
    first = findings("prose.py", tree, "--longest", "2")[0]
    assert first.split()[:2] == ["7", "words"]


@pytest.mark.parametrize(
    ("name", "source", "found"),
    [
        ("signal/mean.py", CLEAN + "\n" * 80, "no name that it defines has a word of its own name"),
        ("signal/utils.py", CLEAN + "\n" * 80, "a vague name"),
        ("signal/average_of_rows.py", CLEAN, "5 code lines"),
        ("signal/average_of_rows.py", CLEAN + "\n" * 400, "lines, at most 400"),
        ("other/averages.py", "from sigdb.signal.averages import average\n" + CLEAN, "past the face of sigdb.signal"),
    ],
)
def test_offences_of_the_tree_are_found(tree, name, source, found):
    path = tree / "sigdb" / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(source)
    assert any(line.startswith(f"sigdb/{name}") and found in line for line in findings("tree.py", tree))


def test_a_large_folder_is_found(tree):
    for number in range(13):
        (tree / "sigdb" / "signal" / f"average_{number}.py").write_text(CLEAN)
    assert "sigdb/signal: 14 modules, at most 12" in findings("tree.py", tree)


@pytest.mark.parametrize(
    ("head", "found"),
    [
        ('<script src="_static/tex-svg.js?v=1"></script><a href="https://doi.org/10.1115/1.1758252">paper</a>', []),
        ('<script src="https://cdn.example/mathjax.js"></script>', ["loads https://cdn.example/mathjax.js"]),
        ('<link rel="stylesheet" href="//fonts.example/a.css">', ["loads //fonts.example/a.css"]),
        ('<img src="lost.png">', ["loads lost.png, which is not there"]),
        ("<style>@import url('https://fonts.example/b.css');</style>", ["loads https://fonts.example/b.css"]),
    ],
)
def test_pages_that_need_a_network_are_found(tmp_path, head, found):
    (tmp_path / "_static").mkdir()
    (tmp_path / "_static" / "tex-svg.js").write_text("")
    (tmp_path / "index.html").write_text(f"<html><head>{head}</head></html>")
    assert list(runpy.run_path(CHECKS / "offline.py")["findings"](tmp_path)) == [f"index.html: {one}" for one in found]
