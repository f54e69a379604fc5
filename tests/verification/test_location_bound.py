"""Verification: the best possible answer to where a tooth is damaged, by NumPy from the Parquet tables alone.

With and without nuisances. The law is written out with dense covariances: of the noise, of the index errors of both
gears, and of each combination of nuisances that a machine may have.
"""

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import log_softmax, logsumexp
from scipy.stats import multivariate_normal

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.recognition import bayes_bound
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
gear = "pinion"
seed = 3
specimens = 3
healthy = 8

[[sweep.grid]]
tooth = "all"
stiffness_loss = [0.2, 0.4]

[measurement]
averages = 102
index_error = 4e-6
snr_db = -18.0

[signature]
sensors = ["pinion-vertical"]
samples_per_tooth = 32
"""

NUISANCE = """
[nuisance]
gain_db = 2.0
path_db = 2.0
path_deg = 15.0
speed = 0.02
none = 0.4
together = 0.2
rigs = 8
"""

TEETH, MATE_TEETH = 12, 36


def table(folder, name):
    parts = [pq.read_table(path) for path in sorted((folder / name).glob("*.parquet"))]
    return [row for part in parts for row in part.to_pylist()]


def mixture(nuisances):
    """Probability of each combination of nuisances and their sizes, stated or a third: none, one alone, all."""
    if not nuisances:
        return [(1.0, [])]
    parts = [(0.4, [0.0] * nuisances)]
    for size in (1.0, 1 / 3):
        parts += [(0.4 / nuisances / 2, [size * (i == j) for i in range(nuisances)]) for j in range(nuisances)]
        parts.append((0.1, [size] * nuisances))
    return parts


def posteriors(folder):
    """Log probabilities of 'none' and of each tooth, (rows, 1 + teeth), and the true teeth."""
    templates, features = table(folder, "templates"), table(folder, "features")
    signals = {row["id"]: np.array(row["tsa"], float) for row in table(folder, "signals")}
    x = np.array([signals[row["id"]] for row in features])
    ((snr_db, averages, size),) = {(row["snr_db"], row["averages"], row["index_error"]) for row in features}
    both = 1 + np.gcd(TEETH, MATE_TEETH) / MATE_TEETH
    index_errors = both * (np.eye(TEETH) - 1 / TEETH)  # the teeth of the mate that a tooth meets are its own
    scores = np.full((len(templates), len(x), TEETH), -np.inf)
    for k, template in enumerate(templates):
        signal, damaged = np.array(template["tsa"]), bool(template["tooth"])
        n = len(signal)
        noise = np.sqrt(template["reference_variance"]) * 10 ** (-snr_db / 20) / np.sqrt(averages)
        response = np.array(template["specimen_response"]).reshape(n, TEETH)
        sound = noise**2 * np.eye(n) + size**2 * response @ index_errors @ response.T
        counts = np.array(template.get("nuisance_counts") or [], int)
        modes = np.array(template.get("nuisance_modes") or []).reshape(n, counts.sum())
        turns = np.arange(TEETH if damaged else 1)
        turned = np.stack([np.roll(x, -turn * n // TEETH, axis=1) for turn in turns], axis=1)
        each = []
        for weight, sizes in mixture(len(counts)):
            changes = modes * np.repeat(sizes, counts)
            each.append(np.log(weight) + multivariate_normal(signal, sound + changes @ changes.T).logpdf(turned))
        share = np.mean([row["template"] == template["template"] for row in features])
        first = template["tooth"] if damaged else 1
        likelihood = logsumexp([one.reshape(len(x), -1) for one in each], axis=0)
        scores[k][:, (turns + first - 1) % TEETH] = likelihood + np.log(share / len(turns))
    damaged = np.array([bool(template["tooth"]) for template in templates])
    none = logsumexp(scores[~damaged], axis=(0, 2))
    known = log_softmax(np.column_stack([none, logsumexp(scores[damaged], axis=0)]), axis=1)
    return known, np.array([row["tooth"] or 0 for row in features])


@pytest.mark.parametrize("nuisance", ["", NUISANCE], ids=["none", "nuisances"])
def test_the_bound_of_location_is_that_of_dense_covariances(nuisance, tmp_path):
    (tmp_path / "recipe.toml").write_text(RECIPE + nuisance, encoding="utf-8")
    recipe = load_recipe(tmp_path / "recipe.toml")
    run(recipe.plan(), tmp_path / "signatures", recipe=recipe.text, jobs=1)
    expected, true = posteriors(tmp_path / "signatures")
    bound = bayes_bound(sigdb.open(tmp_path / "signatures"))
    assert len(bound.rows) == len(true) == 96
    assert_allclose(bound.scores.to_numpy(), expected, rtol=1e-5, atol=1e-5)
    assert_array_equal(bound.losses["error"], expected.argmax(axis=1) != true)
    assert_allclose(bound.losses["log_loss"], -expected[np.arange(len(true)), true], rtol=1e-5, atol=1e-5)
