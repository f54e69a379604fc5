"""The choices of ``sigdb train`` are the targets, learners and splits that there are."""

from typing import get_args

import pytest
from click.testing import CliRunner

from sigdb import database, recognition
from sigdb.cli.main import cli
from sigdb.recognition.settings import SplitName, Target


@pytest.mark.parametrize(
    ("option", "package", "table"),
    [
        ("target", recognition, "TARGET_NAMES"),
        ("learner", recognition, "LEARNERS"),
        ("split", database, "SPLIT_NAMES"),
    ],
)
def test_choices_are_read_when_they_are_needed(monkeypatch, option, package, table):
    monkeypatch.setattr(package, table, (*getattr(package, table), "another"), raising=False)
    text = CliRunner().invoke(cli, ["train", "--help"]).output
    assert f"[{'|'.join(getattr(package, table))}]" in "".join(text.split())
    refused = CliRunner().invoke(cli, ["train", "db", "--target", "location", "--out", "o", f"--{option}", "none"])
    assert refused.exit_code == 2
    assert "another" in refused.output


def test_recipes_take_the_same_targets_and_splits():
    assert set(get_args(Target)) == set(recognition.TARGETS)
    assert set(get_args(SplitName)) == set(database.SPLITS)
