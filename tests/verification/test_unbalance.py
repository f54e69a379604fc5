"""Verification: unbalance and whirl of simple rotors against closed forms, in amplitude, phase and sense."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission import Transmission, modal_system

MASS, SPRING, DAMPER, UNBALANCE = 2.0, 5e5, 40.0, 3e-4
NATURAL = np.sqrt(SPRING / MASS)


def point_rotor(ratio, rotation, *, axis=(0.0, 0.0, 1.0), angle_deg=0.0, shaft=None, springs=(SPRING, SPRING)):
    """A disk on springs across its shaft, turning at a multiple of its natural frequency."""
    return Transmission(
        name="jeffcott",
        damping_ratio=0.0,
        operating={"shaft": "main", "speed_rpm": ratio * NATURAL * 60 / (2 * np.pi), "rotation": rotation},
        shafts={"main": shaft or {"axis": list(axis), "motions": ["x", "y", "rz"]}},
        gears={
            "disk": {
                "shaft": "main",
                "node": 0,
                "teeth": 20,
                "mass": MASS,
                "polar_inertia": 0.01,
                "unbalance": UNBALANCE,
                "unbalance_angle_deg": angle_deg,
            }
        },
        bearings={
            "both": {
                "shaft": "main",
                "node": 0,
                "stiffness": (*springs, 0.0),
                "damping": (DAMPER, DAMPER, 0.0),
            }
        },
        sensors={
            name: {"gear": "disk", "direction": list(direction), "quantity": "displacement"}
            for name, direction in (("X", (1, 0, 0)), ("Y", (0, 1, 0)), ("Z", (0, 0, 1)))
        },
    )


def orbit(rig):
    """(3, 48) X, Y, Z over a revolution, from the rig's transfer function: the mark passes at sample 0."""
    system = modal_system(rig)
    assert system.unbalanced == ("main",)
    speed = abs(rig.speed("main"))
    phasor = system.transfer(np.array([speed]))[0] @ [0, 0, 1, -1j]
    return (phasor[:, None] * np.exp(2j * np.pi * np.arange(48) / 48)).real


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("ratio", [0.4, 0.95, 2.5])
@pytest.mark.parametrize("angle_deg", [0.0, 70.0])
def test_the_orbit_is_a_circle_in_the_sense_of_rotation(ratio, rotation, angle_deg):
    """z = m e w^2 exp(i (phi + alpha)) / (k - m w^2 + i c w), with x + i s y = z for a shaft that turns in sense s."""
    rig = point_rotor(ratio, rotation, angle_deg=angle_deg)
    w = ratio * NATURAL
    circle = UNBALANCE * w**2 / (SPRING - MASS * w**2 + 1j * DAMPER * w)
    z = circle * np.exp(1j * (2 * np.pi * np.arange(48) / 48 + np.deg2rad(angle_deg)))
    x, y, along = orbit(rig)
    assert_allclose(x + 1j * rotation * y, z, rtol=0, atol=1e-9 * abs(circle))
    assert_allclose(along, 0, atol=1e-12 * abs(circle))


def test_far_above_its_critical_speed_the_disk_turns_about_its_centre_of_mass():
    """Radius e = U / m, on the other side of the unbalance."""
    x, y, _ = orbit(point_rotor(300.0, 1))
    expected = -UNBALANCE / MASS * np.exp(2j * np.pi * np.arange(48) / 48)
    assert_allclose(x + 1j * y, expected, rtol=0, atol=2e-4 * UNBALANCE / MASS)


def test_between_two_critical_speeds_the_whirl_turns_backward():
    """Springs of 1 and 4 times k: at 1.5 times the lower natural frequency x is past its resonance and y is not."""
    x, y, _ = orbit(point_rotor(1.5, 1, springs=(SPRING, 4 * SPRING)))
    z = x + 1j * y
    assert ((z.conj() * np.roll(z, -1)).imag < 0).all()
    x, y, _ = orbit(point_rotor(0.5, 1, springs=(SPRING, 4 * SPRING)))
    z = x + 1j * y
    assert ((z.conj() * np.roll(z, -1)).imag > 0).all()


def test_another_axis_turns_the_orbit_into_its_own_plane():
    """Along -Z the shaft's x is -X of the casing; along X it is -Z. The angle of the unbalance is from there."""
    reference = orbit(point_rotor(0.6, 1))
    backward = orbit(point_rotor(0.6, 1, axis=(0.0, 0.0, -1.0)))
    assert_allclose(backward, reference * [[-1], [1], [1]], rtol=0, atol=1e-12 * np.abs(reference).max())
    sideways = orbit(point_rotor(0.6, 1, axis=(1.0, 0.0, 0.0)))
    assert_allclose(sideways, [reference[2], reference[1], -reference[0]], rtol=0, atol=1e-12 * np.abs(reference).max())


@pytest.mark.parametrize("rotation", [1, -1])
def test_a_disk_at_the_middle_of_a_flexible_shaft_sees_half_the_springs_in_series(rotation):
    """Jeffcott: a nearly massless shaft, 48 E I / l^3 with a little shear, on two springs k: below and above it."""
    length, diameter, young = 1.0, 0.02, 2.1e11
    shaft = {
        "axis": [0.0, 0.0, 1.0],
        "material": "light",
        "segments": [{"length": length, "outer_diameter": diameter, "elements": 4}],
    }
    second, area = np.pi / 64 * diameter**4, np.pi / 4 * diameter**2
    nu = young / 2 / 8.1e10 - 1
    shear = 6 * (1 + nu) / (7 + 6 * nu) * 8.1e10 * area
    bending = 1 / (length**3 / (48 * young * second) + length / (4 * shear))
    k = 1 / (1 / bending + 1 / (2 * 4e4))
    for ratio in (0.5, 1.8):
        w = ratio * np.sqrt(k / 5.0)
        rig = Transmission(
            name="jeffcott",
            damping_ratio=0.0,
            operating={"shaft": "main", "speed_rpm": w * 60 / (2 * np.pi), "rotation": rotation},
            materials={"light": {"density": 1.0, "young_modulus": young, "shear_modulus": 8.1e10}},
            shafts={"main": shaft},
            gears={
                "disk": {"shaft": "main", "node": 2, "teeth": 9, "mass": 5.0, "polar_inertia": 0.01, "unbalance": 1e-4}
            },
            bearings={
                end: {"shaft": "main", "node": node, "stiffness": (4e4, 4e4, 1e6)}
                for end, node in (("left", 0), ("right", 4))
            },
            sensors={
                name: {"gear": "disk", "direction": direction, "quantity": "displacement"}
                for name, direction in (("X", [1.0, 0, 0]), ("Y", [0, 1.0, 0]), ("Z", [0, 0, 1.0]))
            },
        )
        x, y, _ = orbit(rig)
        z = 1e-4 * w**2 / (k - 5.0 * w**2) * np.exp(2j * np.pi * np.arange(48) / 48)
        assert_allclose(x + 1j * rotation * y, z, rtol=0, atol=1e-4 * np.abs(z).max())


def test_unbalances_of_one_shaft_add_as_vectors():
    rig = point_rotor(0.7, 1, angle_deg=30.0)
    data = rig.model_dump()
    second = {"shaft": "main", "node": 0, "mass": 1e-9, "polar_inertia": 1e-12, "unbalance": UNBALANCE}
    data["disks"] = {"opposite": second | {"unbalance_angle_deg": 210.0}}
    balanced = orbit(Transmission.model_validate(data))
    assert_allclose(balanced, 0, atol=1e-8 * np.abs(orbit(rig)).max())
    data["disks"]["opposite"]["unbalance_angle_deg"] = 30.0
    assert_allclose(orbit(Transmission.model_validate(data)), 2 * orbit(rig), rtol=1e-6, atol=1e-14)
