"""The smallest damage of a measurement, against the closed form and against counts of simulated rows."""

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq
from scipy.special import logsumexp, ndtri
from scipy.stats import norm

import sigdb
from sigdb.core import InputError, NotApplicableError
from sigdb.dynamics import prepare_periodic
from sigdb.measurement import index_error_covariance
from sigdb.pipeline import load_recipe
from sigdb.planning import PlanSettings, plan_measurement
from sigdb.planning.candidate_averages import CandidateAverages
from sigdb.planning.smallest_damage import SmallestDamage
from sigdb.sweep import run
from sigdb.transmission import Damage, load_transmission

RIG, GEAR, SENSOR = "nasa-spiral-bevel", "pinion", "pinion-vertical"
POINT = {"speeds_rpm": [14400.0], "torques": [356.05], "averages": [102], "sensors": [SENSOR]}


@pytest.fixture(scope="module")
def prepared():
    return prepare_periodic(load_transmission(RIG), gear=GEAR, samples_per_tooth=32)


def difference(prepared, loss):
    """Difference of the average that a stiffness loss of tooth 1 makes, by the simulator alone."""
    states = prepared.steady_state([{}, Damage(tooth=1, stiffness_loss=loss).on_teeth(12)])
    signals = states.signals_at()[:, 0]
    return signals[1] - signals[0]


@pytest.mark.parametrize(("snr_db", "rate"), [(0.0, 1e-3), (-6.0, 1e-2)])
def test_a_known_signal_in_white_noise_has_the_closed_form(prepared, snr_db, rate):
    # d' = sqrt(s' S^-1 s) = |s| / noise, P = Phi(d' - z): a90 is where d' = z(1 - rate) + z(0.9).
    healthy = prepared.steady_state([{}]).signals_at()[0, 0]
    noise = healthy.std() * 10 ** (-snr_db / 20) / np.sqrt(102)
    needed = ndtri(0.9) - ndtri(rate)
    exact = brentq(lambda loss: np.linalg.norm(difference(prepared, loss)) / noise - needed, 1e-4, 0.5, rtol=1e-3)
    settings = PlanSettings(
        **POINT, tooth="known", index_error=0.0, noise={SENSOR: noise * np.sqrt(102)}, false_alarm_rate=rate, draws=2000
    )
    (row,) = plan_measurement(RIG, settings).table.to_dict("records")
    # Three standard errors of a share of 0.9 among the draws, over the slope of the probability against d'.
    error = 3 * np.sqrt(0.09 / 2000) / (norm.pdf(ndtri(0.9)) * needed)
    assert row["a90"] == pytest.approx(exact, rel=error)
    assert row["a90_low"] == row["a90"] == row["a90_high"]
    assert row["noise_from"] == "stated"


ROWS = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 1000
healthy = 1

[[sweep.grid]]
tooth = [5]
stiffness_loss = [0.06]

[measurement]
averages = 102
snr_db = 0.0
index_error = 2e-6

[signature]
sensors = ["pinion-vertical"]
samples_per_tooth = 32
"""


def test_simulated_rows_are_detected_as_often_as_planned(prepared, tmp_path):
    # The sweep draws specimens, noise and averages; the test by Neyman and Pearson is written here with full
    # covariances, and its threshold is that which one in twenty of the healthy rows exceeds.
    (tmp_path / "recipe.toml").write_text(ROWS, encoding="utf-8")
    recipe = load_recipe(tmp_path / "recipe.toml")
    run(recipe.plan(), tmp_path / "db", recipe=recipe.text, jobs=1)
    cases = (db := sigdb.open(tmp_path / "db")).cases(where="status = 'ok'")
    x = db.signals(cases["id"])["tsa"]
    states = prepared.steady_state([{}, Damage(tooth=1, stiffness_loss=0.06).on_teeth(12)])
    noise = states.signals[0, 0].std() / np.sqrt(102)
    C = index_error_covariance(12, 36)

    def log_likelihood(case, x):
        Y = states.specimen_response[case, 0]
        S = noise**2 * np.eye(len(Y)) + (2e-6) ** 2 * Y @ C @ Y.T
        r = x - states.signals_at()[case, 0]
        factor = cho_factor(S)
        return -0.5 * np.sum(r * cho_solve(factor, r.T).T, axis=1) - np.log(np.diag(factor[0])).sum()

    turned = [np.roll(x, -32 * tooth, axis=1) for tooth in range(12)]
    ratio = logsumexp([log_likelihood(1, each) for each in turned], axis=0) - np.log(12) - log_likelihood(0, x)
    damaged = cases["tooth"].to_numpy() > 0
    counted = np.mean(ratio[damaged] > np.quantile(ratio[~damaged], 0.95))

    laws = CandidateAverages.of(load_transmission(RIG), GEAR, PlanSettings(largest=0.06)).by_sensor[SENSOR]
    planned, error = SmallestDamage(
        hypotheses=laws, sizes=np.geomspace(0.06 / 250, 0.06, 24), tooth_known=False,
        noise=noise, index_error=2e-6, rate=0.05, draws=2000, seed=1,
    ).p_detected(23)  # fmt: skip
    # The count has binomial errors of damaged rows, and of the threshold's rate times the slope of the curve.
    assert 0.5 < counted < 0.98
    assert counted == pytest.approx(planned, abs=0.05)
    assert error < 0.01


def test_more_averages_a_greater_load_and_a_known_tooth_show_less_damage():
    common = {**POINT, "snr_db": 0.0, "draws": 400}
    few, many = plan_measurement(RIG, PlanSettings(**common | {"averages": [30, 300]})).table.sort_values("averages")[
        "a90"
    ]
    known = plan_measurement(RIG, PlanSettings(**common | {"averages": [300]}, tooth="known")).table["a90"].item()
    light = plan_measurement(RIG, PlanSettings(**common | {"averages": [300], "torques": [100.0]})).table["a90"].item()
    assert known < many < few
    assert many < light


def test_an_assumed_noise_has_an_interval_and_a_note():
    plan = plan_measurement(RIG, PlanSettings(**POINT, draws=200))
    row = plan.table.iloc[0]
    assert row["a90_low"] < row["a90"] < row["a90_high"]
    assert [note.code for note in plan.notes] == ["noise-assumed", "mesh-opens"]
    assert f"a90 = {row['a90']:.3g}" in plan.sentences[1]
    assert plan.as_json()["table"][0]["sensor"] == SENSOR


def test_sensors_turn_to_the_axes():
    plan = plan_measurement(RIG, PlanSettings(**POINT, directions="axes", draws=200))
    rows = plan.table.set_index("sensor")
    assert {*rows.index} == {f"{SENSOR}-{axis}" for axis in "xyz"}
    assert rows.loc[f"{SENSOR}-y", "direction"] == "0 1 0"
    assert rows["noise"].nunique() == 1  # the same sensor in three directions


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"kind": "crack"}, "no size of a tooth's damage; did you mean 'crack_depth'"),
        ({"kind": "spall_depth", "largest": "50um"}, "kind = 'spall_depth' is no size of a tooth's damage"),
        ({"kind": "crack_depth"}, "give it in m"),
        ({"kind": "crack_depth", "largest": "1 kg"}, "is a mass"),
        ({"kind": "wear_depth", "largest": "0.1 mm"}, "needs the geometry"),
        ({"averages": [100]}, "give 99 or 102"),
        ({"averages": [2]}, "give 3"),
        ({"speeds_rpm": [0.0]}, "must be greater than 0"),
        ({"torques": [5.0, 5.0]}, "lists a value twice"),
        ({"noise": {SENSOR: 0.0}}, "must be greater than 0"),
        ({"noise": {"top": 1.0}}, "sensor 'top' is not in rig"),
        ({"sensors": ["top"]}, "sensor 'top' is not in rig"),
        ({"gear": "wheel"}, "gear 'wheel' is not in rig"),
        ({"averages": [*range(3, 30_000, 3)]}, "the limit is 20000"),
    ],
)
def test_a_wrong_setting_is_refused(settings, text):
    with pytest.raises(InputError, match=text):
        plan_measurement(RIG, PlanSettings(**settings))


def test_a_train_is_refused():
    with pytest.raises(NotApplicableError, match="2 meshes"):
        plan_measurement("two-stage-gearbox")
