"""A table of models beside the best possible answer, on fixed splits of the reference database.

The database is that of `pipelines/reference.toml`; it is made if it is missing. Its splits follow from its seed, and
their hashes are stored with the numbers:

- S1: gear pairs that training has not seen;
- S7: gear pairs and operating points that training has not seen.

Tested are the held-out rows whose id is divisible by 7. All but the templates learn from the 25 000 training rows
that `sigdb.recognition.training.evenly_drawn` draws; the templates are calibrated on all training rows.

The learners and baselines of sigdb are those of the model `nasa-location` for S1; for S7 they are trained by
`sigdb train`. Each peer is a file with a class, which `sigdb evaluate FILE:NAME DB` trains and evaluates, with torch or
aeon in an environment of its own, since these are no dependencies of sigdb.

    python benchmarks/leaderboard.py [DB] [--split S1] [--peer network] [--folder build/leaders]
        [--json benchmarks/leaderboard.json]

The first run makes the environments, which takes minutes. A file of the same splits keeps the models that are in it, so
that peers and splits may be run one by one. The exit code is 1 if a model is better than the bound.
"""

import argparse
import json
import subprocess
import sys
import time
import venv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from measuring import environment, print_table

import sigdb
from sigdb.database import Database, labelled_rows, make_split
from sigdb.pipeline import load_recipe
from sigdb.recognition import RecognitionSettings
from sigdb.sweep import run

ROOT = Path(__file__).parents[1]
RECIPE = ROOT / "pipelines" / "reference.toml"
SPLITS = ("S1", "S7")
TESTED = "id % 7 = 0"
METRICS = ("accuracy", "p_exact", "none_on_healthy", "log_loss")
BOUND = "bound"


@dataclass(frozen=True, kw_only=True)
class Peer:
    """A class of estimators, the columns that it reads, and what its environment needs besides sigdb."""

    name: str
    columns: tuple[str, ...] = ()
    packages: tuple[str, ...] = ()


SIGDB = "sigdb"
"""The learners and baselines of sigdb, with the bound."""

PEERS = {
    "pipeline": Peer(name="PooledPipeline"),
    "minirocket": Peer(name="Rocket", columns=("tsa",), packages=("aeon",)),
    "network": Peer(name="Network", columns=("tsa",), packages=("torch",)),
}


def main() -> int:
    """Evaluate each peer, print the tables in order of accuracy, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database", type=Path, nargs="?", default=ROOT / "build" / "reference", help="its folder")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "leaders", help="environments and models")
    parser.add_argument("--split", choices=SPLITS, action="append", help="split; all by default")
    parser.add_argument("--peer", choices=[SIGDB, *PEERS], action="append", help="peer; all by default")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    options.folder = options.folder.resolve()
    if not options.database.exists():
        recipe = load_recipe(RECIPE)
        run(recipe.plan(), options.database, recipe=recipe.text, jobs=-1)
    stored = _stored(options.json)
    for split in options.split or SPLITS:
        facts = _facts(sigdb.open(options.database), split)
        before = stored.get(split, {})
        models = before.get("models", {}) if facts.items() <= before.items() else {}
        stored[split] = {**facts, "models": models}
        for name in options.peer or [SIGDB, *PEERS]:
            began = time.perf_counter()
            _add_models(models, _evaluated(name, options.folder, options.database.resolve(), split))
            print(f"{split}, {name}: {time.perf_counter() - began:.0f} s", file=sys.stderr)
            if options.json:
                _store(options.json, stored)
    better = False
    for split, results in stored.items():
        print_table(f"{split}: {results['rows']} rows of {results['of']}", _leaders(results["models"]))
        better |= _better_than_bound(results["models"])
    return int(better)


def _stored(file: Path | None) -> dict[str, dict[str, Any]]:
    """Return the results of a file by split; none without one."""
    if file is None or not file.exists():
        return {}
    splits: dict[str, dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))["splits"]
    return splits


def _facts(database: Database, split: str) -> dict[str, Any]:
    """Return what the numbers of a split are of: database, split, and rows that are tested."""
    rows, folds = labelled_rows(database), RecognitionSettings().folds
    parts = make_split(split, rows, seed=database.manifest.seed, folds=folds)
    of_rows = parts.folds(rows)
    tested = rows.index.isin(database.cases(TESTED)["id"]) & (of_rows == "test")
    return {
        "recipe": RECIPE.name,
        "database": database.manifest.hash,
        "split": parts.hash,
        "of": parts.text,
        "training_rows": int((of_rows == "training").sum()),
        "tested": TESTED,
        "rows": int(tested.sum()),
    }


def _evaluated(name: str, folder: Path, database: Path, split: str) -> list[dict[str, Any]]:
    """Return the metrics of a peer, or of the models of sigdb with the bound."""
    python = Path(sys.executable)
    if name == SIGDB:
        words = [str(_model(folder, database, split))]
    else:
        peer = PEERS[name]
        python = _environment(folder / name, peer.packages) if peer.packages else python
        words = [f"{Path(__file__).parent / 'peers' / name}.py:{peer.name}", "--split", split, "--drawn-rows"]
        words += ["--no-baselines", "--no-bound", *[word for each in peer.columns for word in ("--column", each)]]
    text = _sigdb(python, "evaluate", *words, database, "--where", TESTED, "--format", "json")
    rows: list[dict[str, Any]] = json.loads(text)
    return rows


def _model(folder: Path, database: Path, split: str) -> Path:
    """Return the model of sigdb for a split: that of the reference, or one that is trained if it is missing."""
    reference, made = ROOT / "models" / "nasa-location", folder / split
    described = json.loads((reference / "model.json").read_text(encoding="utf-8"))
    if described["split"] == split and described["database_hash"] == sigdb.open(database).manifest.hash:
        return reference
    if not made.exists():
        _sigdb(Path(sys.executable), "train", database, "--target", "location", "--split", split, "--out", made)
    return made


def _sigdb(python: Path, *words: str | Path) -> bytes:
    """Return what a command of this checkout prints, also where another sigdb is installed."""
    return subprocess.run([python, "-m", "sigdb", *words], check=True, stdout=subprocess.PIPE, cwd=ROOT).stdout


def _environment(folder: Path, packages: tuple[str, ...]) -> Path:
    """Return the Python of an environment with sigdb and packages, which is made if it is missing."""
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", str(ROOT), *packages], check=True)
    return python


def _add_models(models: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    titles = {peer.name: name for name, peer in PEERS.items()}
    for row in rows:
        if row["metric"] in METRICS:
            title = titles.get(row["estimator"], row["estimator"])
            models.setdefault(title, {})[row["metric"]] = [row["value"], row["low"], row["high"]]


def _leaders(models: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a line for each model, the most accurate one first and the bound before its equals."""
    order = sorted(models, key=lambda title: (-models[title]["accuracy"][0], title != BOUND))
    return [{"model": title, **{metric: _shown(models[title].get(metric)) for metric in METRICS}} for title in order]


def _better_than_bound(models: dict[str, Any]) -> bool:
    """Return whether the interval of the accuracy of a model lies above that of the bound, and say which."""
    if BOUND not in models:
        return False
    better = [title for title in models if models[title]["accuracy"][1] > models[BOUND]["accuracy"][2]]
    for title in better:
        print(f"{title} is better than the best possible answer", file=sys.stderr)
    return bool(better)


def _store(file: Path, splits: dict[str, dict[str, Any]]) -> None:
    tables = {f"leaders_{split}": _leaders(results["models"]) for split, results in splits.items()}
    numbers = {"machine": environment("numpy", "scikit-learn"), "splits": splits, "tables": tables}
    file.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")


def _shown(estimate: list[float] | None) -> str:
    if estimate is None or estimate[0] is None:
        return "-"
    value, low, high = estimate
    return f"{value:.3f}" if low is None else f"{value:.3f} [{low:.3f}, {high:.3f}]"


if __name__ == "__main__":
    sys.exit(main())
