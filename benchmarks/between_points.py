"""The shipped models at operating points and severities between those of their training, beside the best answers.

The rows are those of `pipelines/reference-points.toml` and of `pipelines/reference-severities.toml`: random operating
points with the damages of the training or with others between them, and gears of other index errors. They are answered
by the model and by the Bayes rule of the database itself, which has templates of these points. Both are compared in
bands of the signal-to-noise ratio: errors, and by how many decibels the noise may grow until the Bayes rule errs as
often as a model of location. Posteriors a second of processor time are compared with those of plain NumPy.

    python benchmarks/between_points.py [--model NAME] [--rows points|severities] [--json FILE]

measures. Without `--json` nothing is stored; `--page` writes the stored tables into models/README.md.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from measured_page import markdown_table
from measuring import environment, json_option, publish
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.database import Database
from sigdb.pipeline import load_recipe
from sigdb.recognition import Model, TemplateBank, evaluate
from sigdb.recognition.rows.batch import Batch
from sigdb.sweep import run

ROOT = Path(__file__).parents[1]
STORED, PAGE = Path(__file__).with_suffix(".json"), ROOT / "models" / "README.md"
BEGIN, END = "<!-- Made by benchmarks/between_points.py from benchmarks/between_points.json. -->\n", "<!-- End. -->"
COLUMNS = {
    "quantity": "quantity",
    "band": "band",
    "rows": "rows",
    "error": "error",
    "bound_error": "best possible",
    "loss_db": "loss, dB",
    "mae_ratio": "ratio",
}
MODELS, RECIPES = ("nasa-location", "nasa-severity"), ("points", "severities")
PEER_ROWS = 20
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the tables, and store them where a file is named; or write the stored ones into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", action="append", help="name or folder of a model; all shipped ones by default")
    parser.add_argument("--rows", choices=RECIPES, action="append", help="recipe of the rows; both by default")
    parser.add_argument("--page", action="store_true", help="only write the stored tables into models/README.md")
    json_option(parser)
    options = parser.parse_args()
    if options.page:
        PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8"), stored_tables()), encoding="utf-8")
        return
    models = {name: sigdb.load_model(name) for name in options.model or MODELS}
    with threadpool_limits(1):
        tables = measure(models, options.rows or RECIPES)
    publish(environment("numpy", "scipy"), tables, options.json)


def measure(models: Mapping[str, Model], recipes: Sequence[str]) -> dict[str, Rows]:
    """Tables by title: of each model on the rows of each recipe, and the speed of the first model."""
    tables = {}
    for name in recipes:
        recipe = load_recipe(ROOT / "pipelines" / f"reference-{name}.toml")
        with tempfile.TemporaryDirectory() as folder:
            run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
            for title, model in models.items():
                tables[f"{title}, {name}"] = bands(model, sigdb.open(folder))
    return tables | {"Posteriors, each row at an operating point of its own": speed(next(iter(models.values())))}


def bands(model: Model, database: Database) -> Rows:
    """Errors of a model and of the Bayes rule by band of the signal-to-noise ratio."""
    alone = replace(model, estimators={model.learner: model.estimator})
    table = evaluate(alone, database).efficiency
    return [
        {title: row[name] for name, title in COLUMNS.items() if name in row and row[name] is not None}
        for row in table.to_dict(orient="records")
    ]


def stored_tables() -> dict[str, Rows]:
    """The stored tables of models by title."""
    tables = json.loads(STORED.read_text(encoding="utf-8"))["tables"]
    return {title: rows for title, rows in tables.items() if title.partition(",")[0] in MODELS}


def with_tables(page: str, tables: Mapping[str, Rows]) -> str:
    """Return the text of a page with tables between its marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    parts = [f"{_title(title)}\n\n{_table(rows)}" for title, rows in tables.items()]
    return f"{before}{begin}\n" + "\n".join(parts) + f"{end}{after}"


def _title(title: str) -> str:
    model, _, rows = title.partition(", ")
    return f"`{model}` on the rows of `pipelines/reference-{rows}.toml`:"


def _table(rows: Rows) -> str:
    """Return a table of bands; of several quantities only the lines for all bands."""
    rows = [row for row in rows if row["band"] == "all" or "quantity" not in row]
    return markdown_table(list(rows[0]), [[_cell(*item) for item in row.items()] for row in rows])


def _cell(title: str, value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:.2f}" if title in ("loss, dB", "ratio") else f"{value:.3g}"


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
