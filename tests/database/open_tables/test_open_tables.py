"""Registered tables hold the rows of the database, by the same files, and verify compares them. Evidence: unit."""

import shutil
import sys
from pathlib import Path

import duckdb
import numpy as np
import pytest
from deltalake import DeltaTable
from pyiceberg.catalog import load_catalog

import sigdb
from sigdb.core.errors import InputError
from sigdb.ingest import IngestSettings, ingest, verify

TEETH, EACH = 8, 16


@pytest.fixture
def folder(tmp_path):
    """Three files with two averages each, and their database in a folder with a space in its name."""
    (tmp_path / "averages").mkdir()
    for seed in range(3):
        write(tmp_path, seed)
    extend(tmp_path)
    return tmp_path


def write(folder, seed):
    tsa = np.random.default_rng(seed).normal(size=(2, TEETH * EACH))
    np.savez(folder / "averages" / f"r{seed}.npz", tsa=tsa)


def extend(folder):
    settings = IngestSettings(teeth=str(TEETH), averages_of="tsa", samples_per_tooth=EACH)
    ingest(folder / "averages", folder / "my db", settings=settings, jobs=1)


def parquet(folder):
    return {path: (path.stat().st_ino, path.read_bytes()) for path in folder.rglob("*.parquet")}


def of_catalog(file):
    return load_catalog("sigdb", type="sql", uri=f"sqlite:///{file}")


def counted(rows):
    """Return the number of rows with a result, by DuckDB over Arrow."""
    with duckdb.connect() as connection:
        connection.register("given", rows)
        return connection.execute("select count(*) from given where rms > 0").fetchall()[0][0]


def found(folder):
    return [(each.kind, each.file.split("/")[0], each.what) for each in verify(folder / "my db")]


def test_delta_tables_hold_the_rows_by_the_same_files(folder):
    before = parquet(folder)
    done = sigdb.open(folder / "my db").register_delta()
    assert [(each.table, each.files, each.rows, each.is_new) for each in done] == [
        ("features", 3, 6, True),
        ("signals", 3, 6, True),
    ]
    assert parquet(folder) == before
    database = sigdb.open(folder / "my db")
    for table in ("features", "signals"):
        read = DeltaTable(str(folder / "my db" / table)).to_pyarrow_table()
        assert read.sort_by("id").to_pydict() == database.batches(table=table).read_all().to_pydict()
    assert counted(DeltaTable(str(folder / "my db" / "features")).to_pyarrow_dataset()) == 6
    assert verify(folder / "my db") == ()


def test_iceberg_tables_hold_the_rows_by_the_same_files(folder):
    before = parquet(folder)
    done = sigdb.open(folder / "my db").register_iceberg(str(folder / "catalog.db"))
    assert [(each.place, each.files, each.rows) for each in done] == [("my_db.features", 3, 6), ("my_db.signals", 3, 6)]
    assert parquet(folder) == before
    catalog, database = of_catalog(folder / "catalog.db"), sigdb.open(folder / "my db")
    for table in ("features", "signals"):
        read = catalog.load_table(f"my_db.{table}").scan().to_arrow()
        assert read.sort_by("id").to_pydict() == database.batches(table=table).read_all().to_pydict()
    assert (
        counted(catalog.load_table("my_db.features").scan(selected_fields=("id", "rms")).to_arrow_batch_reader()) == 6
    )
    catalog.close()
    assert verify(folder / "my db") == ()


def registered(folder, kind):
    database = sigdb.open(folder / "my db")
    return database.register_delta() if kind == "delta" else database.register_iceberg(str(folder / "catalog.db"))


def rows_of(folder, kind):
    """Return the ids that the format's reader gives."""
    if kind == "delta":
        return sorted(DeltaTable(str(folder / "my db" / "features")).to_pyarrow_table()["id"].to_pylist())
    catalog = of_catalog(folder / "catalog.db")
    ids = catalog.load_table("my_db.features").scan().to_arrow()["id"].to_pylist()
    catalog.close()
    return sorted(ids)


@pytest.mark.parametrize("kind", ["delta", "iceberg"])
def test_a_registration_is_of_receipts_and_repeated_when_these_have_changed(folder, kind):
    assert all(each.is_new for each in registered(folder, kind))
    files = {path: path.stat().st_mtime_ns for path in (folder / "my db").rglob("*")}
    assert not any(each.is_new for each in registered(folder, kind))
    assert {path: path.stat().st_mtime_ns for path in (folder / "my db").rglob("*")} == files
    write(folder, 3)
    extend(folder)
    assert found(folder) == [
        ("unfinished", table, "registers other files than the receipts name") for table in ("features", "signals")
    ]
    assert [each.rows for each in registered(folder, kind)] == [8, 8]
    assert rows_of(folder, kind) == sigdb.open(folder / "my db").cases()["id"].tolist()
    assert found(folder) == []


@pytest.mark.parametrize("kind", ["delta", "iceberg"])
def test_a_commit_of_another_writer_is_found(folder, kind):
    registered(folder, kind)
    if kind == "delta":
        DeltaTable(str(folder / "my db" / "features")).delete("id = 0")
    else:
        catalog = of_catalog(folder / "catalog.db")
        catalog.load_table("my_db.features").delete("id = 0")
        catalog.close()
    assert ("unfinished", "features", "registers other files than the receipts name") in found(folder)


def test_a_moved_database_is_registered_again_in_iceberg_and_not_in_delta(folder):
    for kind in ("delta", "iceberg"):
        registered(folder, kind)
    (folder / "elsewhere").mkdir()
    shutil.move(folder / "my db", folder / "elsewhere" / "my db")
    moved = f"registers the table at {folder / 'my db'}"
    assert [what.partition(",")[0] for _, _, what in found(folder / "elsewhere")] == [
        f"{moved}/features",
        f"{moved}/signals",
    ]
    shutil.copy(folder / "catalog.db", folder / "elsewhere" / "catalog.db")
    registered(folder / "elsewhere", "iceberg")
    assert found(folder / "elsewhere") == []
    for kind in ("delta", "iceberg"):
        assert rows_of(folder / "elsewhere", kind) == sigdb.open(folder / "elsewhere" / "my db").cases()["id"].tolist()


def test_a_second_catalog_shares_the_metadata(folder):
    registered(folder, "iceberg")
    before = sorted((folder / "my db").rglob("*"))
    done = sigdb.open(folder / "my db").register_iceberg(str(folder / "other.db"), namespace="gears")
    assert [(each.place, each.is_new) for each in done] == [("gears.features", True), ("gears.signals", True)]
    assert sorted((folder / "my db").rglob("*")) == before
    catalog = of_catalog(folder / "other.db")
    assert catalog.load_table("gears.features").scan().to_arrow().num_rows == 6
    catalog.close()


def test_the_tables_of_another_database_are_not_replaced(folder):
    registered(folder, "iceberg")
    shutil.copytree(folder / "my db", folder / "copy" / "my db")
    with pytest.raises(InputError, match=r"my_db\.features is a table at .*; give another name with --namespace"):
        sigdb.open(folder / "copy" / "my db").register_iceberg(str(folder / "catalog.db"))
    assert rows_of(folder, "iceberg") == sigdb.open(folder / "my db").cases()["id"].tolist()


@pytest.mark.parametrize(
    ("catalog", "namespace", "message"),
    [
        ("nowhere", None, "the catalog cannot be opened"),
        ("no/such/folder/catalog.db", None, "its folder does not exist"),
        ("catalog.db", "a b", "must be a name of letters, digits and underscores"),
    ],
)
def test_what_is_no_catalog_is_refused(folder, monkeypatch, catalog, namespace, message):
    monkeypatch.chdir(folder)
    with pytest.raises(InputError, match=message):
        sigdb.open(Path("my db")).register_iceberg(catalog, namespace=namespace)


@pytest.mark.parametrize(("kind", "library"), [("delta", "deltalake"), ("iceberg", "pyiceberg.catalog")])
def test_a_library_that_is_not_installed_is_named(folder, monkeypatch, kind, library):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=f"{library.partition('.')[0]}, which is not installed: pip install"):
        registered(folder, kind)
