"""A model at operating points and severities between those of its training, compared with the best possible answers.

The rows are those of `pipelines/reference-points.toml` or of `pipelines/reference-severities.toml`: random operating
points with the damages of the training or with others between them, and gears of other index errors. They are answered
by the model and by the Bayes rule of the database itself, which has templates of these points. Both are compared in
bands of the signal-to-noise ratio: errors, and by how many decibels the noise may grow until the Bayes rule errs as
often as a model of location. Posteriors a second of processor time are compared with those of plain NumPy.

    python benchmarks/between_points.py [--model NAME] [--rows points|severities] [--database DIR] [--json FILE]
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from measuring import environment, json_option, publish
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.database import Database
from sigdb.pipeline import load_recipe
from sigdb.recognition import Model, TemplateBank, evaluate
from sigdb.recognition.rows.batch import Batch
from sigdb.sweep import run

PIPELINES = Path(__file__).parents[1] / "pipelines"
PEER_ROWS = 20
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the tables, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="nasa-location", help="name or folder of a model with templates")
    parser.add_argument("--rows", choices=("points", "severities"), default="points", help="recipe of the rows")
    parser.add_argument("--database", help="a database of that recipe; by default it is made, and removed")
    json_option(parser)
    given = parser.parse_args()
    model = sigdb.load_model(given.model)
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        if given.database is None:
            recipe = load_recipe(PIPELINES / f"reference-{given.rows}.toml")
            run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
        tables = measure(model, sigdb.open(given.database or folder))
    machine = environment("numpy", "scipy")
    publish(machine, tables, given.json)


def measure(model: Model, database: Database) -> dict[str, Rows]:
    """Tables by title."""
    alone = replace(model, estimators={model.learner: model.estimator})
    table = evaluate(alone, database).efficiency
    names = {"rows": "rows", "error": "error, model", "bound_error": "error, best possible", "loss_db": "loss, dB"}
    names |= {"mae_ratio": "error over best possible"}
    shown = [name for name in names if name in table]
    bands = [
        {"quantity": row["quantity"]} | _shown(row, names, shown) if "quantity" in row else _shown(row, names, shown)
        for row in table.to_dict(orient="records")
    ]
    return {
        "Model and best possible answers": bands,
        "Posteriors, each row at an operating point of its own": speed(model),
    }


def _shown(row: dict[Any, Any], names: dict[str, str], shown: list[str]) -> dict[str, Any]:
    return {"band": row["band"], **{names[name]: row[name] for name in shown}}


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
    ours = rows / (time.process_time() - started)
    started = time.process_time()
    plain_posteriors(bank, frame[:PEER_ROWS], x[:PEER_ROWS])
    plain = PEER_ROWS / (time.process_time() - started)
    return [
        {"by": "sigdb", "rows": rows, "posteriors a second": ours, "times NumPy": ours / plain},
        {"by": "NumPy, template by template", "rows": PEER_ROWS, "posteriors a second": plain, "times NumPy": 1.0},
    ]


def plain_posteriors(bank: TemplateBank, frame: pd.DataFrame, x: np.ndarray) -> np.ndarray:
    """Log-likelihood (rows, teeth) of damage at each tooth, written out: a matrix inverse for each template and row."""
    teeth, noise = bank.teeth[0], (frame["scatter"] / np.sqrt(frame["averages"])).to_numpy()
    answers = np.empty((len(x), teeth))
    points = frame["speed_rpm"].to_numpy(), frame["torque"].to_numpy(), np.full(len(x), teeth)
    for local, at, coefficients in bank.locals(*points):
        laws, signals = local.laws, local.signals(coefficients)
        step = laws.samples // teeth
        for i, row in enumerate(at):
            turned = np.stack([np.roll(x[row], -turn * step) for turn in range(teeth)])
            each = []
            for k in np.flatnonzero(~local.healthy):
                spread = laws.modes[k] * laws.gains[k] * bank.index_error / noise[row]
                inner = np.eye(spread.shape[1]) + spread.T @ spread
                residual = (turned - signals[i if len(signals) > 1 else 0, k]) / noise[row]
                along = residual @ spread
                chi2 = (residual**2).sum(axis=1) - np.einsum("ti,ij,tj->t", along, np.linalg.inv(inner), along)
                each.append(np.log(local.share[k]) - 0.5 * (chi2 + np.linalg.slogdet(inner)[1]))
            answers[row] = logsumexp(each, axis=0)
    return answers


if __name__ == "__main__":
    main()
