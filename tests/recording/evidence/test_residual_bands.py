"""Unit: bands about mesh harmonics, their level and weight, and the energy of pulses over the turn."""

import numpy as np
import pytest

from sigdb.recording.evidence.residual_bands import PLACES, WIDTHS, ResidualBands

TEETH, REVOLUTIONS = 12, 16


def noise(seed=0, orders=80):
    stream = np.random.default_rng(seed)
    return stream.standard_normal((REVOLUTIONS, orders)) + 1j * stream.standard_normal((REVOLUTIONS, orders))


@pytest.mark.parametrize(("teeth", "offsets"), [(12, [-5, -4, -3, 3, 4, 5, 6]), (9, [-4, -3, 3, 4])])
def test_bands_leave_out_the_mesh_and_its_first_two_sidebands(teeth, offsets):
    bands = ResidualBands.of(noise(), teeth=teeth, highest=200.0)
    np.testing.assert_array_equal(bands.offsets, offsets)
    np.testing.assert_array_equal(bands.orders[1], 2 * teeth + np.array(offsets))
    assert bands.orders.max() <= 79


@pytest.mark.parametrize(("highest", "bands"), [(100.0, 6), (50.0, 3), (22.0, 1), (21.0, None)])
def test_bands_are_whole_and_lie_within_the_range(highest, bands):
    """Up to 0.85 of the highest order: six orders beyond the last harmonic are needed."""
    found = ResidualBands.of(noise(), teeth=TEETH, highest=highest)
    assert (None if found is None else len(found.orders)) == bands


def test_a_band_of_noise_has_little_weight():
    spectra = 0.01 * noise()
    spectra[:, 12 + 3 : 24 - 5] += noise(1)[0, 12 + 3 : 24 - 5]  # repeats in the first band only
    bands = ResidualBands.of(spectra, teeth=TEETH, highest=100.0)
    weight = bands.weight(spectra.mean(axis=0)[bands.orders])
    assert weight.sum() == pytest.approx(1)
    assert weight[0] > 0.5


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("place", [0, 17, 90])
def test_a_pulse_lies_at_its_place(width, place):
    """All orders in phase at one place: there the energy is (sum d)^2 / sum d^2, which no other place exceeds."""
    bands = ResidualBands.of(noise(), teeth=TEETH, highest=100.0)
    at = np.exp(-2j * np.pi * bands.orders * place / (PLACES * TEETH))
    energy = bands.energy(at, np.full(len(at), 1 / len(at)), width)
    assert energy.argmax() == place
    d = np.exp(-0.5 * (np.pi * bands.offsets * width / TEETH) ** 2)
    assert energy[place] == pytest.approx(d.sum() ** 2 / np.sum(d**2))
    assert bands.pulses(at).place == place / PLACES


def test_white_residuals_have_a_level_and_an_energy_of_one():
    """The median of an exponential law is ln 2 of its mean; a band has 7 orders, and 200 averages are taken."""
    bands = ResidualBands.of(noise(), teeth=TEETH, highest=100.0)
    stream = np.random.default_rng(2)
    white = stream.standard_normal((2, 200, *bands.orders.shape)) / np.sqrt(2)
    white = white[0] + 1j * white[1]
    assert bands.level(white).mean() == pytest.approx(1, rel=0.1)  # a median of 7 is biased by 1 / 14
    assert bands.energy(white, np.full((200, 6), 1 / 6), 0.8).mean() == pytest.approx(1, rel=0.03)


def test_the_level_is_linear_between_the_middles_of_the_bands():
    bands = ResidualBands.of(noise(), teeth=TEETH, highest=50.0)
    steps = np.repeat(np.sqrt([[1.0], [3.0], [3.0]]), len(bands.offsets), axis=1)
    level = np.log(2) * bands.level(steps)
    at = dict(zip(bands.offsets.tolist(), level[0], strict=True))
    assert (at[-5], at[6]) == (1.0, pytest.approx(2.0))
    np.testing.assert_allclose(level[2], 3.0)


def test_distances_go_around_the_circle():
    bands = ResidualBands.of(noise(), teeth=TEETH, highest=100.0)
    distance = bands.distance(11.5)
    assert (distance[0], distance[PLACES * 5], distance.max()) == (0.5, 5.5, 6.0)


def test_the_background_is_that_of_the_other_teeth_at_the_phase_of_their_impacts():
    """Each tooth has an energy of 8 at one phase of its pass and of 1 elsewhere; one tooth has 80 times as much."""
    bands = ResidualBands.of(noise(), teeth=TEETH, highest=100.0)
    energy = np.ones((TEETH, PLACES))
    energy[:, 3] = 8.0
    energy[5] *= 80
    background = bands.background(energy.ravel()).reshape(TEETH, PLACES)
    assert background[5, 0] == pytest.approx(8.0)
    assert background[0, 0] == pytest.approx((6 * 8.0 + 640.0) / 7)
