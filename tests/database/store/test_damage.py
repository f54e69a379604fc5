"""Unit: what is damaged is an error that names it, and never a wrong number."""

import shutil

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import sigdb
from sigdb.core.errors import CorruptionError, DatabaseError, InputError
from sigdb.database.store.seal import sealed_json

TABLES = ("templates", "features", "signals")


def flipped(path, offset, bit=0):
    content = bytearray(path.read_bytes())
    content[offset] ^= 1 << bit
    path.write_bytes(content)


def pages(path):
    """Row group, name, first byte and size of each column's chunk; its end is data, its first tens of bytes header."""
    metadata = pq.ParquetFile(path).metadata
    for i in range(metadata.num_row_groups):
        for j in range(metadata.num_columns):
            column = metadata.row_group(i).column(j)
            first = column.dictionary_page_offset if column.has_dictionary_page else column.data_page_offset
            yield i, column.path_in_schema, first, column.total_compressed_size


@pytest.mark.parametrize("where", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("column", ["id", "status", "tooth", "rms", "wigner_ville"])
def test_a_flipped_bit_of_features(copy, column, where):
    path = copy / "features" / "part-00000.parquet"
    ((first, size),) = [(a, b) for _, name, a, b in pages(path) if name.split(".list.")[0] == column]
    # Small chunks are mostly header: of those only the last byte but one is certainly data.
    flipped(path, first + (int(where * size) if size > 500 else size) - 2, bit=3)
    database = sigdb.open(copy)
    for read in (
        lambda: database.features(),
        lambda: database.cases() if column != "wigner_ville" else database.sql("select wigner_ville from features"),
        lambda: database.sql(f'select max("{column}") from features'),
    ):
        with pytest.raises(DatabaseError, match=r"damaged"):
            read()


@pytest.mark.parametrize("where", [0.3, 0.6, 1.0])
@pytest.mark.parametrize(("column", "group"), [("tsa", 0), ("tsa", 2), ("spectrum", 1), ("id", 1)])
def test_a_flipped_bit_of_signals(copy, database, column, group, where):
    path = copy / "signals" / "part-00000.parquet"
    ((first, size),) = [(a, b) for i, name, a, b in pages(path) if name.split(".list.")[0] == column and i == group]
    flipped(path, first + (int(where * size) if size > 500 else size) - 2, bit=5)
    damaged = sigdb.open(copy)
    rows = np.arange(256 * group, min(256 * (group + 1), len(database)))
    with pytest.raises(DatabaseError, match=r"signals.part-00000\.parquet is damaged: bytes \d+ to \d+ are not as"):
        damaged.signals(rows)
    with pytest.raises(DatabaseError, match=r"damaged"):
        damaged.sql(f"select count({column}), max({column}) from signals")
    other = 256 * ((group + 1) % 2)
    if group < 2:  # the last row group shares its block with the footer, which every reading needs
        assert np.array_equal(damaged.signals([other])["tsa"], database.signals([other])["tsa"])


@pytest.mark.parametrize("column", ["tsa", "specimen_response", "status", "min_compression"])
def test_a_flipped_bit_of_templates(copy, column):
    path = copy / "templates" / "part-00000.parquet"
    ((first, size),) = [(a, b) for _, name, a, b in pages(path) if name.split(".list.")[0] == column]
    flipped(path, first + size - 2)
    database = sigdb.open(copy)
    with pytest.raises(DatabaseError, match=r"damaged"):
        database.sql(f"select max({column}) from templates")
    with pytest.raises(DatabaseError, match=r"damaged"):
        database.templates()


READERS = {
    "features": lambda database: database.features(),
    "signals": lambda database: pd.DataFrame(
        {key: list(values) for key, values in database.signals(np.arange(120)).items()}
    ),
    "templates": lambda database: database.sql("select * from templates order by template"),
}


@pytest.mark.parametrize("table", TABLES)
def test_no_flipped_bit_gives_a_wrong_number(copy, database, table):
    """Anywhere in the file, in data, page headers and footer: either the bit is not read, or it is an error."""
    path = copy / table / "part-00000.parquet"
    content, expected = path.read_bytes(), READERS[table](database)
    rng = np.random.default_rng(len(content))
    headers = [first + at for _, _, first, _ in pages(path) for at in range(0, 40, 13)]
    footer = range(len(content) - int.from_bytes(content[-8:-4], "little") - 8, len(content))
    at = [*rng.integers(len(content), size=20), *rng.choice(headers, 10), *rng.choice(footer, 10), *footer[-8:], 0]
    found = 0
    for offset in at:
        path.write_bytes(content)
        flipped(path, int(offset), bit=int(rng.integers(8)))
        try:
            pd.testing.assert_frame_equal(READERS[table](sigdb.open(copy)), expected)
        except DatabaseError as error:
            assert f"{path} is damaged: bytes" in str(error)  # noqa: PT017
            found += 1
    # Of signals, one sensor of two and one row group of three are read.
    assert found == len(at) or (table == "signals" and found > 18)


@pytest.mark.parametrize("size", [0, 3, 1000, -1])
@pytest.mark.parametrize("table", TABLES)
def test_a_truncated_file_is_found_when_the_database_is_opened(copy, table, size):
    path = copy / table / "part-00000.parquet"
    content = path.read_bytes()
    path.write_bytes(content[:size])
    says = rf"{table}.part-00000\.parquet has {len(content[:size])} bytes, its receipt says {len(content)} bytes; make "
    with pytest.raises(CorruptionError, match=says):
        sigdb.open(copy)


@pytest.mark.parametrize("table", TABLES)
def test_a_missing_file_is_found_when_the_database_is_opened(copy, table):
    (copy / table / "part-00000.parquet").unlink()
    with pytest.raises(
        CorruptionError, match=r"part-00000\.parquet is missing, its receipt says .*; make it again with"
    ):
        sigdb.open(copy)


@pytest.mark.parametrize("table", TABLES)
def test_a_file_that_is_no_parquet_is_an_error(copy, table):
    path = copy / table / "part-00000.parquet"
    path.write_bytes(bytes(path.stat().st_size))
    database = sigdb.open(copy)
    read = {"templates": database.templates, "features": database.cases, "signals": lambda: database.signals([0])}
    with pytest.raises(DatabaseError, match=r"damaged"):
        read[table]()
    with pytest.raises(DatabaseError, match=r"damaged"):
        database.sql(f"select count(*) from {table}")
    if table == "signals":
        with pytest.raises(DatabaseError, match=r"damaged"):
            database.unit("tsa")


@pytest.mark.parametrize(
    "name", ["IOError: a", "b. Detail: Python exception", "c; d: is damaged: e", "reading the stream"]
)
def test_an_error_names_the_file_whatever_the_folder_is_called(copy, tmp_path, name):
    """DuckDB passes the error on inside a text of its own, which nobody reads."""
    folder = copy.rename(tmp_path / name)
    flipped(folder / "features" / "part-00000.parquet", -1)
    database = sigdb.open(folder)
    path = folder / "features" / "part-00000.parquet"
    for read in (database.cases, lambda: database.stream("select fm4 from features").read_all()):
        with pytest.raises(CorruptionError) as found:
            read()
        assert found.value.file == str(path)
        assert str(found.value).startswith(f"{path} is damaged: bytes ")


@pytest.mark.parametrize("query", ["select error('reading the stream')", "select cast('a' || id as int) from cases"])
def test_a_statement_that_fails_while_it_runs_is_no_damage(database, query):
    with pytest.raises(InputError, match=r"^query: "):
        database.sql(query)
    with pytest.raises(InputError, match=r"^query: "):
        database.stream(query).read_all()


def test_damage_of_an_earlier_query_is_not_blamed_on_a_later_statement(copy):
    database = sigdb.open(copy)
    assert len(database.sql("select id from cases limit 1")) == 1
    flipped(copy / "features" / "part-00000.parquet", 1000)
    with pytest.raises(CorruptionError):
        database.cases()
    with pytest.raises(InputError, match=r"x1"):
        database.sql("select x1 from templates")


def test_a_file_that_goes_while_the_database_is_open(copy):
    database = sigdb.open(copy)
    shutil.rmtree(copy / "signals")
    with pytest.raises(CorruptionError, match=r"signals.part-00000\.parquet is missing"):
        database.signals([0])


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"files": [{}]}', '{"files": 3}'])
def test_a_receipt_that_cannot_be_read(copy, content):
    (copy / "receipts" / "rows-00000.json").write_text(content, encoding="utf-8")
    with pytest.raises(
        CorruptionError, match=r"rows-00000\.json is damaged .*; make it again with: sigdb verify"
    ) as found:
        sigdb.open(copy)
    assert found.value.file.endswith("rows-00000.json")
    assert (found.value.problem, found.value.remedy[:13]) == ("is damaged or was edited", "make it again")


@pytest.mark.parametrize("content", [{}, {"files": [{}]}, {"files": 3}])
def test_a_sealed_receipt_that_says_nothing(copy, content):
    (copy / "receipts" / "rows-00000.json").write_bytes(sealed_json({"name": "rows"} | content))
    with pytest.raises(CorruptionError, match=r"; make it again with: sigdb verify .* --repair"):
        sigdb.open(copy)


def test_a_receipt_in_the_place_of_another(parts_copy):
    receipts = parts_copy / "receipts"
    shutil.copy(receipts / "rows-00000.json", receipts / "rows-00001.json")
    with pytest.raises(CorruptionError, match=r"rows-00001\.json is a copy of receipts/rows-00000\.json; move it away"):
        sigdb.open(parts_copy)


def test_a_part_of_another_database_is_none_of_this(parts_copy, parts_folder, make, parts_text):
    """The same layout with another seed, its part and receipt whole: its rows are not taken for this one's."""
    other = make(parts_text.replace("seed = 7", "seed = 8"))
    for name in ("receipts/rows-00001.json", "features/part-00001.parquet", "signals/part-00001.parquet"):
        shutil.copy(other / name, parts_copy / name)
    database = sigdb.open(parts_copy)
    assert len(database) == 5060 - 2048
    pd.testing.assert_frame_equal(
        database.cases(), sigdb.open(parts_folder).cases("id < 2048 or id >= 4096"), check_dtype=False
    )
