"""Verification: one pinion and two wheels, at crawling speed, by the stiffness of the two ways of the torque."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.dynamics import ContactLossWarning, Transient, march, prepare_periodic, simulate
from sigdb.measurement import MeasurementSettings
from sigdb.signature import SignatureSettings
from sigdb.sweep import SweepSettings, make_plan
from sigdb.transmission import Damage, Transmission, describe_rig

TEETH, MODULE, MEAN, TORQUE, CONTACT, FLANK, LINK = 12, 0.004, 2.0e7, 60.0, 1.5, 0.3, 8e3
BASE = MODULE * TEETH / 2 * np.cos(np.deg2rad(20.0))


def split(*, linked=True, second=("pinion", "wheel-b")):
    """A pinion between two equal wheels, whose shafts a spring may link; the load is on the first wheel's shaft."""
    mesh = {
        "module": MODULE,
        "face_width": 0.02,
        "pressure_angle_deg": 20.0,
        "stiffness": MEAN,
        "profile": {"contact_ratio": CONTACT, "flank": FLANK},
    }
    across = 1.0 if second[0] != "pinion" else -1.0
    couplings = {
        "motor": {"shaft": "in", "node": 0, "stiffness": 5e3, "inertia": 0.01},
        "brake": {"shaft": "a", "node": 0, "stiffness": 5e3, "inertia": 0.01},
    }
    if linked:
        couplings["link"] = {"shaft": "a", "node": 0, "to_shaft": "b", "stiffness": LINK}
    on = {"pinion": "in", "wheel-a": "a", "wheel-b": "b"}
    return Transmission(
        name="split",
        damping_ratio=0.1,
        operating={"drive": "motor", "load": "brake", "speed_rpm": 0.01, "torque": TORQUE},
        shafts={name: {"axis": [0.0, 0.0, 1.0], "motions": ["x", "rz"]} for name in ("in", "a", "b")},
        gears={
            name: {"shaft": shaft, "node": 0, "teeth": TEETH, "mass": 1.0, "polar_inertia": 3e-4}
            for name, shaft in on.items()
        },
        bearings={
            name: {"shaft": name, "node": 0, "stiffness": [1e12, 0.0, 0.0], "damping": [0.0, 0.0, 0.0]}
            for name in on.values()
        },
        meshes={
            "a": {**mesh, "driving": "pinion", "driven": "wheel-a", "line_of_centres": [0.0, 1.0, 0.0]},
            "b": {**mesh, "driving": second[0], "driven": second[1], "line_of_centres": [0.0, across, 0.0]},
        },
        couplings=couplings,
        sensors={"pinion": {"gear": "pinion", "direction": [1.0, 0.0, 0.0], "quantity": "displacement"}},
    )


def step(x):
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(x, 0.0, 1.0))


def mesh_stiffness(u):
    x = u % 1.0 + np.arange(2)[:, None]
    return (MEAN * step(x / FLANK) * step((CONTACT - x) / FLANK) / (CONTACT - FLANK)).sum(axis=0)


@pytest.mark.parametrize("solver", [None, Transient(samples_per_tooth=64)])
def test_the_torque_is_shared_by_the_stiffness_of_its_two_ways(solver):
    """The second way is a mesh and the link in series; both meshes are at the same place of their pass."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        response = simulate(split(), solver=solver)
    first = mesh_stiffness(np.arange(TEETH * 64) / 64) * BASE**2
    second = 1 / (1 / first + 1 / LINK)
    expected = TORQUE / BASE * first / (first + second)
    assert_allclose(response.mesh_force, expected, rtol=5e-3)
    assert np.ptp(expected) > 0.05 * expected.mean()
    assert not response.contact_loss
    at = prepare_periodic(split())
    shared = MEAN * BASE**2, 1 / (1 / (MEAN * BASE**2) + 1 / LINK)
    assert_allclose(at.static_force, np.array(shared) / sum(shared) * TORQUE / BASE, rtol=1e-3)


def test_an_idle_wheel_is_not_pressed_and_that_is_said():
    """The first mesh carries all of the torque; the second is compared with that force."""
    rig = split(linked=False)
    with pytest.warns(ContactLossWarning):
        response = simulate(rig)
    assert_allclose(response.mesh_force, TORQUE / BASE, rtol=5e-3)
    assert abs(response.min_mesh_force) < 1e-3
    (remark,) = (text for text in describe_rig(rig)["remarks"] if "meshes.b" in text)
    assert "carries no torque" in remark


def test_damage_of_the_pinion_is_refused_and_that_of_a_wheel_simulated():
    simulate(split(), Damage(gear="wheel-a", tooth=2, stiffness_loss=0.1))
    for solver in (None, Transient()):
        with pytest.raises(InputError, match="'pinion' of rig 'split' takes part in 2 meshes; damage is"):
            simulate(split(), Damage(tooth=2, stiffness_loss=0.1), solver=solver)
        with pytest.raises(InputError, match="index errors: leave them out, or name a gear of one mesh"):
            simulate(split(), index_errors=np.full(TEETH, 1e-6), solver=solver)
    with pytest.raises(InputError, match="takes part in 2 meshes"):
        march(split(), Damage(tooth=2, stiffness_loss=0.1), duration=1e-3, sampling_rate=1e4)
    design = SweepSettings.model_validate({"rig": "split.toml", "grid": [{"tooth": 0}]})
    with pytest.raises(InputError, match="takes part in 2 meshes"):
        make_plan(design, MeasurementSettings(), SignatureSettings(), split())


def test_a_mesh_that_the_torque_pulls_apart_is_shown_and_refused():
    rig = split(second=("wheel-b", "pinion"))
    (mesh,) = (mesh for mesh in describe_rig(rig)["meshes"] if mesh["name"] == "b")
    assert mesh["normal_force"] < 0
    sentence = rf"meshes\.b has a static force of {mesh['normal_force']:.4g} N: the torque pulls its teeth apart"
    assert any(remark.startswith(sentence.replace("\\", "")) for remark in describe_rig(rig)["remarks"])
    for solver in (None, Transient()):
        with pytest.raises(InputError, match=sentence + r", since pinion drives wheel-b; give driving = 'pinion' and"):
            simulate(rig, solver=solver)
