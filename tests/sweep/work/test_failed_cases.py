"""Unit: a case without a result is a row with nulls and a sentence, and counted."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.core.streams import noise_stream, specimen_stream
from sigdb.database import database_card
from sigdb.dynamics import ContactLossWarning, Periodic
from sigdb.measurement import index_errors
from sigdb.sweep import run

ROUGH = (
    "seed = 1\nspecimens = 20\n[[sweep.grid]]\ntooth = 3\nstiffness_loss = 0.4\nindex_error = {error}\n"
    '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'
)


@pytest.fixture(scope="module")
def rough_run(plan_of, tmp_path_factory):
    """Folder and summary of twenty specimens, some of which lose contact by their index errors."""
    folder = tmp_path_factory.mktemp("rough") / "signatures"
    return folder, run(plan_of(ROUGH.format(error="2e-5")), folder, jobs=1)


@pytest.fixture(scope="module")
def rough(rough_run):
    return sigdb.open(rough_run[0])


def test_a_row_that_its_specimen_takes_out_of_contact_is_what_a_simulation_warns_of(rough):
    failed = rough.cases("status <> 'ok'").iloc[0]
    rig, damage = sigdb.load_transmission("nasa-spiral-bevel"), sigdb.Damage(tooth=3, stiffness_loss=0.4)
    errors = 2e-5 * index_errors(specimen_stream(1, failed["specimen"]), 12, 36)
    with pytest.warns(ContactLossWarning):
        response = sigdb.simulate(rig, damage, index_errors=errors, solver=Periodic(samples_per_tooth=32))
    assert failed["min_compression"] == pytest.approx(response.min_compression, rel=1e-4)
    assert failed["min_mesh_force"] == pytest.approx(response.min_mesh_force, rel=1e-4)
    assert failed["status"].startswith("with this specimen the mesh loses contact (least mesh force -0.")
    assert failed["status"].endswith("reduce the damage or the index errors, or raise the torque")


def test_rows_without_a_result_are_grouped_by_the_code_of_their_status(rough):
    cases = rough.cases()
    groups = rough.sql("select status_code, count(*) as rows from features group by all order by status_code")
    failed = int((cases["status"] != "ok").sum())
    assert failed > 0
    assert groups.to_dict("list") == {"status_code": ["contact", "ok"], "rows": [failed, len(cases) - failed]}
    (facts,) = database_card(rough)["statuses"]
    assert (facts["code"], facts["rows"]) == ("contact", failed)
    assert facts["status"] in set(cases["status"])


def test_failed_rows_have_nulls_a_status_and_their_parameters(rough):
    rows = rough.features("status <> 'ok'")
    assert rows["contact_loss"].all()
    assert (rows["min_compression"] < 0).all()
    assert (rows["tooth"] == 3).all()
    assert (rows["index_error"] == 2e-5).all()
    assert rows[["fm4", "rms", "scatter", "wigner_ville"]].isna().all(axis=None)
    signals = rough.sql(f"select * from signals where id in ({', '.join(map(str, rows['id']))})")
    assert signals.drop(columns="id").isna().all(axis=None)


def test_nulls_are_where_the_status_is_not_ok_and_nowhere_else(rough):
    rows = rough.cases()
    failed = rows["status"] != "ok"
    assert 0 < failed.sum() < 20
    assert (rows["rms"].isna() == failed).all()
    assert (rows["contact_loss"].astype(bool) == failed).all()
    assert (rows.loc[failed, "min_mesh_force"] <= 0).all()
    assert (rows.loc[~failed, "min_mesh_force"] > 0).all()


def test_failed_rows_are_counted(rough, rough_run):
    folder, summary = rough_run
    failed = int((rough.cases()["status"] != "ok").sum())
    assert summary.failed == failed
    receipt = json.loads((folder / "receipts" / "rows-00000.json").read_text(encoding="utf-8"))
    assert receipt["failed"] == failed
    templates = json.loads((folder / "receipts" / "templates-00000.json").read_text(encoding="utf-8"))
    assert templates["failed"] == 0


def test_a_failed_row_is_nan_among_signals(rough):
    rows = rough.cases()
    failed, kept = (rows.loc[chosen, "id"].iloc[0] for chosen in (rows["status"] != "ok", rows["status"] == "ok"))
    signals = rough.signals([failed, kept])
    assert np.isnan(signals["tsa"][0]).all()
    assert np.isfinite(signals["tsa"][1]).all()
    assert np.isnan(signals["spectrum"][0]).all()


def test_the_noise_of_a_row_does_not_depend_on_whether_another_fails(rough, plan_of):
    """One specimen loses contact where another does not; the template keeps it."""
    templates, rows = rough.templates(), rough.cases()
    assert templates["status"].tolist() == ["ok", "ok"]
    assert not templates["contact_loss"].any()
    stream, n, freedom = noise_stream(1, plan_of(ROUGH.format(error="2e-5")).hash, 0), 12 * 32, 12 * 32 * 101
    stream.standard_normal(20 * n)
    # At 0 dB noise has the variance of the healthy average.
    drawn = np.sqrt(templates["reference_variance"][0] * stream.chisquare(freedom, 20) / freedom)
    kept = rows["status"] == "ok"
    np.testing.assert_allclose(rows["scatter"][kept], drawn[kept], rtol=1e-6)


def test_a_tooth_count_without_any_result_stands_beside_others_that_have_one(plan_of, tmp_path):
    """Its rows share a noise block with them, and are nulls."""
    grid = "[[sweep.grid]]\ntooth = 3\nstiffness_loss = 0.4\naverages = 36\npinion.teeth = {}\nindex_error = {}\n"
    plan = plan_of(grid.format(13, 1e-3) + grid.format(12, 0.0) + '[signature]\nsensors = ["pinion-vertical"]\n')
    assert run(plan, tmp_path, jobs=1).failed == 1
    database = sigdb.open(tmp_path)
    assert database.cases()["rms"].isna().tolist() == [True, False]
    signals = database.sql("select id, len(tsa) as n from signals order by id")
    assert signals["n"].fillna(0).tolist() == [0, 12 * 64]


@pytest.mark.parametrize("where", ["phase_shift_deg = [1.0, 16.0]", "phase_shift_deg = [1.0, -15.1]"])
def test_a_shift_of_more_than_half_a_tooth_pass_is_refused_before_anything_is_made(plan_of, where):
    with pytest.raises(InputError, match=r"phase_shift_deg = (16\.0|-15\.1) is more than half .* give at most 15 deg"):
        plan_of("[[sweep.grid]]\n" + where)


def test_a_shift_is_measured_by_the_teeth_of_each_gear(plan_of):
    """Half a tooth pass of 12 teeth is 15 deg, of 18 teeth 10 deg."""
    text = "[[sweep.grid]]\nphase_shift_deg = 12.0\naverages = 6\npinion.teeth = {}\n"
    assert plan_of(text.format(12)).rows == 12
    with pytest.raises(InputError, match=r"of a gear of 18 teeth; give at most 10 deg"):
        plan_of(text.format("[12, 18]"))


def test_an_unstable_rig_fails_with_its_damping_only(plan_of, tmp_path):
    """At 21 000 rpm and a thousandth of critical damping the mesh feeds a resonance."""
    plan = plan_of(
        "healthy = 1\n[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.1\n"
        'rig = { damping_ratio = [0.054, 1e-3], "operating.speed_rpm" = 21000.0 }\n'
        "[signature]\nsamples_per_tooth = 32\n"
    )
    summary = run(plan, tmp_path, jobs=1)
    database = sigdb.open(tmp_path)
    status = database.sql("select damping_ratio, status, status_code, contact_loss from cases order by all")
    damped = status["damping_ratio"] > 0.01
    assert damped.sum() == 2
    assert not status.loc[damped, "status"].str.contains("unstable").any()
    assert status["status_code"].tolist() == ["unstable" if one else "ok" for one in ~damped]
    sentence = r"rig 'nasa-spiral-bevel' is unstable at 21000 rpm \(Floquet multiplier \d"
    assert status.loc[~damped, "status"].str.match(sentence).all()
    assert summary.failed >= 2
    assert database.templates().query("damping_ratio < 0.01")["floquet_multiplier"].isna().all()
    # Whether contact is lost is not known.
    assert status.loc[~damped, "contact_loss"].isna().all()
