"""Queries of a database: look-ups, aggregates, conditions and match, against other ways to the same answers.

Without --db a database of --rows rows and --templates templates is written into a temporary folder, by the library's
own writer with the columns of pipelines/quick.toml. Its numbers are made up (random averages, templates that are a mesh
tone and a random low-order residual), so that it takes seconds; they weigh as much as simulated ones. The cold look-up
opens the database first. Other times are the best of several runs after a first one; the first match, which puts the
templates' spectra into the cache, is told by itself.

Peers, with the same rows: one .mat and one .npz file a row (of --files rows), pandas reading the whole features,
DuckDB on the Parquet files without checksums, and NumPy's match in double precision over all turns.

    python benchmarks/query.py [--rows N] [--templates N] [--db DIRECTORY] [--json FILE]
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
from measuring import environment, json_option, publish
from scipy.io import loadmat, savemat
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core.version import __version__
from sigdb.database import Database, Manifest
from sigdb.database.matching.residuals import unit_residuals
from sigdb.database.store.manifest import PlanRecord
from sigdb.database.store.store import Store
from sigdb.database.store.writer import write_part
from sigdb.pipeline import load_recipe
from sigdb.sweep.plan.schema import plan_schema

RECIPE = Path(__file__).parents[1] / "pipelines" / "quick.toml"
AGGREGATE = "select tooth, avg(fm4) as fm4 from features group by tooth order by tooth"
WHERE = "tooth = 6 and stiffness_loss >= 0.25"
TEETH, N, CELLS = 12, 768, 204
PART_TEMPLATES = 4096
AIMS_MS = {"look-up of one id": 5.0, "aggregate": 150.0, "match": 300.0}
SECONDS = 1.0


@dataclass(frozen=True, kw_only=True)
class Row:
    """One way to do one thing: milliseconds, and of how many rows, files or templates."""

    what: str
    by: str
    ms: float
    of: str


def main() -> None:
    """Print the table, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000, help="rows of the synthetic database")
    parser.add_argument("--templates", type=int, default=100_000, help="templates of the synthetic database")
    parser.add_argument("--files", type=int, default=1000, help="files of the peer that keeps one a row")
    parser.add_argument("--db", type=Path, help="measure this database instead")
    json_option(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        os.environ["SIGDB_CACHE"] = str(Path(folder) / "cache")
        path = options.db or synthetic(Path(folder) / "db", options.rows, options.templates)
        rows = [*lookups(path, Path(folder), options.files), *aggregates(path, Path(folder)), *matches(path)]
    machine = environment("numpy", "scipy", "pandas", "pyarrow", "duckdb")
    publish(machine, {"Queries": compared(rows)}, options.json)


def synthetic(root: Path, rows: int, templates: int) -> Path:
    """A database of made-up numbers, written part by part."""
    plan = load_recipe(RECIPE).plan()
    schema, rng, store = plan_schema(plan), np.random.default_rng(1), Store.at(root)
    part_rows = min(max(1 << max(0, rows // 16 - 1).bit_length(), 2048), 32768)
    record = PlanRecord(
        hash=f"{rows:032x}{templates:032x}", seed=1, rows=rows, templates=templates, resolved=plan.resolved
    )
    Manifest(
        plan=record,
        part_rows=part_rows,
        part_templates=PART_TEMPLATES,
        sensors=plan.sensors,
        recipe="",
        sigdb_version=__version__,
    ).write(store)
    for part, first in enumerate(range(0, templates, PART_TEMPLATES)):
        content = template_columns(np.arange(first, min(first + PART_TEMPLATES, templates)), rng)
        pieces = [{"templates": table(content, schema.arrow("templates"))}]
        write_part(store, "templates", part, pieces, plan=record.hash, first=first, started=time.perf_counter())
    for part, first in enumerate(range(0, rows, part_rows)):
        content = row_columns(np.arange(first, min(first + part_rows, rows)), rng)
        pieces = [{name: table(content, schema.arrow(name)) for name in ("features", "signals")}]
        write_part(store, "rows", part, pieces, plan=record.hash, first=first, started=time.perf_counter())
    return root


def case_columns(numbers: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Parameters that a template and a row share."""
    k = numbers.size
    return {
        "status": ["ok"] * k,
        "status_code": ["ok"] * k,
        "gear": ["pinion"] * k,
        "shaft": ["pinion-shaft"] * k,
        "pattern": [""] * k,
        "teeth": np.full(k, TEETH),
        "stiffness_loss": rng.random(k) / 2,
        "phase_shift_deg": rng.random(k) * 3,
        "damaged_teeth": 1 + numbers % 3,
    }


def template_columns(numbers: Any, rng: np.random.Generator) -> dict[str, Any]:
    """A mesh tone and a residual of some fifty orders."""
    k, theta = numbers.size, 2 * np.pi * np.arange(N) / N
    spectrum = np.zeros((k, N // 2 + 1), complex)
    spectrum[:, 3:60] = rng.normal(size=(k, 57)) + 1j * rng.normal(size=(k, 57))
    tsa = np.cos(TEETH * theta) + 2 * np.fft.irfft(spectrum, N)
    return {"template": numbers, "tooth": np.ones(k, int), "tsa": list(tsa.astype(np.float32))} | case_columns(
        numbers, rng
    )


def row_columns(numbers: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Random averages, spectra, cells and indicators."""
    k = numbers.size
    return {
        "id": numbers,
        "template": numbers % 1000,
        "tooth": numbers % (TEETH + 1),
        "tsa": list(rng.standard_normal((k, N), np.float32)),
        "spectrum": list(rng.random((k, N // 2 + 1), np.float32)),
        "wigner_ville": list(rng.random((k, CELLS), np.float32)),
    } | case_columns(numbers, rng)


def table(content: dict[str, Any], schema: pa.Schema) -> pa.Table:
    """An Arrow table; numbers that are not given are random, lists that are not are missing."""
    k, rng = len(content["template"]), np.random.default_rng(2)

    def column(field: pa.Field) -> Any:
        if field.name in content:
            return pa.array(content[field.name], field.type)
        if pa.types.is_floating(field.type):
            return pa.array(rng.random(k), field.type)
        return pa.array([None] * k, field.type) if pa.types.is_list(field.type) else pa.array(np.zeros(k), field.type)

    return pa.table([column(field) for field in schema], schema=schema)


def lookups(path: Path, folder: Path, files: int) -> Iterator[Row]:
    """Signals by id, and of a random thousand."""
    started = time.perf_counter()
    sigdb.open(path).signals([len(sigdb.open(path)) // 3])
    cold, db = 1e3 * (time.perf_counter() - started), sigdb.open(path)
    rng, count = np.random.default_rng(0), len(db)
    of = f"{count} rows"
    yield Row(what="look-up, database opened", by="sigdb", ms=cold, of=of)
    yield Row(what="look-up of one id", by="sigdb", ms=timed(lambda: db.signals([rng.integers(count)])), of=of)
    thousand = rng.choice(count, min(1000, count), replace=False)
    yield Row(what="look-up of 1000 ids", by="sigdb", ms=timed(lambda: db.signals(thousand)), of=of)
    some = {"mat": folder / "mat", "npz": folder / "npz"}
    for kind, target in some.items():
        target.mkdir()
        write_files(db, target, kind, files)
        read = loadmat if kind == "mat" else read_npz
        names = sorted(target.iterdir())
        one = timed(lambda read=read, names=names: read(names[rng.integers(len(names))])["tsa"])
        yield Row(what="look-up of one id", by=f"one .{kind} a row", ms=one, of=f"{files} files")
    thousand = [*(folder / "npz").iterdir()] * (1 + 1000 // files)
    all_files = timed(lambda: [read_npz(name)["tsa"] for name in thousand[:1000]])
    yield Row(what="look-up of 1000 ids", by="one .npz a row", ms=all_files, of=f"{files} files")


def write_files(db: Database, folder: Path, kind: str, files: int) -> None:
    """The first rows, one file each."""
    cases, signals = db.cases(f"id < {files}"), db.signals(np.arange(files))
    for i in range(files):
        content = {"tsa": signals["tsa"][i], "tooth": cases["tooth"].iloc[i], "fm4": cases["fm4"].iloc[i]}
        name = folder / f"{i:06d}.{kind}"
        savemat(name, content) if kind == "mat" else np.savez(name, **content)


def read_npz(path: Path) -> dict[str, Any]:
    """Content of a file of arrays."""
    with np.load(path) as content:
        return dict(content)


def aggregates(path: Path, folder: Path) -> Iterator[Row]:
    """An aggregate over all rows, and rows by a condition."""
    db = sigdb.open(path)
    of, features = f"{len(db)} rows", path / "features"
    expected = db.sql(AGGREGATE)
    yield Row(what="aggregate", by="sigdb", ms=timed(lambda: db.sql(AGGREGATE)), of=of)

    with duckdb.connect(":memory:", config={"threads": os.cpu_count()}) as plain:
        text = AGGREGATE.replace("features", f"'{features}/*.parquet'")
        yield Row(what="aggregate", by="DuckDB, no checksums", ms=timed(lambda: plain.sql(text).df()), of=of)
        pd.testing.assert_frame_equal(plain.sql(text).df(), expected, check_dtype=False)

    def by_pandas() -> Any:
        return pd.read_parquet(features).groupby("tooth")["fm4"].mean()

    yield Row(what="aggregate", by="pandas, all columns", ms=timed(by_pandas), of=of)

    for kind in ("mat", "npz"):
        names, read = [*(folder / kind).iterdir()], loadmat if kind == "mat" else read_npz

        def by_files(names: Any = names, read: Any = read) -> Any:
            rows = [(float(np.squeeze(one["tooth"])), float(np.squeeze(one["fm4"]))) for one in map(read, names)]
            return pd.DataFrame(rows).groupby(0).mean()

        yield Row(what="aggregate", by=f"one .{kind} a row", ms=timed(by_files), of=f"{len(names)} files")
    yield Row(what="cases(where)", by="sigdb", ms=timed(lambda: db.cases(WHERE)), of=of)
    yield Row(
        what="cases(where)",
        by="pandas, all columns",
        ms=timed(lambda: pd.read_parquet(features).query(WHERE.replace(" = ", " == "))),
        of=of,
    )


def matches(path: Path) -> Iterator[Row]:
    """A noisy, turned template, against all templates at all turns."""
    db = sigdb.open(path)
    clean = np.stack([np.asarray(one) for one in db.sql("select tsa from templates limit 1000")["tsa"]])
    count = int(db.sql("select count(*) as n from templates where tsa is not null")["n"].iloc[0])
    n, rng = clean.shape[1], np.random.default_rng(5)
    x = np.roll(clean[-1], n // 3) + 0.3 * clean[-1].std() * rng.normal(size=n)
    of = f"{count} templates x {n}"
    started = time.perf_counter()
    db.match(x)
    yield Row(what="match, cache made", by="sigdb", ms=1e3 * (time.perf_counter() - started), of=of)
    yield Row(what="match, database opened", by="sigdb", ms=timed(lambda: sigdb.open(path).match(x)), of=of)
    yield Row(what="match", by="sigdb", ms=timed(lambda: db.match(x)), of=of)

    z, z_t = unit_residuals(x, TEETH), unit_residuals(clean, TEETH)

    def by_numpy() -> Any:
        c = np.fft.irfft(np.fft.rfft(z) * np.fft.rfft(z_t).conj(), n)
        return np.argsort(np.mean(z**2) + np.mean(z_t**2, axis=1) - 2 * c.max(axis=1) / n)[:10]

    yield Row(what="match", by="NumPy, scaled up", ms=timed(by_numpy) * count / len(z_t), of=of)


def timed(call: Callable[[], Any]) -> float:
    """Least time of several runs after a first one, ms."""
    call()
    seconds, until = [], time.perf_counter() + SECONDS
    while len(seconds) < 3 or time.perf_counter() < until:
        started = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - started)
    return min(seconds) * 1e3


def compared(rows: list[Row]) -> list[dict[str, Any]]:
    """One row for each way, with its time as a multiple of sigdb's for the same thing."""
    own = {row.what: row.ms for row in rows if row.by == "sigdb"}
    aims = [AIMS_MS.get(row.what) if row.by == "sigdb" else None for row in rows]
    return [
        asdict(row) | {"times sigdb": row.ms / own[row.what], "aim, ms": aim}
        for row, aim in zip(rows, aims, strict=True)
    ]


if __name__ == "__main__":
    main()
