"""Unit: ``sigdb add-features`` prints what it computed, and ends with 1 where the function has failed."""

import json
import shutil

import pytest

MODULE = '''
def crest(tsa):
    """Crest factor."""
    return {"crest": abs(tsa).max() / tsa.std()}

def picky(tsa):
    return {"inverse": 1 / (int(tsa.argmax()) % 2)}
'''


@pytest.fixture
def place(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cli_shapes.py").write_text(MODULE, encoding="utf-8")
    shutil.copytree(folder / "signatures", tmp_path / "DB")
    return tmp_path


def test_columns_are_added_queried_and_removed(place, leave):
    code, out, _ = leave("add-features", "DB", "cli_shapes:crest", "--jobs", "1")
    assert (code, out) == (0, "DB: crest, crest_status of 66 rows, 66 of them computed now\n")
    code, out, _ = leave("query", "DB", "select count(*) as n from cases where crest > 1", "--format", "csv")
    assert (code, out.split()) == (0, ["n", "66"])
    code, out, _ = leave("add-features", "DB", "cli_shapes:crest", "--jobs", "1", "--format", "json")
    facts = {"columns": ["crest", "crest_status"], "new_rows": 0, "rows": 66, "failed": 0, "reasons": []}
    assert (code, json.loads(out)) == (0, facts)
    assert leave("add-features", "DB", "cli_shapes:crest", "--remove", "--replace")[0] == 2
    code, out, _ = leave("add-features", "DB", "cli_shapes:crest", "--remove")
    assert (code, out) == (0, "DB: removed crest, crest_status\n")


def test_rows_without_numbers_end_with_1_and_their_reasons(place, leave):
    code, out, err = leave("add-features", "DB", "cli_shapes:picky", "--jobs", "1")
    assert code == 1
    assert "rows without numbers: ZeroDivisionError: division by zero" in out
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("function", "says"),
    [("cli_shapes:crost", "has no crost; did you mean 'crest'?"), ("cli_shapes", "give MODULE:FUNCTION")],
)
def test_an_error_is_one_line(place, leave, function, says):
    code, out, err = leave("add-features", "DB", function)
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1
