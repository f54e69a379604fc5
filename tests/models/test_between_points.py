"""Verification: the reference model between the points and severities of its training, against the exact law there.

The law is written out in NumPy from a table of templates alone: normal averages with white noise and index errors. The
templates stand for all severities: they lie closer together than an average can tell them apart, and weigh as in the
trapezoidal rule. Rows are drawn from the law. The exact answer is the posterior of the Bayes rule with these templates;
it costs what an answer of the model adds to the expected log loss, their relative entropy. That is compared with what a
quarter of a decibel more noise costs the exact answer on the same rows.
"""

import tomllib

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import tomli_w
from scipy.special import logsumexp

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

from .conftest import REFERENCE

TEETH, STEP, MATE, AVERAGES, INDEX_ERROR, HEALTHY = 12, 64, 36, 102, 2e-6, 0.175
SNR_DB = (-28.0, -22.0, -16.0)
LOSSES, SHIFTS = np.linspace(0, 0.4, 9), np.linspace(0, 3, 7)
ROWS = 150
MORE = 10 ** (0.25 / 10) - 1
"""Variance of the noise that is a quarter of a decibel more, over that of the noise."""


@pytest.fixture(scope="module")
def templates(tmp_path_factory):
    """The table of templates at two points that no training has seen, as arrays by column."""
    folder = tmp_path_factory.mktemp("between")
    recipe = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))
    (grid,) = recipe["sweep"]["grid"]
    kept = {"damaged_teeth": grid["damaged_teeth"]}
    kept |= {"phase_shift_deg": SHIFTS.tolist(), "stiffness_loss": LOSSES.tolist()}
    table = {"operating": {"speed_rpm": [13_931.7, 14_868.3], "torque": [399.0, 311.0]}, "snr_db": [20.0, 20.0]}
    recipe["sweep"] |= {"seed": 2002, "specimens": 1, "healthy": 1, "grid": [kept | {"tooth": [1], "table": table}]}
    (folder / "recipe.toml").write_text(tomli_w.dumps(recipe), encoding="utf-8")
    loaded = load_recipe(folder / "recipe.toml")
    run(loaded.plan(), folder / "signatures", recipe=loaded.text, jobs=1)
    parts = sorted((folder / "signatures" / "templates").glob("*.parquet"))
    return pd.concat([pq.read_table(part).to_pandas() for part in parts], ignore_index=True)


_AXES = {"stiffness_loss": LOSSES, "phase_shift_deg": SHIFTS}


class Law:
    """The law of averages at one operating point, written out."""

    def __init__(self, table):
        self.speed_rpm, self.torque = table["speed_rpm"].iloc[0], table["torque"].iloc[0]
        self.healthy = (table["tooth"] == 0).to_numpy()
        self.mean = np.stack(table["tsa"].to_list()).astype(float)
        response = np.stack(table["specimen_response"].to_list()).astype(float).reshape(len(table), -1, TEETH)
        group = np.gcd(TEETH, MATE)
        same = np.subtract.outer(np.arange(TEETH), np.arange(TEETH)) % group == 0
        covariance = np.eye(TEETH) - 1 / TEETH + group / MATE * (same - 1 / group)
        value, vector = np.linalg.eigh(covariance)
        self.spread = INDEX_ERROR * response @ (vector * np.sqrt(value.clip(min=0)))
        ends = [np.isin(table[name], axis[[0, -1]]) for name, axis in _AXES.items()]
        share = np.where(ends[0], 0.5, 1.0) * np.where(ends[1], 0.5, 1.0)
        self.share = np.where(self.healthy, HEALTHY, (1 - HEALTHY) * share / share[~self.healthy].sum())
        self.variance = table["reference_variance"].to_numpy(float)[self.healthy][0]

    def noise(self, snr_db):
        return np.sqrt(self.variance * 10 ** (-snr_db / 10) / AVERAGES)

    def draw(self, stream, noise):
        place = stream.choice(len(self.share), ROWS, p=self.share)
        tooth = np.where(self.healthy[place], 0, stream.integers(1, TEETH + 1, ROWS))
        errors = np.einsum("knt,kt->kn", self.spread[place], stream.standard_normal((ROWS, TEETH)))
        clean = [np.roll(x, max(t - 1, 0) * STEP) for x, t in zip(self.mean[place] + errors, tooth, strict=True)]
        return np.array(clean) + noise * stream.standard_normal((ROWS, TEETH * STEP))

    def location(self, x, noise):
        """(rows, teeth + 1) logarithm of the probability of none, and of each tooth."""
        joint = np.empty((len(x), len(self.mean), TEETH))
        turned = np.stack([np.roll(x, -t * STEP, axis=1) for t in range(TEETH)], axis=1)
        for k, (mean, spread) in enumerate(zip(self.mean, self.spread, strict=True)):
            inner = np.eye(TEETH) + spread.T @ spread / noise**2
            residual = (turned - mean) / noise
            along = residual @ spread / noise
            square = (residual**2).sum(axis=2) - (along * np.linalg.solve(inner, along[..., None])[..., 0]).sum(axis=2)
            joint[:, k] = -0.5 * (square + np.linalg.slogdet(inner)[1])
        joint += np.log(self.share)[:, None]
        none = joint[:, self.healthy, 0]
        damage = logsumexp(joint[:, ~self.healthy], axis=1) - np.log(TEETH)
        both = np.column_stack([none, damage])
        return both - logsumexp(both, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def laws(templates):
    return [Law(table) for _, table in templates.groupby("speed_rpm")]


def model_location(model, law, x, noise):
    rows = pd.DataFrame({"teeth": TEETH, "speed_rpm": law.speed_rpm, "torque": law.torque}, index=range(len(x)))
    rows = rows.assign(averages=AVERAGES, scatter=noise * np.sqrt(AVERAGES), tsa=list(x))
    return np.log(model.estimators["templates"].predict_proba(rows).clip(min=1e-300))


def entropy(log_p):
    return -(np.exp(log_p) * log_p).sum(axis=1).mean()


@pytest.mark.parametrize("snr_db", SNR_DB)
def test_it_loses_less_than_a_quarter_of_a_decibel_between_its_points_and_severities(laws, snr_db):
    model, costs, quarters = sigdb.load_model("nasa-location"), [], []
    for number, law in enumerate(laws):
        stream, noise = np.random.default_rng([3, number, int(-snr_db)]), law.noise(snr_db)
        x = law.draw(stream, noise)
        exact, answer = law.location(x, noise), model_location(model, law, x, noise)
        costs.append((np.exp(exact) * (exact - answer)).sum(axis=1).mean())
        noisier = x + noise * np.sqrt(MORE) * stream.standard_normal(x.shape)
        quarters.append(entropy(law.location(noisier, noise * np.sqrt(1 + MORE))) - entropy(exact))
        assert np.mean(exact.argmax(axis=1) == answer.argmax(axis=1)) > 0.97
    assert np.mean(costs) < np.mean(quarters)
