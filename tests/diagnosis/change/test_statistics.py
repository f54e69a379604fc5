"""The level of the other teeth: one tooth does not raise it, a band with much of it counts for less."""

import numpy as np
import pytest

from sigdb.diagnosis.change.change import PLACES, Band, Change, excess
from sigdb.diagnosis.change.statistics import NOISE_ALARMS, pulse_evidence, pulse_statistic, without_shape

Z, HARMONICS = 24, 8


def change(seed, *, levels=(1.0,) * HARMONICS, pulse=0.0, place=9.0):
    """Noise with the given levels in the bands about each mesh harmonic, and a short pulse at a tooth pass."""
    stream = np.random.default_rng(seed)
    bands = []
    for h, level in enumerate(levels, 1):
        k = np.array([k for k in range(h * Z - Z // 2, h * Z + Z // 2) if abs(k - h * Z) > 1])
        noise = stream.standard_normal((2, len(k))) / np.sqrt(2)
        event = pulse * np.exp(-2j * np.pi * k * place / Z) * np.exp(-0.5 * ((k - h * Z) * np.pi / Z * 0.8) ** 2)
        residual = np.sqrt(level) * (noise[0] + 1j * noise[1]) + event
        bands.append(Band(harmonic=h, orders=k, gain=1.0, residual=residual, deviation=np.ones(len(k))))
    return Change(teeth=Z, bands=tuple(bands), turn=0.0, likeness=1.0)


def test_the_level_of_the_other_teeth_is_that_of_the_noise():
    """The median energy of noise relative to its law has the mean 1, and grows with the noise."""
    middles = [np.mean([change(s, levels=np.full(8, level)).raw_middle for s in range(40)]) for level in (1.0, 4.0)]
    assert middles[0] == pytest.approx(1, abs=0.05)
    assert middles[1] == pytest.approx(4 * middles[0], rel=1e-9)


def test_others_are_more_than_four_passes_from_the_strongest_place():
    others = change(0, pulse=20.0, place=9.0).others.reshape(Z, PLACES)
    assert not others[6:12].any()
    assert others[14:].all()
    assert others[:4].all()


def test_a_pulse_is_as_strong_relative_to_noise_of_any_level():
    loud = change(1, levels=np.full(HARMONICS, 9.0), pulse=30.0)
    quiet = change(1, levels=np.full(HARMONICS, 1.0), pulse=10.0)
    assert pulse_statistic(loud).value.max() == pytest.approx(pulse_statistic(quiet).value.max() * 1, rel=0.1)


def test_evidence_of_noise_exceeds_its_inverse_rate_no_more_often():
    """At one place, since the mean of the density ratio is 1 there (Markov's inequality); at levels of any band."""
    found = np.array([pulse_evidence(change(s, levels=(1.0, 4.0) * 4))[::PLACES] for s in range(150)]).ravel()
    for rate in (0.2, 0.05, 0.01):
        assert np.mean(found > -np.log(rate)) <= rate
    assert np.mean(found > np.log(NOISE_ALARMS) / 2) > 0.5


def test_evidence_of_a_pulse_grows_with_it_at_its_place():
    found = [pulse_evidence(change(3, pulse=size, place=9.0)) for size in (0.0, 3.0, 6.0)]
    assert [each.argmax() / PLACES for each in found[1:]] == pytest.approx([9.0, 9.0], abs=0.25)
    assert found[0].max() < found[1].max() < found[2].max()


def test_the_excess_of_a_band_is_the_energy_of_its_noise():
    """Over the noise of forty averages; a level below that of noise counts as noise."""
    levels = (25.0, 1.0, 4.0, 0.1, 1.0, 1.0, 9.0, 1.0)
    found = np.mean([excess(each, each.others) for each in (change(s, levels=levels) for s in range(40))], axis=0)
    assert found[[0, 2, 6]] == pytest.approx([25, 4, 9], rel=0.15)
    assert found[3] == 1
    assert np.all(found[[1, 4, 5, 7]] < 1.25)


def test_a_shape_is_taken_out_with_an_amplitude_that_is_free_in_each_band():
    """What is left is orthogonal to the shape; a change that is nothing but the shape leaves nothing."""
    stream = np.random.default_rng(0)
    empty = change(0, levels=np.zeros(HARMONICS))
    shape = [stream.standard_normal(len(band.orders)) + 0j for band in empty.bands]
    place = 40
    turned = [
        part * np.exp(-2j * np.pi * band.orders * place / (PLACES * Z))
        for part, band in zip(shape, empty.bands, strict=True)
    ]
    amplitudes = stream.standard_normal(HARMONICS) + 1j * stream.standard_normal(HARMONICS)
    noisy = change(5)
    for base in (empty, noisy):
        with_shape = Change(
            teeth=Z,
            bands=tuple(
                Band(harmonic=b.harmonic, orders=b.orders, gain=1.0, residual=b.residual + a * t, deviation=b.deviation)
                for b, a, t in zip(base.bands, amplitudes, turned, strict=True)
            ),
            turn=0.0,
            likeness=1.0,
        )
        rest = without_shape(with_shape, shape, place)
        assert all(abs(np.vdot(t, band.residual)) < 1e-9 for t, band in zip(turned, rest.bands, strict=True))
    assert all(np.abs(band.residual).max() > 0.1 for band in rest.bands)
