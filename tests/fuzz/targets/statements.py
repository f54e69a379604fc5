"""SQL: statements and conditions of a user, which read the views of a database and nothing else."""

from damages import damaged
from outcomes import READ, FaultError, answered
from targets.stored import contents, small_database

import sigdb

SECRET = "do-not-read-this"
LIMITS = {"max_seconds": 2.0, "max_memory_gb": 0.2, "max_rows": 20_000}

STATEMENTS = (
    "select tooth, count(*) as rows, avg(fm4) as fm4 from features group by tooth order by tooth",
    "select f.id, s.tsa[1] from features f join signals s using (id) where tooth > 0 limit 5",
    "with a as (select * from cases), b as (select max(id) as id from a) select a.* from a join b using (id)",
    "select *, row_number() over (partition by tooth order by fm4 desc) as place from features",
    "select list_sum(tsa), array_length(tsa), unnest([1, 2]) from signals where id in (select id from cases)",
    "select t.template, c.id from templates t left join cases c on c.template = t.template",
    "describe features",
    "select case when fm4 > 3 then 'high' else status end as level from features union all select 'x'",
)
CONDITIONS = ("tooth = 6", "fm4 > 3 and tooth in (0, 1)", "status like 'ok%'", "id between 1 and 4 or tooth is null")
HOSTILE = (
    "read_csv('{secret}')", "read_text('{secret}')", "'{secret}'", "glob('{folder}/*')", "read_parquet('{folder}/*')",
    "parquet_metadata('{folder}/x')", "getenv('HOME')", "duckdb_settings()", "duckdb_secrets()", "pragma_version()",
    "range(1000000000000)", "repeat('x', 10000000000)", "generate_series(1, 100000000)", "list_value()", "version()",
    "(with recursive r as (select 1 as n union all select n + 1 from r) select max(n) from r)", "random()", "1/0",
    "features a cross join features b cross join features c cross join range(100000)", "sleep_ms(100000)", "null",
    "information_schema.tables", "sqlite_master", "query('select 1')", "query_table('features')",
    "1e400", "'\\x1b[31m'",
    "cast('x' as int)", "interval 1 year", "'é\x00\n'", "99999999999999999999999999", "[1, 2]", "{'a': 1}", "map()",
    "?", "$1", "current_setting('home_directory')", "(select tsa from signals)", "date '2024-01-02'", "'\x1b[2J'",
    "(" * 3000 + "1" + ")" * 3000, "not " * 2000 + "true", "a" * 5000, "exists (select 1)", "nan", "signals.tsa",
    "current_date", "uuid()", "typeof(tsa)", "columns(*)", "decode('\\xff'::blob)", "'\\xff'::blob", "1::hugeint",
    "'infinity'::double", "struct_pack(a := 1)", "timestamp 'infinity'", "enum_range(null::enum('a'))", "bit_string",
)  # fmt: skip
FORBIDDEN = (
    "copy cases to '{folder}/out.csv'", "attach '{folder}/x.db'", "install httpfs", "load httpfs", "pragma threads=1",
    "create table t as select 1", "drop view features", "set memory_limit = '100GB'", "delete from features",
    "export database '{folder}/out'", "call pragma_version()", "select 1; drop view features", "vacuum", "checkpoint",
    "create view v as select 1", "begin", "explain analyze select 1", "set enable_external_access = true", "use memory",
    "prepare a as select 1", "detach memory", "summarize features", "show tables",
    "pivot features on tooth using avg(fm4)",
    "from features", "table features", "values (1)", "import database '{folder}'", "create secret (type s3)", ";", "--",
    "/* select 1", "select 'a", 'select "a', "reset all", "force checkpoint", "update features set fm4 = 0",
)  # fmt: skip


def _mixed(text, random, places):
    """A statement in which words became hostile expressions, or bytes changed."""
    for _ in range(int(random.integers(0, 3))):
        words = text.split(" ")
        place = int(random.integers(len(words)))
        texts = HOSTILE if random.random() < 0.8 else words
        words[place] = _in(places, texts[int(random.integers(len(texts)))])
        text = " ".join(words)
    if random.random() < 0.3:
        text = damaged(text.encode("utf-8", "replace"), random, text=True)[0].decode("utf-8", "replace")
    return text


def sql(folder, random, about):
    """Query a database; it reads no file, changes nothing, and answers the next query as before."""
    database = sigdb.open(small_database())
    (folder / "secret.txt").write_text(SECRET + "\n", encoding="utf-8")
    places = {"{secret}": str(folder / "secret.txt"), "{folder}": str(folder)}
    way = ("sql", "sql", "arrow", "stream", "cases", "features")[int(random.integers(6))]
    conditions = way in ("cases", "features")
    texts = CONDITIONS if conditions else STATEMENTS
    text = _mixed(texts[int(random.integers(len(texts)))], random, places)
    if random.random() < 0.15:
        text = _in(places, FORBIDDEN[int(random.integers(len(FORBIDDEN)))])
    about["way"], about["text"] = way, text[:1000]
    before, files = contents(small_database()), sorted(path.name for path in folder.iterdir())

    def query():
        result = getattr(database, way)(text, **LIMITS)
        shown = repr(result.read_all().to_pylist() if way == "stream" else result.to_pylist() if way == "arrow" else
                     result.to_dict("records") if len(result) < 2000 else "")  # fmt: skip
        if SECRET in shown:
            raise FaultError("leak", text[:300])
        return READ

    outcome = answered(query, about)
    if contents(small_database()) != before or sorted(path.name for path in folder.iterdir()) != files:
        raise FaultError("written", text[:300])
    count = database.sql("select count(*) as n from features")["n"][0]
    if count != len(database):
        raise FaultError("unsound", f"{count} rows in place of {len(database)} after {text[:300]}")
    return outcome


def _in(places, text):
    for name, place in places.items():
        text = text.replace(name, place)
    return text
