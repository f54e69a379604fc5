"""Cost of a database against its number of rows: what stays flat, and what grows.

The recipe is pipelines/quick.toml with more noise draws and healthy rows, so that databases differ in their number of
rows only. Each step is a process of its own, whose imports do not count. Memory is the greatest that it held; that of
the workers of a sweep is not in it. Virtual rows are those of the same recipe with `store = "templates"`. Ten million
of them take a quarter of an hour: `--virtual 10000000`. The last table is computed: the cost by row of the largest
database of each kind, times a billion. A file of the same machine and versions keeps its other sizes, so that they
may be measured one by one.

    python benchmarks/scale.py [--rows N ...] [--virtual N ...] [--jobs 2] [--json FILE]
"""

import argparse
import json
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from measuring import environment, json_option, publish

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run, verify

RECIPE = Path(__file__).parents[1] / "pipelines" / "quick.toml"


def main() -> None:
    """Measure databases of all sizes and publish the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="*", default=[10_000, 100_000, 1_000_000], help="stored rows")
    parser.add_argument("--virtual", type=int, nargs="*", default=[10_000, 100_000, 1_000_000], help="virtual rows")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes of a sweep")
    parser.add_argument("--step", nargs=3, metavar=("STEP", "RECIPE", "DB"), help=argparse.SUPPRESS)
    json_option(parser)
    options = parser.parse_args()
    if options.step:
        name, recipe, place = options.step
        print(json.dumps(measured(STEPS[name], Path(recipe), Path(place), options.jobs)))
        return
    machine = environment("numpy", "pyarrow", "duckdb")
    before = measured_before(options.json, machine)
    stored = together(before.get("Stored rows", []), [costs(rows, "rows", options.jobs) for rows in options.rows])
    virtual = together(
        before.get("Virtual rows", []), [costs(rows, "templates", options.jobs) for rows in options.virtual]
    )
    computed = [
        billion(kind, lines[-1], options.jobs) for kind, lines in (("stored", stored), ("virtual", virtual)) if lines
    ]
    publish(
        machine, {"Stored rows": stored, "Virtual rows": virtual, "A billion rows, computed": computed}, options.json
    )


def measured_before(file: Path | None, machine: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a file that were measured on a machine like this one, with the same versions."""
    if file is None or not file.exists():
        return {}
    document = json.loads(file.read_text(encoding="utf-8"))
    same = all(document["machine"].get(key) == value for key, value in machine.items() if key != "load")
    tables: dict[str, Any] = document["tables"]
    return tables if same else {}


def together(before: list[dict[str, Any]], now: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the lines of databases by their number of rows, the newer one of each."""
    lines = {line["rows"]: line for line in [*before, *now]}
    return [lines[rows] for rows in sorted(lines)]


def billion(kind: str, line: Mapping[str, Any], jobs: int) -> dict[str, Any]:
    """Return the cost of a billion rows, from that of a database by row."""
    hours = {name: line[f"{name}, us a row"] * 1e9 / 1e6 / 3600 for name, unit in UNITS.items() if unit == "us a row"}
    return {"rows": kind, "TB": line["bytes a row"] / 1e3, "sweep, core hours": hours.pop("sweep") * jobs} | {
        f"{name}, hours": value for name, value in hours.items()
    }


def costs(rows: int, store: str, jobs: int) -> dict[str, Any]:
    """Return the cost of each step of a database of about so many rows."""
    with tempfile.TemporaryDirectory() as folder:
        recipe, place = Path(folder) / "scale.toml", Path(folder) / "db"
        recipe.write_text(recipe_text(rows, store), encoding="utf-8")
        steps = {name: step(name, recipe, place, jobs) for name in STEPS}
        size = sum(path.stat().st_size for path in place.rglob("*") if path.is_file())
    number = steps["plan"]["value"]
    line: dict[str, Any] = {"rows": number, "bytes a row": size / number}
    for name, unit in UNITS.items():
        factor, of = (1e6, number) if unit == "us a row" else (1e3, 1)
        line[f"{name}, {unit}"] = steps[name]["seconds"] * factor / of
    return line | {"sweep, MB": steps["sweep"]["megabytes"], "query, MB": steps["mean"]["megabytes"]}


def recipe_text(rows: int, store: str) -> str:
    """Return the quick recipe with about so many rows."""
    text = RECIPE.read_text(encoding="utf-8")
    factor = max(round(rows / load_recipe(RECIPE).plan().rows), 1)
    text = re.sub(r"^healthy = (\d+)$", lambda found: f"healthy = {int(found[1]) * factor}", text, flags=re.MULTILINE)
    return text.replace("[sweep]\n", f'[sweep]\nstore = "{store}"\ndraws = {factor}\n', 1)


def step(name: str, recipe: Path, place: Path, jobs: int) -> dict[str, Any]:
    """Return seconds, memory and value of a step, which runs in a process of its own."""
    command = [sys.executable, __file__, "--jobs", str(jobs), "--step", name, str(recipe), str(place)]
    result: dict[str, Any] = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    print(f"{recipe.parent.name}: {name} {result['seconds']:.3g} s", file=sys.stderr)
    return result


def measured(call: Callable[[Path, Path, int], Any], recipe: Path, place: Path, jobs: int) -> dict[str, Any]:
    """Return seconds and memory of a step in this process, and what it returned."""
    started = time.perf_counter()
    value = call(recipe, place, jobs)
    seconds = time.perf_counter() - started
    kilobytes = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return {"seconds": seconds, "megabytes": kilobytes / 1e3, "value": value}


def _plan(recipe: Path, place: Path, jobs: int) -> int:
    return load_recipe(recipe).plan().rows


def _sweep(recipe: Path, place: Path, jobs: int) -> int:
    loaded = load_recipe(recipe)
    return run(loaded.plan(), place, recipe=loaded.text, jobs=jobs).new_rows


def _open(recipe: Path, place: Path, jobs: int) -> int:
    return len(sigdb.open(place))


def _query(text: str) -> Callable[[Path, Path, int], Any]:
    def run_query(recipe: Path, place: Path, jobs: int) -> float:
        with sigdb.open(place) as database:
            return float(database.sql(text).iloc[0, 0])

    return run_query


def _one(recipe: Path, place: Path, jobs: int) -> int:
    with sigdb.open(place) as database:
        return len(database.signals([len(database) // 2])["tsa"])


def _match(recipe: Path, place: Path, jobs: int) -> None:
    with sigdb.open(place) as database:
        database.match(database.signals([len(database) // 2])["tsa"][0])


def _verify(recipe: Path, place: Path, jobs: int) -> int:
    return len(verify(place))


STEPS: Mapping[str, Callable[[Path, Path, int], Any]] = {
    "plan": _plan,
    "sweep": _sweep,
    "open": _open,
    "count": _query("select count(*) from features where tooth = 6"),
    "mean": _query("select avg(fm4) from features where tooth = 6"),
    "one row": _one,
    "match": _match,
    "verify": _verify,
}
UNITS = {
    "plan": "ms",
    "sweep": "us a row",
    "open": "ms",
    "count": "us a row",
    "mean": "us a row",
    "one row": "ms",
    "match": "ms",
    "verify": "us a row",
}
"""Unit of each step: milliseconds where the cost should not grow with the rows, else microseconds a row."""


if __name__ == "__main__":
    main()
