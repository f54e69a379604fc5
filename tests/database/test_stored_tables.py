"""Unit: tables and results in batches, as they are needed, with little in memory."""

import re
import time

import numpy as np
import pyarrow as pa
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest

import sigdb
from sigdb.core.errors import DatabaseError, InputError
from sigdb.database.query import Connection, Engine

TABLES = ("features", "signals", "templates")


@pytest.fixture(scope="module")
def parts(parts_folder):
    return sigdb.open(parts_folder)


def stored(folder, table):
    """A table, read by pyarrow alone."""
    return pa.concat_tables(pq.read_table(path) for path in sorted((folder / table).iterdir()))


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("rows", [50, 300, 10**6])
def test_batches_are_the_table(database, folder, table, rows):
    batches = list(database.batches(table=table, rows=rows))
    assert max(batch.num_rows for batch in batches) <= rows
    assert pa.Table.from_batches(batches).equals(stored(folder, table), check_metadata=False)


@pytest.mark.parametrize("table", ["features", "signals"])
def test_batches_of_parts_come_by_id(parts, parts_folder, table):
    found = parts.batches(table=table, rows=300).read_all()
    assert found.equals(stored(parts_folder, table))
    assert found["id"].to_pylist() == list(range(5060))


@pytest.mark.parametrize("table", ["features", "signals"])
def test_batches_with_a_condition(parts, parts_folder, table):
    where = "tooth in (2, 9) and stiffness_loss > 0.15"
    ids = parts.cases(where)["id"].to_numpy()
    assert len(ids) == 115 * 2 * 2
    found = parts.batches(where, table=table, rows=64).read_all()
    assert found.equals(stored(parts_folder, table).take(ids))


@pytest.mark.parametrize(("table", "names"), [("features", ["fm4", "id"]), ("signals", ["tsa"]), ("templates", [])])
def test_columns_in_the_order_asked_for(database, folder, table, names):
    found = database.batches(table=table, columns=names or ["teeth", "template"]).read_all()
    assert found.equals(stored(folder, table).select(names or ["teeth", "template"]), check_metadata=False)


def test_columns_carry_what_they_are(database):
    schema = database.batches(columns=["rms", "stiffness_loss"]).schema
    assert schema.field("rms").metadata[b"unit"] == b"m/s"
    assert b"fraction" in schema.field("stiffness_loss").metadata[b"description"].lower()
    batch = database.batches(table="signals").read_next_batch()
    assert batch.schema.field("tsa__pinion-housing-vertical").metadata[b"unit"] == b"m/s^2"


@pytest.mark.parametrize("table", ["features", "signals"])
def test_no_row_meets_the_condition(database, table):
    found = database.batches("tooth = 99", table=table, columns=["id"]).read_all()
    assert found.num_rows == 0
    assert found.schema.names == ["id"]


def test_what_cannot_be_asked(database):
    for options, says in (
        ({"table": "case"}, r"table = 'case' is not a table of a database"),
        ({"columns": ["fm5"]}, r"columns: features has no column 'fm5'; did you mean 'fm\d'\?"),
        ({"columns": ['id", tooth --']}, r"columns: features has no column"),
        ({"rows": 0}, r"rows = 0 must be 1 or more"),
        ({"where": "tuth = 1"}, r"where = 'tuth = 1': .*\"tuth\" not found"),
    ):
        with pytest.raises(InputError, match=says):
            database.batches(**options)
    with pytest.raises(InputError, match=r"must be one SELECT statement; a database is read-only"):
        database.stream("drop view cases")
    with pytest.raises(InputError, match=r"rows = -1 must be 1 or more"):
        database.stream("select 1", rows=-1)


def test_a_stream_is_the_result(database):
    query = "select id, tooth, fm4 from cases where tooth > 0 order by id"
    batches = list(database.stream(query, rows=50))
    assert [batch.num_rows for batch in batches[:-1]] == [50] * (len(batches) - 1)
    assert pa.Table.from_batches(batches).equals(database.arrow(query))


def test_streams_do_not_disturb_each_other(parts):
    """Nor does a query that is asked while they are open."""
    one, other = parts.stream("select id from features", rows=100), parts.batches(rows=100, columns=["id"])
    for k in range(12):
        assert one.read_next_batch()["id"][0].as_py() == other.read_next_batch()["id"][0].as_py()
        assert len(parts.cases(f"id = {k}")) == 1


class Source:
    """A table of 2000 batches of 80 kB, 160 MB in all, which counts what was read of it and may break off."""

    schema = pa.schema({"id": pa.int64(), "x": pa.float64()})

    def __init__(self, broken_at=None):
        self.read, self.broken_at, self.errors = 0, broken_at, []

    def batches(self):
        for k in range(2000):
            if k == self.broken_at:
                self.errors.append(DatabaseError("this place is damaged"))
                raise self.errors[0]
            self.read = k + 1
            yield pa.record_batch([np.arange(5000) + 5000 * k, np.zeros(5000)], schema=self.schema)

    def connection(self):
        reader = pa.RecordBatchReader.from_batches(self.schema, self.batches())
        return Connection(Engine(1.0), {"features": reader}, errors=self.errors)


def rows_until_error(read):
    """Rows that a reader gives, and the error that it ends with; a small table is read ahead when it is opened."""
    rows = 0
    try:
        for batch in read():
            rows += batch.num_rows
    except DatabaseError as error:
        return rows, error
    return rows, None


READS = {
    "batches": lambda connection: connection.choose_batches("features", "x < 1", ["id"], 5000),
    "stream": lambda connection: connection.stream("select id from features where x < 1", 5000),
}


@pytest.mark.parametrize("read", READS)
def test_the_first_batches_come_before_most_is_read(read):
    source = Source()
    reader = READS[read](source.connection())
    for k in range(20):
        assert reader.read_next_batch()["id"][0].as_py() == 5000 * k
    time.sleep(0.5)  # in which a reader that reads ahead would read everything
    assert source.read < 600
    assert sum(batch.num_rows for batch in reader) == 5000 * (2000 - 20)
    assert source.read == 2000


@pytest.mark.parametrize("read", READS)
def test_damage_in_the_middle_is_told_in_the_middle(read):
    rows, error = rows_until_error(lambda: READS[read](Source(broken_at=1500).connection()))
    assert "this place is damaged" in str(error)
    assert 5000 * 500 < rows <= 5000 * 1500


def test_memory_is_bounded(parts):
    """Arrow holds a few row groups of 256 rows at a time, of 5060 rows."""
    before = pa.total_allocated_bytes()
    whole = sum(batch.nbytes for batch in parts.batches(table="signals", rows=256))
    most = 0
    for _ in parts.batches(table="signals", columns=["id", "tsa", "spectrum"], rows=256):
        most = max(most, pa.total_allocated_bytes() - before)
    assert most < whole / 3


@pytest.mark.parametrize("table", ["features", "signals"])
def test_damage_in_the_last_part(parts_copy, table):
    """What comes before is given, and the damage is an error of the database, not of the question."""
    path = parts_copy / table / "part-00002.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)
    rows, error = rows_until_error(lambda: sigdb.open(parts_copy).batches(table=table, rows=256))
    assert re.search(rf"{table}.part-00002\.parquet is damaged", str(error))
    assert (rows <= 4096) if table == "features" else (4096 <= rows < 5060)


def test_an_unfinished_database_has_batches(parts_copy):
    (parts_copy / "receipts" / "rows-00001.json").unlink()
    database = sigdb.open(parts_copy)
    ids = database.batches(table="signals", columns=["id"], where="true").read_all()["id"].to_pylist()
    assert ids == [*range(2048), *range(4096, 5060)]


def test_a_dataset_answers_by_its_rows_or_refuses(database, folder):
    """What Arrow does with the files of a dataset would find none."""
    dataset, table = database.dataset("features"), stored(folder, "features")
    assert dataset.count_rows() == table.num_rows
    assert dataset.head(3).equals(table.slice(0, 3), check_metadata=False)
    assert dataset.take([5, 2]).equals(table.take([5, 2]), check_metadata=False)
    few = dataset.to_table(columns=["id"], filter=ds.field("id") < 4)
    assert few["id"].to_pylist() == [0, 1, 2, 3]
    for refused in (
        lambda: dataset.filter(ds.field("id") < 4),
        lambda: list(dataset.get_fragments()),
        lambda: dataset.join(dataset, "id"),
        lambda: dataset.sort_by("id"),
        lambda: dataset.files,
    ):
        with pytest.raises(InputError, match="use these, or sql"):
            refused()
