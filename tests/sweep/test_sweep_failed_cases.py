"""Unit: a case without a result is a row with nulls and a sentence, and counted."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.dynamics import ContactLossWarning, Periodic
from sigdb.sweep import run


def test_contact_loss_is_what_a_simulation_warns_of(small):
    rig = sigdb.load_transmission("nasa-spiral-bevel").replace({"operating.torque": 100.0})
    damage = sigdb.Damage(tooth=2, stiffness_loss=0.5, phase_shift_deg=4.5)
    with pytest.warns(ContactLossWarning):
        response = sigdb.simulate(rig, damage, solver=Periodic(samples_per_tooth=32))
    (template,) = small.templates().query("status != 'ok'").itertuples()
    assert template.contact_loss
    assert template.min_compression == pytest.approx(response.min_compression, rel=1e-5)
    assert template.status.startswith("the mesh loses contact (least compression -0.")
    assert template.status.endswith("reduce the damage or raise the torque")
    for name in ("tsa", "specimen_response", "compression", "compression_response", "mesh_force"):
        assert getattr(template, name) is None


def test_its_rows_have_nulls_a_status_and_their_parameters(small):
    rows = small.features("torque = 100 and tooth > 0")
    assert len(rows) == 3 * 2
    assert rows["contact_loss"].all()
    assert (rows["min_compression"] < 0).all()
    assert rows["status"].str.match("the mesh loses contact").all()
    assert (rows["tooth"] == 2).all()
    assert rows[["fm4", "rms", "scatter", "wigner_ville", "rms__pinion-housing-vertical"]].isna().all(axis=None)
    signals = small.sql(f"select * from signals where id in ({', '.join(map(str, rows['id']))})")
    assert signals.drop(columns="id").isna().all(axis=None)


def test_nulls_are_where_the_status_is_not_ok_and_nowhere_else(small):
    rows = small.cases()
    failed = rows["status"] != "ok"
    assert (rows["rms"].isna() == failed).all()
    assert (rows["contact_loss"].astype(bool) == (rows["min_compression"] < 0)).all()
    assert (rows.loc[failed, "min_compression"] < 0).all()


def test_failed_rows_are_counted(small, small_run):
    folder, summary = small_run
    failed = int((small.cases()["status"] != "ok").sum())
    assert failed >= 6
    assert summary.failed == failed
    receipt = json.loads((folder / "receipts" / "rows-00000.json").read_text(encoding="utf-8"))
    assert receipt["failed"] == failed
    templates = json.loads((folder / "receipts" / "templates-00000.json").read_text(encoding="utf-8"))
    assert templates["failed"] == 1


def test_a_failed_row_is_nan_among_signals(small):
    failed = small.cases("teeth = 12 and status <> 'ok'")["id"][0]
    ids = [failed, 0]
    signals = small.signals(ids)
    assert np.isnan(signals["tsa"][0]).all()
    assert np.isfinite(signals["tsa"][1]).all()
    assert np.isnan(signals["spectrum"][0]).all()


def test_one_specimen_may_lose_contact_where_another_does_not(plan_of, tmp_path):
    """Large index errors: the row, not the template, loses contact; the noise of the others does not depend on it."""
    text = (
        "seed = 1\nspecimens = 20\n[[sweep.grid]]\ntooth = 3\nstiffness_loss = 0.4\nindex_error = {error}\n"
        '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'
    )
    plan = plan_of(text.format(error="2e-5"))
    summary = run(plan, tmp_path / "rough", jobs=1)
    rough = sigdb.open(tmp_path / "rough").cases()
    lost = rough["status"] != "ok"
    assert 0 < lost.sum() < 20
    assert summary.failed == lost.sum()
    assert (rough["contact_loss"].astype(bool) == lost).all()
    assert (rough.loc[lost, "min_compression"] < 0).all()
    assert (rough.loc[~lost, "min_compression"] >= 0).all()
    assert sigdb.open(tmp_path / "rough").templates()["status"].tolist() == ["ok", "ok"]

    run(plan_of(text.format(error="0.0")), tmp_path / "smooth", jobs=1)
    smooth = sigdb.open(tmp_path / "smooth").cases()
    kept = ~lost.to_numpy()
    np.testing.assert_array_equal(rough["scatter"][kept], smooth["scatter"][kept])


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
    status = database.sql("select damping_ratio, status, contact_loss from cases order by all")
    damped = status["damping_ratio"] > 0.01
    assert damped.sum() == 2
    assert not status.loc[damped, "status"].str.contains("unstable").any()
    sentence = r"rig 'nasa-spiral-bevel' is unstable at 21000 rpm \(Floquet multiplier \d"
    assert status.loc[~damped, "status"].str.match(sentence).all()
    assert summary.failed >= 2
    assert database.templates().query("damping_ratio < 0.01")["floquet_multiplier"].isna().all()
    # Whether contact is lost is not known.
    assert status.loc[~damped, "contact_loss"].isna().all()
