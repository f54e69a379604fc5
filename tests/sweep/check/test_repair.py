"""Unit: repair makes again what is damaged, bit for bit, and touches nothing else; and the command around it."""

import json
import shutil
import sys

import pytest

import sigdb
from sigdb.cli.main import cli, main
from sigdb.core.errors import CorruptionError, DatabaseError, InputError
from sigdb.database.store.store import Store
from sigdb.sweep import repair, run, verify
from sigdb.sweep.work.ownership import ownership_of


@pytest.fixture
def copy(parts_folder, tmp_path):
    return shutil.copytree(parts_folder, tmp_path / "copy")


@pytest.fixture
def command(monkeypatch, capsys):
    """Run ``sigdb verify``; its exit code, and what it printed."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["sigdb", "verify", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main(cli, "sigdb")
        told = capsys.readouterr()
        assert "Traceback" not in told.err
        return left.value.code or 0, told.out, told.err

    return call


def flipped(path, offset):
    content = bytearray(path.read_bytes())
    content[offset] ^= 1
    path.write_bytes(content)


def test_all_kinds_of_damage_at_once(copy, parts_folder, digests):
    """A flipped bit, a missing file, a damaged receipt, a lost one, a damaged schema and a temporary file."""
    flipped(copy / "templates" / "part-00000.parquet", 5000)
    (copy / "signals" / "part-00000.parquet").unlink()
    flipped(copy / "receipts" / "rows-00001.json", 200)
    (copy / "receipts" / "rows-00002.json").unlink()
    flipped(copy / "schema.json", 1000)
    (copy / "features" / ".part-00001.parquet.1.ab.tmp").write_bytes(b"half")
    done = repair(copy, jobs=1)
    assert {one.file for one in done.before} == {
        "templates/part-00000.parquet",
        "signals/part-00000.parquet",
        "receipts/rows-00001.json",
        "schema.json",
        "features/.part-00001.parquet.1.ab.tmp",
        "",
    }
    assert done.left == ()
    assert digests(copy) == digests(parts_folder)
    for name in ("sigdb.toml", "schema.json"):
        assert (copy / name).read_bytes() == (parts_folder / name).read_bytes()
    assert not list(copy.rglob("*.tmp"))
    assert not (copy / ".owner").exists()
    assert verify(copy, deep=True) == ()


def test_only_damaged_parts_are_made_again(copy):
    before = {path: path.stat().st_mtime_ns for path in copy.rglob("*") if path.is_file()}
    flipped(copy / "features" / "part-00001.parquet", 1000)
    repair(copy, jobs=1)
    after = {path: path.stat().st_mtime_ns for path in copy.rglob("*") if path.is_file() and path.name != ".lock"}
    assert {path.relative_to(copy).as_posix() for path, time in after.items() if before.get(path) != time} == {
        "features/part-00001.parquet",
        "signals/part-00001.parquet",
        "receipts/rows-00001.json",
    }


def test_a_whole_database_is_left_alone(copy):
    before = {path: path.stat().st_mtime_ns for path in copy.rglob("*")}
    done = repair(copy, jobs=1)
    assert (done.before, done.left) == ((), ())
    assert {path: path.stat().st_mtime_ns for path in copy.rglob("*")} == before


def test_foreign_files_stay(copy):
    (copy / "notes.txt").write_text("mine", encoding="utf-8")
    flipped(copy / "features" / "part-00001.parquet", 1000)
    done = repair(copy, jobs=1)
    assert [one.file for one in done.left] == ["notes.txt"]
    assert (copy / "notes.txt").read_text(encoding="utf-8") == "mine"


def test_a_damaged_description_is_written_again_by_a_sweep_and_then_parts_by_a_repair(
    copy, parts_plan, parts_text, parts_folder, digests
):
    flipped(copy / "sigdb.toml", 700)
    flipped(copy / "receipts" / "rows-00001.json", 200)
    flipped(copy / "signals" / "part-00002.parquet", 200)
    before = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    done = repair(copy, jobs=1)
    assert done.left == done.before
    assert "sigdb sweep RECIPE --out" in next(one.remedy for one in done.before if one.file == "sigdb.toml")
    assert {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()} == before
    with pytest.raises(CorruptionError, match=r"rows-00001\.json is damaged .* sigdb verify .* --repair"):
        run(parts_plan, copy, recipe=parts_text, jobs=1)
    assert repair(copy, jobs=1).left == ()
    assert digests(copy) == digests(parts_folder)
    assert (copy / "sigdb.toml").read_bytes() == (parts_folder / "sigdb.toml").read_bytes()


def test_a_repair_that_is_stopped_goes_on(copy, parts_folder, digests):
    """Stopped when the first part has been made: the others are missing, then; nothing that is whole is lost."""
    for part in range(3):
        flipped(copy / "features" / f"part-{part:05d}.parquet", 1000)

    def stop(progress):
        if progress.stage == "rows" and progress.done > progress.before:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        repair(copy, jobs=1, on_progress=stop)
    assert 0 < len(sigdb.open(copy)) < 5060
    assert [one.kind for one in verify(copy)] == ["unfinished"]
    assert repair(copy, jobs=1).left == ()
    assert digests(copy) == digests(parts_folder)


def test_a_repair_owns_the_place(copy):
    flipped(copy / "features" / "part-00001.parquet", 1000)
    with (
        ownership_of(Store.at(copy)),
        pytest.raises(DatabaseError, match=r"a sweep is already running on it \(process"),
    ):
        repair(copy, jobs=1)


def test_another_version_repairs_nothing(copy, monkeypatch):
    import importlib

    flipped(copy / "features" / "part-00001.parquet", 1000)
    monkeypatch.setattr(importlib.import_module("sigdb.sweep.work.describe_database"), "__version__", "99.0.0")
    with pytest.raises(InputError, match=r"was begun with sigdb \S+, this is 99\.0\.0"):
        repair(copy, jobs=1)
    assert (copy / "receipts" / "rows-00001.json").exists()


def test_what_readers_say_of_damage_mends_it(command, copy, parts_folder, digests):
    """The command that a reader's error names is the remedy."""
    flipped(copy / "features" / "part-00001.parquet", 1000)
    with pytest.raises(CorruptionError) as error:
        sigdb.open(copy).dataset("features").to_table()
    remedy = str(error.value).partition("make it again with: sigdb ")[2].split()
    assert remedy == ["verify", str(copy), "--repair"]
    assert command(*remedy[1:], "--jobs", 1)[0] == 0
    assert digests(copy) == digests(parts_folder)


def test_the_command_on_a_whole_database(command, copy):
    assert command(copy)[:2] == (0, f"{copy}: whole\n")
    assert command(copy, "--deep", "--sample", 1)[:2] == (0, f"{copy}: whole\n")
    code, out, _ = command(copy, "--format", "json")
    assert (code, json.loads(out)) == (0, [])


def test_the_command_on_a_damaged_database(command, copy, parts_folder, digests):
    flipped(copy / "features" / "part-00001.parquet", 1000)
    (copy / "notes.txt").write_text("mine", encoding="utf-8")
    code, out, _ = command(copy)
    assert code == 1
    assert out.splitlines() == [
        "foreign: notes.txt: does not belong to this database; move it away or delete it",
        "damage: features/part-00001.parquet: its bytes are not those that were written; "
        "make part 1 of rows again with --repair",
        f"{copy}: 2 found",
    ]
    code, out, _ = command(copy, "--format", "json", "--repair", "--jobs", 1)
    assert code == 1
    assert [(one["file"], one["stage"], one["part"], one["repaired"]) for one in json.loads(out)] == [
        ("notes.txt", None, None, False),
        ("features/part-00001.parquet", "rows", 1, True),
    ]
    (copy / "notes.txt").unlink()
    flipped(copy / "features" / "part-00001.parquet", 1000)
    code, out, _ = command(copy, "--repair", "--jobs", 1)
    assert code == 0
    assert out.splitlines()[0].endswith("its bytes are not those that were written; repaired")
    assert digests(copy) == digests(parts_folder)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere"], "nowhere is not a sigdb database"),
        (["nowhere", "--jobs", "0"], "0; give 1 or more, or -1"),
        (["nowhere", "--sample", "-1"], "--sample"),
        ([], "Missing argument 'DB'"),
    ],
)
def test_bad_input_is_exit_code_2(command, arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = command(*arguments)
    assert code == 2
    assert says in err


def test_a_repair_that_cannot_be_done_now_is_exit_code_3(command, copy):
    flipped(copy / "features" / "part-00001.parquet", 1000)
    with ownership_of(Store.at(copy)):
        code, _, err = command(copy, "--repair", "--jobs", 1)
    assert code == 3
    assert "a sweep is already running on it" in err
