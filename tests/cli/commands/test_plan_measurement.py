"""``sigdb plan-measurement``: a table, JSON, a page, and errors in a line."""

import json

import pytest
from click.testing import CliRunner

from sigdb.cli.main import cli

POINT = ["nasa-spiral-bevel", "--speed", "14400", "--torque", "356", "--sensor", "pinion-vertical", "--draws", "200"]


def test_a_plan_is_printed_and_written(tmp_path):
    words = ["plan-measurement", *POINT, "--averages", "102", "--known-tooth", "--snr-db", "0", "--format", "json"]
    done = CliRunner().invoke(cli, [*words, "--out", str(tmp_path)], catch_exceptions=False)
    assert done.exit_code == 0
    printed = json.loads(done.stdout)
    assert printed == json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))
    assert printed["settings"]["tooth"] == "known"
    assert [row["averages"] for row in printed["table"]] == [102]
    assert (tmp_path / "index.html").is_file()


@pytest.mark.parametrize("noise", ["pinion-vertical", "=3", "pinion-vertical=loud"])
def test_a_noise_that_is_no_pair_is_refused(noise):
    done = CliRunner().invoke(cli, ["plan-measurement", *POINT, "--noise", noise])
    assert done.exit_code == 2
    assert "is not of the form SENSOR=NUMBER" in done.output
