"""Verification: the error that a periodic solution states against its true one, its fall with the grid, hard cases.

The true error is the difference from a solution on a grid many times finer, of which the harmonics are taken that the
samples given out can hold.
"""

import importlib
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import SigdbError
from sigdb.dynamics import prepare_periodic
from sigdb.dynamics.periodic import periodic
from sigdb.transmission import ToothDamage, Transmission, load_transmission

PREPARE = importlib.import_module("sigdb.dynamics.periodic.prepare")
RIGS = ("nasa-spiral-bevel", "spur-test-rig", "chaari-8dof", "luo-10dof")
DAMAGES = {
    "healthy": {},
    "loss": {2: ToothDamage(stiffness_loss=0.5)},
    "pitted": {1: ToothDamage(stiffness_loss=0.5, loss_extent=0.2)},
    "shift-and-loss": {3: ToothDamage(phase_shift_deg=2.0, stiffness_loss=0.2)},
    "rubbing": {1: ToothDamage(stiffness_loss=0.5, loss_extent=0.6, friction=0.1)},
    "all-lost": {1: ToothDamage(stiffness_loss=1.0)},
    "half-a-pass-early": {1: ToothDamage(phase_shift_deg=-7.0)},
}


def true_error(state, fine):
    """Greatest error of a sensor as a fraction of its peak-to-peak."""
    n = state.signals.shape[1]
    exact = np.fft.irfft(np.fft.rfft(fine.signals)[:, : (n + 1) // 2] * (n / fine.signals.shape[1]), n=n)
    return (np.abs(state.signals - exact).max(axis=1) / np.ptp(exact, axis=1)).max()


def solved(rig, damage, samples_per_tooth, **more):
    return prepare_periodic(rig, samples_per_tooth=samples_per_tooth, **more).steady_state([damage], specimens=False)[0]


@pytest.fixture(scope="module", params=RIGS)
def filed(request):
    """A rig, prepared as usual, and its state by the name of a damage on a fine grid."""
    rig = load_transmission(request.param)
    fine = prepare_periodic(rig, samples_per_tooth=256)
    return rig, prepare_periodic(rig), cache(lambda name: fine.steady_state([DAMAGES[name]], specimens=False)[0])


@pytest.mark.parametrize("name", DAMAGES)
def test_the_usual_grid_is_good_to_1e_4_and_says_how_good(filed, name):
    _, usual, on_fine_grid = filed
    state = usual.steady_state([DAMAGES[name]], specimens=False)[0]
    reference = on_fine_grid(name)
    error = true_error(state, reference)
    assert error < 1e-4
    assert error / 3 < state.error + reference.error or error < 1e-6
    # Where alias was taken out, what is left of it is stated for the worst of outputs.
    assert state.error < 10 * max(error, 1e-6)


@pytest.mark.parametrize("samples_per_tooth", [16, 17, 33])
def test_few_samples_are_nearly_as_good_or_say_so(filed, samples_per_tooth):
    """The internal grid is finer where it must be, and alias is taken out; what is stated holds within a factor."""
    rig, _, on_fine_grid = filed
    prepared = prepare_periodic(rig, samples_per_tooth=samples_per_tooth)
    for name, damage in DAMAGES.items():
        state = prepared.steady_state([damage], specimens=False)[0]
        error = true_error(state, on_fine_grid(name))
        assert error < max(1e-4, 3 * state.error)


def test_the_healthy_estimate_is_the_error_itself():
    """One term of the series of corrections, so right to the ratio of the next term to it."""
    rig = load_transmission("chaari-8dof")
    fine = solved(rig, {}, 256)
    for samples_per_tooth in (24, 33, 64):
        state = solved(rig, {}, samples_per_tooth)
        assert_allclose(state.error, true_error(state, fine), rtol=0.1)


def rate(rig, damage, grids, monkeypatch):
    """Exponent p of an error that falls as N^-p, fitted over grids, none of them refined and no alias taken out."""
    fine = solved(rig, damage, 384)
    for module in (PREPARE, periodic):
        monkeypatch.setattr(module, "TOLERANCE", 1.0)
    errors = [true_error(solved(rig, damage, n), fine) for n in grids]
    return -np.polyfit(np.log(grids), np.log(errors), 1)[0]


def test_alias_of_a_damage_falls_with_the_third_power_of_the_samples(monkeypatch):
    """Raised cosines have a jump in their second derivative: coefficients, and so their alias, fall as h^-3.

    A displacement or velocity falls at least as 1 / h itself, so the lowest harmonics decide.
    """
    rig = load_transmission("nasa-spiral-bevel")
    assert 2.6 < rate(rig, DAMAGES["loss"], (32, 48, 64, 96, 128), monkeypatch) < 3.6


def test_in_a_gears_acceleration_the_alias_falls_with_the_second_power(monkeypatch):
    """The receptance of a mass's acceleration does not fall: N harmonics each have an alias of N^-3."""
    rig = load_transmission("chaari-8dof")
    assert 1.6 < rate(rig, DAMAGES["loss"], (48, 64, 96, 128), monkeypatch) < 2.5


def test_the_healthy_error_falls_with_the_fifth_power_at_least(monkeypatch):
    """What is cut off beyond K: forces of K^-3, which move the mesh by K^-5 and come back."""
    rig = load_transmission("chaari-8dof")
    assert rate(rig, {}, (48, 64, 96, 128), monkeypatch) > 4.5


@pytest.mark.parametrize("name", ["nasa-spiral-bevel", "spur-test-rig"])
def test_without_specimens_the_signals_are_the_same(name):
    prepared = prepare_periodic(load_transmission(name).replace({"pinion.unbalance": 1e-4}), samples_per_tooth=32)
    for damage in DAMAGES.values():
        whole, nominal = (prepared.steady_state([damage], specimens=one)[0] for one in (True, False))
        assert nominal.specimen_response.shape[2] == nominal.compression_response.shape[1] == 0
        for field in ("signals", "compression", "harmonic_response", "compression_harmonic"):
            expected = getattr(whole, field)
            # Another number of columns lets the iteration that takes alias out end at the same place by other sums.
            assert_allclose(getattr(nominal, field), expected, rtol=0, atol=1e-11 * np.abs(expected).max())
        assert_allclose([nominal.error, nominal.least_elsewhere], [whole.error, whole.least_elsewhere], rtol=1e-6)


def five_teeth():
    """A pinion of 5 teeth with 2.2 pairs in contact on the average."""
    data = load_transmission("chaari-8dof").model_dump()
    first, second = data["gears"]
    data["gears"][first]["teeth"], data["gears"][second]["teeth"] = 5, 10
    mesh = next(iter(data["meshes"].values()))
    mesh["profile"] = {"contact_ratio": 2.6, "flank": 0.4}
    return Transmission.model_validate(data)


HARD = {
    "all-five-teeth-rubbing": (
        five_teeth,
        dict.fromkeys(range(1, 6), ToothDamage(stiffness_loss=0.3, phase_shift_deg=10.0, friction=0.2)),
    ),
    "two-of-five-teeth": (five_teeth, {5: ToothDamage(stiffness_loss=1.0), 1: ToothDamage(phase_shift_deg=-36.0)}),
    "half-a-pass-late": (lambda: load_transmission("nasa-spiral-bevel"), {12: ToothDamage(phase_shift_deg=15.0)}),
    "sharp-flank": (
        lambda: load_transmission("nasa-spiral-bevel").replace({"main.profile.flank": 0.02}),
        {4: ToothDamage(stiffness_loss=0.5)},
    ),
}


TOO_COARSE = [("two-of-five-teeth", 16), ("two-of-five-teeth", 17)]


@pytest.mark.parametrize("name", HARD)
def test_hard_cases_are_solved_or_say_how_wrong_they_are(name):
    make, damage = HARD[name]
    rig = make()
    fine = solved(rig, damage, 256)
    for samples_per_tooth in (16, 17, 33, 64):
        if (name, samples_per_tooth) not in TOO_COARSE:
            state = solved(rig, damage, samples_per_tooth)
            assert np.isfinite(state.signals).all()
            assert true_error(state, fine) < max(1e-4, 2.5 * state.error)


@pytest.mark.parametrize(("name", "samples_per_tooth"), TOO_COARSE)
def test_alias_that_cannot_be_taken_out_is_refused(name, samples_per_tooth):
    make, damage = HARD[name]
    with pytest.raises(SigdbError, match=r"samples a tooth are too few for this damage: .*give more samples_per_tooth"):
        solved(make(), damage, samples_per_tooth)


def test_sharp_flanks_refine_the_grid_and_not_what_is_given_out():
    rig = HARD["sharp-flank"][0]()
    prepared = prepare_periodic(rig, samples_per_tooth=16)
    assert prepared.period.refinement > 1
    assert prepared.period.samples == 192 * prepared.period.refinement
    assert prepared.steady_state([{}])[0].signals.shape == (2, 192)
    assert prepared.steady_state([{}])[0].compression.shape == (192,)
