"""Unit: SQL over a database reads its views, and nothing else, and changes nothing."""

import hashlib
import re

import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import sigdb
from sigdb.core.errors import InputError


def state(folder):
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.rglob("*") if path.is_file()}


def test_the_views(database):
    tables = database.sql("select table_name from information_schema.tables")["table_name"]
    assert sorted(tables) == ["cases", "features", "signals", "templates"]
    assert len(database.sql("select * from cases")) == len(database)


def test_a_query_of_the_documents(database):
    """``select tooth, avg(fm4) from features group by tooth`` against pandas."""
    found = database.sql(
        "select tooth, avg(fm4) as fm4 from features where status = 'ok' group by tooth order by tooth"
    )
    cases = database.cases("status = 'ok'")
    expected = cases.astype({"fm4": float}).groupby("tooth", as_index=False)["fm4"].mean()
    pd.testing.assert_frame_equal(found, expected, check_dtype=False, rtol=1e-12)


@pytest.mark.parametrize(
    ("query", "rows"),
    [
        ("with a as (select id from cases where tooth = 1) select count(*) from a join signals using (id)", 1),
        ("from cases limit 3", 3),
        ("values (1), (2)", 2),
        ("select id, tsa[1] as first from signals where id < 4;", 4),
        ("select id from cases where tooth = 6 union all select id from cases where tooth = 6", 32),
        ('select "rms__pinion-housing-vertical" from cases limit 2', 2),
        ("select * from cases where tooth = 99", 0),
    ],
)
def test_one_select_in_its_many_forms(database, query, rows):
    assert len(database.sql(query)) == rows


def test_arrow_keeps_types(database):
    table = database.arrow("select id, rms, wigner_ville, status from features limit 2")
    assert isinstance(table, pa.Table)
    assert [str(field.type) for field in table.schema][:3] == ["int64", "float", "list<element: float>"] or [
        table.schema.field(0).type,
        table.schema.field(1).type,
    ] == [pa.int64(), pa.float32()]


@pytest.mark.parametrize(
    "query",
    [
        "insert into cases values (1)",
        "insert into templates select * from templates",
        "update features set tooth = 1",
        "delete from features",
        "drop view cases",
        "drop view features",
        "create table mine as select * from cases",
        "create view mine as select 1",
        "create or replace view cases as select 1 as id",
        "create macro f(x) as x + 1",
        "alter view cases rename to other",
        "copy (select 1) to 'OUT'",
        "copy cases to 'OUT' (format parquet)",
        "export database 'OUT'",
        "attach 'OUT'",
        "detach memory",
        "use memory",
        "set threads = 1",
        "set enable_external_access = true",
        "reset lock_configuration",
        "pragma enable_profiling",
        "pragma database_list",
        "install httpfs",
        "load httpfs",
        "call pragma_version()",
        "checkpoint",
        "begin transaction",
        "prepare x as select 1",
        "explain analyze select 1",
        "vacuum",
        "select 1; select 2",
        "select 1; drop view cases",
        "",
        " ; ",
        "-- nothing",
    ],
)
def test_only_one_select_is_run(copy, query, tmp_path):
    database, before = sigdb.open(copy), state(copy)
    count = len(database.sql("select * from cases"))
    with pytest.raises(InputError, match=r"must be one SELECT statement; a database is read-only"):
        database.sql(query.replace("OUT", str(tmp_path / "out")))
    assert len(database.sql("select * from cases")) == count
    assert state(copy) == before
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]


@pytest.mark.parametrize(
    "query",
    [
        "select * from read_text('FILE')",
        "select * from read_blob('FILE')",
        "select * from read_csv('FILE')",
        "select * from read_csv_auto('FILE')",
        "select * from read_json('FILE')",
        "select * from read_parquet('PARQUET')",
        "select * from parquet_metadata('PARQUET')",
        "select * from parquet_scan('PARQUET')",
        "select * from 'FILE'",
        "select * from 'PARQUET'",
        'select * from "PARQUET"',
        "select * from glob('*')",
        "select * from query('select * from read_text(''FILE'')')",
        "select count(*) from cases where id in (select length(content) from read_text('FILE'))",
        "select * from 'https://example.org/a.parquet'",
        "select getenv('HOME')",
    ],
)
def test_no_file_can_be_read(database, folder, tmp_path, query):
    (tmp_path / "secret.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    query = query.replace("FILE", str(tmp_path / "secret.csv"))
    with pytest.raises(InputError, match=r"^query: "):
        database.sql(query.replace("PARQUET", str(folder / "features" / "part-00000.parquet")))


def test_variables_of_python_are_not_tables(database):
    secret = pd.DataFrame({"x": [1]})
    assert len(secret) == 1
    for name in ("secret", "database"):
        with pytest.raises(InputError, match=rf"Table with name {name} does not exist"):
            database.sql(f"select * from {name}")


@pytest.mark.parametrize(
    ("query", "says"),
    [
        ("selec 1", r"query: .*syntax error"),
        ("select fm5 from cases", r'query: .*"fm5" not found.*; Candidate bindings: .*fm4'),
        ("select * from case_", r"query: .*case_ does not exist"),
        ("select sum(status) from cases", r"query: "),
        ("select 1/", r"query: .*syntax error"),
    ],
)
def test_a_wrong_query_is_told_in_a_sentence(database, query, says):
    with pytest.raises(InputError, match=says) as error:
        database.sql(query)
    assert "\n" not in str(error.value)


SMUGGLED = [
    "true); drop view cases; select (1",
    "true; select 1",
    "true); select 1 --",
    "true) --",
    "1=0) union all select * from cases --",
    "1=0) union all select * from features --",
    "true) order by id limit (1",
    "true union select 1",
    "true order by id desc",
    "true limit 1",
    "true group by all",
    "tooth = 1, tooth = 2",
    "*",
    "select 1",
    "tooth = 1 /* open",
    "(select count(*) from read_text('/etc/hostname')) > 0",
    "exists (from glob('/*'))",
    "getenv('HOME') <> ''",
    "sum(tooth) > 1",
    "row_number() over () = 1",
    "tooth = ",
    "tuth = 1",
]


@pytest.mark.parametrize("where", SMUGGLED)
def test_a_condition_smuggles_nothing(database, where):
    """It is one expression or an error that repeats it; what follows an expression is never run."""
    for read in (database.cases, database.features, lambda where: database.batches(where).read_all()):
        with pytest.raises(InputError, match=r"^query: where = " + re.escape(repr(where))) as error:
            read(where)
        assert "\n" not in str(error.value)
    assert len(database.cases()) == len(database)


@pytest.mark.parametrize("where", ["", "  ", 3, True, ["tooth = 1"]])
def test_a_condition_is_a_text(database, where):
    with pytest.raises(InputError, match=r"where = .* must be a condition in SQL, for example 'tooth = 6'"):
        database.cases(where)


@pytest.mark.parametrize(
    ("where", "rows"),
    [
        ("tooth = 6 -- and more", 4 * 2 * 2),
        ("tooth = 6 /* and more */", 4 * 2 * 2),
        ("status like '%;;%' or tooth = 6", 4 * 2 * 2),
        ("id in (select id from signals where tsa is null)", 3),
        ("id = (select max(id) from cases)", 1),
        ("tooth", 548 - 360),
        ("null", 0),
        ("(tooth = 6) and not (stiffness_loss < 0.25)", 4 * 2),
    ],
)
def test_expressions_of_every_kind(database, where, rows):
    """Comments, semicolons in text, subqueries over the views: all within the one expression."""
    assert len(database.cases(where)) == rows


WORDS = ["tooth", "1", "'a'", "=", "or", "and", "not", "(", ")", ";", ",", "--", "select", "union all", "from", "cases"]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(where=st.lists(st.sampled_from([*WORDS, "*", "order by", "limit", "1=0)", "is null", "/*", "*/"])).map(" ".join))
def test_no_text_gives_more_than_rows_of_the_database(database, where):
    """Either an error, or some rows, each once, with the columns that cases have."""
    try:
        found = database.cases(where)
    except InputError:
        return
    assert list(found) == list(database.cases("id = 0"))
    assert found["id"].is_monotonic_increasing
    assert found["id"].is_unique
    assert found["id"].between(0, len(database) - 1).all()
