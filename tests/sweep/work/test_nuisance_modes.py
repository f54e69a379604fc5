"""Nuisances of a sweep: modes of templates against simulated changes, and rows that are drawn with them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.database import stored_templates
from sigdb.dynamics import prepare_periodic
from sigdb.measurement import NuisanceSettings, drawn_colours
from sigdb.recognition import Hypotheses, TemplateBank, TemplateScores
from sigdb.sweep import plan_from, run, verify

RECIPE = """
[sweep]
rig = "spur-test-rig"
gear = "pinion"
seed = 5
specimens = 3
healthy = 30

[[sweep.grid]]
tooth = [1, 3]
stiffness_loss = 0.4

[measurement]
averages = {averages}
snr_db = {snr_db}
index_error = {index_error}

[nuisance]
{nuisance}

[signature]
samples_per_tooth = 32
"""


@pytest.fixture(scope="module")
def made(plan_of, tmp_path_factory):
    def make(nuisance, *, snr_db=10.0, index_error=1e-6):
        rig = sigdb.load_transmission("spur-test-rig")
        mate = rig.gears[rig.mate("pinion")].teeth
        nuisance += "\nnone = 0.0"
        text = RECIPE.format(averages=2 * mate, snr_db=snr_db, index_error=index_error, nuisance=nuisance)
        plan, folder = plan_of(text), tmp_path_factory.mktemp("nuisance")
        run(plan, folder, jobs=1)
        return plan, sigdb.open(folder)

    return make


@pytest.fixture(scope="module")
def with_all(made):
    return made(
        "gain_db = 1.0\npath_db = 0.5\nmark = 0.02\nrigs = 4\nrig = 0.02\nspeed = 0.002\ntorque = 0.1\n"
        "profile = 1e-7\nindex_error = 1e-7",
        snr_db=10.0,
    )


def first(db, tooth):
    plan = plan_from(db.manifest.resolved)
    case = plan.case_columns(plan.first_template)
    point = {name: case[name] for name in ("speed_rpm", "torque", "teeth")}
    return next(one for one in stored_templates(db, **point) if one.tooth == tooth)


def test_an_error_of_the_torque_changes_the_average_in_proportion(made):
    _, db = made("torque = 0.2\nrigs = 3")
    for tooth in (0, 1):
        one = first(db, tooth)
        modes, signal = one.nuisance_modes[0], one.signals[0]
        assert modes.shape[1] == 1
        cosine = modes[:, 0] @ signal / np.linalg.norm(modes[:, 0]) / np.linalg.norm(signal)
        assert abs(cosine) > 1 - 1e-4
        assert 0.02 < np.linalg.norm(modes[:, 0]) / np.linalg.norm(signal) < 0.2


def test_an_error_of_the_speed_is_that_of_rigs_at_other_speeds(made):
    plan, db = made("speed = 0.004\nrigs = 6")
    one = first(db, 1)
    changed = []
    for share in (-0.003, 0.001, 0.003):
        rig = plan.rig.replace({"operating.speed_rpm": plan.rig.operating.speed_rpm * (1 + share)})
        prepared = prepare_periodic(rig, gear=plan.gear, samples_per_tooth=32)
        case = plan.case(int(one.case["template"])).damage.on_teeth(prepared.teeth)
        at = list(plan.rig.sensors).index(plan.sensors[0])
        changed.append(prepared.steady_state([case], specimens=False).signals[0, at] - one.signals[0])
    inside, _ = np.linalg.qr(one.nuisance_modes[0])
    for away in changed:
        assert np.linalg.norm(away - inside @ (inside.T @ away)) < 0.05 * np.linalg.norm(away)


def test_rows_vary_as_the_nuisances_say(made):
    """Half of the machines have a gain of the stated size, the others of a third of it."""
    _, db = made("gain_db = 1.0", snr_db=200.0, index_error=0.0)
    rows = db.features(where="tooth = 0")["id"].to_numpy()
    signal = first(db, 0).signals[0]
    gains = db.signals(rows)["tsa"] @ signal / (signal @ signal)
    assert_allclose(db.signals(rows)["tsa"], gains[:, None] * signal, atol=1e-4 * np.abs(signal).max())
    deviation = np.log(10) / 20 * np.sqrt((1 + 1 / 9) / 2)
    assert len(gains) == 90
    assert abs(gains.std() / deviation - 1) < 6 / np.sqrt(2 * len(gains))
    assert abs(gains.mean() - 1) < 5 * deviation / np.sqrt(len(gains))


def test_a_late_mark_turns_rows(made):
    _, db = made("mark = 0.2", snr_db=200.0, index_error=0.0)
    rows = db.features(where="tooth = 0")["id"].to_numpy()
    one = first(db, 0)
    teeth, n = int(one.case["teeth"]), one.signals.shape[1]
    mesh = np.fft.rfft(db.signals(rows)["tsa"], axis=1)[:, teeth] / np.fft.rfft(one.signals[0])[teeth]
    passes = -np.angle(mesh) / (2 * np.pi)
    assert abs(passes.std() / 0.2 - 1) < 0.4
    assert_allclose(np.abs(mesh), 1, rtol=1e-4)
    assert one.nuisance_modes.shape[1:] in ((n, 0), (0, 0))


def test_the_plan_and_the_contents_agree(with_all):
    plan, db = with_all
    assert plan_from(plan.resolved).hash == plan.hash
    assert verify(db.store, deep=True, sample=1) == ()


def test_averages_are_white_under_the_law_of_the_most_likely_part(with_all):
    """Averages that are drawn as the law says have a squared residual of one variance a sample."""
    _, db = with_all
    bank = TemplateBank.of(db)
    (point,) = bank.points
    assert point.nuisance is not None
    rows = db.features(where="status = 'ok'")
    x = db.signals(rows["id"].to_numpy())["tsa"].astype(float)
    noise = (rows["scatter"] / np.sqrt(rows["averages"])).to_numpy()
    table = rows.assign(tsa=list(x))
    scores = TemplateScores(bank).transform(table)
    reduced = scores[:, list(TemplateScores(bank).get_feature_names_out()).index("reduced_chi2")]
    assert abs(reduced.mean() - 1) < 5 * np.sqrt(2 / x.shape[1] / len(rows)) + 0.03
    case = {name: rows[name].iloc[0].item() for name in ("speed_rpm", "torque", "teeth")}
    exact = Hypotheses.of(db, **case).log_likelihood(x[:3], noise=noise[:3], index_error=bank.index_error)
    found = point.local.mixture.log_likelihood(x[:3], noise=noise[:3], index_error=bank.index_error)
    assert_allclose(found, exact, rtol=5e-4, atol=0.3)


@pytest.mark.parametrize("snr_db", [-10.0, 30.0])
@pytest.mark.parametrize("more", ["", "gain_db = 1.0\npath_db = 0.5\nspeed = 0.002\nrigs = 4"], ids=["alone", "others"])
def test_a_mark_that_may_be_late_leaves_nothing_in_the_residual(made, more, snr_db):
    """Neither where no other nuisance is stated, nor where the noise shows what bends away from the mode."""
    _, db = made(f"mark = 0.2\n{more}", snr_db=snr_db)
    rows = db.features(where="status = 'ok'")
    x = db.signals(rows["id"].to_numpy())["tsa"].astype(float)
    scores = TemplateScores(TemplateBank.of(db))
    reduced = scores.transform(rows.assign(tsa=list(x)))[:, list(scores.get_feature_names_out()).index("reduced_chi2")]
    assert abs(reduced.mean() - 1) < 5 * np.sqrt(2 / x.shape[1] / len(rows)) + 0.03
    assert reduced.max() < 1.3


def test_between_speeds_a_bank_has_the_modes_of_the_nearest_point(plan_of, tmp_path):
    speeds = [1764.0, 1776.0, 1788.0, 1800.0, 1812.0, 1824.0, 1836.0]
    text = RECIPE.format(averages=96, snr_db=-20.0, index_error=1e-6, nuisance="gain_db = 2.0\nmark = 0.05")
    text = text.replace("tooth = [1, 3]", f"tooth = 1\noperating.speed_rpm = {speeds}").replace(
        "healthy = 30", "healthy = 2"
    )
    run(plan_of(text), tmp_path / "made", jobs=1)
    db = sigdb.open(tmp_path / "made")
    bank = TemplateBank.of(db)
    assert bank.interpolations
    rows = db.features(where="status = 'ok' and speed_rpm = 1800")
    x, noise = db.signals(rows["id"].to_numpy())["tsa"].astype(float), (rows["scatter"] / np.sqrt(rows["averages"]))
    point = {name: rows[name].to_numpy() for name in ("speed_rpm", "torque", "teeth")}
    ((local, _, coefficients),) = bank.locals(**point)
    law = {"noise": noise.to_numpy(), "index_error": bank.index_error}
    found = local.mixture.log_likelihood(x, **law, coefficients=coefficients)
    exact = Hypotheses.of(db, **{name: values[0].item() for name, values in point.items()}).log_likelihood(x, **law)
    assert_allclose(found, exact, atol=0.5)


def test_without_nuisances_nothing_changes(plan_of):
    text = RECIPE.format(averages=96, snr_db=0.0, index_error=1e-6, nuisance="")
    plan = plan_of(text)
    assert "nuisance" not in plan.resolved
    assert plan.hash == plan_of(text.replace("[nuisance]\n", "")).hash
    assert not plan.nuisance.exist


def test_sources_change_no_row(plan_of):
    text = RECIPE.format(averages=96, snr_db=0.0, index_error=1e-6, nuisance="gain_db = 1.0")
    sourced = text.replace("gain_db = 1.0", 'gain_db = 1.0\nsources.gain_db = "its data sheet"')
    assert plan_of(text).hash == plan_of(sourced).hash
    assert plan_of(text).hash != plan_of(text.replace("1.0", "2.0")).hash
    assert NuisanceSettings(gain_db=1.0).exist


def test_rows_have_noise_of_a_drawn_colour_and_show_it_by_order(made):
    """The average without its template is noise of the stored colour, which the row's own estimate shows."""
    plan, db = made("colour_db = 8.0\ncolours = 2", index_error=0.0)
    rows, one = db.features(where="tooth = 0"), first(db, 0)
    tsa, shown = (
        np.array(db.signal_rows(rows["id"].to_numpy(), [name]).to_pydict()[name]) for name in ("tsa", "noise")
    )
    colours = drawn_colours(plan.nuisance, plan.seed, tsa.shape[1], int(one.case["teeth"]))[rows["noise_colour"]]
    assert set(rows["noise_colour"]) == {1, 2}
    revolutions = rows["averages"].to_numpy()[0]
    deviation = np.sqrt(one.reference_variance[0] * 10 ** (-plan.measurement.snr_db / 10) / revolutions)
    spectrum = np.abs(np.fft.rfft(tsa - one.signals[0], axis=1)) / np.sqrt(tsa.shape[1])
    power = (spectrum / colours / deviation)[:, 1:-1] ** 2
    assert_allclose(power.mean(axis=0), 1.0, atol=6 / np.sqrt(len(rows)))
    assert_allclose(power.mean(axis=1), 1.0, atol=6 / np.sqrt(power.shape[1]))
    assert_allclose(shown[:, 1:-1] / colours[:, 1:-1], deviation, rtol=6 / np.sqrt(4 * revolutions))
    both_sides = np.concatenate([shown, shown[:, -2:0:-1]], axis=1)
    assert_allclose(np.sqrt((both_sides**2).mean(axis=1) * revolutions), rows["scatter"], rtol=1e-4)
    assert plan_from(plan.resolved).hash == plan.hash
    assert verify(db.store, deep=True, sample=1) == ()
