"""Models: each reference model loads by its name, answers as when it was saved, and is as good as its card says."""

import functools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm, t

import sigdb
from sigdb.core.errors import DatabaseError, InputError
from sigdb.database.store.seal import unsealed
from sigdb.recognition import OutsideWarning, built_in_models, evaluate
from sigdb.recognition.metrics.estimate import Estimate

from .conftest import operating_points

MODELS = Path(__file__).parents[2] / "models"
loaded = functools.cache(sigdb.load_model)
NAMES = sorted(path.parent.name for path in MODELS.glob("*/model.json"))
MOST_BYTES = 5_000_000
JUDGED = {
    "location": ("accuracy", "p_exact", "p_detected", "none_on_healthy", "log_loss", "brier", "set_coverage"),
    "detection": ("p_detected", "false_alarm_rate"),
    "severity": tuple(
        f"{figure}_{target}"
        for figure in ("mae", "rmse", "coverage")
        for target in ("stiffness_loss", "phase_shift_deg", "damaged_teeth")
    ),
}

OVERVIEW = {
    "location": ("accuracy", "p_exact", "pd_at_1e-3"),
    "detection": ("p_detected", "false_alarm_rate"),
    "severity": ("mae_stiffness_loss", "mae_phase_shift_deg", "mae_damaged_teeth"),
}


def described(name):
    return json.loads((MODELS / name / "model.json").read_text(encoding="utf-8"))


def figures_of_the_card(name):
    facts = described(name)
    return {
        figure: Estimate(**ends)
        for figure, ends in facts["evaluation"]["metrics"][facts["learner"]].items()
        if None not in ends.values()
    }


def student(figure, specimens):
    """The interval for few specimens: a bootstrap over K has the normal law and (K - 1) / K of the variance."""
    wider = t.ppf(0.975, specimens - 1) / norm.ppf(0.975) * np.sqrt(specimens / (specimens - 1))
    low, high = (figure.value + wider * (end - figure.value) for end in (figure.low, figure.high))
    return Estimate(value=figure.value, low=low, high=high)


def disagreements(name, card, evaluation, judged):
    """Figures outside the card's interval, widened by their own."""
    of_card = described(name)["evaluation"]["specimens"]
    found = evaluation.metrics[evaluation.learner]
    pairs = {key: (student(card[key], of_card), student(found[key], evaluation.specimens)) for key in judged}
    return [
        f"{key}: card {one}, found {other}"
        for key, (one, other) in pairs.items()
        if other.high < one.low or other.low > one.high
    ]


def test_models_of_the_nasa_rig_are_there():
    assert {"nasa-detection", "nasa-location", "nasa-severity"} <= set(NAMES)
    assert built_in_models() == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_it_loads_by_name_and_is_small(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model = sigdb.load_model(name)
    assert name.endswith(model.target)
    assert sum(path.stat().st_size for path in (MODELS / name).iterdir()) < MOST_BYTES
    assert (MODELS / name / "README.md").read_text(encoding="utf-8").startswith("# ")


@pytest.mark.parametrize("name", NAMES)
def test_the_overview_tells_the_cards_figures(name):
    overview = (MODELS / "README.md").read_text(encoding="utf-8")
    evaluation = described(name)["evaluation"]
    for figure in OVERVIEW[described(name)["target"]]:
        model, best = (facts[figure]["value"] for facts in (evaluation["metrics"]["templates"], evaluation["bound"]))
        assert f"| {model:.3g} | {best:.3g} |" in overview


@pytest.mark.parametrize("name", NAMES)
def test_it_answers_its_probe_as_when_it_was_saved(name):
    estimator = (model := loaded(name)).estimators[model.learner]
    with np.load(MODELS / name / "probe.npz") as probe:
        expected = probe["expected"]
        columns = {key: list(probe[key]) for key in probe.files if key != "expected"}
    rows = pd.DataFrame(columns)
    assert len(rows) == 8
    found = estimator.predict(rows) if model.target == "severity" else estimator.decision_function(rows)
    np.testing.assert_allclose(np.asarray(found), expected, rtol=1e-6, atol=1e-9)


def probe_rows(name):
    """Rows of the training, as arrays by name."""
    with np.load(MODELS / name / "probe.npz") as probe:
        return {key: probe[key] for key in probe.files if key not in ("expected", "teeth", "wigner_ville")}


@pytest.mark.parametrize("name", NAMES)
def test_it_is_sealed_and_states_its_range(name):
    content = (MODELS / name / "model.json").read_bytes()
    assert unsealed(content, name="model.json")["trained_range"]["unit"] == "m/s"
    with pytest.raises(DatabaseError, match="damaged or was edited"):
        unsealed(content.replace(b"102.0", b"103.0", 1), name="model.json")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["speed", "torque", "averages", "mm/s", "g", "samples"])
def test_rows_that_it_was_not_trained_for_have_no_answer(name, kind):
    model, rows = loaded(name), probe_rows(name)
    assert len(model.predict(**rows)) == 8
    factor = {"mm/s": 1000.0, "g": 1 / 9.81}.get(kind, 1.0)
    changed = {
        "speed": {"speed_rpm": 3000.0},
        "torque": {"torque": 100.0},
        "averages": {"averages": 30},
        "samples": {"tsa": rows["tsa"][:, ::2]},
    }.get(kind, {"tsa": factor * rows["tsa"], "scatter": factor * rows["scatter"]})
    with pytest.warns(OutsideWarning, match="outside the range of the model's training"):
        predicted = np.asarray(model.predict(**rows | changed), float)
    assert np.isnan(predicted).all() if model.target == "severity" else (predicted == -1).all()
    assert set(model.assess(**rows | changed)["kind"]) == {"cannot be judged"}


@pytest.mark.parametrize("name", NAMES)
def test_its_templates_are_at_points_of_the_reference_recipe_and_hold_between_them(name):
    bank = loaded(name).estimator.template_bank
    recipe = operating_points()[["speed_rpm", "torque"]].to_numpy()
    stored = np.array([(point.speed_rpm, point.torque) for point in bank.points])
    assert np.abs(stored[:, None] / recipe - 1).max(axis=2).min(axis=1).max() < 1e-12
    (between,) = bank.interpolations
    assert between.error <= 0.1
    assert between.speed_rpm[0] < recipe[:, 0].min()
    assert between.speed_rpm[1] > recipe[:, 0].max()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("speed_rpm", "outside"), [(13_500.0, True), (13_520.0, False), (15_240.0, False), (15_260.0, True)]
)
def test_a_speed_beyond_its_templates_is_outside(name, speed_rpm, outside):
    reasons = loaded(name).assess(**probe_rows(name) | {"speed_rpm": speed_rpm})["reason"]
    assert reasons.str.contains("is beyond the templates, which hold from").all() == outside


@pytest.mark.parametrize(
    ("loss", "shift", "outside"),
    [(0.1, 0.0, 0.0), (0.3, 0.7, 0.0), (0.4, 3.0, 0.0), (0.5, 0.0, 1.0), (0.2, 4.5, 1.0)],
)
def test_damage_more_severe_than_the_templates_is_outside(loss, shift, outside):
    """At -14 dB, between the points of the training. One in a hundred rows inside is called outside."""
    model, stream = loaded("nasa-severity"), np.random.default_rng(5)
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    rig = rig.replace({"operating.speed_rpm": 14_050.0, "operating.torque": 350.0})
    prepared = sigdb.prepare(rig, "pinion")
    damage = sigdb.Damage(tooth=6, stiffness_loss=loss, phase_shift_deg=shift)
    clean, healthy = (prepared.simulate(one).signal("pinion-vertical") for one in (damage, sigdb.Damage()))
    noise = np.sqrt(healthy.var() * 10**1.4 / 102)
    x = clean + noise * stream.standard_normal((40, len(clean)))
    point = {"speed_rpm": 14_050.0, "torque": 350.0, "averages": 102, "scatter": noise * np.sqrt(102)}
    reasons = model.assess(tsa=x, **point)["reason"]
    found = reasons.str.startswith("the damage is more severe than that of all templates, which have ")
    assert abs(found.mean() - outside) < 0.1


@pytest.mark.parametrize(("loss", "shift", "teeth"), [(0.3, 0.75, 1), (0.15, 2.2, 2), (0.05, 1.0, 1), (0.27, 0.4, 2)])
def test_severities_between_those_of_the_training_are_estimated_as_they_are(loss, shift, teeth):
    """At -12 dB, between the points of the training: they are no values of a grid, and right on average."""
    model, stream = loaded("nasa-severity"), np.random.default_rng(6)
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    rig = rig.replace({"operating.speed_rpm": 14_450.0, "operating.torque": 330.0})
    prepared = sigdb.prepare(rig, "pinion")
    damage = sigdb.Damage(tooth=2, stiffness_loss=loss, phase_shift_deg=shift, damaged_teeth=teeth)
    clean, healthy = (prepared.simulate(case).signal("pinion-vertical") for case in (damage, sigdb.Damage()))
    noise = np.sqrt(healthy.var() * 10**1.2 / 102)
    x = clean + noise * stream.standard_normal((40, len(clean)))
    point = {"speed_rpm": 14_450.0, "torque": 330.0, "averages": 102, "scatter": noise * np.sqrt(102)}
    found = model.assess(tsa=x, **point)
    for name, true, most in (("stiffness_loss", loss, 0.025), ("phase_shift_deg", shift, 0.2)):
        assert abs(found[name].mean() - true) < most
        assert found[name].nunique() > 30
    assert (found["damaged_teeth"].round() == teeth).mean() > 0.9


def test_location_answers_by_a_prevalence():
    """A row of the probe that is called damaged is called healthy where damage is hardly ever there."""
    model, rows = loaded("nasa-location"), probe_rows("nasa-location")
    assert model.estimator.trained_prevalence == pytest.approx(0.825, abs=0.001)
    assert (model.predict(**rows, prevalence=1e-300) > 0).sum() < (model.predict(**rows) > 0).sum()


@pytest.fixture(scope="module")
def fresh_evaluation(fresh):
    made = {}

    def evaluation(name):
        if name not in made:
            model = loaded(name)
            alone = replace(model, estimators={model.learner: model.estimators[model.learner]})
            made[name] = evaluate(alone, fresh, bound=False)
        return made[name]

    return evaluation


@pytest.mark.parametrize("name", NAMES)
def test_it_is_as_good_as_its_card_says(name, fresh_evaluation):
    judged = JUDGED[described(name)["target"]]
    assert disagreements(name, figures_of_the_card(name), fresh_evaluation(name), judged) == []


def test_a_card_that_says_too_much_is_found_out(fresh_evaluation):
    """Accuracy six hundredths above, and errors a fifth below, what is found."""
    card = figures_of_the_card("nasa-location")
    better = card["accuracy"]
    boast = {"accuracy": Estimate(value=better.value + 0.06, low=better.low + 0.06, high=better.high + 0.06)}
    assert disagreements("nasa-location", card | boast, fresh_evaluation("nasa-location"), ["accuracy"])
    card = figures_of_the_card("nasa-severity")
    least = card["mae_stiffness_loss"]
    boast = {"mae_stiffness_loss": Estimate(value=0.8 * least.value, low=0.8 * least.low, high=0.8 * least.high)}
    assert disagreements("nasa-severity", card | boast, fresh_evaluation("nasa-severity"), ["mae_stiffness_loss"])


def test_an_unknown_name_lists_those_there_are(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        InputError, match=r"my_model.py is a file in Python; name the class in it, as my_model.py:Model"
    ):
        sigdb.load_model("my_model.py")
    with pytest.raises(InputError, match=r"nasa-locaton is not a model folder, nor .* nasa-location, nasa-severity"):
        sigdb.load_model("nasa-locaton")
    with pytest.raises(InputError, match=r"is not a model folder: model\.json is missing"):
        sigdb.load_model("./nasa-location")


def test_a_folder_here_goes_before_a_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nasa-location").mkdir()
    with pytest.raises(InputError, match=r"is not a model folder: model\.json is missing"):
        sigdb.load_model("nasa-location")
