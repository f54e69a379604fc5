"""Verification: spectra over a common period, on grids of even and odd size, coarser and finer."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics import prepare_periodic
from sigdb.dynamics.period import Period
from sigdb.transmission import ToothDamage, load_transmission

GRIDS = [
    Period(samples=revolutions * refinement * n, revolutions=revolutions, passes=(n,), refinement=refinement)
    for revolutions in (1, 3)
    for refinement in (1, 2, 4)
    for n in (20, 21)
]


def wave(harmonics, samples):
    """(samples, 1) of sum over h of cos(h t + h) / (h + 1)."""
    t = 2 * np.pi * np.arange(samples) / samples
    return sum(np.cos(h * t + h) / (h + 1) for h in harmonics)[:, None]


@pytest.mark.parametrize("period", GRIDS)
def test_values_come_back_from_their_spectrum(period):
    values = wave(range((period.samples - 1) // 2 + 1), period.samples)
    assert_allclose(period.sampled(period.spectrum(values)), values, rtol=0, atol=1e-12)


@pytest.mark.parametrize("period", GRIDS)
@pytest.mark.parametrize("finer", [1.5, 2, 3, 8])
def test_a_finer_grid_has_the_same_spectrum_without_what_the_coarse_one_cannot_hold(period, finer):
    kept = range((period.samples - 1) // 2 + 1)
    F = int(finer * period.samples)
    beyond = range(period.samples // 2 + (period.samples % 2), (F - 1) // 2 + 1)
    fine = wave([*kept, *beyond], F)
    assert_allclose(period.spectrum(fine), period.spectrum(wave(kept, period.samples)), rtol=0, atol=1e-11 * F)


@pytest.mark.parametrize("period", GRIDS)
def test_a_coarser_grid_leaves_the_other_harmonics_zero(period):
    coarse = period.samples // 2
    kept = range((coarse - 1) // 2 + 1)
    found = period.sampled(period.spectrum(wave(kept, coarse)))
    assert_allclose(found, wave(kept, period.samples), rtol=0, atol=1e-12)


@pytest.mark.parametrize("period", GRIDS)
def test_the_average_is_that_of_the_revolutions_without_harmonics_beyond_it(period):
    """Harmonics of the period that are no harmonics of a revolution cancel; those above n / 2 are left out."""
    n = period.samples // (period.revolutions * period.refinement)
    values = wave(range((period.samples - 1) // 2 + 1), period.samples)
    folded = values.reshape(period.revolutions, -1).mean(axis=0)
    spectrum = np.fft.rfft(folded)[: (n + 1) // 2] / period.refinement
    assert_allclose(period.averaged(period.spectrum(values))[:, 0], np.fft.irfft(spectrum, n=n), rtol=0, atol=1e-12)


@pytest.mark.parametrize("samples_per_tooth", [24, 25])
def test_given_signals_hold_no_nyquist_harmonic(samples_per_tooth):
    state = prepare_periodic(load_transmission("nasa-spiral-bevel"), samples_per_tooth=samples_per_tooth).steady_state(
        [{1: ToothDamage(stiffness_loss=0.5, loss_extent=0.2)}]
    )[0]
    n = 12 * samples_per_tooth
    spectrum = np.fft.rfft(np.moveaxis(state.specimen_response, 1, -1))
    assert state.signals.shape == (2, n)
    if n % 2 == 0:
        assert (np.abs(spectrum[..., -1]) < 1e-12 * np.abs(spectrum).max(axis=-1)).all()
