"""Unit: templates whose damage takes the mesh out of contact are marched, marked, and carry no specimen."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.dynamics import ContactLossWarning, Periodic, Transient
from sigdb.sweep import run

DAMAGE = {"stiffness_loss": 0.5, "phase_shift_deg": 4.5}
STRONG = "stiffness_loss = 0.5\nphase_shift_deg = 4.5\noperating.torque = 100.0\n"
SMALL = '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'
MARCH = Transient(samples_per_tooth=32, steps_per_tooth=512)


@pytest.fixture(scope="module")
def rig():
    return sigdb.load_transmission("nasa-spiral-bevel").replace({"operating.torque": 100.0})


@pytest.fixture(scope="module")
def lost(small):
    templates = small.templates()
    (number,) = templates.loc[templates["contact_loss"].astype(bool), "template"]
    return templates.iloc[number]


def test_a_template_that_loses_contact_is_the_march_at_tooth_1(rig, lost):
    damage = sigdb.Damage(tooth=1, **DAMAGE)
    with pytest.warns(ContactLossWarning):
        sigdb.simulate(rig, damage, solver=Periodic(samples_per_tooth=32))
    response = sigdb.simulate(rig, damage, solver=MARCH)
    assert response.contact_loss
    assert lost["status"] == "ok"
    for sensor, signal in response.signals.items():
        name = "tsa" if sensor == "pinion-vertical" else f"tsa__{sensor}"
        # Stored as float32.
        assert_allclose(lost[name], signal, rtol=0, atol=1e-7 * np.abs(signal).max())
    assert_allclose(lost["compression"], response.compression, rtol=0, atol=1e-7 * response.compression.max())
    assert lost["min_compression"] == pytest.approx(response.min_compression, rel=1e-6)
    assert lost["error"] == pytest.approx(response.error, rel=1e-5)
    assert lost["mesh_force"].min() == 0


def test_it_has_no_specimen_response(lost):
    for name in ("specimen_response", "compression_response", "compression_harmonic", "harmonic_response"):
        assert lost[name] is None
        assert lost.get(f"{name}__pinion-housing-vertical") is None


def test_every_template_says_its_error(small):
    templates = small.templates()
    assert templates["error"].between(0, 1e-3).all()
    assert (templates["error"] > 0).all()


def test_its_rows_differ_by_noise_only(plan_of, tmp_path):
    """At 300 dB two specimens with index errors of 5 um are alike; turned by a tooth they are turned by its samples."""
    plan = plan_of(
        f"specimens = 2\n[[sweep.grid]]\ntooth = [1, 7]\nindex_error = 5e-6\nsnr_db = 300.0\n{STRONG}{SMALL}"
    )
    run(plan, tmp_path, jobs=1)
    database = sigdb.open(tmp_path)
    rows = database.cases("tooth > 0")
    assert (rows["status"] == "ok").all()
    assert rows["contact_loss"].all()
    assert (rows["min_compression"] < 0).all()
    tsa = dict(zip(zip(rows["tooth"], rows["specimen"], strict=True), database.signals(rows["id"])["tsa"], strict=True))
    assert_allclose(tsa[1, 0], tsa[1, 1], rtol=0, atol=0)
    assert_allclose(tsa[7, 0], np.roll(tsa[1, 0], 6 * 32), rtol=0, atol=0)


def test_with_unbalance_a_turned_row_fails_with_a_sentence(plan_of, tmp_path):
    """What turns with the shaft meets the damage elsewhere then; at tooth 1 it is what was marched."""
    unbalanced = "pinion.unbalance = 1e-4\n"
    plan = plan_of(f"[[sweep.grid]]\ntooth = [1, 7]\nsnr_db = 300.0\n{unbalanced}{STRONG}{SMALL}")
    summary = run(plan, tmp_path, jobs=1)
    database = sigdb.open(tmp_path)
    rows = database.cases("tooth > 0").set_index("tooth")
    assert rows.loc[[1, 7], "status_code"].tolist() == ["ok", "not_turned"]
    assert rows.loc[1, "status"] == "ok"
    assert rows.loc[7, "status"].startswith(
        "the mesh loses contact, and unbalance, run-out or a fluctuating load act in addition"
    )
    assert rows["contact_loss"].all()
    assert summary.failed == 1
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    rig = rig.replace({"operating.torque": 100.0, "pinion.unbalance": 1e-4})
    expected = sigdb.simulate(rig, sigdb.Damage(tooth=1, **DAMAGE), solver=MARCH).signal("pinion-vertical")
    (found,) = database.signals([rows.loc[1, "id"]])["tsa"]
    assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_a_motion_that_does_not_repeat_is_a_failed_template_and_the_sweep_goes_on(plan_of, tmp_path, monkeypatch):
    class Impatient(Transient):
        """Gives up after its second revolution, which never repeats the first to 1e-12."""

        def __init__(self, **settings):
            super().__init__(**settings, most_revolutions=2, tolerance=1e-12)

    monkeypatch.setattr("sigdb.dynamics.solver.Transient", Impatient)
    plan = plan_of(f"[[sweep.grid]]\ntooth = 2\nstiffness_loss = 0.2\n[[sweep.grid]]\ntooth = 2\n{STRONG}{SMALL}")
    summary = run(plan, tmp_path, jobs=1)
    database = sigdb.open(tmp_path)
    (failed,) = database.templates().query("status != 'ok'").itertuples()
    assert failed.status.startswith(
        "rig 'nasa-spiral-bevel': the motion does not repeat to 1e-12 of its size within 2 rev"
    )
    assert failed.status.endswith("change the damage, the speed or the damping")
    assert failed.status_code == "not_converged"
    assert failed.contact_loss
    assert failed.tsa is None
    rows = database.cases()
    lost = (rows["torque"] == 100.0) & (rows["tooth"] > 0)
    assert (rows.loc[lost, "status"] == failed.status).all()
    assert rows.loc[lost, "contact_loss"].all()
    assert (rows.loc[~lost, "status"] == "ok").all()
    assert summary.failed == lost.sum() == 1


def test_a_template_whose_march_cannot_meet_its_accuracy_has_no_result(plan_of, tmp_path, monkeypatch):
    class Crude(Transient):
        """Takes no smaller steps."""

        def __init__(self, **settings):
            super().__init__(**settings, most_steps_per_tooth=1, accuracy=1e-9)

    monkeypatch.setattr("sigdb.dynamics.solver.Transient", Crude)
    assert run(plan_of(f"[[sweep.grid]]\ntooth = 2\n{STRONG}{SMALL}"), tmp_path, jobs=1).failed == 1
    database = sigdb.open(tmp_path)
    (status,) = database.templates().query("tooth > 0")["status"]
    assert status.startswith("the march in time does not meet its accuracy (error ")
    assert database.cases("status <> 'ok'")["status"].tolist() == [status]
    assert database.cases("status <> 'ok'")["status_code"].tolist() == ["not_converged"]
