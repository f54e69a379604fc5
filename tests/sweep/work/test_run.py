"""Unit: a run is plan minus receipts, and its rows are the same bit for bit for any number of jobs."""

import importlib
import importlib.util
import json
import os
import shutil
import socket
from pathlib import Path

import pytest

import sigdb
from sigdb.core import Progress
from sigdb.core.errors import CorruptionError, DatabaseError, InputError
from sigdb.sweep import run

BEGINNING = importlib.import_module("sigdb.sweep.work.describe_database")
_SPEC = importlib.util.spec_from_file_location("crashes", Path(__file__).with_name("crashes.py"))
CRASHES = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(CRASHES)
BUILT_IN = Path(__file__).parents[3] / "data" / "transmissions" / "nasa_spiral_bevel.toml"


@pytest.fixture
def copy(parts_folder, tmp_path):
    """A copy of the database in three parts, with the times of its files."""
    shutil.copytree(parts_folder, tmp_path / "copy")
    return tmp_path / "copy"


def times(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file() and path.name != ".lock"}


def test_the_number_of_jobs_changes_no_byte(parts_plan, parts_folder, parts_text, digests, tmp_path):
    summary = run(parts_plan, tmp_path / "two", recipe=parts_text, jobs=2)
    assert summary.new_rows == summary.rows == 5060
    expected = digests(parts_folder)
    assert len(expected) == 1 + 3 + 3
    assert digests(tmp_path / "two") == expected
    for name in ("sigdb.toml", "schema.json"):
        assert (tmp_path / "two" / name).read_bytes() == (parts_folder / name).read_bytes()


def test_a_finished_sweep_has_nothing_to_do(parts_plan, parts_text, copy):
    before = times(copy)
    summary = run(parts_plan, copy, recipe=parts_text, jobs=1)
    assert summary.new_rows == 0
    assert (summary.rows, summary.templates) == (5060, 5)
    assert summary.bytes == sum(path.stat().st_size for path in copy.rglob("*.parquet"))
    assert times(copy) == before


@pytest.mark.parametrize("part", [0, 1, 2])
def test_a_part_without_receipt_is_made_again_and_no_other(parts_plan, parts_text, copy, digests, part):
    before, content = times(copy), digests(copy)
    receipt = copy / "receipts" / f"rows-{part:05d}.json"
    receipt.unlink()
    summary = run(parts_plan, copy, recipe=parts_text, jobs=1)
    assert summary.new_rows == (2048, 2048, 5060 - 2 * 2048)[part]
    assert digests(copy) == content
    name = f"part-{part:05d}.parquet"
    again = {receipt, copy / "features" / name, copy / "signals" / name}
    assert {path for path, time in times(copy).items() if before.get(path) != time} == again


def test_templates_without_receipt_are_made_again(parts_plan, parts_text, copy, digests):
    content = digests(copy)
    (copy / "receipts" / "templates-00000.json").unlink()
    (copy / "receipts" / "rows-00002.json").unlink()
    assert run(parts_plan, copy, recipe=parts_text, jobs=1).new_rows == 5060 - 2 * 2048
    assert digests(copy) == content


def test_a_directory_that_is_made_anew_with_another_recipe_keeps_nothing(plan_of, tmp_path, digests):
    """Two databases in one process at one path, one after the other: the second is not the first's templates."""
    text = "[[sweep.grid]]\ntooth = 1\nstiffness_loss = {}\n[signature]\nsamples_per_tooth = 32\n"
    run(plan_of(text.format(0.1)), tmp_path / "one", jobs=1)
    shutil.rmtree(tmp_path / "one")
    for folder in ("one", "fresh"):
        run(plan_of(text.format(0.4)), tmp_path / folder, jobs=1)
    assert digests(tmp_path / "one") == digests(tmp_path / "fresh")


def test_progress_counts_what_is_finished(parts_plan, parts_text, copy):
    (copy / "receipts" / "rows-00001.json").unlink()
    told = []
    run(parts_plan, copy, recipe=parts_text, jobs=1, on_progress=told.append)
    assert told == [
        Progress(stage="templates", done=5, total=5, before=5),
        Progress(stage="rows", done=5060 - 2048, total=5060, before=5060 - 2048),
        Progress(stage="rows", done=5060, total=5060, before=5060 - 2048),
    ]


def test_a_second_sweep_is_refused_with_the_owner_while_the_first_runs(parts_plan, copy, digests, parts_text):
    content = digests(copy)
    (copy / "receipts" / "rows-00000.json").unlink()
    refused = []

    def meanwhile(progress):
        if progress.stage == "templates":
            with pytest.raises(DatabaseError, match="a sweep is already running on it") as error:
                run(parts_plan, copy, jobs=1)
            refused.append(str(error.value))

    run(parts_plan, copy, recipe=parts_text, jobs=1, on_progress=meanwhile)
    (sentence,) = refused
    assert f"(process {os.getpid()} on {socket.gethostname()}); wait until it ends, or stop it" in sentence
    assert digests(copy) == content
    assert not (copy / ".owner").exists()


def test_the_owner_that_died_does_not_block(parts_plan, parts_text, copy):
    """What a killed sweep leaves: the lock's file and its owner's name, but no lock."""
    (copy / ".owner").write_text("process 1 on another\n", encoding="utf-8")
    assert run(parts_plan, copy, recipe=parts_text, jobs=1).new_rows == 0


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("seed = 7", "seed = 8", r"sweep\.seed was 7 and is now 8"),
        ("specimens = 115", "specimens = 116", r"sweep\.specimens was 115 and is now 116"),
        ("[0.1, 0.2]", "[0.1, 0.3]", r"sweep\.grid\.1\.stiffness_loss\.2 was 0\.2 and is now 0\.3"),
        ("[0.1, 0.2]", "[0.1]", r"sweep\.grid\.1\.stiffness_loss was \[0\.1, 0\.2\] and is now \[0\.1\]"),
        ("averages = 36", "averages = 72", r"sweep\.grid\.1\.averages\.1 was 36 and is now 72"),
        ("[signature]", "[measurement]\nsnr_db = 3.0\n[signature]", r"measurement\.snr_db was 0\.0 and is now 3\.0"),
        ("samples_per_tooth = 32", "samples_per_tooth = 64", r"signature\.samples_per_tooth was 32 and is now 64"),
    ],
)
def test_another_recipe_is_refused_by_its_first_difference(plan_of, parts_text, copy, old, new, says):
    before = times(copy)
    changed = parts_text.replace(old, new)
    assert changed != parts_text
    with pytest.raises(InputError, match=r"was made from another recipe: " + says + "; give another directory"):
        run(plan_of(changed), copy, recipe=changed, jobs=1)
    assert times(copy) == before


def test_another_rig_is_refused_by_its_first_difference(recipe_of, parts_text, copy, tmp_path):
    text = BUILT_IN.read_text(encoding="utf-8").replace("stiffness = 2.2e8", "stiffness = 2.1e8")
    rig = tmp_path / "rig.toml"
    rig.write_text(text, encoding="utf-8")
    changed = parts_text.replace("nasa-spiral-bevel", rig.as_posix())
    with pytest.raises(InputError, match=r"rig\.meshes\.main\.stiffness was 220000000\.0 and is now 210000000\.0"):
        run(recipe_of(changed).plan(), copy, recipe=changed, jobs=1)


def test_a_recipe_that_makes_the_same_rows_goes_on_and_is_kept(plan_of, parts_text, copy):
    reworded = parts_text + '\n[recognition]\nlearner = "lda"\n'
    assert run(plan_of(reworded), copy, recipe=reworded, jobs=1).new_rows == 0
    assert sigdb.open(copy).manifest.recipe == reworded


def test_going_on_without_the_text_keeps_the_recipe(parts_plan, parts_text, copy):
    """The recipe's text is optional in Python; a database does not lose it."""
    run(parts_plan, copy, jobs=1)
    assert sigdb.open(copy).manifest.recipe == parts_text


def test_a_directory_below_a_file(parts_plan, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(DatabaseError, match=r"file/signatures: cannot be written \(Not a directory\)"):
        run(parts_plan, tmp_path / "file" / "signatures", jobs=1)
    with pytest.raises(DatabaseError, match=r"file: cannot be written \(File exists\)"):
        run(parts_plan, tmp_path / "file", jobs=1)


def test_a_damaged_template_is_found_when_rows_are_made(parts_plan, parts_text, copy):
    """Rows are never made from it, and the sentence says what is damaged, not that the disk cannot be written."""
    path = copy / "templates" / "part-00000.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    (copy / "receipts" / "rows-00001.json").unlink()
    with pytest.raises(DatabaseError, match=r"part-00000\.parquet.* is damaged"):
        run(parts_plan, copy, recipe=parts_text, jobs=1)


def test_a_receipt_that_is_no_json(parts_plan, copy):
    path = copy / "receipts" / "rows-00001.json"
    path.write_text("{", encoding="utf-8")
    with pytest.raises(CorruptionError, match=r"rows-00001\.json is damaged .*; make it again with: sigdb verify"):
        run(parts_plan, copy, jobs=1)


def test_receipts_say_what_was_made(parts_folder):
    receipts = [json.loads(path.read_text()) for path in sorted((parts_folder / "receipts").glob("rows-*.json"))]
    assert [(one["part"], one["first"], one["rows"]) for one in receipts] == [
        (0, 0, 2048),
        (1, 2048, 2048),
        (2, 4096, 5060 - 4096),
    ]


DESCRIPTIONS = {
    "none": lambda path: path.unlink(),
    "empty": lambda path: path.write_bytes(b""),
    "another letter": lambda path: path.write_bytes(path.read_bytes().replace(b"seed = 7", b"seed = 8", 1)),
}


@pytest.mark.parametrize("damage", DESCRIPTIONS)
def test_a_damaged_description_is_written_again_from_the_recipe(parts_plan, parts_text, parts_folder, copy, damage):
    before = times(copy)
    DESCRIPTIONS[damage](copy / "sigdb.toml")
    assert run(parts_plan, copy, recipe=parts_text, jobs=1).new_rows == 0
    after = times(copy)
    assert {path.name for path in after if after[path] != before[path]} == {"sigdb.toml"}
    for name in ("sigdb.toml", "schema.json"):
        assert (copy / name).read_bytes() == (parts_folder / name).read_bytes()


@pytest.mark.parametrize("damage", DESCRIPTIONS)
def test_parts_of_another_recipe_are_not_taken_over(plan_of, parts_text, copy, damage):
    """Without its description a directory still holds the parts of the recipe that they were made with."""
    DESCRIPTIONS[damage](copy / "sigdb.toml")
    before = times(copy)
    with pytest.raises(
        InputError, match=r"holds parts but no readable sigdb\.toml, and they are not all of this recipe"
    ):
        run(plan_of(parts_text.replace("seed = 7", "seed = 8")), copy, jobs=1)
    assert times(copy) == before


def test_parts_that_no_receipt_names_readably_are_not_taken_over(parts_plan, copy):
    (copy / "sigdb.toml").unlink()
    for receipt in (copy / "receipts").iterdir():
        receipt.write_bytes(b"")
    with pytest.raises(InputError, match=r"holds parts but no readable sigdb\.toml"):
        run(parts_plan, copy, jobs=1)


def test_another_version_does_not_go_on(parts_plan, copy, monkeypatch):
    monkeypatch.setattr(BEGINNING, "__version__", "99.0.0")
    for _ in range(2):
        with pytest.raises(InputError, match=r"was begun with sigdb \S+, this is 99\.0\.0, whose rows may differ"):
            run(parts_plan, copy, jobs=1)
        (copy / "sigdb.toml").unlink(missing_ok=True)  # then the receipts say so


def test_a_reader_sees_whole_parts_while_a_sweep_runs(parts_plan, parts_text, parts_folder, tmp_path):
    """It opens the database whenever something is finished, and finds rows of the undisturbed one."""
    reader = CRASHES.Reader(parts_folder, seed=1)
    run(parts_plan, tmp_path / "db", recipe=parts_text, jobs=1, on_progress=lambda _: reader.look(tmp_path / "db"))
    assert {2048, 4096, 5060} <= set(reader.reads)
