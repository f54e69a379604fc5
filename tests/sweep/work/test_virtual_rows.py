"""Unit: a database that stores templates only makes the rows of a full sweep when they are read, and compares them."""

import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.core import CorruptionError, InputError
from sigdb.database import OtherBitsWarning
from sigdb.sweep import Job, add_features, run, verify
from sigdb.sweep.work import rows


def as_templates(plan):
    """The same plan, whose rows are not stored."""
    return replace(plan, design=plan.design.model_copy(update={"store": "templates"}))


@pytest.fixture(scope="module")
def virtual_folder(small_plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("virtual") / "signatures"
    run(as_templates(small_plan), folder, jobs=1)
    return folder


@pytest.fixture
def virtual(virtual_folder):
    with sigdb.open(virtual_folder) as database:
        yield database


def test_the_stored_form_determines_no_row(small_plan):
    assert as_templates(small_plan).hash == small_plan.hash
    assert "store" not in as_templates(small_plan).resolved["sweep"]


def test_rows_are_those_of_a_full_sweep_bit_for_bit(virtual, small):
    assert virtual.virtual_rows == len(virtual) == len(small)
    assert small.virtual_rows == 0
    for table in ("templates", "features", "signals"):
        assert virtual.dataset(table).to_table().equals(small.dataset(table).to_table(), check_metadata=True)


def test_only_digests_of_rows_are_stored(virtual_folder):
    folders = {path.name for path in virtual_folder.iterdir() if path.is_dir()}
    assert folders == {"digests", "receipts", "templates"}
    size = sum(path.stat().st_size for path in (virtual_folder / "digests").iterdir())
    assert size / len(sigdb.open(virtual_folder)) < 50


@pytest.mark.parametrize(
    "query",
    [
        "select count(*) as n from features",
        "select * from features where id in (3, 300)",
        "select id, fm4 from features where tooth = 6 and fm4 > 3 order by id",
        "select id from features where fm4 is null order by id",
        "select id from features where not (fm4 is not null and snr_db > 0) order by id",
        "select teeth, avg(rms) as rms, count(*) as n from features group by teeth order by teeth",
        "select id, tsa[2] as second, specimen from features join signals using (id) where tooth = 12 order by id",
        "select id, status from features where status <> 'ok' or index_error = 0 order by id",
    ],
)
def test_queries_give_what_a_full_database_gives(virtual, small, query):
    assert virtual.arrow(query).equals(small.arrow(query))


def test_signals_and_batches_and_export_are_those_of_a_full_database(virtual, small, tmp_path):
    ids = np.array([700, 3, 256, 3])
    assert virtual.signals(ids)["tsa"].tobytes() == small.signals(ids)["tsa"].tobytes()
    for table in ("features", "signals"):
        batches = [database.batches("tooth = 3", table=table).read_all() for database in (virtual, small)]
        assert batches[0].equals(batches[1])
    for name, database in (("virtual", virtual), ("full", small)):
        database.export(tmp_path / f"{name}.h5", where="tooth = 3 and teeth = 12")
    with h5py.File(tmp_path / "virtual.h5") as virtual_file, h5py.File(tmp_path / "full.h5") as full_file:
        names = []
        full_file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        assert len(names) > 20
        for name in names:
            np.testing.assert_array_equal(virtual_file[name][()], full_file[name][()])


def test_the_cost_counts_the_blocks_that_are_made(virtual, small):
    nothing = virtual.cost("select tooth, count(*) from features where specimen = 1 group by tooth")
    assert (nothing.rows, nothing.of, nothing.columns, nothing.seconds) == (0, len(virtual), (), 0.0)
    every = virtual.cost("select avg(rms) from features")
    assert (every.rows, every.columns) == (len(virtual), ("rms",))
    ids = small.sql("select id from features where teeth = 13")["id"]
    some = virtual.cost("select avg(rms) from features where teeth = 13")
    assert some.rows == sum(min(256, len(small) - 256 * block) for block in set(ids // 256))
    assert 0 < some.seconds < every.seconds
    assert small.cost("select avg(rms) from features").rows == 0
    assert str(every).startswith(f"makes rms of {len(small)} of {len(small)} virtual rows, in at most about ")


def test_a_query_makes_only_the_blocks_and_columns_that_it_names(virtual, monkeypatch):
    calls = []
    real = rows.features

    def counted(tsa, *, teeth, names):
        calls.append((len(tsa), list(names)))
        return real(tsa, teeth=teeth, names=names)

    monkeypatch.setattr(rows, "features", counted)
    virtual.sql("select tooth, specimen from features")
    virtual.sql("select max(scatter) from features")
    virtual.sql("select max(tsa[1]) from signals")
    assert not calls
    virtual.sql("select kurtosis from features where id = 5")
    assert [names for _, names in calls] == [["kurtosis"]]
    assert calls[0][0] <= 256


@pytest.mark.parametrize("query", ["select max(rms) from features", "select max(rms) as r from features where id < 9"])
def test_rows_that_differ_are_an_error_and_last_bits_a_warning(virtual, small, monkeypatch, query):
    real = rows.features

    def scaled(factor):
        return lambda *args, **options: {name: values * factor for name, values in real(*args, **options).items()}

    expected = small.sql(query)
    monkeypatch.setattr(rows, "features", scaled(1 + 3e-7))
    with pytest.warns(OtherBitsWarning, match=r"rms of rows 0 to 255: this processor"):
        got = virtual.sql(query)
    assert got.iloc[0, 0] == pytest.approx(expected.iloc[0, 0], rel=1e-6)
    monkeypatch.setattr(rows, "features", scaled(1.001))
    with pytest.raises(CorruptionError, match=r"other numbers than those .* rms of rows 0 to 255"):
        virtual.sql(query)


def test_verification_reads_digests_and_finds_what_is_wrong(virtual_folder, tmp_path, small_plan):
    assert verify(virtual_folder, deep=True) == ()
    copy = shutil.copytree(virtual_folder, tmp_path / "copy")
    file = copy / "digests" / "part-00000.parquet"
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    (finding,) = verify(copy)
    assert (finding.kind, finding.file) == ("damage", "digests/part-00000.parquet")
    with sigdb.open(copy) as database, pytest.raises(CorruptionError, match="digests/part-00000"):
        database.sql("select max(rms) from features")


def test_a_deep_verification_compares_digests_with_rows_made_again(virtual_folder, monkeypatch):
    real = rows.features
    monkeypatch.setattr(rows, "features", lambda *args, **o: {n: v * (1 + 3e-7) for n, v in real(*args, **o).items()})
    findings = verify(virtual_folder, deep=True, sample=1)
    assert [finding.file for finding in findings] == ["digests/part-00000.parquet"]
    assert "are not what making them again gives" in findings[0].what


def test_materialised_rows_are_the_files_of_a_full_sweep(small_plan, small_run, virtual_folder, digests, tmp_path):
    copy = shutil.copytree(virtual_folder, tmp_path / "copy")
    first = run(as_templates(small_plan), copy, jobs=1, materialise=True, job=Job(2, 2))
    assert first.missing_rows == first.rows  # all rows are one part, of job 1
    summary = run(as_templates(small_plan), copy, jobs=1, materialise=True)
    assert (summary.new_rows, summary.missing_rows) == (summary.rows, 0)
    assert digests(copy) == digests(small_run[0])
    assert verify(copy, deep=True) == ()
    assert sigdb.open(copy).virtual_rows == 0
    assert run(as_templates(small_plan), copy, jobs=1).new_rows == 0


def test_added_features_are_computed_from_virtual_averages(virtual_folder, small_run, tmp_path, monkeypatch):
    (tmp_path / "crest_module.py").write_text("def peak(tsa):\n    return {'peak_value': abs(tsa).max()}\n")
    monkeypatch.syspath_prepend(tmp_path)
    copies = [shutil.copytree(folder, tmp_path / name) for name, folder in (("v", virtual_folder), ("f", small_run[0]))]
    for copy in copies:
        add_features(copy, "crest_module:peak", jobs=1)
    query = "select id, peak_value, rms from features where peak_value > 0 and tooth = 6 order by id"
    got, due = (sigdb.open(copy).arrow(query) for copy in copies)
    assert got.num_rows
    assert got.equals(due)
    assert verify(copies[0], deep=True) == ()


def test_a_registration_needs_files(virtual_folder):
    with sigdb.open(virtual_folder) as database, pytest.raises(InputError, match="--materialise"):
        database.register_delta()


def test_a_recipe_and_a_command_say_how_rows_are_stored(tmp_path):
    recipe = tmp_path / "virtual.toml"
    recipe.write_text(
        '[sweep]\nrig = "nasa-spiral-bevel"\nstore = "templates"\n[[sweep.grid]]\nstiffness_loss = 0.4\ntooth = "all"\n'
    )

    def command(*words):
        result = CliRunner().invoke(cli, [*map(str, words)], catch_exceptions=False)
        assert result.exit_code == 0, result.output
        return result

    place = tmp_path / "db"
    assert "12 rows" in command("sweep", recipe, "--out", place, "--jobs", 1).output
    answer = command("query", place, "select count(*) as n from features where rms > 0", "--format", "json")
    assert json.loads(answer.stdout) == [{"n": 12}]
    assert "makes rms of 12 of 12 virtual rows, in at most about" in answer.stderr
    assert "makes" not in command("query", place, "select count(*) from features where tooth > 0").stderr
    assert "made 12 rows" in command("sweep", recipe, "--out", place, "--jobs", 1, "--materialise").output
    assert command("query", place, "select max(rms) from features").stderr == ""
