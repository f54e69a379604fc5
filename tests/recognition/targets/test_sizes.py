"""Verification: sizes of cracks and of other kinds of damage, against posteriors by NumPy from the Parquet tables."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import CubicSpline
from scipy.special import softmax
from scipy.stats import binom

import sigdb
from sigdb.core import InputError
from sigdb.database import database_quantities, severity_levels
from sigdb.pipeline import load_recipe
from sigdb.recognition import RecognitionSettings, evaluate, train
from sigdb.recognition.answers import severity_sentences, without_improbable
from sigdb.recognition.estimators import registry
from sigdb.recognition.storage.model_card import efficiency_cells, metric_table
from sigdb.recognition.training import usable_rows
from sigdb.report import evaluation_html
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "{rig}"
gear = "pinion"
seed = {seed}
specimens = {specimens}
healthy = 2
{grids}
[measurement]
averages = {averages}
index_error = 1e-6
snr_db = {snr_db}

[signature]
sensors = ["pinion-vertical"]
"""

CRACKS = '[[sweep.grid]]\ntooth = [3, 9]\ncrack_depth = ["0.5 mm", "1 mm", "1.5 mm", "2 mm", "2.5 mm"]\n'
DEEPER = CRACKS.replace('["0.5 mm", "1 mm", "1.5 mm", "2 mm", "2.5 mm"]', '["3.5 mm"]')
BETWEEN = CRACKS.replace('["0.5 mm", "1 mm", "1.5 mm", "2 mm", "2.5 mm"]', '["1.2 mm", "2.2 mm"]')
KINDS = """
[[sweep.grid]]
tooth = [3, 9]
crack_depth = ["1 mm", "2 mm"]

[[sweep.grid]]
tooth = [3, 9]
pit_diameter = ["1.5 mm", "3 mm"]

[[sweep.grid]]
tooth = [3, 9]
wear_depth = ["10 um", "20 um"]

[[sweep.grid]]
tooth = [3, 9]
flank_deviation = ["5 um", "15 um"]
deviation_extent = 0.5
"""


@pytest.fixture(scope="module")
def make(tmp_path_factory):
    def make(grids, *, seed=1, specimens=4, snr_db=-10.0, rig="spur-test-rig", averages=96):
        folder = tmp_path_factory.mktemp("sizes")
        text = RECIPE.format(grids=grids, seed=seed, specimens=specimens, snr_db=snr_db, rig=rig, averages=averages)
        (folder / "recipe.toml").write_text(text, encoding="utf-8")
        recipe = load_recipe(folder / "recipe.toml")
        run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
        return sigdb.open(folder / "signatures")

    return make


@pytest.fixture(scope="module")
def trained():
    """Train with the estimators of severity that are quick."""
    kept = tuple(one for one in registry.REGISTRY if one.name in ("lda", "templates", "fm4", "majority"))

    def trained(database):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("sigdb.recognition.estimators.registry.REGISTRY", kept)
            return train(database, "severity", RecognitionSettings(folds=4))

    return trained


@pytest.fixture(scope="module")
def cracks(make):
    return make(CRACKS, specimens=16)


@pytest.fixture(scope="module")
def kinds(make):
    return make(KINDS, specimens=12)


@pytest.fixture(scope="module")
def crack_model(cracks, trained):
    return trained(cracks)


@pytest.fixture(scope="module")
def kind_model(kinds, trained):
    return trained(kinds)


@pytest.fixture(scope="module")
def crack_evaluation(crack_model, cracks):
    return evaluate(crack_model, cracks)


@pytest.fixture(scope="module")
def kind_evaluation(kind_model, kinds):
    return evaluate(kind_model, kinds)


def damaged_rows(database, count):
    rows = usable_rows(database, "severity")
    rows = rows[rows["tooth"] > 0]
    return rows.iloc[np.linspace(0, len(rows) - 1, count).astype(int)]


def stored_templates(database):
    """Damage of all templates, their signals and responses, as the Parquet files hold them."""
    table = pd.concat(
        pq.read_table(path).to_pandas() for path in sorted(Path(str(database.store)).glob("templates/*.parquet"))
    )
    signals = np.stack(table["tsa"]).astype(float)
    response = np.stack(table["specimen_response"]).astype(float).reshape(len(table), signals.shape[1], -1)
    return table, signals, response


def log_densities(x, noise, mean, response, size=1e-6):
    """(rows, teeth) normal log-densities of averages under damage at each tooth of a pinion of 19 with a wheel of 48.

    Tooth counts have no common factor, so that each tooth meets all of the mate, and index errors have the covariance
    C = I - 1 / 19, a projection.
    """
    teeth = response.shape[1]
    U, gains, _ = np.linalg.svd(response @ (np.eye(teeth) - 1 / teeth), full_matrices=False)
    rho = (size * gains / noise[:, None]) ** 2
    log_p = np.empty((len(x), teeth))
    for t in range(teeth):
        r = np.roll(x, -t * x.shape[1] // teeth, axis=1) - mean
        chi2 = ((r**2).sum(axis=1) - (rho / (1 + rho) * (r @ U) ** 2).sum(axis=1)) / noise**2
        log_p[:, t] = -0.5 * (chi2 + np.log1p(rho).sum(axis=1))
    return log_p


def averages_of(database, rows):
    x = database.signals(rows.index.to_numpy())["tsa"].astype(float)
    return x, (rows["scatter"] / np.sqrt(rows["averages"])).to_numpy()


def test_quantities_follow_from_the_damage(database, cracks, kinds):
    assert database_quantities(database) == ("stiffness_loss", "phase_shift_deg", "damaged_teeth")
    assert database_quantities(cracks) == ("crack_depth", "damaged_teeth")
    several = ("flank_deviation", "crack_depth", "pit_diameter", "wear_depth", "damaged_teeth")
    assert database_quantities(kinds) == several
    y = kinds.xy("severity", columns=["fm4"], folds=4).y
    assert tuple(y) == several
    assert_array_equal(y.notna().sum(axis=1), 2)  # its size, and the number of damaged teeth
    assert sorted(y["flank_deviation"].dropna().unique()) == pytest.approx([5e-6, 15e-6])


def test_details_that_vary_are_quantities():
    cases = pd.DataFrame({"tooth": 1, "damaged_teeth": 1, "pit_diameter": [1e-3, 1e-3], "pit_depth": [0.0, 1e-4]})
    assert sigdb.database.severity_quantities(cases) == ("pit_diameter", "pit_depth", "damaged_teeth")
    levels = severity_levels(cases.assign(pit_diameter=[0.0, 1e-3]), ("pit_diameter", "pit_depth"))
    assert_array_equal(levels, [[np.nan, np.nan], [1e-3, 1e-4]])


def test_the_depth_of_a_crack_is_the_posterior_over_interpolated_signals(crack_model, cracks, make):
    """Posterior means by sums over depths in steps of 0.05 mm, of signals and responses by a cubic spline."""
    unseen = make(BETWEEN, seed=9, specimens=2)
    rows = damaged_rows(unseen, 8)
    x, noise = averages_of(unseen, rows)
    table, signals, response = stored_templates(cracks)
    depths = np.linspace(0, 2.5e-3, 51)
    stored = table["crack_depth"].to_numpy()
    means, responses = (CubicSpline(stored, values)(depths) for values in (signals, response))
    log_p = np.stack([log_densities(x, noise, *law) for law in zip(means, responses, strict=True)])
    weights = softmax(np.logaddexp.reduce(log_p, axis=2), axis=0)
    mean = depths @ weights
    spread = np.sqrt((depths - mean[:, None]) ** 2 @ weights)[np.arange(8), np.arange(8)]
    batch, estimator = crack_model.read(unseen, rows), crack_model.estimator
    assert estimator.bank.has_continuous_severity(19)
    found = estimator.reducer.severities(batch)
    assert_allclose(found["mean"][:, 0], mean, atol=0.05 * spread.max())
    assert_allclose(found["spread"][:, 0], spread, rtol=0.05)
    off_grid = np.abs(estimator.predict(batch)["crack_depth"].to_numpy()[:, None] - stored).min(axis=1)
    assert off_grid.max() > 0.1e-3


def test_each_quantity_is_given_damage_that_has_it(kind_model, kinds):
    rows = damaged_rows(kinds, 12)
    x, noise = averages_of(kinds, rows)
    table, signals, response = stored_templates(kinds)
    damaged = (table["tooth"] > 0).to_numpy()
    log_p = np.stack([log_densities(x, noise, *law) for law in zip(signals, response, strict=True)])
    log_p = np.logaddexp.reduce(log_p, axis=2)[damaged]
    batch, estimator = kind_model.read(kinds, rows), kind_model.estimator
    found = estimator.reducer.severities(batch)
    for place, name in enumerate(estimator.bank.quantities[:-1]):
        values = table[name].to_numpy()[damaged]
        has = values != 0
        share = softmax(log_p, axis=0)[has].sum(axis=0)
        assert_allclose(found["probability"][:, place], share, atol=2e-3)
        likely = share > 1e-6
        assert likely.any()
        mean = values[has] @ softmax(log_p[has], axis=0)
        assert_allclose(found["mean"][likely, place], mean[likely], rtol=1e-3)


def test_intervals_cover_and_errors_are_those_of_the_best_answer(crack_evaluation):
    """The coverage is not below 0.9 by a binomial test of the rows, as if each were a specimen."""
    metrics = crack_evaluation.metrics["templates"]
    rows = crack_evaluation.rows
    covered = round(metrics["coverage_crack_depth"].value * rows)
    assert binom.cdf(covered, rows, 0.9) > 1e-3
    assert "mae_stiffness_loss" not in metrics
    assert not crack_evaluation.above
    ratio = crack_evaluation.efficiency.set_index("quantity").loc["crack_depth", "mae_ratio"]
    assert_allclose(ratio, 1, atol=0.05)
    assert metrics["mae_crack_depth"].value < crack_evaluation.metrics["lda"]["mae_crack_depth"].value
    cells = next(row for row in metric_table(crack_evaluation).rows if row[0] == "MAE crack_depth, mm")
    assert cells[2].value == pytest.approx(1e3 * metrics["mae_crack_depth"].value)
    assert efficiency_cells(crack_evaluation).rows[0][0] == "crack_depth, mm"
    assert "Estimates of the crack depth" in evaluation_html(crack_evaluation, title="Cracks")


def test_errors_are_those_of_rows_that_have_the_size(kind_evaluation, kind_model, kinds):
    metrics = kind_evaluation.metrics["templates"]
    test = usable_rows(kinds, "severity")
    test = test[~test["specimen"].isin(kind_model.trained_on) & (test["wear_depth"] > 0)]
    error = kind_model.estimator.predict(kind_model.read(kinds, test))["wear_depth"] - test["wear_depth"]
    assert_allclose(metrics["mae_wear_depth"].value, np.abs(error).mean())
    assert kind_evaluation.bound["mae_wear_depth"].value <= metrics["mae_wear_depth"].value
    assert not kind_evaluation.above
    assert {f"coverage_{name}" for name in kind_model.estimator.quantities_} <= {*metrics}


def test_answers_name_the_size_that_damage_has(kind_model, kinds):
    rows = usable_rows(kinds, "severity")
    rows = rows[rows["wear_depth"] == 20e-6].iloc[:4]
    verdict = kind_model.assess(kind_model.read(kinds, rows))
    assert verdict["answer"].str.startswith("If a tooth is damaged, its wear depth is 20 um").all()
    assert (verdict["wear_depth_probability"] > 0.99).all()
    assert verdict["crack_depth"].isna().all()


def test_an_interval_at_the_end_of_the_training_may_be_more():
    ends = {"crack_depth": [2.4e-3], "crack_depth_low": 1.9e-3, "crack_depth_high": 2.5e-3, "wear_depth": 1e-6}
    predicted = pd.DataFrame(ends | {"crack_depth_probability": 0.9, "wear_depth_probability": 0.005})
    kept = without_improbable(predicted)
    assert kept["wear_depth"].isna().all()
    said = severity_sentences(kept, {"crack_depth": 2.5e-3})
    crack = "If a tooth is damaged, its crack depth is 2.4 mm (1.9 to 2.5 or more), with probability 0.90."
    assert said == [crack]
    assert "or more" not in severity_sentences(kept, {"crack_depth": 3e-3})[0]


def test_more_than_the_templates_have_is_outside(crack_model, make):
    deep = make(DEEPER, seed=5, specimens=2, snr_db=0.0)
    verdict = crack_model.assess(crack_model.read(deep, damaged_rows(deep, 4)))
    assert verdict["outside"].all()
    assert verdict["crack_depth"].isna().all()
    reason = "the damage is more severe than that of all templates, which have a crack depth of at most 2.5 mm"
    assert (verdict["reason"] == reason).all()
    assert evaluate(crack_model, deep, bound=False).metrics["templates"]["outside"].value == 1


def test_a_loss_beyond_the_templates_is_outside(severity_model, make_database):
    """Templates end at 0.4."""
    severe = make_database(seed=8, specimens=2, healthy=1, grid="tooth = [3, 6]\nstiffness_loss = [0.6]")
    model = replace(severity_model, learner="templates")
    verdict = model.assess(model.read(severe, damaged_rows(severe, 4)))
    assert verdict["outside"].all()
    assert verdict["stiffness_loss"].isna().all()


def test_rows_with_sizes_that_a_model_does_not_answer_are_refused(crack_model, kinds):
    match = "damage whose flank_deviation, pit_diameter, wear_depth is not 0, and the model answers crack_depth"
    with pytest.raises(InputError, match=match):
        evaluate(crack_model, kinds)
    assert evaluate(crack_model, kinds, where="pit_diameter = 0 and wear_depth = 0 and flank_deviation = 0").rows
