"""The law of an average in a train: each template at its own tooth, against the normal density written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from sigdb.core.errors import NotApplicableError
from sigdb.database import Template
from sigdb.measurement import index_error_covariance
from sigdb.recognition import Hypotheses, TemplateBank, bayes_bound, fuse
from sigdb.recognition.bound.untied_hypotheses import UntiedHypotheses
from sigdb.transmission import Transmission

TEETH, STEP, MATE = 4, 6, 10
N = TEETH * STEP
TOOTH = [0, 1, 3, 3]
SIZES = {"noise": 0.5, "index_error": 2e-6}


@pytest.fixture(scope="module")
def stored():
    stream = np.random.default_rng(3)
    return [
        Template(
            case={"template": i, "tooth": tooth},
            signals=stream.standard_normal((1, N)),
            specimen_response=1e5 * stream.standard_normal((1, N, TEETH)),
            harmonic_response=0.3 * stream.standard_normal((1, N, 2, 2)),
            orders=np.array([1.0, 3.0]),
            reference_variance=np.ones(1),
        )
        for i, tooth in enumerate(TOOTH)
    ]


@pytest.fixture(scope="module")
def laws(stored):
    return UntiedHypotheses.of_hypotheses(Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE))


def law(one):
    """Mean and covariance of the average, from the mark."""
    mean = one.signals[0] + one.harmonic_response[0].reshape(N, -1) @ [1, 0, 1, 0]
    response = SIZES["index_error"] * one.specimen_response[0]
    covariance = response @ index_error_covariance(TEETH, MATE) @ response.T
    return mean, SIZES["noise"] ** 2 * np.eye(N) + covariance


def test_each_template_has_its_density_at_its_own_tooth_and_none_elsewhere(stored, laws):
    x = np.random.default_rng(4).standard_normal((2, N))
    found = laws.log_likelihood(x, **SIZES)
    for k, one in enumerate(stored):
        expected = multivariate_normal.logpdf(x, *law(one))
        own = range(TEETH) if k == 0 else [TOOTH[k] - 1]
        for tooth in range(TEETH):
            if tooth in own:
                assert_allclose(found[:, k, tooth], expected, rtol=1e-10)
            else:
                assert_array_equal(found[:, k, tooth], -np.inf)


def test_drawn_averages_are_not_turned(stored, laws):
    many = 8000
    drawn = laws.draw(np.random.default_rng(5), np.full(many, 2), np.full(many, 3), **SIZES)
    mean, covariance = law(stored[2])
    assert np.abs((drawn.mean(axis=0) - mean) / np.sqrt(np.diag(covariance))).max() < 5 / np.sqrt(many)


def test_the_bound_of_a_train_takes_templates_as_they_are_and_what_turns_them_is_refused(database, monkeypatch):
    """Rows of damage at tooth 1, where turned and untied templates are the same."""
    ids = database.cases("tooth <= 1")["id"].to_numpy()
    turned = bayes_bound(database, ids, among=ids)
    monkeypatch.setattr(Transmission, "turns_exactly", lambda self, gear: False)
    untied = bayes_bound(database, ids, among=ids)
    assert_allclose(untied.losses["log_loss"], turned.losses["log_loss"], rtol=1e-6, atol=1e-9)
    with pytest.raises(NotApplicableError, match="templates that are turned are those of rigs with one mesh"):
        TemplateBank.of(database)
    with pytest.raises(NotApplicableError, match="averages are fused for rigs with one mesh"):
        fuse(database, ids)
