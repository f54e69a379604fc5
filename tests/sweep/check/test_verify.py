"""Unit: verify finds whatever is not as it was written, says what to make again, and finds nothing else."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from sigdb.core import Progress
from sigdb.core.errors import CorruptionError, InputError
from sigdb.database.store.manifest import read_manifest
from sigdb.database.store.receipts import read_receipt, write_receipt
from sigdb.database.store.seal import sealed_json, sealed_toml, unsealed
from sigdb.database.store.store import Store
from sigdb.database.store.writer import write_part
from sigdb.sweep import refine, repair, run, verify

ALL = 10**9
TABLES = {"templates": ("templates",), "rows": ("features", "signals")}


@pytest.fixture
def copy(parts_folder, tmp_path):
    """A database in three parts that may be damaged."""
    return shutil.copytree(parts_folder, tmp_path / "copy")


@pytest.fixture
def small_copy(small_run, tmp_path):
    """One part with two sensors, two tooth counts, patterns, rows and templates that lose contact."""
    return shutil.copytree(small_run[0], tmp_path / "small")


def files_of(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)


def told(findings):
    return [(one.kind, one.file, one.stage, one.part) for one in findings]


def remade(folder, stage, part, change):
    """Write a part with other content, checksums and receipt right: ``change`` takes and gives a table."""
    store = Store.at(folder)
    receipt = read_receipt(store, stage, part)
    tables = {name: pq.read_table(folder / receipt.file(name).path) for name in TABLES[stage]}
    changed = {name: change(name, table) for name, table in tables.items()}
    write_part(store, stage, part, [changed], plan=receipt.plan, first=receipt.first, started=0.0)


def with_value(column, row, value):
    """A change of one value of a column, in whichever table has it."""

    def change(name, table):
        if column not in table.column_names:
            return table
        values = table[column].to_pylist()
        values[row] = value(values[row]) if callable(value) else value
        at = table.schema.get_field_index(column)
        return table.set_column(at, table.schema.field(at), pa.array(values, table.schema.field(at).type))

    return change


@pytest.mark.parametrize("deep", [False, True])
def test_a_whole_database_is_whole(small_run, parts_folder, deep):
    """All kinds of damage, contact loss and two tooth counts, every row and template made again; of parts a row."""
    for folder, sample in ((small_run[0], ALL), (parts_folder, 1)):
        assert verify(folder, deep=deep, sample=sample) == ()


@pytest.fixture(scope="module")
def extended(plan_of, tmp_path_factory):
    """A database with two extensions and a coverage record: damage between that of the grid was badly stood for."""
    folder = tmp_path_factory.mktemp("extended") / "db"
    text = "[[sweep.grid]]\ntooth = [1, 2]\nphase_shift_deg = [0.5, 4.0]\n[signature]\nsamples_per_tooth = 32\n"
    run(plan_of(text), folder, jobs=1)
    refine(folder, match=0.9999, cases=10, rounds=2, jobs=1)
    return folder


def test_an_extended_database(extended, tmp_path):
    """Its extensions are parts like others: whole, found when damaged, and made again with their own plans."""
    folder = shutil.copytree(extended, tmp_path / "copy")
    assert len(read_manifest(Store.at(folder)).extensions) >= 2
    assert (folder / "coverage.json").exists()
    assert verify(folder, deep=True, sample=ALL) == ()
    content = {path: path.read_bytes() for path in folder.rglob("*.parquet")}
    for name in ("templates/part-00002.parquet", "signals/part-00001.parquet"):
        (folder / name).unlink()
    assert told(verify(folder)) == [
        ("damage", "templates/part-00002.parquet", "templates", 2),
        ("damage", "signals/part-00001.parquet", "rows", 1),
    ]
    assert repair(folder, jobs=1).left == ()
    assert {path: path.read_bytes() for path in folder.rglob("*.parquet")} == content
    (folder / "receipts" / "rows-00002.json").unlink()
    (found,) = verify(folder)
    assert found.what.endswith("parts of rows are not made yet (2)")


def test_nothing_is_written(copy):
    before = {path: path.stat().st_mtime_ns for path in copy.rglob("*")}
    verify(copy, deep=True, sample=2)
    assert {path: path.stat().st_mtime_ns for path in copy.rglob("*")} == before


def test_failed_rows_and_quotients_without_variance_are_as_they_should_be(plan_of, tmp_path):
    """Nulls where specimens lose contact; nulls of indicators of healthy gears without errors and all but no noise."""
    text = (
        "seed = 1\nspecimens = 4\nhealthy = 2\n[[sweep.grid]]\ntooth = 3\nstiffness_loss = 0.4\n"
        "index_error = [0.0, 1e-4]\nsnr_db = 200.0\n[signature]\nsamples_per_tooth = 32\n"
    )
    run(plan_of(text), tmp_path / "db", jobs=1)
    features = pq.read_table(tmp_path / "db" / "features" / "part-00000.parquet")
    ok = pc.equal(features["status"], "ok")
    assert 0 < pc.sum(ok).as_py() < len(features)
    assert pc.sum(pc.and_(ok, features["fm4"].is_null())).as_py() > 0
    assert verify(tmp_path / "db", deep=True, sample=0) == ()


@pytest.mark.parametrize("where", ["small", "parts"])
def test_any_flipped_bit_is_found(small_copy, copy, where):
    """Random bits of all files, half of them spread over bytes and half over files; and the first and last bytes."""
    folder = small_copy if where == "small" else copy
    rng = np.random.default_rng(7)
    paths = files_of(folder)
    sizes = np.array([path.stat().st_size for path in paths])
    chosen = [(paths[k], offset) for k in range(len(paths)) for offset in (0, sizes[k] - 1)]
    for k in [*rng.integers(len(paths), size=6), *rng.choice(len(paths), size=6, p=sizes / sizes.sum())]:
        chosen.append((paths[k], int(rng.integers(sizes[k]))))
    for path, offset in chosen:
        content = path.read_bytes()
        flipped = bytearray(content)
        flipped[offset] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        (found,) = verify(folder)
        assert (found.kind, found.file) == ("damage", path.relative_to(folder).as_posix())
        if path.parent != folder:
            stage = "rows" if path.parent.name in ("features", "signals") else path.stem.split("-")[0]
            stage = "templates" if path.parent.name == "templates" else stage
            assert (found.stage, found.part) == (stage, int(path.stem[-5:]))
            assert found.remedy == f"make part {found.part} of {stage} again with --repair"
        path.write_bytes(content)
    assert verify(folder) == ()


@pytest.mark.parametrize("size", [0, 1000, -1, 1])
@pytest.mark.parametrize(
    "name", ["templates/part-00000.parquet", "signals/part-00002.parquet", "features/part-00001.parquet"]
)
def test_a_file_of_another_size(copy, name, size):
    path = copy / name
    content = path.read_bytes()
    path.write_bytes(content + b"\0" if size == 1 else content[:size])
    (found,) = verify(copy)
    assert (found.file, found.part) == (name, int(name[-13:-8]))
    assert f"bytes, its receipt says {len(content)}" in found.what


def test_a_missing_file(copy):
    for path in files_of(copy):
        content, name = path.read_bytes(), path.relative_to(copy).as_posix()
        path.unlink()
        (found,) = verify(copy)
        if "receipts" in name:
            assert found.kind == "unfinished"
            assert f"parts of {path.stem.split('-')[0]} are not made yet" in found.what
        else:
            assert (found.kind, found.file, found.what) == ("damage", name, "is missing")
        path.write_bytes(content)
    assert verify(copy) == ()


def test_parts_that_are_not_made_yet_are_no_damage(copy):
    """As a killed sweep leaves them: files without a receipt are of the part that is made next."""
    for part in (1, 2):
        (copy / "receipts" / f"rows-{part:05d}.json").unlink()
    (copy / "signals" / "part-00002.parquet").write_bytes(b"half")
    (found,) = verify(copy, deep=True)
    assert (found.kind, found.file, found.part) == ("unfinished", "", None)
    assert str(found).startswith("2 of 3 parts of rows are not made yet (1-2); go on with the command that began it")
    (copy / "receipts" / "templates-00000.json").unlink()
    shutil.copy(copy / "receipts" / "rows-00000.json", copy / "receipts" / "rows-00001.json")
    assert told(verify(copy)) == [
        ("unfinished", "", None, None),
        ("unfinished", "", None, None),
        ("damage", "receipts/rows-00001.json", "rows", 1),
    ]


def test_foreign_files_are_named(copy):
    for name in (
        "notes.txt",
        "features/part-00003.parquet",
        "receipts/rows-00003.json",
        "receipts/rows-1.json",
        "x/y.tmp",
    ):
        (copy / name).parent.mkdir(exist_ok=True)
        (copy / name).write_bytes(b"")
        assert told(verify(copy)) == [("foreign", name, None, None)]
        (copy / name).unlink()
    for name in (".owner", ".lock"):
        (copy / name).write_text("a sweep", encoding="utf-8")
    assert verify(copy) == ()
    (copy / "signals" / ".part-00001.parquet.12.ab.tmp").write_bytes(b"")
    (found,) = verify(copy)
    assert told([found]) == [("foreign", "signals/.part-00001.parquet.12.ab.tmp", None, None)]
    assert "temporary" in found.what


def test_a_part_of_another_database_is_found(copy, plan_of, parts_text, tmp_path):
    other = parts_text.replace("seed = 7", "seed = 8")
    run(plan_of(other), tmp_path / "other", jobs=1)
    for name in ("receipts/rows-00001.json", "features/part-00001.parquet", "signals/part-00001.parquet"):
        shutil.copy(tmp_path / "other" / name, copy / name)
    (found,) = verify(copy)
    assert told([found]) == [("damage", "receipts/rows-00001.json", "rows", 1)]
    assert "another plan" in found.what


def test_files_of_other_parts_in_a_receipt_are_found(copy):
    store = Store.at(copy)
    first, second = (read_receipt(store, "rows", part) for part in (0, 1))
    write_receipt(store, replace(second, files=first.files))
    assert told(verify(copy)) == [("damage", "receipts/rows-00001.json", "rows", 1)]


def test_a_wrong_row_count_is_found(copy):
    remade(copy, "rows", 1, lambda name, table: table.slice(0, 2000))
    (found,) = verify(copy)
    assert told([found]) == [("damage", "receipts/rows-00001.json", "rows", 1)]
    store = Store.at(copy)
    receipt = replace(read_receipt(store, "rows", 1), rows=2048)
    write_receipt(store, receipt)
    assert [one.what for one in verify(copy)] == ["has 2000 rows, its receipt says 2048"] * 2


NAN, INFINITY = float("nan"), float("inf")


WRONG_ROWS = {
    "numbers": [
        ("id", 5, 2052, "id of row 2053 is 2052, by the recipe 2053"),
        ("stiffness_loss", 7, 0.4, "stiffness_loss of row 2055 is 0.4, by the recipe 0."),
        ("tooth", 0, lambda tooth: tooth % 11 + 1, "tooth of row 2048 is "),
        ("gear", 0, "gear", "gear of row 2048 is 'gear', by the recipe 'pinion'"),
        ("rms", 3, NAN, "rms of row 2051 is nan"),
        ("fm4", 3, INFINITY, "fm4 of row 2051 is inf"),
        ("tsa", 300, lambda tsa: [*tsa[:-1], NAN], "tsa of row 2348 holds a value that is no finite number"),
        (
            "spectrum",
            300,
            lambda spectrum: spectrum[:-1],
            "spectrum of row 2348 has 176 values, by the recipe it has 177",
        ),
        ("wigner_ville", 300, None, "wigner_ville of row 2348 is null, by the recipe it has 187 values"),
    ],
    "nulls": [
        ("id", 5, 9999, "id of row 2053 is 9999, by the recipe 2053"),
        ("stiffness_loss", 7, None, "stiffness_loss of row 2055 is None, by the recipe 0."),
        ("tsa", 300, lambda tsa: [*tsa[:-1], None], "tsa of row 2348 holds a value that is no finite number"),
    ],
    "status": [("status", 3, "no result", "rms of row 2051 is ")],
    "codes": [("status_code", 3, "contact", "status_code of row 2051 is 'contact', its status is 'ok'")],
}
WRONG_TEMPLATES = {
    "numbers": [
        ("template", 2, 1, "template of row 2 is 1, by the recipe 2"),
        ("damaged_teeth", 2, 7, "damaged_teeth of row 2 is 7, by the recipe "),
        ("reference_variance", 1, NAN, "reference_variance of row 1 is nan"),
        ("tsa", 1, lambda tsa: [*tsa[:-1], INFINITY], "tsa of row 1 holds a value that is no finite number"),
        ("specimen_response", 1, lambda values: values[:-1], "specimen_response of row 1 has 3871 values"),
        ("compression", 1, None, "compression of row 1 is null"),
    ],
    "status": [("status", 1, "no result", "tsa of row 1 has 352 values, by the recipe it is null")],
    "codes": [("status_code", 1, None, "status_code of row 1 is None, its status is 'ok'")],
}


def with_values(changes):
    def change(name, table):
        for column, row, value, _ in changes:
            table = with_value(column, row, value)(name, table)
        return table

    return change


@pytest.mark.parametrize("changes", WRONG_ROWS.values(), ids=WRONG_ROWS)
def test_wrong_content_is_found_in_depth(copy, changes):
    """The part was written so, its checksums are right; every wrong column is named."""
    remade(copy, "rows", 1, with_values(changes))
    assert verify(copy) == ()
    findings = verify(copy, deep=True, sample=0)
    assert {(one.kind, one.stage, one.part) for one in findings} == {("damage", "rows", 1)}
    for *_, says in changes:
        assert any(one.what.startswith(says) for one in findings), (says, [one.what for one in findings])


@pytest.mark.parametrize("changes", WRONG_TEMPLATES.values(), ids=WRONG_TEMPLATES)
def test_wrong_templates_are_found_in_depth(copy, changes):
    remade(copy, "templates", 0, with_values(changes))
    assert verify(copy) == ()
    findings = verify(copy, deep=True, sample=0)
    assert {(one.kind, one.file, one.part) for one in findings} == {("damage", "templates/part-00000.parquet", 0)}
    for *_, says in changes:
        assert any(one.what.startswith(says) for one in findings), (says, [one.what for one in findings])


@pytest.mark.parametrize(
    ("stage", "column", "name"),
    [
        ("rows", "rms", "features/part-00002.parquet"),
        ("rows", "spectrum", "signals/part-00002.parquet"),
        ("templates", "specimen_response", "templates/part-00000.parquet"),
    ],
)
def test_a_result_that_is_another_by_one_bit_is_found_when_it_is_made_again(copy, stage, column, name):
    def next_float(value):
        if isinstance(value, list):
            return [*value[:-1], next_float(value[-1])]
        return float(np.nextafter(np.float32(value), np.float32(np.inf)))

    remade(copy, stage, 2 if stage == "rows" else 0, with_value(column, -1, next_float))
    assert verify(copy, deep=True, sample=0) == ()
    found = verify(copy, deep=True, sample=3)  # the first and the last are among them
    assert name in {one.file for one in found}
    (first,) = (one for one in found if one.file == name)
    assert f"{column} " in first.what
    assert "not what making them again gives" in first.what


def test_a_missing_indicator_is_doubted_and_made_again(copy):
    remade(copy, "rows", 1, with_value("kurtosis", 1000, None))
    (found,) = verify(copy, deep=True, sample=0)
    assert found.what == "rows 2816 to 3071: kurtosis are not what making them again gives"


def test_another_number_of_failures_than_the_receipt_says(copy):
    store = Store.at(copy)
    write_receipt(store, replace(read_receipt(store, "rows", 0), failed=3))
    assert verify(copy) == ()
    assert [one.what for one in verify(copy, deep=True, sample=0)] == [
        "has 0 rows without a result, its receipt says 3"
    ]


def test_descriptions_that_do_not_agree(copy):
    """Sealed anew, so that no byte looks damaged."""
    text = (copy / "sigdb.toml").read_bytes()
    content = unsealed(text, name="sigdb.toml")
    for key, value in (("part_rows", 4096), ("sensors", ["pinion-housing-vertical"]), ("part_templates", 32)):
        (copy / "sigdb.toml").write_bytes(sealed_toml(content | {key: value}))
        (found,) = verify(copy)
        assert (found.file, found.what) == (
            "sigdb.toml",
            "the hash or the numbers in it are not those of the recipe in it",
        )
        assert f"sigdb sweep RECIPE --out {copy}" in found.remedy
    for key, value in (("rows", 5061), ("seed", 8), ("hash", "0" * 64), ("templates", 6)):
        (copy / "sigdb.toml").write_bytes(sealed_toml(content | {"plan": content["plan"] | {key: value}}))
        assert "sigdb.toml" in {one.file for one in verify(copy)}
    resolved = content["plan"]["resolved"] | {"measurement": {"averages": 0.5}}
    (copy / "sigdb.toml").write_bytes(sealed_toml(content | {"plan": content["plan"] | {"resolved": resolved}}))
    assert [one.file for one in verify(copy)] == ["sigdb.toml"]
    (copy / "sigdb.toml").write_bytes(text)
    schema = unsealed((copy / "schema.json").read_bytes(), name="schema.json")
    (gear,) = (column for column in schema["features"] if column["name"] == "gear")
    gear["unit"] = "inch"
    (copy / "schema.json").write_bytes(sealed_json(schema))
    assert [(one.file, one.what) for one in verify(copy)] == [
        (
            "schema.json",
            "its columns are not those of sigdb.toml: column gear of table features is of another type or unit",
        )
    ]


def test_columns_that_are_not_the_schemas(copy):
    def other_unit(name, table):
        at = table.schema.get_field_index("tsa")
        field = table.schema.field(max(at, 0)).with_metadata({"unit": "inch"})
        return table if at < 0 else table.cast(table.schema.set(at, field))

    remade(copy, "rows", 0, other_unit)
    assert [(one.file, one.what) for one in verify(copy)] == [
        ("signals/part-00000.parquet", "its columns are not those of schema.json")
    ]


def test_with_a_damaged_description_the_parts_are_still_compared_with_their_receipts(copy):
    (copy / "sigdb.toml").write_bytes(b"")
    path = copy / "features" / "part-00001.parquet"
    content = bytearray(path.read_bytes())
    content[100] ^= 1
    path.write_bytes(content)
    assert told(verify(copy, deep=True)) == [
        ("damage", "sigdb.toml", None, None),
        ("damage", "features/part-00001.parquet", "rows", 1),
    ]


def test_a_coverage_record_is_the_databases_and_sealed(copy):
    path = copy / "coverage.json"
    path.write_bytes(sealed_json({"threshold": 0.1}))
    assert verify(copy) == ()
    path.write_bytes(path.read_bytes().replace(b"0.1", b"0.2"))
    (found,) = verify(copy)
    assert (found.file, found.what) == ("coverage.json", "is damaged or was edited")
    assert "sigdb coverage" in found.remedy


def test_what_is_no_database(tmp_path):
    for place in (tmp_path, tmp_path / "none"):
        with pytest.raises(InputError, match=r"is not a sigdb database"):
            verify(place)


def test_progress_counts_files(copy):
    told = []
    verify(copy, on_progress=told.append)
    assert told == [Progress(stage="files", done=done, total=7, before=0) for done in (1, 3, 5, 7)]


def test_a_damaged_file_is_an_error_of_each_reader_too(copy):
    """What verify finds in a description, no reader takes."""
    text = json.loads((copy / "receipts" / "rows-00000.json").read_text(encoding="utf-8"))
    (copy / "receipts" / "rows-00000.json").write_text(json.dumps(text | {"rows": 1}), encoding="utf-8")
    with pytest.raises(CorruptionError):
        read_receipt(Store.at(copy), "rows", 0)
    (copy / "sigdb.toml").write_bytes((copy / "sigdb.toml").read_bytes() + b"\n")
    with pytest.raises(CorruptionError):
        read_manifest(Store.at(copy))


@pytest.mark.parametrize("field", ["sha256", "blocks"])
def test_checksums_of_another_file_in_a_receipt_are_found(copy, field):
    store = Store.at(copy)
    first, second = (read_receipt(store, "rows", part) for part in (0, 1))
    files = (replace(second.files[0], **{field: getattr(first.files[0], field)}), second.files[1])
    write_receipt(store, replace(second, files=files))
    assert told(verify(copy)) == [("damage", "features/part-00001.parquet", "rows", 1)]
