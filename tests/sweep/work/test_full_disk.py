"""Unit: a file that cannot be written ends the sweep with a sentence; finished parts stay, and the sweep goes on."""

import shutil
import subprocess
import sys

import pytest

import sigdb
from sigdb.core.errors import DatabaseError
from sigdb.sweep import run

LIMITED = """
import resource, sys
from sigdb.cli.main import main
from sigdb.cli.commands.sweep import sweep
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
sys.argv = ["sigdb.sweep", *sys.argv[2:]]
main(sweep, "python -m sigdb.sweep")
"""


@pytest.fixture
def copy(parts_folder, tmp_path):
    return shutil.copytree(parts_folder, tmp_path / "copy")


def test_no_room_for_a_part(copy, recipe_of, parts_text, parts_plan, parts_folder, digests):
    """The operating system refuses files of more than half a megabyte, in worker processes."""
    for part in (0, 1):
        (copy / "receipts" / f"rows-{part:05d}.json").unlink()
    shutil.rmtree(copy / "templates")
    (copy / "receipts" / "templates-00000.json").unlink()
    place = [str(recipe_of(parts_text).path), "--out", str(copy), "--jobs", "2"]
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, "500000", *place], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 3, done.stderr
    (sentence,) = (line for line in done.stderr.splitlines() if "error" in line)
    assert sentence.startswith(f"python -m sigdb.sweep: error: {copy}/")
    assert sentence.endswith(
        ".parquet: cannot be written (File too large); nothing that is finished is lost; make room or give the right "
        "to write, then run the same command again"
    )
    assert "Traceback" not in done.stderr
    # The templates had room; the part of rows that was there is there.
    assert (copy / "receipts" / "templates-00000.json").exists()
    database = sigdb.open(copy)
    assert database.cases()["id"].tolist() == list(range(4096, 5060))
    assert not list(copy.rglob("*.tmp"))
    assert not (copy / ".owner").exists()
    assert run(parts_plan, copy, recipe=parts_text, jobs=1).new_rows == 4096
    assert digests(copy) == digests(parts_folder)


@pytest.fixture(scope="module")
def few(plan_of, digests, tmp_path_factory):
    """A plan of few rows, and the files of its database."""
    plan = plan_of("[[sweep.grid]]\ntooth = 2\nstiffness_loss = 0.4\n[signature]\nsamples_per_tooth = 32\n")
    folder = tmp_path_factory.mktemp("few") / "signatures"
    run(plan, folder, jobs=1)
    return plan, digests(folder)


@pytest.mark.parametrize("name", ["features", "signals", "receipts", "templates"])
def test_a_file_where_a_folder_should_be(few, digests, tmp_path, name):
    """As where writing is not allowed; the administrator may write anywhere, so that permissions do not tell here."""
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_bytes(b"")
    with pytest.raises(DatabaseError, match=rf"{name}.*:? cannot be \w+ \(.*(File exists|Not a directory)\)"):
        run(few[0], out, jobs=1)
    (out / name).unlink()
    run(few[0], out, jobs=1)
    assert digests(out) == few[1]
