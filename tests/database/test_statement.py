"""Unit: a query reads its views only, tells no settings, and holds nothing that DuckDB could not stop."""

import duckdb
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.database.statement import check_statement


@pytest.fixture(scope="module")
def cursor():
    with duckdb.connect(":memory:") as connection:
        yield connection


@pytest.mark.parametrize(
    "query",
    [
        "select * from '.tmp/secret.csv'",
        "from '.tmp/secret.csv'",
        "select * from read_text('.tmp/secret.csv')",
        "select * from read_blob('.tmp/*')",
        "select * from glob('.tmp/*')",
        "with a as (from read_csv('.tmp/secret.csv')) from a",
        "select (select content from read_text('.tmp/secret.csv'))",
        "select id from cases where exists (from glob('.tmp/*'))",
        "select * from cases, lateral read_text('.tmp/secret.csv')",
        "select 1 union all select file from glob('.tmp/*')",
        "from sniff_csv('.tmp/secret.csv')",
        "from query('select 1')",
        "from duckdb_settings()",
        "from duckdb_extensions()",
        "from duckdb_temporary_files()",
        "from duckdb_secrets()",
        "from which_secret('s3://a', 's3')",
        "select * from pg_catalog.pg_settings",
        "select * from PG_SETTINGS",
        "from duckdb_logs",
        "select current_setting('temp_directory')",
        "select CURRENT_SETTING('threads')",
        "select getvariable('x')",
        "show variables",
        "show databases",
        "from json_execute_serialized_sql(json_serialize_sql('select 1'))",
        "select write_log('x')",
        "select sleep_ms(20000)",
        "select pg_sleep(20)",
        "select st_area('x')",
        "from delta_scan('x')",
        "from iceberg_scan('x')",
        "update extensions",
        "select '\udcff'",
        "select " + "(" * 3000 + "1" + ")" * 3000,
        "select 1" + " " * 1_000_000,
    ],
)
def test_what_a_query_may_not_do_is_refused_in_a_line(database, query, tmp_path, monkeypatch):
    (tmp_path / ".tmp").mkdir()
    (tmp_path / ".tmp" / "secret.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"^query") as error:
        database.sql(query)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize("where", ["'.tmp/x' in (select file from glob('.tmp/*'))", "current_setting('threads') = '2'"])
def test_nor_may_a_condition(database, where):
    tsa = database.signals([0])["tsa"][0]
    for read in (database.cases, database.features, lambda some: database.match(tsa, where=some)):
        with pytest.raises(InputError, match=r"^query: where = "):
            read(where)


@pytest.mark.parametrize(
    "expression",
    [
        "printf('%1000000000d', 1)",
        "format('{:1000000000d}', 1)",
        "format('{:{}d}', 1, 1000000000)",
        "printf('%*d', 1000000000, 1)",
        "printf(text, 1)",
        "repeat('x', 1000000000)",
        "repeat('x', n)",
        "repeat(repeat('x', 10000), 10000)",
        "'x'.repeat(1000000000)",
        "lpad('x', 1000000000, 'y')",
        "rpad('x', 1e9::int, 'y')",
        "bitstring('1', 1000000000)",
        "range(1000000000)",
        "generate_series(0, 1000000000)",
        "unnest(range(1000000000))",
        "list_transform(range(10000), lambda i: repeat('x', 10000))",
        "list_resize([1], 1000000000)",
    ],
)
def test_a_length_that_is_large_or_computed_is_refused(cursor, expression):
    with pytest.raises(InputError, match=r"length"):
        check_statement(cursor, f"select {expression} from t")


@pytest.mark.parametrize(
    "text",
    [
        "select printf('%.3f', fm4), format('{:>10}', status), lpad(status, 12, ' '), repeat('-', 20) from cases",
        "select * from range(1000000000) t(i) limit 3",
        "select unnest(range(12)) as tooth, random(), now(), current_date, uuid()",
        "select [x * 2 for x in tsa if x > 0], list_sum(tsa), tsa[1:3] from signals",
        "select quantile_cont(fm4, [0.1, 0.9]), corr(fm4, rms), histogram(tooth), wavg(fm4, rms) from cases",
        "select row_number() over (partition by tooth order by fm4) from cases qualify true",
        "select table_name from information_schema.tables",
        "summarize cases",
        "describe features",
        "show tables",
        "with recursive f(x) as (select 1 union all select x + 1 from f where x < 5) from f",
    ],
)
def test_what_computes_is_a_query(cursor, text):
    check_statement(cursor, text)


def test_a_query_writes_no_file(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"more memory than"):
        sigdb.open(folder).sql("select * from range(300000000) t(i) order by hash(i)", max_memory_gb=0.1)
    assert list(tmp_path.iterdir()) == []
