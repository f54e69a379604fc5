"""Laws with nuisances against normal densities with dense covariances."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from sigdb.measurement import NuisanceMixture, NuisancePart
from sigdb.recognition.laws.mixture_laws import MixtureLaws, Nuisances
from sigdb.recognition.laws.turned_laws import TurnedLaws

TEETH, SAMPLES, TEMPLATES = 4, 32, 3
PARTS = (
    NuisancePart(0.5),
    NuisancePart(0.2, nuisances=(0,), size=1.0),
    NuisancePart(0.2, nuisances=(1,), size=0.3),
    NuisancePart(0.1, nuisances=(0, 1), size=1.0),
)


@pytest.fixture
def draws():
    return np.random.default_rng(7)


def laws_of(draws, carriers):
    """Laws without nuisances, with the responses to index errors and the nuisances of 1 and of 2 modes."""
    signals = draws.standard_normal((TEMPLATES, *carriers, SAMPLES))
    errors = 0.4 * draws.standard_normal((TEMPLATES, SAMPLES, 2))
    modes, gains, _ = np.linalg.svd(errors, full_matrices=False)
    phases = np.ones((TEMPLATES, carriers[1], 1))
    healthy = np.array([False, True, False])
    laws = TurnedLaws(teeth=TEETH, healthy=healthy, modes=modes, gains=gains, carriers=signals, phases=phases)
    columns = 0.6 * draws.standard_normal((TEMPLATES, SAMPLES, 3))
    return laws, errors, Nuisances(modes=columns, counts=(1, 2), mixture=NuisanceMixture(parts=PARTS))


@pytest.mark.parametrize("carriers", [(1, 1), (3, 1), (2, 2)])
@pytest.mark.parametrize("noise", [0.01, 0.5, 20.0])
def test_the_density_is_that_of_dense_covariances(draws, carriers, noise):
    laws, errors, nuisances = laws_of(draws, carriers)
    coefficients = draws.standard_normal((5, *carriers))
    means = np.einsum("rab,kabn->rkn", coefficients, laws.carriers)
    x = means[:, 0] + 0.3 * draws.standard_normal((5, SAMPLES))
    mixture = MixtureLaws.of(laws, errors, nuisances, means[0])
    found = mixture.log_likelihood(x, noise=noise, index_error=1.0, coefficients=coefficients)
    factors = nuisances.mixture.factors(nuisances.counts)
    for row, template, turn in np.ndindex(found.shape):
        if laws.healthy[template] and turn:
            continue
        back = np.roll(x[row], -turn * SAMPLES // TEETH)
        each = []
        for part, factor in zip(PARTS, factors, strict=True):
            columns = np.hstack([errors[template], nuisances.modes[template] * factor])
            covariance = noise**2 * np.eye(SAMPLES) + columns @ columns.T
            each.append(np.log(part.weight) + multivariate_normal.logpdf(back, means[row, template], covariance))
        assert_allclose(found[row, template, turn], logsumexp(each), rtol=1e-6, atol=1e-6)


def test_modes_along_a_basis_have_the_covariance_of_the_nuisances(draws):
    laws, errors, nuisances = laws_of(draws, (2, 2))
    mixture = MixtureLaws.of(laws, errors, nuisances, laws.carriers[:, 0, 0])
    x, amplitudes = draws.standard_normal((6, SAMPLES)), draws.standard_normal(mixture.parts[3].gains.shape)
    for part, factor in zip(mixture.parts, nuisances.mixture.factors(nuisances.counts), strict=True):
        for k in range(TEMPLATES):
            columns = np.hstack([errors[k], nuisances.modes[k] * factor])
            modes = part.modes_of(k) * part.gains[k]
            assert_allclose(modes @ modes.T, columns @ columns.T, rtol=0, atol=1e-12)
            assert_allclose(part.along_modes(k, x) * part.gains[k], x @ modes, rtol=0, atol=1e-12)
    last = mixture.parts[3]
    assert_allclose(last.sum_of_modes(1, amplitudes), amplitudes @ last.modes_of(1).T, rtol=0, atol=1e-12)


def test_a_law_of_one_part_without_modes_is_that_without_nuisances(draws):
    laws, errors, nuisances = laws_of(draws, (1, 1))
    alone = Nuisances(modes=nuisances.modes, counts=(1, 2), mixture=NuisanceMixture(parts=(NuisancePart(1.0),)))
    x = draws.standard_normal((4, SAMPLES))
    mixture = MixtureLaws.of(laws, errors, alone, laws.carriers[:, 0, 0])
    found = mixture.log_likelihood(x, noise=0.7, index_error=1.0)
    assert_allclose(found, laws.log_likelihood(x, noise=0.7, index_error=1.0), rtol=1e-9)
