"""The posterior of several averages against sums of their evidence, and what it owes to each of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from sigdb.diagnosis.change.change import PLACES
from sigdb.diagnosis.change.location import USUAL_LAG
from sigdb.diagnosis.machine.joint_posterior import JointPosterior

TEETH = 20


def finding(tooth=None, size=8.0, *, base=-1.0, wider=False, templates=None):
    """A finding with evidence of a pulse one lag after the first contact of a tooth."""
    evidence = np.full(PLACES * TEETH, base)
    if tooth is not None:
        near = round(PLACES * (tooth - 1 + USUAL_LAG)) + np.arange(-2, 3)
        evidence[near % evidence.size] = size
    change = SimpleNamespace(teeth=TEETH)
    return SimpleNamespace(change=change, evidence=evidence, template_evidence=templates, wider=wider)


def law_of_lag(tooth):
    """Weights of the places for the lag of a tooth."""
    off = (np.arange(PLACES * TEETH) / PLACES - USUAL_LAG - (tooth - 1) + TEETH / 2) % TEETH - TEETH / 2
    weight = norm.pdf(off, scale=np.where(off < 0, 0.75, 1.05) / 1.96)
    return weight / weight.sum()


def robust(found):
    """Density at each place: its mean over the scatter of the place, or 1 where the average says nothing."""
    scatter = norm.pdf((np.arange(-40, 41)) / PLACES, scale=0.25)
    density = np.exp(found.evidence)
    near = [np.roll(density, shift) for shift in range(-40, 41)]
    return 0.95 * np.tensordot(scatter / scatter.sum(), near, axes=1) + 0.05


def test_evidence_adds_up_at_each_place_and_the_lag_is_common():
    some = [finding(7, 3.0), finding(7, 4.0)]
    total = robust(some[0]) * robust(some[1])
    density = np.array([law_of_lag(tooth) @ total for tooth in range(1, TEETH + 1)])
    both = JointPosterior.of(some)
    none = 1 / (1 + density.mean())
    assert both.none == pytest.approx(none)
    np.testing.assert_allclose(both.teeth, none * density / TEETH, rtol=1e-6)
    assert both.none < min(JointPosterior.of([each]).none for each in some)
    assert both.candidates[0] <= 7 <= both.candidates[-1]


def test_more_averages_make_the_tooth_no_surer_than_its_lag():
    odds = law_of_lag(7) / (law_of_lag(6) + law_of_lag(7) + law_of_lag(8))
    place = round(PLACES * (6 + USUAL_LAG))
    many = JointPosterior.of([finding(7, 30.0)] * 6)
    assert many.none < 1e-20
    assert many.teeth[6] == pytest.approx(odds[place], abs=0.05)


def test_templates_lie_at_the_first_contact():
    templates = np.full(PLACES * TEETH, -1.0)
    templates[PLACES * 3] = 12.0
    assert JointPosterior.of([finding(templates=templates)]).teeth.argmax() == 3


def test_an_average_that_says_nothing_changes_nothing():
    one = JointPosterior.of([finding(7)])
    both = JointPosterior.of([finding(7), finding(base=0.0)])
    np.testing.assert_allclose(both.teeth, one.teeth, rtol=1e-9)


def test_an_average_contradicts_by_a_factor_of_20_at_most():
    one = JointPosterior.of([finding(7, 8.0)])
    both = JointPosterior.of([finding(7, 8.0), finding(base=-50.0)])
    assert np.log(both.teeth[6] / both.none) == pytest.approx(np.log(one.teeth[6] / one.none) + np.log(0.05))


def test_averages_that_are_wider_than_healthy_ones_count_as_one():
    one = JointPosterior.of([finding(7, wider=True)])
    three = JointPosterior.of([finding(7, wider=True)] * 3)
    np.testing.assert_allclose(three.teeth, one.teeth)
