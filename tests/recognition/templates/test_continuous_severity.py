"""Verification: posteriors over severities between templates, against the density integrated on a fine grid.

The signals are linear in both sizes, so that interpolation is exact, and the reference density is written out with the
inverse covariance.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import logsumexp

from sigdb.recognition.laws.turned_laws import TurnedLaws
from sigdb.recognition.templates.continuous_severity import ContinuousSeverity, TemplateDistances
from sigdb.recognition.templates.severity_grid import severity_grids, severity_interpolation, severity_weights

TEETH, N, INDEX_ERROR = 4, 24, 2.0
LOSSES, SHIFTS, COUNTS = (0.0, 0.1, 0.4), (0.0, 1.0, 3.0), (1.0, 2.0)


def severities():
    rows = [(loss, shift, count) for count in COUNTS for loss in LOSSES for shift in SHIFTS if loss or shift]
    return np.array([(0.0, 0.0, 0.0), *rows])


class Law:
    """Signals that are linear in loss and shift, of two counts, with modes that all templates share."""

    def __init__(self, gains=(0.0, 0.0)):
        stream = np.random.default_rng(8)
        self.healthy = np.tile(stream.standard_normal(N // TEETH), TEETH)  # the same from every tooth, as its modes
        self.along = {count: stream.standard_normal((2, N)) * [[8.0], [1.0]] for count in COUNTS}
        self.modes = np.linalg.qr(np.tile(stream.standard_normal((N // TEETH, 2)), (TEETH, 1)))[0]
        self.gains = np.array(gains)

    def signal(self, loss, shift, count):
        return self.healthy + np.array([loss, shift]) @ self.along.get(count, np.zeros((2, N)))

    def laws(self):
        signals = np.array([self.signal(*row) for row in severities()])
        k = len(signals)
        return TurnedLaws(
            teeth=TEETH,
            healthy=severities()[:, 2] == 0,
            modes=np.repeat(self.modes[None], k, axis=0),
            gains=np.repeat(self.gains[None], k, axis=0),
            carriers=signals[:, None, None],
            phases=np.ones((k, 1, 1)),
        )

    def continuous(self):
        healthy = severities()[:, 2] == 0
        share = np.where(severities()[:, 2] == 2, 0.5, 0.25) * ~healthy
        return ContinuousSeverity(severity_grids(severities(), healthy), healthy, share)

    def inverse(self, noise):
        covariance = noise**2 * np.eye(N) + INDEX_ERROR**2 * (self.modes * self.gains**2) @ self.modes.T
        return np.linalg.inv(covariance)

    def density(self, x, noise, losses, shifts):
        """(counts, losses, shifts, teeth) of the logarithm of the density times the shares, one average."""
        inverse = self.inverse(noise)
        sizes = np.stack(np.meshgrid(losses, shifts, indexing="ij"), axis=-1)
        mean = self.healthy + np.stack([sizes @ self.along[count] for count in COUNTS])
        turned = np.array([np.roll(x, -turn * N // TEETH) for turn in range(TEETH)])
        away = turned - mean[..., None, :]
        exponent = -0.5 * np.einsum("...n,nm,...m->...", away, inverse, away, optimize=True)
        constant = 0.5 * np.linalg.slogdet(inverse / (2 * np.pi))[1]
        return exponent + constant + np.log([1 / 3, 2 / 3])[:, None, None, None]


@pytest.mark.parametrize("gains", [(0.0, 0.0), (1.0, 0.5)])
@pytest.mark.parametrize(("noise", "true"), [(0.3, (0.3, 0.6, 1.0)), (1.0, (0.05, 2.0, 2.0)), (4.0, (0.2, 1.0, 1.0))])
def test_posteriors_are_those_of_the_integrated_density(gains, noise, true):
    law = Law(gains)
    x = law.signal(*true) + noise * np.random.default_rng(3).standard_normal(N)
    x = np.roll(x, 2 * N // TEETH)[None]
    likelihood = law.laws().log_likelihood(x, noise=noise, index_error=INDEX_ERROR)
    continuous = law.continuous()
    distances = [
        TemplateDistances(law.laws(), templates).at(noise=np.array([noise]), index_error=INDEX_ERROR)
        for templates in continuous.templates
    ]
    ((at, evidence, posterior),) = continuous.marginals(likelihood, distances)
    assert at.tolist() == [0]
    losses, shifts = (np.linspace(ends[0], ends[-1], 101) + 0.5 * ends[-1] / 100 for ends in (LOSSES, SHIFTS))
    losses, shifts = losses[:-1], shifts[:-1]  # the middles of equal steps
    log = law.density(x[0], noise, losses, shifts)
    of_teeth = logsumexp(log, axis=(0, 1, 2)) - np.log(100**2)
    likely = of_teeth > of_teeth.max() - 10
    np.testing.assert_allclose(evidence[0, likely], of_teeth[likely], atol=0.02)
    density = np.exp(logsumexp(log, axis=3) - log.max())
    density /= density.sum()
    mass = [density.sum(axis=tuple(j for j in range(3) if j != i)) for i in (1, 2, 0)]
    axes = (losses, shifts, np.array(COUNTS))
    mean = [one @ axis for one, axis in zip(mass, axes, strict=True)]
    spread = [np.sqrt(one @ (axis - m) ** 2) for one, axis, m in zip(mass, axes, mean, strict=True)]
    median = [axis[np.searchsorted(np.cumsum(one), 0.5)] for one, axis in zip(mass, axes, strict=True)]
    unit = np.array([0.4, 3.0, 1.0])
    np.testing.assert_allclose(posterior.mean()[0] / unit, np.array(mean) / unit, atol=0.006)
    np.testing.assert_allclose(posterior.spread()[0] / unit, np.array(spread) / unit, atol=0.006)
    np.testing.assert_allclose(posterior.quantile(0.5)[0] / unit, np.array(median) / unit, atol=0.02)


def test_the_location_needs_no_marginals():
    """The density of each tooth is the same with and without the marginals of severities, row by row and in blocks."""
    law, noise = Law((1.0, 0.5)), np.geomspace(0.05, 8.0, 40)
    x = law.signal(0.2, 1.0, 1.0) + noise[:, None] * np.random.default_rng(5).standard_normal((40, N))
    likelihood = law.laws().log_likelihood(x, noise=noise, index_error=INDEX_ERROR)
    continuous = law.continuous()
    distances = [
        TemplateDistances(law.laws(), templates).at(noise=noise, index_error=INDEX_ERROR)
        for templates in continuous.templates
    ]
    evidence = continuous.evidence(likelihood, distances)
    places = []
    for at, of_teeth, _ in continuous.marginals(likelihood, distances):
        np.testing.assert_allclose(of_teeth, evidence[at])
        places += at.tolist()
    assert sorted(places) == list(range(40))


def test_distances_of_templates_are_under_the_mean_of_their_inverse_covariances():
    stream = np.random.default_rng(6)
    modes = np.linalg.qr(stream.standard_normal((3, N, 2)))[0]
    laws = replace(Law((1.0, 0.5)).laws(), modes=np.concatenate([modes, Law().laws().modes[3:]]))
    found = TemplateDistances(laws, np.array([0, 1, 2])).at(noise=np.array([0.7]), index_error=INDEX_ERROR)[0]
    inverses = [
        np.linalg.inv(0.7**2 * np.eye(N) + INDEX_ERROR**2 * (each * laws.gains[0] ** 2) @ each.T) for each in modes
    ]
    signals = laws.carriers[:3, 0, 0]
    expected = [
        (signals[j] - signals[k]) @ (inverses[j] + inverses[k]) @ (signals[j] - signals[k]) / 2
        for j, k in [(0, 1), (0, 2), (1, 2)]
    ]
    np.testing.assert_allclose(found, expected)


def test_a_common_basis_leaves_out_no_more_than_its_precision_allows():
    """Signals of three shapes with traces of others: the coarse basis has three, and the likelihood hardly changes."""
    stream, precise = np.random.default_rng(9), Law((1.0, 0.5)).laws()
    shapes = np.linalg.qr(stream.standard_normal((N, 3)))[0].T
    carriers = stream.standard_normal((len(precise.carriers), 3)) @ shapes
    carriers += 1e-6 * stream.standard_normal(carriers.shape)
    precise = replace(precise, carriers=carriers[:, None, None], modes=np.repeat(shapes[:2].T[None], len(carriers), 0))
    coarse = replace(precise, precision=1e-3)
    assert (len(precise._basis), len(coarse._basis)) == (len(carriers) + 2, 3)
    x = carriers[:4] + 0.1 * stream.standard_normal((4, N))
    some, others = (law.log_likelihood(x, noise=0.1, index_error=INDEX_ERROR) for law in (precise, coarse))
    np.testing.assert_allclose(some, others, atol=1e-3)
    assert not np.array_equal(some, others)


def test_severities_without_a_full_grid_are_those_of_the_templates_alone():
    healthy = severities()[:, 2] == 0
    assert [grid.places.shape for grid in severity_grids(severities(), healthy)] == [(3, 3), (3, 3)]
    assert severity_grids(severities()[:-1], healthy[:-1]) == []
    twice = np.vstack([severities(), severities()[-1:]])
    assert severity_grids(twice, np.append(healthy, False)) == []


@pytest.mark.parametrize("levels", [(0.0, 0.5, 1.0), (0.0, 0.2, 0.5, 1.0), tuple(np.linspace(0, 1, 6))])
def test_the_stated_error_is_that_of_a_smooth_signal_or_a_little_more(levels):
    """The error stated for exp(1.5 a) and a sine is the greatest that 400 severities between the levels show."""
    shape = np.random.default_rng(1).standard_normal((2, 16))

    def signal(a):
        return np.stack([np.exp(1.5 * a), np.sin(2 * a)], axis=-1) @ shape

    severity = np.array([(0.0, 0.0, 0.0), *((level, 0.0, 1.0) for level in levels[1:])])
    healthy = severity[:, 2] == 0
    (grid,) = severity_grids(severity, healthy)
    at = np.linspace(0, 1, 400)
    away = severity_weights(grid.levels, at, np.zeros(1)) @ signal(np.array(levels)) - signal(at)
    true = np.linalg.norm(away, axis=1).max()
    between = severity_interpolation(4, [severity], [healthy], [signal(severity[:, 0])], noise=1.0)
    assert true < between.error < 6 * true


def test_two_severities_show_nothing_of_what_lies_between():
    severity = np.array([(0.2, 1.0, 1.0), (0.4, 1.0, 1.0), (0.0, 0.0, 0.0)])
    between = severity_interpolation(4, [severity], [severity[:, 2] == 0], [np.eye(3)], noise=1.0)
    assert not between.holds
    assert pd.isna(between.error) or np.isinf(between.error)
