"""A table of models beside the best possible answer, on the fixed split of a database.

Each peer is a file with a class. `sigdb evaluate FILE:NAME DB --column tsa` trains and evaluates it, in an environment
of its own, since torch and aeon are no dependencies of sigdb. The learners and baselines of sigdb are trained on the
same rows. The split is S1: specimens that training has not seen.

Without a database it makes a sample of the reference database: its recipe with fewer operating points and gear pairs.

    python benchmarks/leaderboard.py [DB] [--points 8] [--specimens 6] [--environments build/peers]
        [--json benchmarks/leaderboard.json] [--split S1] [--peer network]

The first run makes the environments, which takes minutes. A file of the same rows and split keeps the models that are
in it, so that peers may be run one by one.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path
from typing import Any

from measuring import environment, print_table

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

ROOT = Path(__file__).parents[1]
PEERS = {"network": ("Network", ["torch"]), "minirocket": ("Rocket", ["aeon"])}
"""Class of each peer, and what its environment needs besides sigdb."""
METRICS = ("accuracy", "p_exact", "none_on_healthy", "log_loss")


def main() -> None:
    """Evaluate each peer, and print the table in order of accuracy."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database", type=Path, nargs="?", help="a finished database; a sample is made if left out")
    parser.add_argument("--points", type=int, default=8, help="operating points of the sample; 8 by default")
    parser.add_argument("--specimens", type=int, default=6, help="gear pairs of the sample; 6 by default")
    parser.add_argument("--environments", type=Path, default=ROOT / "build" / "peers", help="folder of environments")
    parser.add_argument("--split", default="S1", help="split; S1 by default")
    parser.add_argument("--peer", choices=list(PEERS), action="append", help="peer; all by default")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        database = options.database or _sample(Path(folder), options.points, options.specimens)
        rows = len(sigdb.open(database).sql("select id from features where status = 'ok'"))
        facts = {
            "database": "sample" if options.database is None else options.database.name,
            "points": options.points,
            "specimens": options.specimens,
            "rows": rows,
            "split": options.split,
        }
        table = _stored(options.json, facts)
        for name in options.peer or list(PEERS):
            python = _environment(options.environments / name, PEERS[name][1])
            began = time.perf_counter()
            for row in _evaluated(python, name, database, options.split):
                if row["metric"] in METRICS:
                    title = name if row["estimator"] == PEERS[name][0] else row["estimator"]
                    table.setdefault(title, {})[row["metric"]] = [row["value"], row["low"], row["high"]]
            seconds = time.perf_counter() - began
            print(f"{name}: {seconds:.0f} s with the learners and baselines of sigdb", file=sys.stderr)
    order = sorted(table, key=lambda title: -table[title].get("accuracy", [0.0])[0])
    leaders = [{"model": title, **{metric: _shown(table[title].get(metric)) for metric in METRICS}} for title in order]
    print_table(f"{rows} rows, split {options.split}", leaders)
    if options.json:
        numbers = {
            "machine": environment("numpy", "scikit-learn"),
            **facts,
            "models": table,
            "tables": {"leaders": leaders},
        }
        options.json.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")


def _stored(file: Path | None, facts: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the models of a file of the same rows and split; none otherwise."""
    if file is None or not file.exists():
        return {}
    stored = json.loads(file.read_text(encoding="utf-8"))
    models: dict[str, dict[str, Any]] = stored["models"]
    return models if all(stored[name] == value for name, value in facts.items()) else {}


def _sample(folder: Path, points: int, specimens: int) -> Path:
    """Make a database of the reference recipe with fewer operating points and gear pairs."""
    text = (ROOT / "pipelines" / "reference.toml").read_text(encoding="utf-8")
    for key, value in (("points", points), ("specimens", specimens)):
        text, found = re.subn(rf"^{key} = \d+$", f"{key} = {value}", text, flags=re.MULTILINE)
        if found != 1:
            raise ValueError(f"pipelines/reference.toml has {key} {found} times")
    text = re.sub(r"^evaluate_on = .*\n", "", text, flags=re.MULTILINE)
    (folder / "sample.toml").write_text(text, encoding="utf-8")
    recipe = load_recipe(folder / "sample.toml")
    run(recipe.plan(), folder / "sample", recipe=recipe.text, jobs=1)
    return folder / "sample"


def _environment(folder: Path, packages: list[str]) -> Path:
    """Return the Python of an environment with sigdb and packages, which is made if it is missing."""
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", str(ROOT), *packages], check=True)
    return python


def _evaluated(python: Path, name: str, database: Path, split: str) -> list[dict[str, Any]]:
    file = Path(__file__).parent / "peers" / f"{name}.py"
    command: list[str | Path] = [
        python,
        "-m",
        "sigdb",
        "evaluate",
        f"{file}:{PEERS[name][0]}",
        database,
        "--column",
        "tsa",
    ]
    done = subprocess.run([*command, "--split", split, "--format", "json"], check=True, stdout=subprocess.PIPE)
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    return rows


def _shown(estimate: list[float] | None) -> str:
    if estimate is None or estimate[0] is None:
        return "-"
    value, low, high = estimate
    return f"{value:.3f}" if low is None else f"{value:.3f} [{low:.3f}, {high:.3f}]"


if __name__ == "__main__":
    main()
