"""Two averages of one gear: what the healthy one and a pulse leave, against least squares at each place."""

from dataclasses import dataclass

import numpy as np
import pytest

from sigdb.diagnosis.change.change import orders_of_bands
from sigdb.diagnosis.change.statistics import WIDTHS, left_by_damage

TEETH, N = 12, 384


@dataclass
class Spectrum:
    """Mean and variance of an average; the turn is that of the shift theorem."""

    mean: np.ndarray
    variance: np.ndarray
    teeth: int = TEETH
    samples: int = N
    highest_order: float = N / 2

    def turned(self, turn):
        return Spectrum(self.mean * np.exp(2j * np.pi * np.arange(len(self.mean)) * turn), self.variance)


@pytest.fixture
def pair():
    """Spectra of a healthy gear and of one with more noise and a pulse at a third of the turn."""
    stream, k = np.random.default_rng(4), np.arange(N // 2 + 1)
    first, second = stream.normal(size=(2, k.size)) + 1j * stream.normal(size=(2, k.size))
    healthy, variance = 3 * first, stream.uniform(0.5, 2, size=k.size)
    run = (0.5 - 1j) * healthy + np.sqrt(variance / 2) * second + 5 * np.exp(-2j * np.pi * k / 3)
    return Spectrum(run, variance), Spectrum(healthy, 0 * variance)


def test_it_is_the_least_of_the_fits_at_each_place_and_width(pair):
    run, healthy = pair
    bands, turn = orders_of_bands(TEETH, N, 0.9 * N / 2), 0.01
    H = healthy.turned(turn).mean
    fits = []
    for width in WIDTHS:
        for place in np.arange(8 * TEETH) / (8 * TEETH):
            left = 0.0
            for h, k in bands:
                s = np.sqrt(run.variance[k])
                pulse = np.exp(-0.5 * ((k - h * TEETH) * np.pi / TEETH * width) ** 2 - 2j * np.pi * k * place)
                A = np.stack([H[k], pulse], axis=1) / s[:, None]
                amplitudes = np.linalg.lstsq(A, run.mean[k] / s, rcond=None)[0]
                left += np.sum(np.abs(run.mean[k] / s - A @ amplitudes) ** 2)
            fits.append(left / sum(len(k) - 2 for _, k in bands))
    assert left_by_damage(run, healthy, turn=turn) == pytest.approx(min(fits), rel=1e-9)
