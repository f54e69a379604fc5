"""Unit: what ``sigdb coverage`` and ``sigdb refine`` print, write and leave with."""

import json
import shutil

import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli


@pytest.fixture
def copy(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("SIGDB_CACHE", str(tmp_path / "cache"))
    return shutil.copytree(folder / "signatures", tmp_path / "signatures")


def strict(text):
    """JSON without NaN and infinity, which it does not know."""

    def refuse(name):
        raise ValueError(name)

    return json.loads(text, parse_constant=refuse)


def test_coverage_as_json_is_what_is_stored(invoke, copy):
    printed = strict(invoke("coverage", copy, "--cases", 6, "--jobs", 1, "--format", "json").stdout)
    stored = json.loads((copy / "coverage.json").read_text())
    assert printed["threshold"] == stored["threshold"]
    assert printed["sensor"] == "pinion-vertical"
    assert (printed["cases"], printed["failed"], printed["seed"]) == (6, 0, 5)
    assert {one["axis"] for one in printed["coarse"]} == {"stiffness_loss", "phase_shift_deg"}
    assert sum(one["cases"] for one in printed["coarse"]) == 12


def test_coverage_as_text_and_picture(invoke, copy, tmp_path):
    result = invoke("coverage", copy, "--cases", 6, "--jobs", 1, "--seed", 9, "--out", tmp_path / "a" / "match.png")
    first, *lines, last = result.stdout.splitlines()
    assert first == f"{copy}: 6 random cases between its own, sensor pinion-vertical"
    assert any(line.startswith("threshold of 'outside the database': a residual distance of") for line in lines)
    assert last == f"{tmp_path / 'a' / 'match.png'}: the match of 6 cases"
    assert (tmp_path / "a" / "match.png").read_bytes().startswith(b"\x89PNG")


def test_progress_names_what_is_counted(copy, invoke):
    err = invoke("coverage", copy, "--cases", 6, "--jobs", 1).stderr
    for stage in ("off-grid templates: 7 of 7", "off-grid cases: 6 of 6", "measured rows: 28 of 28"):
        assert stage in err


def test_refine_tells_whether_the_match_was_reached(copy):
    def refine(*arguments):
        return CliRunner().invoke(cli, ["refine", str(copy), "--jobs", "1", *arguments], standalone_mode=False)

    far = refine("--match", "0.999999", "--cases", "4", "--rounds", "1", "--format", "json")
    told = strict(far.stdout)
    assert (far.return_value, told["reached"], told["rounds"]) == (1, False, 1)
    database = sigdb.open(copy)
    assert told["rows"] == database.manifest.extensions[0].rows
    assert told["cases"] == database.manifest.extensions[0].templates - 1
    near = refine("--match", "0.5", "--cases", "4")
    assert near.return_value == 0
    assert f"{copy}: appended 0 cases, 0 rows; a match of 0.5 is reached" in near.stdout
