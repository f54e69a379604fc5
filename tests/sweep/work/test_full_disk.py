"""Unit: a file that cannot be written ends the sweep with a sentence; finished parts stay, and the sweep goes on."""

import resource
import shutil
from contextlib import contextmanager

import pytest

import sigdb
from sigdb.core.errors import DatabaseError
from sigdb.sweep import run


@pytest.fixture
def copy(parts_folder, tmp_path):
    return shutil.copytree(parts_folder, tmp_path / "copy")


@contextmanager
def room_for_files_of(size):
    """Let the operating system refuse greater files."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_no_room_for_a_part(copy, parts_text, parts_plan, parts_folder, digests):
    for part in (0, 1):
        (copy / "receipts" / f"rows-{part:05d}.json").unlink()
    shutil.rmtree(copy / "templates")
    (copy / "receipts" / "templates-00000.json").unlink()
    says = (
        r"copy/.*\.parquet: cannot be written \(File too large\); nothing that is finished is lost; make room or give "
        "the right to write, then run the same command again$"
    )
    with room_for_files_of(500_000), pytest.raises(DatabaseError, match=says):
        run(parts_plan, copy, recipe=parts_text, jobs=1)
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
