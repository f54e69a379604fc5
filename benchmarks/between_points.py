"""A model at operating points between those of its training, compared with the best possible answers there.

A database is made at random operating points, of the damages that the model has templates of, with gears of other index
errors. Its rows are answered by the model and by the Bayes rule of the database itself, which has templates of these
very points. Both are compared in bands of the signal-to-noise ratio: the shares of wrong answers, and by how many
decibels the noise may grow until the Bayes rule errs as often as the model.

    python benchmarks/between_points.py [--model NAME] [--points N] [--specimens N] [--seed N] [--json]
"""

import argparse
import json
import tempfile
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w
from measuring import environment, print_table
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.database import Database
from sigdb.pipeline import load_recipe
from sigdb.recognition import Model, evaluate
from sigdb.recognition.rows.batch import Batch
from sigdb.sweep import run

REFERENCE = Path(__file__).parents[1] / "pipelines" / "reference.toml"
SNR_DB = (-30.0, -10.0)
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the tables, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="nasa-location", help="name or folder of a location model")
    parser.add_argument("--points", type=int, default=25, help="random operating points; 25 by default")
    parser.add_argument("--specimens", type=int, default=3, help="pairs of gears; 3 by default")
    parser.add_argument("--seed", type=int, default=4712, help="seed of points, gears and noise")
    parser.add_argument("--json", action="store_true", help="print JSON")
    given = parser.parse_args()
    model = sigdb.load_model(given.model)
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        text = recipe(model, points=given.points, specimens=given.specimens, seed=given.seed)
        Path(folder, "recipe.toml").write_text(text, encoding="utf-8")
        loaded = load_recipe(Path(folder, "recipe.toml"))
        run(loaded.plan(), Path(folder, "signatures"), recipe=loaded.text, jobs=1)
        tables = measure(model, sigdb.open(Path(folder, "signatures")))
    machine = environment("numpy", "scipy")
    if given.json:
        print(json.dumps({"machine": machine, "tables": tables}, indent=1))
        return
    print(", ".join(f"{key} {value}" for key, value in machine.items()))
    for title, rows in tables.items():
        print_table(title, rows)


def recipe(model: Model, *, points: int, specimens: int, seed: int) -> str:
    """The recipe of the model's training at random operating points within its range, as TOML."""
    content: dict[str, Any] = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))
    (grid,) = content["sweep"]["grid"]
    stream = np.random.default_rng(seed)
    bank = model.estimator.template_bank
    assert bank is not None
    assert model.trained_range is not None
    speeds = bank.interpolations[0].speed_rpm if bank.interpolations else model.trained_range.speed_rpm[0]
    ranges = {"speed_rpm": speeds, "torque": model.trained_range.torque[0]}
    operating = {name: stream.uniform(*ends, points).tolist() for name, ends in ranges.items()}
    kept = {name: grid[name] for name in ("tooth", "damaged_teeth", "phase_shift_deg", "stiffness_loss")}
    table = {"operating": operating, "snr_db": stream.uniform(*SNR_DB, points).tolist()}
    content["sweep"] |= {"seed": seed, "specimens": specimens, "grid": [kept | {"table": table}]}
    return tomli_w.dumps(content)


def measure(model: Model, database: Database) -> dict[str, Rows]:
    """Tables by title."""
    alone = replace(model, estimators={model.learner: model.estimator})
    evaluation = evaluate(alone, database)
    table = evaluation.efficiency
    names = {"rows": "rows", "error": "wrong, model", "bound_error": "wrong, best possible", "loss_db": "loss, dB"}
    bands = [
        {"band": row["band"], **{title: row[name] for name, title in names.items()}}
        for row in table.to_dict(orient="records")
    ]
    return {
        "Model and best possible answers": bands,
        "Posteriors, each row at an operating point of its own": speed(model),
    }


def speed(model: Model, rows: int = 20_000) -> Rows:
    """Posteriors a second of processor time, of averages that all have operating points of their own."""
    reducer, seen = model.estimator.reducer, model.trained_range
    assert reducer is not None
    assert seen is not None
    stream = np.random.default_rng(1)
    bank = model.estimator.template_bank
    assert bank is not None
    frame = pd.DataFrame({"teeth": bank.teeth[0], "averages": 102, "scatter": 3.0}, index=range(rows))
    for name in ("speed_rpm", "torque"):
        frame[name] = stream.uniform(*getattr(seen, name)[0], rows)
    x = stream.standard_normal((rows, bank.points[0].samples))
    batch = Batch(table=frame, tsa={bank.teeth[0]: x})
    reducer.transform(batch.take(np.arange(200)))
    started = time.process_time()
    reducer.transform(batch)
    return [{"rows": rows, "posteriors a second": rows / (time.process_time() - started)}]


if __name__ == "__main__":
    main()
