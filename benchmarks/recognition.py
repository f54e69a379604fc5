"""Speed of recognition: posteriors a second on one core, the time of the Bayes bound, and that of training.

The rows are those of `pipelines/quick.toml`: 768 samples, 12 teeth, 25 templates, so 289 hypotheses, with specimens of
11 degrees of freedom. Every row counts as one of an own level of noise. The peer is what is done by hand: the logarithm
of the normal density of each template, turned to each tooth, by SciPy's `multivariate_normal` with a frozen covariance,
factored beforehand for one level of noise; it is timed on a few rows.

Training is of location, on the training rows of the split S1, and each learner is asked about the rows held out. The
peers are scikit-learn's on the averages as they are, a class for each tooth and one for none; with aeon, if it is
installed, also its MiniRocket classifier.

    python benchmarks/recognition.py [--json FILE] [--rows N]
"""

import argparse
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, json_option, least_seconds, publish, timed
from scipy.stats import multivariate_normal
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import HistGradientBoostingClassifier
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.database import TEST, TRAINING, Database, make_split
from sigdb.pipeline import load_recipe
from sigdb.recognition import (
    LocationClassifier,
    OperatingPoint,
    TemplateBank,
    TemplateLocation,
    bayes_bound,
    detection_table,
    error_curve,
    expected_losses,
    operating_points,
)
from sigdb.recognition.estimators.pooled_location import POOLED_LEARNERS
from sigdb.recognition.model import reducers_of
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.rows.streams import read_features, reduce_averages
from sigdb.recognition.training import usable_rows
from sigdb.sweep import run

RECIPE = Path(__file__).parents[1] / "pipelines" / "quick.toml"
ROWS = 10_000
PEER_ROWS, PEER_TEMPLATES = 100, 2
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the tables, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    parser.add_argument("--rows", type=int, default=ROWS, help=f"averages to judge; {ROWS} by default")
    given = parser.parse_args()
    machine = environment("numpy", "scipy", "pandas", "pyarrow")
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        recipe = load_recipe(RECIPE)
        run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
        tables = measure(sigdb.open(folder), given.rows)
    publish(machine, tables, given.json)


def measure(database: Database, rows: int) -> dict[str, Rows]:
    """Tables by title."""
    (point,), _ = operating_points(database)
    return {
        "Posteriors on one core": posteriors(point, rows),
        "The bound of the quick recipe": bounds(database, point),
        "Training, location": training(database),
    }


def posteriors(point: OperatingPoint, rows: int) -> Rows:
    """Averages a second, by sigdb and by the densities of SciPy."""
    parts = list(point.redrawn(np.random.default_rng(0), rows))
    own = least_seconds(lambda: [point.posterior(x, some) for some, x in parts]) / rows
    drawn = timed(lambda: list(point.redrawn(np.random.default_rng(0), rows)))[1] / rows
    peer = density_seconds(point, parts[0][1][:PEER_ROWS])
    return [
        {"what": "posterior of sigdb", "averages a second": 1 / own, "times SciPy": peer / own},
        {"what": "draw of the law", "averages a second": 1 / drawn, "times SciPy": None},
        {"what": "densities of SciPy", "averages a second": 1 / peer, "times SciPy": 1.0},
    ]


def training(database: Database) -> Rows:
    """Seconds of training by each learner and by the peers, and the accuracy on held-out specimens."""
    rows = usable_rows(database, "location")
    folds = make_split("S1", rows, seed=database.manifest.seed, folds=5).folds(rows)
    bank, bank_seconds = timed(lambda: TemplateBank.of(database))
    sensor = database.sensors[0]
    batch, reducers = Batch(table=rows), reducers_of([TemplateLocation(bank)])
    scored, scoring = timed(lambda: reduce_averages(database, batch, reducers, sensor=sensor))
    scored = read_features(database, scored)
    x = database.signals(rows.index.to_numpy())["tsa"]
    seen, asked = (folds == one for one in (TRAINING, TEST))
    y = rows["tooth"].to_numpy()
    found: Rows = []

    def add(what: str, estimator: Any, data: Any, of: str, *groups: Any, before: float = 0.0) -> None:
        _, seconds = timed(lambda: estimator.fit(_some(data, seen), y[seen], *groups))
        right = float((estimator.predict(_some(data, asked)) == y[asked]).mean())
        row = {"what": what, "of": of, "rows": int(seen.sum()), "seconds": float(before + seconds), "accuracy": right}
        found.append(row)

    specimens = rows["specimen"].to_numpy()[seen]
    for learner in POOLED_LEARNERS:
        add(learner, LocationClassifier(learner), scored, "features", specimens)
    share = scoring * seen.mean()
    add("templates", TemplateLocation(bank), scored, "averages", specimens, before=bank_seconds + share)
    add("scikit-learn LDA", LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), x, "averages")
    add("scikit-learn boosting", HistGradientBoostingClassifier(max_iter=20, early_stopping=False), x, "averages")
    if find_spec("aeon"):
        from aeon.classification.convolution_based import MiniRocketClassifier

        add("aeon MiniRocket", MiniRocketClassifier(random_state=0), x[:, None], "averages")
    return found


def _some(data: Batch | np.ndarray, rows: np.ndarray) -> Batch | np.ndarray:
    return data.take(rows) if isinstance(data, Batch) else data[rows]


def density_seconds(point: OperatingPoint, x: np.ndarray) -> float:
    """Seconds an average of all densities by SciPy, from those of some templates."""
    hypotheses, row = point.hypotheses, point.rows.iloc[0]
    step = x.shape[1] // hypotheses.teeth
    laws = []
    for k in range(PEER_TEMPLATES):
        modes = hypotheses.modes[k] * hypotheses.gains[k] * row["index_error"]
        covariance = row["noise"] ** 2 * np.eye(x.shape[1]) + modes @ modes.T
        laws.append(multivariate_normal(hypotheses.signal[k], covariance))
    turned = [np.roll(x, -turn * step, axis=1) for turn in range(hypotheses.teeth)]
    seconds = least_seconds(lambda: [law.logpdf(one) for law in laws for one in turned])
    return seconds * len(hypotheses.cases) / PEER_TEMPLATES / len(x)


def bounds(database: Database, point: OperatingPoint) -> Rows:
    """Seconds of the parts of the bound, and what they give."""
    found: Rows = []

    def add(what: str, rows: int, call: Any) -> Any:
        result, seconds = timed(call)
        found.append({"what": what, "averages": rows, "seconds": seconds})
        return result

    rows = len(database)
    add("location, stored rows", rows, lambda: bayes_bound(database))
    add("severity, stored rows", rows, lambda: bayes_bound(database, target="severity"))
    add("Bayes error, with specimens", ROWS, lambda: expected_losses([point], "location", draws=ROWS))
    add("Bayes error, nominal", ROWS, lambda: expected_losses([point], "location", draws=ROWS, specimens=False))
    curve = add("error against noise", 0, lambda: error_curve([point]))
    found[-1]["averages"] = 2000 * len(curve.error)
    table = add("detection of each severity", 0, lambda: detection_table(point))
    found[-1]["averages"] = 2000 * len(table)
    return found


if __name__ == "__main__":
    main()
