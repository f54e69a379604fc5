"""The table of robustness, on a small database of a model with nuisances."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.measurement import NEPER_DB, NuisanceMixture
from sigdb.pipeline import load_recipe, train_model
from sigdb.pipeline.robustness import nuisance_bounds
from sigdb.pipeline.robustness.disturbances import DISTURBANCES, NOTHING
from sigdb.pipeline.robustness.off_law_rows import OffLawRows
from sigdb.pipeline.robustness.robustness import with_robustness
from sigdb.recognition import (
    Batch,
    RobustnessSettings,
    evaluate,
    load_model,
    requested_rows,
    robustness_cells,
)
from sigdb.report import evaluation_html
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "spur-test-rig"
gear = "pinion"
seed = 5
specimens = 6
healthy = 60

[[sweep.grid]]
tooth = [1, 8]
stiffness_loss = 0.5

[measurement]
averages = 96
snr_db = -10.0
index_error = 1e-6

[nuisance]
gain_db = 2.0
mark = 0.05
colour_db = 8.0
colour_octaves = 3.0
colours = 4

[signature]
samples_per_tooth = 32

[recognition]
learner = "templates"
folds = 3
robustness.rows = 40
robustness.rigs = 2
"""
SHARES = ["right", "not_sure", "outside", "sure_wrong"]


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robust")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")


@pytest.fixture(scope="module")
def trained(database, tmp_path_factory, few_trees):
    folder = tmp_path_factory.mktemp("model") / "location"
    return train_model(database, "location", folder, command="sigdb run recipe.toml", check=False), folder


def test_rows_without_a_disturbance_follow_the_law(database, trained):
    """Their squared residual under the true template is that of the noise: the generator agrees with the bank."""
    model = load_model(trained[1])
    cases = database.sql("select id, template, index_error, snr_db, tooth from cases").set_index("id")
    rows = requested_rows(model, database)
    rows = rows.join(cases[[name for name in cases if name not in rows]])
    made = OffLawRows(database, rows, database.sensors[0]).disturbed_rows(NOTHING, np.random.default_rng(1))
    reduced = model.estimator.reducer.reduced_chi2(Batch.from_rows(made, model.estimator.columns_read))
    samples = len(made["tsa"].iloc[0])
    assert abs(reduced.mean() - 1) < 5 * np.sqrt(2 / samples / len(made)) + 3 / samples
    assert_allclose(made["tooth"], rows.loc[made.index, "tooth"])


def test_the_table_is_in_card_and_report(trained):
    evaluation, folder = trained
    table = evaluation.tables["robustness"]
    assert_allclose(table[SHARES].sum(axis=1), 1.0)
    assert (table["rows"] <= 40).all()
    assert "soft form" not in set(table["disturbance"])
    nothing = table.set_index("disturbance").loc["nothing"]
    assert nothing["sure_wrong"] <= 0.05
    assert nothing["outside"] <= 0.15
    text = "the mark 0.4 of a tooth pass late"
    assert text in (folder / "README.md").read_text(encoding="utf-8")
    html = evaluation_html(evaluation, title="Robust")
    assert "<h2>Robustness</h2>" in html
    assert text in html
    assert len(robustness_cells(evaluation).rows) == len(table)


def test_a_gain_that_was_stated_does_no_harm_and_another_shape_is_outside(trained):
    table = trained[0].tables["robustness"].set_index("disturbance")
    assert table.loc["gain 3 dB", "outside"] <= 0.15
    assert table.loc["ghost 0.3", "outside"] > 0.8


def test_a_model_that_has_seen_coloured_noise_answers_it(trained):
    """The noise of these rows hides damage as white noise of ten times the power, beyond all that is white."""
    table = trained[0].tables["robustness"].set_index("disturbance")
    assert table.loc["coloured noise", "outside"] <= 0.15
    assert table.loc["coloured noise", "sure_wrong"] <= 0.05


def test_the_best_answer_knows_a_disturbance_by_its_kind_and_size(database, trained):
    """A gain changes the average in proportion; a late mark is known by its standard deviation."""
    rows = requested_rows(load_model(trained[1]), database)
    bounds = nuisance_bounds.NuisanceBounds(database, rows, database.sensors[0], 2)
    named = {each.name: each for each in DISTURBANCES}
    law = bounds._point(bounds._points[0], named["gain 3 dB"]).hypotheses
    modes = law.nuisances.modes[:, :, 0]
    assert_allclose(modes * np.sign(np.sum(modes * law.signal, axis=1))[:, None], law.signal * 3 / NEPER_DB, rtol=1e-5)
    late = bounds._point(bounds._points[0], named["mark 0.4"]).hypotheses.nuisances
    assert late.mixture == NuisanceMixture.certain(0, mark=0.4)
    assert bounds._point(bounds._points[0], named["nothing"]).hypotheses.nuisances is None


def test_the_loss_is_the_noise_at_which_the_best_answer_errs_as_often_on_the_same_rows(database, trained, monkeypatch):
    """At 24 dB more noise the best answer has the errors of rows that were made with 24 dB more noise."""
    monkeypatch.setattr(nuisance_bounds, "_LEVELS", (0.0, 12.0, 24.0, 36.0))
    rows = requested_rows(load_model(trained[1]), database)
    cases = database.sql("select id, template, index_error, snr_db, tooth from cases").set_index("id")
    rows = rows.join(cases[[name for name in cases if name not in rows]])
    bounds = nuisance_bounds.NuisanceBounds(database, rows, database.sensors[0], 2)
    coloured = next(each for each in DISTURBANCES if each.name == "coloured noise")
    for disturbance in (NOTHING, coloured):
        off_law = OffLawRows(database, rows, database.sensors[0])
        disturbed = off_law.disturbed_rows(disturbance, np.random.default_rng(3))
        louder = OffLawRows(database, rows.assign(snr_db=rows["snr_db"] - 24.0), database.sensors[0])
        loud = louder.disturbed_rows(disturbance, np.random.default_rng(3))
        points = [bounds._point(point, disturbance) for point in bounds._points]
        errors = nuisance_bounds._errors(points, disturbance, disturbed, 10 ** (24 / 20))
        points = [
            replace(point, rows=point.rows.assign(noise=point.rows["noise"] * 10 ** (24 / 20))) for point in points
        ]
        assert 0 < errors == nuisance_bounds._errors(points, disturbance, loud, 1.0)
        assert bounds.loss_db(disturbance, disturbed, errors) == 24.0
        assert bounds.loss_db(disturbance, disturbed, 0.0) == 0.0
        assert bounds.loss_db(disturbance, disturbed, 0.99) == np.inf


def test_nothing_is_tested_by_default(database, trained):
    evaluation = evaluate(load_model(trained[1]), database, bound=False)
    assert with_robustness(evaluation, load_model(trained[1]), database, RobustnessSettings()) is evaluation
    assert not robustness_cells(evaluation)
