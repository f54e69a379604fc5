"""Verification: all excitations and several meshes, against the second-order equations marched in time.

``M q'' + (C + G) q' + K q = F(t) - sum over meshes h (sum_j k_j(t) (h' q - e_j(t)) + c h' q')``, not reduced to modes,
from rest until it repeats. Mesh stiffness, damage, errors, unbalance, load and modal damping are built here from their
stated laws.
"""

import importlib

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import cholesky, eigh, solve

from sigdb.core.errors import InputError
from sigdb.dynamics import floquet_multiplier, prepare_periodic, simulate
from sigdb.dynamics.periodic import periodic
from sigdb.transmission import Damage, ToothDamage, Transmission, load_transmission
from sigdb.transmission.mesh.stiffness import tooth_stiffness
from sigdb.transmission.system.assembly import assemble

# Soft and heavy shafts of one element, so that the fastest mode is slow enough to march through.
SOFT = {"density": 9000.0, "young_modulus": 3.0e9, "shear_modulus": 1.15e9}
CONTACT_RATIO, FLANK = 1.5, 0.25
FINER = 4
"""How much finer the marched signals are sampled, so that they are compared without what N samples cannot hold."""
STEPS = 3
"""Steps of the march for each of these samples."""


def shaft(length, diameter):
    return {
        "axis": [0.0, 0.0, 1.0],
        "material": "soft",
        "segments": [{"length": length, "outer_diameter": diameter}],
    }


def gear(on, node, teeth, **more):
    return {"shaft": on, "node": node, "teeth": teeth, "body_length": 0.03, "material": "soft"} | more


def mesh(driving, driven, line, stiffness, **more):
    profile = {"contact_ratio": CONTACT_RATIO, "flank": FLANK}
    return {
        "driving": driving,
        "driven": driven,
        "module": 0.012,
        "face_width": 0.03,
        "pressure_angle_deg": 20.0,
        "helix_angle_deg": 12.0,
        "line_of_centres": line,
        "stiffness": stiffness,
        "profile": profile,
    } | more


def bearings(on):
    """At both ends, unlike in x and y, one of them holding the shaft along itself."""
    return {
        f"{on}-a": {
            "shaft": on,
            "node": 0,
            "stiffness": (2.0e6, 1.5e6, 1.0e6),
            "tilt_stiffness": 3.0e3,
            "damping": (200.0, 150.0, 100.0),
        },
        f"{on}-b": {"shaft": on, "node": 1, "stiffness": (1.0e6, 2.0e6, 0.0), "tilt_stiffness": 2.0e3},
    }


def rig_of(shafts, gears, meshes, last, **operating):
    return Transmission(
        name="train",
        damping_ratio=0.2,
        operating={"drive": "motor", "load": "brake", "speed_rpm": 1200.0, "torque": 30.0, "rotation": -1} | operating,
        materials={"soft": SOFT},
        shafts=shafts,
        gears=gears,
        couplings={
            "motor": {"shaft": "first", "node": 1, "stiffness": 3.0e3, "inertia": 0.02},
            "brake": {"shaft": last, "node": 0, "stiffness": 4.0e3, "inertia": 0.03},
        },
        bearings={name: one for on in shafts for name, one in bearings(on).items()},
        meshes=meshes,
        sensors={
            "position": {"gear": "small", "direction": [0.0, 1.0, 0.0], "quantity": "displacement"},
            "speed": {"gear": "large", "direction": [1.0, 1.0, 0.3], "quantity": "velocity"},
            "shock": {"gear": "large", "direction": [0.0, 1.0, 0.0], "quantity": "acceleration"},
        },
    )


def one_mesh(teeth=(7, 14), **operating):
    """A pair in which everything excites."""
    return rig_of(
        {"first": shaft(0.3, 0.08), "second": shaft(0.35, 0.09)},
        {
            "small": gear("first", 0, teeth[0], unbalance=6e-3, unbalance_angle_deg=25.0, runout=4e-5),
            "large": gear(
                "second", 1, teeth[1], unbalance=4e-2, unbalance_angle_deg=-70.0, runout=6e-5, runout_angle_deg=200.0
            ),
        },
        {"main": mesh("small", "large", [1.0, 0.2, 0.0], 2.0e6, damping=300.0, profile_error={"amplitude": 3e-5})},
        "second",
        **({"load_fluctuation": 0.2, "load_order": 3, "load_angle_deg": 40.0} | operating),
    )


def two_stages(second=(12, 18), *, excited=False):
    """10/20 and 12/18 teeth, or others; the intermediate shaft carries two gears."""
    shafts = {"first": shaft(0.3, 0.08), "middle": shaft(0.25, 0.08), "last": shaft(0.35, 0.09)}
    more = {"unbalance": 8e-3, "unbalance_angle_deg": 35.0} if excited else {}
    gears = {
        "small": gear("first", 0, 10, runout=3e-5 if excited else 0.0),
        "large": gear("middle", 0, 20, unbalance=3e-2 if excited else 0.0, unbalance_angle_deg=-20.0),
        "third": gear("middle", 1, second[0]),
        "fourth": gear("last", 1, second[1]),
    }
    gears["small"] |= more
    relief = {"profile_error": {"amplitude": 2e-5}} if excited else {}
    return rig_of(
        shafts,
        gears,
        {
            "in": mesh("small", "large", [1.0, 0.2, 0.0], 2.0e6),
            "out": mesh("third", "fourth", [0.3, 1.0, 0.0], 3.0e6, damping=100.0, **relief),
        },
        "last",
    )


def step(x):
    return 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.maximum(x, 0.0), 1.0))


def pairs(u, teeth, mean, shift_deg, loss, extent):
    """Place in the contact and stiffness of every tooth's pair at pass coordinate u."""
    place = x = (u - np.arange(teeth)[:, None] + 2.0) % teeth - 2.0
    shift = shift_deg * teeth / 360
    edge = np.maximum(0.1, 1.6 * np.abs(shift))
    x = x - shift * step(1 + x / edge) * step(1 + (CONTACT_RATIO - x) / edge)
    profile = step(x / FLANK) * step((CONTACT_RATIO - x) / FLANK) / (CONTACT_RATIO - FLANK)
    return place, mean * profile * (1 - loss * step((extent * (CONTACT_RATIO + edge) - x) / edge))


def rotor_damping(mass, stiffness, ratio):
    """2 zeta M (M^-1 K)^(1/2)."""
    factor = cholesky(mass, lower=True)
    whitened = solve(factor, solve(factor, stiffness).T)
    squares, vectors = eigh((whitened + whitened.T) / 2)
    return 2 * ratio * factor @ (vectors * np.sqrt(squares.clip(min=0))) @ vectors.T @ factor.T


class Marched:
    """The assembled rig, marched over whole revolutions of the damaged gear; every gear has tooth 1 at the mark."""

    def __init__(self, rig, gear, damage, errors):
        bare = rig.model_dump()
        for one in bare["meshes"].values():
            one["damping"] = 0.0
        self.rig, self.parts = rig, assemble(Transmission.model_validate(bare))
        parts, self.n = self.parts, len(self.parts.mass)
        self.revolution = 2 * np.pi / abs(rig.speed(rig.gears[gear].shaft))
        self.h = parts.meshes.T
        with_mesh = parts.stiffness + self.h.T @ np.diag(parts.mesh_stiffness) @ self.h
        damping = parts.damping + parts.gyroscopic + rotor_damping(parts.mass, with_mesh, rig.damping_ratio)
        self.inverse = np.linalg.inv(parts.mass)
        self.flow = -np.hstack([self.inverse @ parts.stiffness, self.inverse @ damping])
        self.start = np.linalg.lstsq(with_mesh, parts.torque, rcond=1e-12)[0]
        self.members = []
        for name, one in rig.meshes.items():
            own = gear in (one.driving, one.driven)
            counted = rig.gears[gear if own else one.driving]
            changed = np.zeros((3, counted.teeth))
            for tooth, what in (damage if own else {}).items():
                changed[:, tooth - 1] = what.phase_shift_deg, what.stiffness_loss, what.loss_extent
            late = errors if own else np.zeros(counted.teeth)
            self.members.append((name, one, counted.teeth, abs(rig.speed(counted.shaft)), changed, late))
        self.unbalance = np.zeros((self.n, 2 * len(rig.gears)))
        for i, one in enumerate(rig.gears.values()):
            x = 12 * list(rig.shafts).index(one.shaft) + 6 * one.node
            self.unbalance[x, 2 * i] = self.unbalance[x + 1, 2 * i + 1] = one.unbalance

        # Unbalance and the load's swing, as waves cos(w t + phase) of a constant force each.
        waves = []
        for i, one in enumerate(rig.gears.values()):
            speed, phase = rig.speed(one.shaft), np.deg2rad(one.unbalance_angle_deg)
            for axis, (size, lag) in enumerate(((1.0, 0.0), (np.sign(speed), np.pi / 2))):
                waves.append((abs(speed), phase - lag, size * speed**2 * self.unbalance[:, 2 * i + axis]))
        operating = rig.operating
        swing = operating.load_order * abs(rig.speed(rig.couplings[operating.load].shaft))
        lag = operating.load_order * np.deg2rad(operating.load_angle_deg)
        waves.append((swing, -lag, operating.load_fluctuation * parts.load))
        self.speeds, self.phases, forces = (np.array(one) for one in zip(*waves, strict=True))
        self.waves = forces.T

    def angle(self, on, t):
        return abs(self.rig.speed(on)) * t

    def external(self, t):
        return self.parts.torque[:, None] + self.waves @ np.cos(
            np.multiply.outer(self.speeds, t) + self.phases[:, None]
        )

    def mesh_laws(self, t):
        """Return stiffness and force at no compression, ``-sum_j k_j e_j``, of each mesh at each time."""
        laws = []
        for _, one, teeth, speed, changed, late in self.members:
            tooth = (slice(None), None)
            x, k = pairs(speed * t / (2 * np.pi) * teeth, teeth, one.stiffness, *(row[tooth] for row in changed))
            error = late[tooth] + np.zeros_like(x)
            if one.profile_error is not None:
                error += one.profile_error.amplitude * (2 * x / CONTACT_RATIO - 1) ** 2
            for name in (one.driving, one.driven):
                g = self.rig.gears[name]
                error += g.runout * np.cos(self.angle(g.shaft, t) - np.deg2rad(g.runout_angle_deg))
            laws.append((k.sum(axis=0), (k * error).sum(axis=0)))
        return np.array(laws).transpose(1, 2, 0)

    def last(self, second_order, settle, revolutions, samples):
        """Compressions, signals and mesh forces over the last so many revolutions, after some to settle."""
        steps = revolutions * samples * STEPS
        t = np.arange(2 * steps + 1) / (2 * steps) * revolutions * self.revolution
        gain, late = self.mesh_laws(t)
        state = np.concatenate([self.start, 0 * self.start])
        for _ in range(int(np.ceil(settle / revolutions)) + 1):
            q, v, a, forces, state = second_order(
                self.flow,
                self.inverse @ self.h.T,
                self.h,
                gain=gain,
                late=late,
                damping=[one.damping for _, one, *_ in self.members],
                external=(self.inverse @ self.external(t)).T,
                state=state,
                step=2 * t[1],
                samples=revolutions * samples,
            )
        rows = self.parts.sensors
        return self.h @ q, np.array([rows[0] @ q, rows[1] @ v, rows[2] @ a]), forces


def settled(prepared, digits):
    slowest = -prepared.system.poles.real.max()
    return np.log(10**digits) / (slowest * 2 * np.pi / prepared.shaft_speed) + 1


def whole(state, errors):
    compression = state.compression + state.compression_response @ errors + state.compression_harmonic[..., 0].sum(1)
    return compression, state.signals + state.specimen_response @ errors + state.harmonic_response[..., 0].sum(axis=2)


def held(values, n):
    """What n samples hold of periodic values on another grid, coarse or fine: harmonics below n / 2."""
    spectrum = np.fft.rfft(values)[..., : (n + 1) // 2]
    spectrum = spectrum[..., : (values.shape[-1] + 1) // 2] * (n / values.shape[-1])
    return np.fft.irfft(spectrum, n=n)


def close(actual, expected, tolerance):
    expected = held(expected, actual.shape[-1])
    assert (np.abs(actual - expected).max(axis=-1) < tolerance * np.ptp(expected, axis=-1)).all()


# --- one mesh, all excitations


def test_everything_that_excites_acts_as_in_the_marched_equations(second_order):
    """The wheel is damaged; pinion and its excitations turn twice with it, the load's fluctuation three times."""
    rig = one_mesh()
    damage = {14: ToothDamage(phase_shift_deg=3.0, stiffness_loss=0.5, loss_extent=0.5)}
    errors = 3e-5 * np.random.default_rng(5).standard_normal(14)
    prepared = prepare_periodic(rig, gear="large", samples_per_tooth=48)
    state = prepared.steady_state([damage])[0]
    assert state.orders == (1, 2, 3)
    compression, signals = whole(state, errors)
    marched = Marched(rig, "large", damage, errors)
    expected, seen, _ = marched.last(second_order, settled(prepared, 6), 1, FINER * prepared.samples)
    close(compression, expected[0], 3e-5)
    close(signals, seen, 3e-5)
    for i in range(3):
        assert np.ptp(state.compression_harmonic[:, i, 0]) > 0.02 * np.ptp(compression)
    without = rig.replace({"main.profile_error.amplitude": 0.0})
    plain = prepare_periodic(without, gear="large", samples_per_tooth=48).steady_state([damage])[0]
    assert np.ptp(state.compression - plain.compression) > 0.02 * np.ptp(compression)


def test_what_another_shaft_excites_between_whole_turns_cancels_over_the_tooth_cycle(second_order):
    """7 and 11 teeth: the average over 11 turns of the pinion sees neither the wheel's unbalance nor its run-out."""
    rig = one_mesh((7, 11))
    damage = {3: ToothDamage(stiffness_loss=0.6)}
    prepared = prepare_periodic(rig, gear="small", samples_per_tooth=48)
    state = prepared.steady_state([damage])[0]
    assert state.orders == (1,)
    compression, signals = whole(state, np.zeros(7))
    marched = Marched(rig, "small", damage, np.zeros(7))
    expected, seen, _ = marched.last(second_order, settled(prepared, 6), 11, FINER * prepared.samples)
    folded = expected[0].reshape(11, -1)
    assert np.ptp(folded - folded.mean(axis=0)) > 0.05 * np.ptp(compression)
    close(compression, folded.mean(axis=0), 5e-5)
    close(signals, seen.reshape(3, 11, -1).mean(axis=1), 5e-5)


def test_orders_are_those_of_shafts_that_turn_whole_times():
    assert [one.order for one in prepare_periodic(one_mesh((7, 21)), gear="large").harmonics] == [1, 3]
    assert [one.order for one in prepare_periodic(one_mesh((7, 21)), gear="small").harmonics] == [1]
    assert [one.order for one in prepare_periodic(one_mesh((10, 25), load_order=5), gear="small").harmonics] == [1, 2]
    quiet = one_mesh(load_fluctuation=0.0).replace(
        {f"{g}.{e}": 0.0 for g in ("small", "large") for e in ("unbalance", "runout")}
    )
    assert prepare_periodic(quiet, gear="large").harmonics == ()


@pytest.mark.parametrize("psi_deg", [30.0, -100.0])
def test_the_response_in_a_turned_frame(psi_deg):
    """All excitations turned on by psi of the wheel, its damage and its teeth staying where they are."""
    rig, psi = one_mesh(), np.deg2rad(psi_deg)
    damage = {2: ToothDamage(stiffness_loss=0.5)}
    turned = rig.replace(
        {
            "small.unbalance_angle_deg": 25.0 + 2 * psi_deg,
            "small.runout_angle_deg": -2 * psi_deg,
            "large.unbalance_angle_deg": -70.0 + psi_deg,
            "large.runout_angle_deg": 200.0 - psi_deg,
            "operating.load_angle_deg": 40.0 - psi_deg,
        }
    )
    one, other = (
        prepare_periodic(r, gear="large", samples_per_tooth=24).steady_state([damage])[0] for r in (rig, turned)
    )
    orders = np.array(one.orders)
    for name in ("harmonic_response", "compression_harmonic"):
        parts = getattr(one, name)
        expected = np.cos(orders * psi) * parts[..., 0] + np.sin(orders * psi) * parts[..., 1]
        assert_allclose(getattr(other, name)[..., 0], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_runout_is_an_index_error_that_varies_within_the_contact():
    """With a run-out of cos(theta) the teeth have that error at their own angle, but for its change in a contact.

    Against index errors of the teeth at the middle of their contacts, the difference falls with the tooth count.
    """

    def gap(teeth):
        data = one_mesh((teeth, 2 * teeth), load_fluctuation=0.0).model_dump()
        for name in ("small", "large"):
            data["gears"][name] |= {"unbalance": 0.0, "runout": 1e-5 if name == "small" else 0.0}
        data["meshes"]["main"] |= {"profile_error": None, "module": 0.012 * 7 / teeth}
        prepared = prepare_periodic(Transmission.model_validate(data), gear="small", samples_per_tooth=32)
        state = prepared.steady_state([{}])[0]
        errors = 1e-5 * np.cos(2 * np.pi * (np.arange(teeth) + CONTACT_RATIO / 2) / teeth)
        by_teeth = state.specimen_response[0] @ errors
        return np.ptp(by_teeth - state.harmonic_response[0, :, 0, 0]) / np.ptp(by_teeth)

    coarse, fine = gap(10), gap(40)
    assert fine < 0.02
    assert fine < coarse / 3


# --- several meshes


@pytest.fixture
def without_alias(monkeypatch):
    """The alias of damage is taken out where it is more than 1e-6."""
    monkeypatch.setattr(periodic, "TOLERANCE", 1e-6)


PREPARE = importlib.import_module("sigdb.dynamics.periodic.prepare")


@pytest.mark.parametrize(
    "damage", [{}, {3: ToothDamage(stiffness_loss=0.5, friction=0.3), 4: ToothDamage(friction=0.1)}]
)
def test_the_iteration_for_long_periods_gives_what_the_factored_blocks_do(damage, monkeypatch):
    """Two revolutions of 20 and 13 passes, with index errors, unbalance, run-out and profile errors."""
    rig, solvers, states = two_stages((13, 18), excited=True), [], []
    for most in (PREPARE._MOST_ENTRIES, 0):
        monkeypatch.setattr(PREPARE, "_MOST_ENTRIES", most)
        prepared = prepare_periodic(rig, gear="small", samples_per_tooth=16)
        solvers.append(type(prepared.solver).__name__)
        states.append(prepared.steady_state([damage])[0])
    assert solvers == ["Hill", "LongPeriod"]
    for field in (
        "signals", "specimen_response", "harmonic_response",
        "compression", "compression_response", "compression_harmonic",
    ):  # fmt: skip
        factored, iterated = (getattr(state, field) for state in states)
        assert_allclose(iterated, factored, rtol=0, atol=1e-8 * np.abs(factored).max())
    assert_allclose(states[1].error, states[0].error, rtol=1e-6)


@pytest.mark.parametrize(("gear", "torque"), [("small", 30.0), ("fourth", 30.0 * 36 / 13 * 40 / 17)])
def test_a_train_of_hunting_teeth_carries_its_torque(gear, torque, monkeypatch):
    """13/36 and 17/40 teeth: 36 revolutions of the first pinion, 17 of the last wheel, to close the tooth cycle."""
    monkeypatch.setattr(PREPARE, "_MOST_ENTRIES", 0)
    data = two_stages((17, 40)).model_dump()
    for name, teeth in (("small", 13), ("large", 36)):
        data["gears"][name]["teeth"] = teeth
    damage = {2: ToothDamage(stiffness_loss=0.5, friction=0.1)}
    prepared = prepare_periodic(Transmission.model_validate(data), gear=gear, samples_per_tooth=16)
    assert prepared.period.revolutions == {"small": 36, "fourth": 17}[gear]
    state, teeth = prepared.steady_state([damage], specimens=False)[0], prepared.teeth
    fine = tooth_stiffness(prepared.meshes[0], teeth, np.arange(128 * teeth) / 128, damage).sum(axis=0)
    force = np.tile(fine, prepared.period.revolutions) * held(state.compression, 8 * len(state.compression))
    carried = torque / (0.006 * teeth * np.cos(np.deg2rad(20)) * np.cos(np.deg2rad(12)))
    # Friction of one tooth in 13, at right angles to the normal, takes some torque by the change of its arm.
    without = prepared.steady_state([{2: ToothDamage(stiffness_loss=0.5)}], specimens=False)[0]
    plain = np.tile(fine, prepared.period.revolutions) * held(without.compression, 8 * len(state.compression))
    assert_allclose(plain.mean(), carried, rtol=1e-6)
    assert abs(force.mean() / carried - 1) < 5e-3
    assert state.error < 1e-4


STAGES = {
    "second-stage": (
        "third",
        (13, 18),
        1,
        Damage(tooth=13, damaged_teeth=2, stiffness_loss=0.5, loss_extent=0.6).on_teeth(13),
    ),
    "two-revolutions": ("small", (13, 18), 2, {10: ToothDamage(phase_shift_deg=5.0, stiffness_loss=0.5)}),
}


@pytest.mark.parametrize("name", STAGES)
@pytest.mark.usefixtures("without_alias")
def test_two_stages_settle_where_the_marched_equations_do(name, second_order):
    """Where the period is two turns of the pinion, the intermediate shaft's unbalance turns once in it: order 1/2.

    The meshes' variation at half orders brings it into the average over single turns.
    """
    gear, teeth, revolutions, damage = STAGES[name]
    rig = two_stages(teeth, excited=True)
    errors = 3e-5 * np.random.default_rng(6).standard_normal(rig.gears[gear].teeth)
    prepared = prepare_periodic(rig, gear=gear, samples_per_tooth=48)
    assert prepared.period.revolutions == revolutions
    assert not rig.turns_exactly(gear)
    state = prepared.steady_state([damage])[0]
    compression, signals = whole(state, errors)
    marched = Marched(rig, gear, damage, errors)
    expected, seen, forces = marched.last(second_order, settled(prepared, 6), revolutions, FINER * prepared.samples)
    own = 1 if gear == "third" else 0
    close(compression, expected[own], 3e-5)
    close(signals, seen.reshape(3, revolutions, -1).mean(axis=1), 3e-5)
    assert set(state.orders) == {"small": {0.5, 1.0}, "third": {1.0, 2.0}}[gear]
    # Every mesh carries its torque in the mean, W = T / (r cos(phi) cos(psi)), the second at its shaft's torque.
    radii = 0.006 * np.array([10, teeth[0]])
    carried = np.array([30.0, 60.0]) / (radii * np.cos(np.deg2rad(20)) * np.cos(np.deg2rad(12)))
    assert_allclose(forces.mean(axis=1), carried, rtol=1e-5)
    assert_allclose(state.static_compression * prepared.meshes[0].stiffness, carried[own], rtol=1e-6)


def test_the_mean_force_of_each_mesh_carries_its_torque():
    """Each gear damaged in turn, its mesh's stiffness 8 times finer than the compression: a product has no alias then.

    The mean of the samples given out is that of the torque but for their alias.
    """
    rig = two_stages()
    for gear, torque, teeth in (("small", 30, 10), ("large", 60, 20), ("third", 60, 12), ("fourth", 90, 18)):
        damage = {2: ToothDamage(stiffness_loss=0.5)}
        prepared = prepare_periodic(rig, gear=gear, samples_per_tooth=16)
        state = prepared.steady_state([damage])[0]
        carried = torque / (0.006 * teeth * np.cos(np.deg2rad(20)) * np.cos(np.deg2rad(12)))
        fine = tooth_stiffness(prepared.meshes[0], teeth, np.arange(128 * teeth) / 128, damage).sum(axis=0)
        force = fine * held(state.compression, 128 * teeth)
        assert_allclose(force.mean(), carried, rtol=1e-6)
        assert_allclose(state.mesh_force.mean(), carried, rtol=3e-5)


def test_the_least_compression_elsewhere_is_that_of_the_other_mesh():
    """Seen from the damaged first stage and, healthy, from the second stage itself."""
    rig = two_stages()
    ours = prepare_periodic(rig, gear="small", samples_per_tooth=96).steady_state([{}])[0]
    theirs = prepare_periodic(rig, gear="third", samples_per_tooth=160).steady_state([{}])[0]
    assert_allclose(ours.least_elsewhere, theirs.compression.min() / theirs.static_compression, rtol=2e-3)
    assert_allclose(theirs.least_elsewhere, ours.compression.min() / ours.static_compression, rtol=2e-3)


@pytest.mark.parametrize(
    ("teeth", "gear", "revolutions", "passes"),
    [
        ((12, 18), "small", 1, (10, 6)),
        ((12, 18), "large", 1, (20, 12)),
        ((12, 18), "fourth", 1, (18, 30)),
        ((13, 18), "small", 2, (20, 13)),
        ((13, 17), "third", 1, (13, 20)),
        ((13, 17), "fourth", 13, (221, 340)),
    ],
)
def test_the_common_period_is_the_least_that_all_meshes_repeat_in(teeth, gear, revolutions, passes):
    prepared = prepare_periodic(two_stages(teeth), gear=gear, samples_per_tooth=16)
    assert (prepared.period.revolutions, prepared.period.passes) == (revolutions, passes)
    assert_allclose(prepared.seconds, revolutions * 2 * np.pi / prepared.shaft_speed, rtol=1e-12)
    assert prepared.mesh_stiffness({}).shape == (2, revolutions * prepared.samples)


def test_a_common_period_that_is_too_long_is_refused():
    """Damage on the last wheel, 61 and 67 teeth: only 61 turns of it bring back the first stage."""
    with pytest.raises(InputError, match=r"do not repeat within 60 revolutions; choose tooth counts with a shorter"):
        prepare_periodic(two_stages((61, 67)), gear="fourth")


def test_a_rig_without_torque_is_refused():
    for changes in ({"operating.torque": 0.0}, {"operating.speed_rpm": 0.0}):
        with pytest.raises(InputError, match=r"'train' has no torque through its meshes; give operating\.drive, load"):
            prepare_periodic(two_stages().replace(changes))
    with pytest.raises(InputError, match=r"'friswell-turbogenerator' has no torque through its meshes"):
        prepare_periodic(load_transmission("friswell-turbogenerator"))
    with pytest.raises(InputError, match=r"'friswell-5.9.1' has no mesh, so no gear can be damaged"):
        prepare_periodic(load_transmission("friswell-5.9.1"))


def test_an_idler_cannot_be_damaged_and_its_neighbours_can():
    """A gear in two meshes: damage on its mate is simulated, on itself refused."""
    data = two_stages().model_dump()
    data["gears"]["fourth"] |= {"teeth": 12, "node": 0}
    data["meshes"]["out"]["driving"] = "large"
    del data["gears"]["third"]
    rig = Transmission.model_validate(data)
    with pytest.raises(InputError, match=r"gear 'large' of rig 'train' takes part in 2 meshes; damage is simulated in"):
        prepare_periodic(rig, gear="large").steady_state([{1: ToothDamage(stiffness_loss=0.3)}])
    assert prepare_periodic(rig, gear="fourth", samples_per_tooth=16).steady_state(
        [{1: ToothDamage(stiffness_loss=0.3)}]
    )[0]


def test_the_order_of_the_meshes_in_the_rig_does_not_matter():
    rig = two_stages(excited=True)
    data = rig.model_dump()
    data["meshes"] = dict(reversed(data["meshes"].items()))
    other = Transmission.model_validate(data)
    damage = Damage(gear="third", tooth=2, stiffness_loss=0.4)
    one, two = (simulate(r, damage) for r in (rig, other))
    for sensor in rig.sensors:
        assert_allclose(two.signal(sensor), one.signal(sensor), rtol=0, atol=1e-8 * np.abs(one.signal(sensor)).max())
    assert_allclose(two.floquet_multiplier, one.floquet_multiplier, rtol=1e-9)
    assert_allclose(two.min_compression, one.min_compression, rtol=1e-7)


def test_the_multiplier_of_two_meshes_is_that_of_the_assembled_equations():
    """Monodromy of the common period of two meshes by small steps, without the free rotation's two unit multipliers."""
    light = {"damping_ratio": 2e-3, "operating.speed_rpm": 2600.0}
    data = two_stages().model_dump()
    for one in data["bearings"].values():
        one["damping"] = (0.0, 0.0, 0.0)
    data["meshes"]["out"]["damping"] = 0.0
    rig = Transmission.model_validate(data).replace(light)
    marched = Marched(rig, "small", {}, np.zeros(10))
    n = marched.n

    # Half a revolution of the pinion has 5 and 3 passes.
    steps = 1200
    length = marched.revolution / 2 / steps
    stiffness = marched.mesh_laws(np.arange(2 * steps + 1) * length / 2)[0]
    push, monodromy = marched.inverse @ marched.h.T, np.eye(2 * n)

    def slopes(when, z):
        return np.vstack([z[n:], marched.flow @ z - push @ (stiffness[when][:, None] * (marched.h @ z[:n]))])

    for i in range(steps):  # the classical Runge-Kutta method
        z = [slopes(2 * i, monodromy)]
        z.append(slopes(2 * i + 1, monodromy + length / 2 * z[0]))
        z.append(slopes(2 * i + 1, monodromy + length / 2 * z[1]))
        z.append(slopes(2 * i + 2, monodromy + length * z[2]))
        monodromy += length / 6 * (z[0] + 2 * z[1] + 2 * z[2] + z[3])
    multipliers = np.linalg.eigvals(monodromy)
    elastic = multipliers[np.argsort(np.abs(multipliers - 1))[2:]]
    prepared = prepare_periodic(rig, gear="small", samples_per_tooth=96)
    half = prepared.healthy[:, :480]
    multiplier = floquet_multiplier(prepared.system, half, marched.revolution / 2)
    assert_allclose(multiplier, np.abs(elastic).max(), rtol=1e-6)
    if multiplier < 1:
        whole_period = prepared.floquet_multiplier([{}])
        assert_allclose(whole_period, multiplier**2, rtol=1e-3)
