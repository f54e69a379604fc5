"""Speed of models of templates: posteriors a second on one core.

The averages follow the law of each model: its templates at some of its operating points, gears with index errors, and
noise of -30 to -10 dB for one of 102 revolutions. A posterior is all scores of an average: of each tooth and severity,
with the tests of the residual. The peer is what is done by hand: the normal law of each template and tooth in plain
NumPy, with a small inverse for each average, without severities in between and without tests. Its time is that of a
few averages. With nuisances the bank is that of `pipelines/nuisances.toml`, and both sum over the mixture. All times
are of one core in one run.

    python benchmarks/posteriors.py [--rows N] [--json FILE]
"""

import argparse
import json
import tempfile
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from measuring import environment, print_table, timed
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core import FloatArray
from sigdb.pipeline import load_recipe
from sigdb.recognition import TemplateBank, TemplateScores
from sigdb.recognition.rows.batch import Batch
from sigdb.sweep import run

NUISANCES = Path(__file__).parents[1] / "pipelines" / "nuisances.toml"
MODELS = ("nasa-location", "nasa-severity", "nasa-detection")
ROWS, PEER_ROWS, REPEATS = 10_000, 20, 3
AVERAGES = 102
SNR_DB = (-30.0, -10.0)
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the table, or store a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=ROWS, help=f"averages of each model; {ROWS} by default")
    parser.add_argument("--json", type=Path, help="file to store the numbers in")
    given = parser.parse_args()
    machine = environment("numpy", "scipy")
    with threadpool_limits(1):
        tables = {"posteriors": measure(given.rows)}
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "tables": tables}, indent=1) + "\n", encoding="utf-8")
    for title, rows in tables.items():
        print_table(title, rows)


def measure(rows: int) -> Rows:
    """A row for each model, and for the same scores with nuisances."""
    found = []
    for name in MODELS:
        reducer = sigdb.load_model(name).estimator.reducer
        assert isinstance(reducer, TemplateScores)
        found.append(speed(name, reducer, rows))
    recipe = load_recipe(NUISANCES)
    with tempfile.TemporaryDirectory() as folder:
        run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
        bank = TemplateBank.of(sigdb.open(folder))
    found.append(speed("location, with nuisances", TemplateScores(bank, severity=False), rows))
    found.append(speed("severity, with nuisances", TemplateScores(bank), rows))
    return found


def speed(name: str, reducer: TemplateScores, rows: int) -> dict[str, Any]:
    """Posteriors a second of processor time, by sigdb and by the peer."""
    bank, stream = reducer.bank, np.random.default_rng(1)
    batch = averages(bank, rows, stream)
    scores = TemplateScores(bank, n_jobs=1, severity=reducer.severity)
    scores.transform(batch)
    ours = rows / min(timed(lambda: scores.transform(batch))[1] for _ in range(REPEATS))
    few = batch.take(np.sort(stream.choice(rows, PEER_ROWS, replace=False)))
    plain = PEER_ROWS / timed(lambda: plain_posteriors(bank, few))[1]
    templates = max(len(point.share) for point in bank.points)
    return {"model": name, "templates": templates, "posteriors_a_second": ours, "times_numpy": ours / plain}


def averages(bank: TemplateBank, rows: int, stream: np.random.Generator) -> Batch:
    """Averages of the law of a bank, the same number at each of its operating points."""
    teeth, parts, frames = bank.teeth[0], [], []
    for some in np.array_split(np.arange(rows), len(bank.points)):
        point = bank.points[stream.integers(len(bank.points))]
        laws = point.hypotheses
        deviation = np.sqrt(laws.reference_variance.mean() * 10 ** (-stream.uniform(*SNR_DB, len(some)) / 10))
        template = stream.integers(len(laws.cases), size=len(some))
        tooth = stream.integers(1, teeth + 1, len(some))
        noise = deviation / np.sqrt(AVERAGES)
        parts.append(laws.draw(stream, template, tooth, noise=noise, index_error=bank.index_error))
        place = {"teeth": teeth, "averages": AVERAGES, "speed_rpm": point.speed_rpm, "torque": point.torque}
        frames.append(pd.DataFrame({"scatter": deviation}).assign(**place))
    return Batch(table=pd.concat(frames, ignore_index=True), tsa={teeth: np.concatenate(parts)})


def plain_posteriors(bank: TemplateBank, batch: Batch) -> FloatArray:
    """Log-likelihood (rows, teeth) of damage at each tooth, written out: a matrix inverse for each template and row."""
    teeth, noise = bank.teeth[0], batch.noise()
    ((_, _, x),) = batch.averages()
    answers = np.empty((len(x), teeth))
    for local, at, coefficients in bank.locals(*batch.operating_point()):
        signals, step = local.signals(coefficients), local.samples // teeth
        mixture = [(0.0, local.laws)]
        if local.mixture is not None:
            mixture = list(zip(local.mixture.log_weights, local.mixture.parts, strict=True))
        for i, row in enumerate(at):
            turned = np.stack([np.roll(x[row], -turn * step) for turn in range(teeth)])
            each = []
            for k, (weight, laws) in product(np.flatnonzero(~local.healthy), mixture):
                spread = laws.modes_of(k) * laws.gains[k] * float(laws.size(bank.index_error)) / noise[row]
                inner = np.eye(spread.shape[1]) + spread.T @ spread
                residual = (turned - signals[i if len(signals) > 1 else 0, k]) / noise[row]
                along = residual @ spread
                chi2 = (residual**2).sum(axis=1) - np.einsum("ti,ij,tj->t", along, np.linalg.inv(inner), along)
                each.append(weight + np.log(local.share[k]) - 0.5 * (chi2 + np.linalg.slogdet(inner)[1]))
            answers[row] = logsumexp(each, axis=0)
    return answers


if __name__ == "__main__":
    main()
