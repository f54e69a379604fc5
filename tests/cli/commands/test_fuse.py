"""``sigdb fuse``: one answer of each machine, by the database's templates and by a model."""

import csv
import io
import json

import pytest


def test_machines_of_a_database_have_one_answer_each(invoke, folder):
    result = invoke("fuse", folder / "signatures", "--format", "csv")
    machines = list(csv.DictReader(io.StringIO(result.stdout)))
    assert len(machines) == 3 * (1 + 3 * 4)
    assert {row["averages"] for row in machines if row["tooth"] == "0"} == {"10"}
    assert result.stderr.startswith("right in 1.000 [0.9")
    assert "of 39 machines, by the best possible rule" in result.stderr


def test_a_model_answers_machines_that_columns_name(invoke, folder):
    result = invoke(
        "fuse", folder / "signatures", "--model", folder / "location", "--by", "specimen,tooth",
        "--where", "tooth = 6", "--format", "json",
    )  # fmt: skip
    machines = json.loads(result.stdout)
    assert [row["averages"] for row in machines] == [4, 4, 4]
    assert {row["tooth"] for row in machines} == {6}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--over", "channels"], "over = 'channels' is no source of averages"),
        (["--where", "tooth = 99"], "has no row with a result where tooth = 99"),
        (["--by", "specimen"], "--by is for models"),
        (["--model", "location", "--sensor", "x"], "--sensor and --over are for the database's own templates"),
        (["--model", "location", "--by", "serial"], "by = 'serial' is no column of the rows"),
    ],
)
def test_what_cannot_be_fused_is_one_line(leave, folder, options, says):
    options = [folder / "location" if option == "location" else option for option in options]
    code, _, error = leave("fuse", folder / "signatures", *options)
    assert code == 2
    assert says in error
    assert len(error.splitlines()) == 1
