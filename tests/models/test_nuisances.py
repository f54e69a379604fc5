"""Models: those of machines that are not what is stated, on machines between the points of their training."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.recognition import OutsideWarning, evaluate
from sigdb.sweep import run

RECIPE = Path(__file__).parents[2] / "pipelines" / "reference-nuisances.toml"
SNR_DB = -14.0


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    """Machines with the nuisances of the recipe, at a point between those of the training."""
    recipe = tomllib.loads(RECIPE.read_text(encoding="utf-8"))
    operating = {"speed_rpm": 14_050.0, "torque": 350.0}
    case = {"tooth": [3, 8], "stiffness_loss": [0.2, 0.4], "operating": operating}
    recipe["sweep"] |= {"seed": 909, "specimens": 30, "healthy": 4, "grid": [case]}
    recipe["measurement"]["snr_db"] = SNR_DB
    recipe["nuisance"]["rigs"] = 16
    folder = tmp_path_factory.mktemp("machines")
    (folder / "recipe.toml").write_text(tomli_w.dumps(recipe), encoding="utf-8")
    read = load_recipe(folder / "recipe.toml")
    run(read.plan(), folder / "signatures", recipe=read.text, jobs=1)
    return sigdb.open(folder / "signatures")


def test_location_is_as_good_between_its_points_as_the_best_possible_answer(machines):
    """It knows less, any severity of its training, and so it may be wrong a little more often."""
    model = sigdb.load_model("nasa-nuisances-location")
    alone = replace(model, estimators={model.learner: model.estimator})
    evaluation = evaluate(alone, machines)
    ours, best = evaluation.metrics[model.learner], evaluation.bound
    assert best["accuracy"].value - ours["accuracy"].value < 0.08
    assert ours["set_coverage"].value > 0.85


def test_detection_keeps_its_rate_of_false_alarms(machines):
    model = sigdb.load_model("nasa-nuisances-detection")
    rows = machines.features(where="tooth = 0")
    signals = machines.signals(rows["id"].to_numpy())
    alarms = model.predict(rows.assign(tsa=list(signals["tsa"].astype(float))))
    assert len(alarms) == 120
    assert alarms.sum() <= 6


@pytest.mark.parametrize("passes", [0.3, -0.3])
def test_a_mark_out_of_its_place_changes_no_answer(passes):
    """At high signal-to-noise ratio; the model of a stated mark has none, or another."""
    rig = sigdb.load_transmission("nasa-spiral-bevel").replace(
        {"operating.speed_rpm": 14_050.0, "operating.torque": 350.0}
    )
    prepared = sigdb.prepare(rig, "pinion")
    x = prepared.simulate(sigdb.Damage(tooth=6, stiffness_loss=0.4)).signal("pinion-vertical")
    late = np.fft.irfft(np.fft.rfft(x) * np.exp(-2j * np.pi / 12 * passes * np.arange(len(x) // 2 + 1)), len(x))
    noise = x.std() * 10**0.5 / np.sqrt(102)
    seen = late + noise * np.random.default_rng(3).standard_normal((8, len(x)))
    point = {"speed_rpm": 14_050.0, "torque": 350.0, "averages": 102, "scatter": noise * np.sqrt(102)}
    assert (sigdb.load_model("nasa-nuisances-location").predict(tsa=seen, **point) == 6).all()
    with pytest.warns(OutsideWarning):
        stated = np.asarray(sigdb.load_model("nasa-location").predict(tsa=seen, **point))
    assert (stated == -1).all()
