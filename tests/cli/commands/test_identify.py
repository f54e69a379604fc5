"""``sigdb identify``: a small search, and errors in a line."""

import json

import pytest
from click.testing import CliRunner

from sigdb.cli.main import cli
from sigdb.transmission import load_transmission

TARGETS = "[[modes]]\nfrequency_hz = 13.59\nrelative_error = 0.01\n"


@pytest.fixture
def rotor(tmp_path):
    text = load_transmission("friswell-5.9.1").to_toml()
    text = text.replace("stiffness.2", "stiffness.1").replace("low = 10000000.0", "low = 5e5")
    text = text.replace("high = 1000000000.0", "high = 2e6")
    (tmp_path / "rotor.toml").write_text(text, encoding="utf-8")
    (tmp_path / "targets.toml").write_text(TARGETS, encoding="utf-8")
    return [str(tmp_path / name) for name in ("rotor.toml", "targets.toml")]


def test_a_search_writes_its_rigs_and_prints_its_tables(rotor, tmp_path):
    words = ["identify", *rotor, "--out", str(tmp_path / "out"), "--members", "2", "--format", "json"]
    done = CliRunner().invoke(cli, words, catch_exceptions=False)
    assert done.exit_code == 0
    printed = json.loads(done.stdout)
    assert printed == json.loads((tmp_path / "out" / "identification.json").read_text(encoding="utf-8"))
    assert [row["number"] for row in printed["posterior"]] == ["bearings.left.stiffness.1"]
    assert all(row["meets_targets"] for row in printed["members"])
    assert len(list((tmp_path / "out" / "members").glob("*.toml"))) == 2
