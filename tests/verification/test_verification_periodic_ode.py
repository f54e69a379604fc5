"""Verification: the periodic solution against the second-order equations marched in time by DOP853.

``M q'' + (C + G) q' + K q = F - h sum_j k_j(t) (h' q - e_j)``, not reduced to modes, from rest until it repeats.
Mesh stiffness, damage and modal damping of the rotors are built here from their stated laws.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import cholesky, eigh, expm, solve

from sigdb.dynamics import floquet_multiplier, prepare
from sigdb.transmission import Damage, ToothDamage, Transmission, load_transmission
from sigdb.transmission.assembly import assemble

# Soft and heavy shafts of one element, so that the fastest mode is slow enough to march through.
COARSE = """
name = "coarse-spur"
damping_ratio = 0.25
[operating]
drive = "motor"
load = "brake"
speed_rpm = 1500.0
torque = 40.0
rotation = -1
[materials.soft]
density = 9000.0
young_modulus = 3.0e9
shear_modulus = 1.15e9
[shafts.first]
axis = [0.0, 0.0, 1.0]
material = "soft"
segments = [{ length = 0.3, outer_diameter = 0.08 }]
[shafts.second]
axis = [0.0, 0.0, 1.0]
material = "soft"
segments = [{ length = 0.35, outer_diameter = 0.09, inner_diameter = 0.03 }]
[gears.small]
shaft = "first"
node = 0
teeth = 7
body_length = 0.03
material = "soft"
[gears.large]
shaft = "second"
node = 1
teeth = 11
body_length = 0.03
bore = 0.05
material = "soft"
[meshes.main]
driving = "small"
driven = "large"
module = 0.02
face_width = 0.03
pressure_angle_deg = 20.0
helix_angle_deg = 15.0
line_of_centres = [1.0, 0.2, 0.0]
stiffness = 2.0e6
[meshes.main.profile]
contact_ratio = 1.5
flank = 0.25
[couplings.motor]
shaft = "first"
node = 1
stiffness = 3.0e3
inertia = 0.02
[couplings.brake]
shaft = "second"
node = 0
stiffness = 4.0e3
inertia = 0.03
[bearings.a]
shaft = "first"
node = 0
seat = "wall"
stiffness = [2.0e6, 1.5e6, 1.0e6]
tilt_stiffness = 3.0e3
damping = [200.0, 150.0, 100.0]
[bearings.b]
shaft = "first"
node = 1
stiffness = [2.0e6, 1.5e6, 0.0]
[bearings.c]
shaft = "second"
node = 0
stiffness = [1.0e6, 2.0e6, 1.0e6]
tilt_stiffness = 2.0e3
[bearings.d]
shaft = "second"
node = 1
seat = "wall"
stiffness = [1.0e6, 2.0e6, 0.0]
[[casing.modes]]
frequency_hz = 150.0
damping_ratio = 0.2
modal_mass = 5.0
shape.wall = [0.3, 1.0, 0.2]
[sensors.position]
gear = "small"
direction = [0.0, 1.0, 0.0]
quantity = "displacement"
[sensors.speed]
gear = "large"
direction = [1.0, 1.0, 0.0]
quantity = "velocity"
[sensors.wall]
point = "wall"
direction = [0.0, 1.0, 0.0]
quantity = "acceleration"
"""
CONTACT_RATIO, FLANK, MEAN = 1.5, 0.25, 2.0e6
PITCH_POINT = CONTACT_RATIO / 2
BASE_PITCH = 2 * np.pi * 0.01 * np.cos(np.deg2rad(20.0)) * np.cos(np.deg2rad(15.0))
SAMPLES = 128


def step(x):
    return 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.maximum(x, 0.0), 1.0))


def pair_stiffness(u, teeth, shift_deg, loss, extent):
    """(teeth,) stiffness of every pair at pass coordinate u; the damage as arrays over the teeth (PHYSICS.md, 1)."""
    x = (u - np.arange(teeth) + 2.0) % teeth - 2.0
    shift = shift_deg * teeth / 360
    edge = np.maximum(0.1, 1.6 * np.abs(shift))
    x = x - shift * step(1 + x / edge) * step(1 + (CONTACT_RATIO - x) / edge)
    profile = step(x / FLANK) * step((CONTACT_RATIO - x) / FLANK) / (CONTACT_RATIO - FLANK)
    return MEAN * profile * (1 - loss * step((extent * (CONTACT_RATIO + edge) - x) / edge))


def rotor_damping(parts, stiffness, ratio):
    """2 zeta M (M^-1 K)^(1/2) on the rotors, the casing fixed."""
    rotors = np.setdiff1d(np.arange(len(parts.mass)), parts.casing)
    take = np.ix_(rotors, rotors)
    factor = cholesky(parts.mass[take], lower=True)
    whitened = solve(factor, solve(factor, stiffness[take]).T)
    squares, vectors = eigh((whitened + whitened.T) / 2)
    damping = np.zeros_like(stiffness)
    damping[take] = 2 * ratio * factor @ (vectors * np.sqrt(squares.clip(min=0))) @ vectors.T @ factor.T
    return damping


class Marched:
    """The assembled rig, marched over whole revolutions of one gear."""

    def __init__(self, rig, gear, damage, errors):
        self.parts = parts = assemble(rig)
        self.teeth = rig.gears[gear].teeth
        self.revolution = 2 * np.pi / abs(rig.speed(rig.gears[gear].shaft))
        self.h = parts.meshes[:, 0]
        with_mesh = parts.stiffness + MEAN * np.outer(self.h, self.h)
        damping = parts.damping + parts.gyroscopic + rotor_damping(parts, with_mesh, rig.damping_ratio)
        inverse = np.linalg.inv(parts.mass)
        self.flow = -np.hstack([inverse @ parts.stiffness, inverse @ damping])
        self.torque, self.push = inverse @ parts.torque, inverse @ self.h
        self.errors = errors
        self.across = inverse @ parts.friction
        self.damage, self.friction = np.zeros((3, self.teeth)), np.zeros(self.teeth)
        for tooth, one in damage.items():
            self.damage[:, tooth - 1] = one.phase_shift_deg, one.stiffness_loss, one.loss_extent
            self.friction[tooth - 1] = one.friction

    def mesh_force(self, t, state):
        """Along the normal, and those of friction in f0 and f1."""
        u = t / self.revolution * self.teeth
        k = pair_stiffness(u, self.teeth, *self.damage)
        force = k * (self.h @ state[: len(self.h)] - self.errors)
        behind = (u - np.arange(self.teeth) + 2.0) % self.teeth - 2.0 - PITCH_POINT
        sign = 2 * step(behind / 0.1 + 0.5) - 1
        rubbing = self.friction * force * sign
        return force.sum(), rubbing.sum(), rubbing @ (behind * BASE_PITCH)

    def slope(self, t, state):
        n = len(self.h)
        normal, rubbing, turning = self.mesh_force(t, state)
        acceleration = self.flow @ state + self.torque - self.push * normal - self.across @ [rubbing, turning]
        return np.concatenate([state[n:], acceleration])

    def last_revolution(self, revolutions, samples):
        """Compression and sensors' signals over the last revolution."""
        n = len(self.h)
        start = np.zeros(2 * n)
        with_mesh = self.parts.stiffness + MEAN * np.outer(self.h, self.h)
        start[:n] = np.linalg.lstsq(with_mesh, self.parts.torque, rcond=1e-12)[0]
        t = (revolutions - 1 + np.arange(samples) / samples) * self.revolution
        end = revolutions * self.revolution
        found = solve_ivp(self.slope, (0, end), start, method="DOP853", t_eval=t, rtol=1e-9, atol=1e-13)
        assert found.success
        slopes = np.array([self.slope(at, state) for at, state in zip(t, found.y.T, strict=True)]).T
        rows = self.parts.sensors
        derivatives = (found.y[:n], found.y[n:], slopes[n:])
        return self.h @ found.y[:n], np.array([rows[i] @ derivatives[i] for i in range(3)])


def coarse_rig(folder):
    path = folder / "coarse.toml"
    path.write_text(COARSE)
    return load_transmission(path)


DAMAGES = {
    "shift-and-loss-over-part": ("small", {3: ToothDamage(phase_shift_deg=6.0, stiffness_loss=0.5, loss_extent=0.4)}),
    "broken-between-pitted-across-the-mark": (
        "small",
        Damage(
            tooth=7,
            each=[
                ToothDamage(stiffness_loss=0.5, loss_extent=0.2),
                ToothDamage(stiffness_loss=0.5),
                ToothDamage(phase_shift_deg=-4.0),
            ],
        ).on_teeth(7),
    ),
    "rubbing-and-pitted-with-a-rubbing-neighbour": (
        "small",
        {
            4: ToothDamage(friction=0.3, stiffness_loss=0.5, loss_extent=0.5, phase_shift_deg=3.0),
            5: ToothDamage(friction=0.2),
        },
    ),
    "driven-gear-rubbing": ("large", {11: ToothDamage(phase_shift_deg=4.0, stiffness_loss=0.6, friction=0.2)}),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_the_periodic_solution_is_where_the_marched_equations_settle(name, tmp_path):
    """With phase shift, loss, friction and index errors together; errors relative to each signal's peak-to-peak.

    A pair rubs with ``mu k (delta - e)`` across its normal, one way before the pitch point and the other behind it.
    """
    gear, damage = DAMAGES[name]
    rig = coarse_rig(tmp_path)
    errors = 4e-5 * np.random.default_rng(3).standard_normal(rig.gears[gear].teeth)

    prepared = prepare(rig, gear=gear, samples_per_tooth=SAMPLES)
    state = prepared.steady_state(damage)
    compression = state.compression + state.compression_response @ errors
    signals = state.signals + state.specimen_response @ errors

    slowest = -prepared.system.poles.real.max()
    marched = Marched(rig, gear, damage, errors)
    settled = int(np.ceil(np.log(1e7) / (slowest * marched.revolution))) + 2
    marched_compression, marched_signals = marched.last_revolution(settled, len(compression))

    assert np.abs(compression - marched_compression).max() < 1e-5 * np.ptp(compression)
    assert (np.abs(signals - marched_signals).max(axis=1) < 1e-5 * np.ptp(signals, axis=1)).all()
    # Each part of the excitation counts in what is compared.
    assert np.ptp(state.compression_response @ errors) > 0.05 * np.ptp(compression)
    assert np.ptp(state.compression - prepared.steady_state({}).compression) > 0.05 * np.ptp(compression)


def test_the_floquet_multiplier_is_that_of_the_assembled_equations(tmp_path):
    """Monodromy of one tooth pass as a product of exponentials, without the free rotation's two unit multipliers.

    Nearly undamped at a speed where the mesh is parametrically unstable, so that the varying stiffness decides.
    """
    data = coarse_rig(tmp_path).model_dump()
    data["bearings"]["a"]["damping"] = (0.0, 0.0, 0.0)
    light = {"damping_ratio": 1e-3, "casing.modes.0.damping_ratio": 1e-3, "operating.speed_rpm": 3000.0}
    rig = Transmission.model_validate(data).replace(light)

    marched = Marched(rig, "small", {}, np.zeros(7))
    n, steps = len(marched.h), 300
    length = marched.revolution / 7 / steps
    monodromy = np.eye(2 * n)
    for i in range(steps):
        k = pair_stiffness((i + 0.5) / steps, 7, *marched.damage).sum()
        matrix = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), marched.flow])
        matrix[n:, :n] -= k * np.outer(marched.push, marched.h)
        monodromy = expm(length * matrix) @ monodromy
    multipliers = np.linalg.eigvals(monodromy)
    elastic = multipliers[np.argsort(np.abs(multipliers - 1))[2:]]

    prepared = prepare(rig, samples_per_tooth=300)
    found = floquet_multiplier(prepared.system, prepared.healthy[0, :300], marched.revolution / 7)
    assert found > 1.15
    assert_allclose(found, np.abs(elastic).max(), rtol=1e-4)
