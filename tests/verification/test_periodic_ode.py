"""Verification: the periodic solution and the march against the second-order equations marched in time.

``M q'' + (C + G) q' + K q = F - h f``, not reduced to modes, with ``f = sum_j k_j(t) (h' q - e_j)``. With backlash b
that is so where it is positive, and ``f = sum_j k_j(t) (h' q + b - e_j)`` where that is negative. Mesh stiffness,
damage and modal damping of the rotors are built here from their stated laws.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import cholesky, eigh, expm, solve

from sigdb.dynamics import Transient, floquet_multiplier, march, prepare_periodic, settle
from sigdb.transmission import Damage, ToothDamage, Transmission, load_transmission, modal_system
from sigdb.transmission.system.assembly import assemble

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
    """(teeth, ...) stiffness of every pair at pass coordinates u; the damage as arrays (teeth, 1)."""
    x = (u - np.arange(teeth)[:, None] + 2.0) % teeth - 2.0
    shift = shift_deg * teeth / 360
    edge = np.maximum(0.1, 1.6 * np.abs(shift))
    x = x - shift * step(1 + x / edge) * step(1 + (CONTACT_RATIO - x) / edge)
    profile = step(x / FLANK) * step((CONTACT_RATIO - x) / FLANK) / (CONTACT_RATIO - FLANK)
    return MEAN * profile * (1 - loss * step((extent * (CONTACT_RATIO + edge) - x) / edge))


def rotor_damping(parts, stiffness, ratio):
    """2 zeta M (M^-1 K)^(1/2) on the rotors' motion, less that with which they follow the casing statically."""
    rotors = np.setdiff1d(np.arange(len(parts.mass)), parts.casing)
    take = np.ix_(rotors, rotors)
    factor = cholesky(parts.mass[take], lower=True)
    whitened = solve(factor, solve(factor, stiffness[take]).T)
    squares, vectors = eigh((whitened + whitened.T) / 2)
    relative = np.eye(len(stiffness))[rotors]
    followed = np.linalg.lstsq(stiffness[take], stiffness[np.ix_(rotors, parts.casing)], rcond=1e-12)[0]
    relative[:, parts.casing] = followed
    own = 2 * ratio * factor @ (vectors * np.sqrt(squares.clip(min=0))) @ vectors.T @ factor.T
    return relative.T @ own @ relative


class Marched:
    """The assembled rig, marched over whole revolutions of one gear."""

    def __init__(self, rig, gear, damage, errors, backlash=None):
        self.backlash = backlash
        self.parts = parts = assemble(rig)
        self.teeth = rig.gears[gear].teeth
        self.revolution = 2 * np.pi / abs(rig.speed(rig.gears[gear].shaft))
        self.h = parts.meshes[:, 0]
        with_mesh = parts.stiffness + MEAN * np.outer(self.h, self.h)
        damping = parts.damping + parts.gyroscopic + rotor_damping(parts, with_mesh, rig.damping_ratio)
        inverse = np.linalg.inv(parts.mass)
        self.damping = damping
        self.flow = -np.hstack([inverse @ parts.stiffness, inverse @ damping])
        self.torque, self.push = inverse @ parts.torque, inverse @ self.h
        self.errors = errors[:, None]
        self.across = inverse @ parts.friction
        self.damage, self.friction = np.zeros((3, self.teeth, 1)), np.zeros((self.teeth, 1))
        for tooth, one in damage.items():
            self.damage[:, tooth - 1, 0] = one.phase_shift_deg, one.stiffness_loss, one.loss_extent
            self.friction[tooth - 1] = one.friction

    def mesh_laws(self, t):
        """(times, 3) stiffness, and force at no compression: normal force, friction and friction's moment."""
        u = t / self.revolution * self.teeth
        behind = (u - np.arange(self.teeth)[:, None] + 2.0) % self.teeth - 2.0 - PITCH_POINT
        friction = self.friction * (2 * step(behind / 0.1 + 0.5) - 1)
        k = pair_stiffness(u, self.teeth, *self.damage)
        pairs = np.array([k, friction * k, friction * k * behind * BASE_PITCH])
        return pairs.sum(axis=1).T, (pairs * self.errors).sum(axis=1).T

    def last_revolution(self, second_order, revolutions, samples, *, steps, last=1):
        """Compression and sensors' signals over the last revolution, or over more, from the static place."""
        n = len(self.h)
        state = np.zeros(2 * n)
        with_mesh = self.parts.stiffness + MEAN * np.outer(self.h, self.h)
        state[:n] = np.linalg.lstsq(with_mesh, self.parts.torque, rcond=1e-12)[0]
        t = np.arange(2 * samples * steps + 1) / (2 * samples * steps) * self.revolution
        gain, late = self.mesh_laws(t)
        compressions, signals = [], []
        for _ in range(revolutions):
            q, v, a, _, state = second_order(
                self.flow,
                np.column_stack([self.push, self.across]),
                np.tile(self.h, (3, 1)),
                gain=gain,
                late=late,
                external=np.tile(self.torque, (len(t), 1)),
                state=state,
                step=2 * t[1],
                samples=samples,
                backlash=self.backlash or 0.0,
            )
            compressions.append(self.h @ q)
            signals.append([row @ one for row, one in zip(self.parts.sensors, (q, v, a), strict=True)])
        return np.hstack(compressions[-last:]), np.hstack(signals[-last:])


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
def test_the_periodic_solution_is_where_the_marched_equations_settle(name, second_order, tmp_path):
    """With phase shift, loss, friction and index errors together; errors relative to each signal's peak-to-peak.

    A pair rubs with ``mu k (delta - e)`` across its normal, one way before the pitch point and the other behind it.
    """
    gear, damage = DAMAGES[name]
    rig = coarse_rig(tmp_path)
    errors = 4e-5 * np.random.default_rng(3).standard_normal(rig.gears[gear].teeth)

    prepared = prepare_periodic(rig, gear=gear, samples_per_tooth=SAMPLES)
    state = prepared.steady_state([damage])[0]
    compression = state.compression + state.compression_response @ errors
    signals = state.signals + state.specimen_response @ errors

    slowest = -prepared.system.poles.real.max()
    marched = Marched(rig, gear, damage, errors)
    settled = int(np.ceil(np.log(1e7) / (slowest * marched.revolution))) + 2
    marched_compression, marched_signals = marched.last_revolution(second_order, settled, len(compression), steps=4)

    assert np.abs(compression - marched_compression).max() < 1e-5 * np.ptp(compression)
    assert (np.abs(signals - marched_signals).max(axis=1) < 1e-5 * np.ptp(signals, axis=1)).all()
    # Each part of the excitation counts in what is compared.
    assert np.ptp(state.compression_response @ errors) > 0.05 * np.ptp(compression)
    assert np.ptp(state.compression - prepared.steady_state([{}])[0].compression) > 0.05 * np.ptp(compression)


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
        k = pair_stiffness(np.array([(i + 0.5) / steps]), 7, *marched.damage).sum()
        matrix = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), marched.flow])
        matrix[n:, :n] -= k * np.outer(marched.push, marched.h)
        monodromy = expm(length * matrix) @ monodromy
    multipliers = np.linalg.eigvals(monodromy)
    elastic = multipliers[np.argsort(np.abs(multipliers - 1))[2:]]

    prepared = prepare_periodic(rig, samples_per_tooth=300)
    found = floquet_multiplier(prepared.system, prepared.healthy[0, :300], marched.revolution / 7)
    assert found > 1.15
    assert_allclose(found, np.abs(elastic).max(), rtol=1e-4)


LOOSE = {"damping_ratio": 0.2, "casing.modes.0.damping_ratio": 0.3, "operating.torque": 10.0}
BACKLASH = 6e-5
LATE = np.array([0.0, 0.0, -8e-4, -5e-5, 0.0, 2e-5, 0.0])
"""Index errors; one tooth is early by ten times the static compression and throws the gears apart."""
SETTLED = 8
"""Revolutions after which the motion repeats to some 1e-6 of its size."""


@pytest.fixture(scope="module")
def loose(tmp_path_factory):
    """The coarse rig, hardly damped and with backlash; one tooth is early, the next broken."""
    data = coarse_rig(tmp_path_factory.mktemp("loose")).model_dump()
    data["meshes"]["main"]["backlash"] = BACKLASH
    rig = Transmission.model_validate(data).replace(LOOSE)
    damage = Damage(tooth=4, stiffness_loss=0.7, phase_shift_deg=5.0)
    return rig, damage, Marched(rig, "small", damage.on_teeth(7), LATE, BACKLASH)


@pytest.fixture(scope="module")
def settling(loose, second_order):
    """Compression and sensors' signals, 64 samples a tooth pass, from the static place until it repeats."""
    return loose[2].last_revolution(second_order, SETTLED, 7 * 64, steps=64, last=SETTLED)


def test_a_march_through_lost_contact_is_that_of_the_assembled_equations(loose, settling):
    """Two revolutions from the static place, through contact, flight and contact of the backs; second order."""
    rig, damage, marched = loose
    wanted = np.array([settling[0], *settling[1]])[:, : 2 * 7 * 64]
    errors = []
    for steps in (128, 512, 2048):
        history = march(
            rig,
            damage,
            index_errors=LATE,
            duration=2 * marched.revolution,
            sampling_rate=7 * steps / marched.revolution,
            steps_per_tooth=1,
        )
        found = np.array([history.compression["main"], *history.signals.values()])[:, :: steps // 64]
        errors.append(np.abs(found - wanted).max(axis=1) / np.ptp(wanted, axis=1))
        force = history.mesh_force["main"]
        assert (force == 0).mean() > 0.05
        assert force.min() < 0 < force.max()
        assert history.contact == pytest.approx((force > 0).mean(), abs=1e-3)
    assert (errors[-1] < 1e-4).all()
    assert_allclose(np.log(np.divide(errors[0], errors[-1])) / np.log(16), 2, atol=0.2)


@pytest.fixture(scope="module")
def orbit(loose):
    """The settled motion of the same rig."""
    rig, damage, _ = loose
    system = modal_system(rig)
    solver = Transient(samples_per_tooth=512, steps_per_tooth=2048, tolerance=1e-7)
    state = np.zeros((system.poles.imag >= 0).sum(), complex)
    return settle(
        rig, gear="small", damage=damage.on_teeth(7), index_errors=LATE, state=state, solver=solver, system=system
    )


def test_the_settled_motion_is_where_the_assembled_equations_settle(orbit, settling):
    compression, signals = settling[0][-7 * 64 :], settling[1][:, -7 * 64 :]
    assert orbit.contact_loss
    assert orbit.min_compression < 0
    assert orbit.mesh_force.min() < 0
    assert np.abs(orbit.compression[0, ::8] - compression).max() < 1e-5 * np.ptp(compression)
    assert (np.abs(orbit.signals[:, ::8] - signals).max(axis=1) < 1e-5 * np.ptp(signals, axis=1)).all()
    assert orbit.error < 1e-5


def test_what_the_stiffness_feeds_into_the_settled_motion_is_what_is_dissipated(loose, orbit):
    """The mesh force, as a given force on the assembled rig without its mesh, causes the compression that it came from;
    and its power, ``-f d(delta)/dt``, is that of the damping, ``q'' C q'``. The constant torque's is none on average.
    """
    _, _, marched = loose
    parts, force = marched.parts, np.fft.rfft(orbit.mesh_force[0]) / orbit.mesh_force.shape[1]
    compression = np.fft.rfft(orbit.compression[0]) / orbit.compression.shape[1]
    omega = 2 * np.pi / marched.revolution * np.arange(len(force))
    fed = dissipated = 0.0
    caused = np.zeros_like(compression)
    for k in range(1, len(force) // 2):
        w = omega[k]
        q = np.linalg.solve(parts.stiffness + 1j * w * marched.damping - w**2 * parts.mass, -marched.h * force[k])
        caused[k] = marched.h @ q
        fed -= 2 * (force[k].conj() * 1j * w * compression[k]).real
        dissipated += 2 * w**2 * (q.conj() @ marched.damping @ q).real
    kept = slice(1, len(force) // 2)
    assert_allclose(caused[kept], compression[kept], rtol=0, atol=1e-5 * np.abs(compression[kept]).max())
    assert dissipated > 1.0
    assert_allclose(fed, dissipated, rtol=1e-5)
