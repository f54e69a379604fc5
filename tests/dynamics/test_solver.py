"""Unit: solvers share one seam: cases of damage at once, failures as data, a name in a recipe."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core import InputError, NotApplicableError, SigdbError
from sigdb.dynamics import (
    SOLVERS,
    Periodic,
    PeriodicOrTransient,
    Prepared,
    Solver,
    SteadyState,
    Transient,
    simulate,
    solver_named,
    superpose,
)
from sigdb.transmission import Damage, ToothDamage, load_transmission

LOSS, SHIFT = {6: ToothDamage(stiffness_loss=0.4)}, {2: ToothDamage(phase_shift_deg=3.0, friction=0.1)}
LOST = {6: ToothDamage(stiffness_loss=0.9)}
ARRAYS = ("signals", "specimen_response", "harmonic_response", "compression", "mesh_force", "error", "least_elsewhere")


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def prepared(rig):
    return Periodic(samples_per_tooth=32).prepare(rig.replace({"pinion.unbalance": 1e-4}))


def march(samples_per_tooth=16):
    return Transient(samples_per_tooth=samples_per_tooth, steps_per_tooth=4 * samples_per_tooth)


def test_cases_solved_together_are_bit_for_bit_those_solved_one_at_a_time(prepared):
    damages = [{}, LOSS, SHIFT]
    together = prepared.steady_state(damages)
    assert len(together) == 3
    assert together.signals.shape == (3, 2, 384)
    for i, damage in enumerate(damages):
        alone = prepared.steady_state([damage])[0]
        for name in ARRAYS:
            assert_array_equal(getattr(together[i], name), getattr(alone, name))
            assert_array_equal(getattr(together, name)[i], getattr(alone, name))


def test_signals_of_several_specimens_are_those_of_each(prepared):
    states = prepared.steady_state([LOSS, SHIFT])
    errors = np.random.default_rng(0).normal(0, 2e-6, (5, 12))
    angle = 2 * np.pi * np.arange(5) / 12
    phases = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
    signals, least = states.signals_at(errors, phases), states.least_compression_at(errors, phases)
    assert signals.shape == (5, 2, 2, 384)
    for row in range(5):
        one = states[1].signals_at(errors[row], phases[row])
        np.testing.assert_allclose(signals[row, 1], one, rtol=0, atol=1e-12 * np.abs(one).max())
        assert least[row, 1] == pytest.approx(float(states[1].least_compression_at(errors[row], phases[row])))
    assert_array_equal(states.signals_at(np.zeros(12)), states.signals_at())
    explicit = states[0].signals + states[0].specimen_response @ errors[0] + states[0].harmonic_response[..., 0].sum(-1)
    assert_array_equal(states[0].signals_at(errors[0]), explicit)


def test_superpose_without_errors_or_harmonics_is_the_response_itself():
    values = np.arange(6.0).reshape(2, 3)
    assert_array_equal(superpose(values, np.ones((2, 3, 4)), np.ones((2, 3, 0, 2))), values)


@pytest.mark.parametrize("name", SOLVERS)
def test_every_named_solver_fulfils_the_seam(rig, name):
    solver = solver_named(name, 16)
    prepared = solver.prepare(rig, "pinion")
    assert isinstance(solver, Solver)
    assert (prepared.gear, prepared.teeth) == ("pinion", 12)
    states = prepared.steady_state([LOSS])
    assert isinstance(states, SteadyState)
    assert states.signals.shape == (1, 2, 192)
    assert states.specimen_response.shape == (1, 2, 192, 12)
    assert states.failures == (None,)
    assert prepared.healthy_signals().shape == (2, 192)
    assert 0 < prepared.floquet_multiplier([{}, LOSS]) < 1
    assert states.is_linear[0] == solver.serves_all_specimens


def test_only_the_case_that_loses_contact_is_marched(rig):
    solver = PeriodicOrTransient(transient=march())
    states = solver.prepare(rig).steady_state([LOSS, LOST])
    assert states.is_linear.tolist() == [True, False]
    assert states.contact_loss.tolist() == [False, True]
    linear = Periodic(samples_per_tooth=16).prepare(rig).steady_state([LOSS, LOST])
    marched = march().prepare(rig).steady_state([LOST])
    assert_array_equal(states[0].signals, linear[0].signals)
    assert_array_equal(states[1].signals, marched[0].signals)
    assert not states[1].specimen_response.any()
    assert linear.contact_loss.tolist() == [False, True]


def test_simulate_takes_the_solver_that_marches_where_contact_is_lost(rig):
    damage = Damage(tooth=6, stiffness_loss=0.9)
    response = simulate(rig, damage, solver=PeriodicOrTransient(transient=march()))
    marched = simulate(rig, damage, solver=march())
    assert response.contact_loss
    assert_array_equal(response.signal("pinion-vertical"), marched.signal("pinion-vertical"))
    assert response.min_compression == marched.min_compression < 0


def test_a_case_that_fails_leaves_the_others_and_is_raised_when_it_is_taken(rig):
    solver = PeriodicOrTransient(
        transient=Transient(samples_per_tooth=16, steps_per_tooth=64, most_revolutions=2, tolerance=1e-9)
    )
    states = solver.prepare(rig).steady_state([LOSS, LOST])
    assert states.failures[0] is None
    assert states[0].signals.shape == (2, 192)
    assert states.min_compression[1] < 0
    with pytest.raises(SigdbError, match="does not repeat"):
        states[1]
    # Only the linear solution is known, and it does not hold.
    assert states.case(1).contact_loss


def test_another_solver_is_one_class(rig):
    """``simulate`` asks for nothing but the seam."""

    class Still:
        serves_all_specimens = True

        def prepare(self, rig, gear=None, *, system=None) -> Prepared:
            return Periodic(samples_per_tooth=16).prepare(rig.replace({"operating.torque": 1.0}), gear)

    quiet = simulate(rig, solver=Still()).signal("pinion-vertical")
    usual = simulate(rig, solver=Periodic(samples_per_tooth=16)).signal("pinion-vertical")
    np.testing.assert_allclose(quiet * 356.05, usual, rtol=1e-6, atol=1e-9)


def test_what_is_no_solver_is_refused(rig):
    with pytest.raises(InputError, match="'periodic' is no solver"):
        simulate(rig, solver="periodic")
    with pytest.raises(InputError, match="did you mean 'periodic'"):
        solver_named("periodical", 32)
    assert not issubclass(InputError, NotApplicableError)
