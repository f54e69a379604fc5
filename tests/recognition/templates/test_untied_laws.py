"""Templates of a train, each at its own tooth: against the normal density written out, and against turned ones."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from sigdb.core.errors import NotApplicableError
from sigdb.database import Template
from sigdb.measurement import index_error_covariance
from sigdb.recognition import (
    Hypotheses,
    RecognitionSettings,
    TemplateBank,
    TemplateScores,
    evaluate,
    fuse,
    load_model,
    save_model,
    train,
)
from sigdb.recognition.estimators import registry
from sigdb.recognition.fusion.bank_laws import BankLaws
from sigdb.recognition.training import usable_rows
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
    return replace(Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE), untied=True)


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


GRID = "tooth = [1, 4, 8]\nstiffness_loss = [0.2, 0.4]"
FEW = {"specimens": 6, "healthy": 4, "snr_db": -6.0, "grid": GRID}


@pytest.fixture
def of_a_train(monkeypatch):
    """As if the rig had several meshes."""
    monkeypatch.setattr(Transmission, "turns_exactly", lambda self, gear: False)


@pytest.fixture(scope="module")
def tied(make_database):
    return make_database(**FEW)


@pytest.fixture(scope="module")
def untied(make_database):
    """The same rows, with a template for each damaged tooth, as of a train."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Transmission, "turns_exactly", lambda self, gear: False)
        return make_database(**FEW)


def few_estimators(patch):
    kept = tuple(one for one in registry.REGISTRY if one.name in ("templates", "nearest_template", "majority"))
    patch.setattr("sigdb.recognition.estimators.registry.REGISTRY", kept)


@pytest.fixture(scope="module")
def models(tied, untied):
    settings = RecognitionSettings(folds=3)
    with pytest.MonkeyPatch.context() as patch:
        few_estimators(patch)
        of_turned = train(tied, "location", settings)
        patch.setattr(Transmission, "turns_exactly", lambda self, gear: False)
        return of_turned, train(untied, "location", settings)


def test_a_train_is_judged_as_a_pair_where_both_laws_are_the_same(tied, untied, models, of_a_train, monkeypatch):
    """On a rig that turns exactly, templates of the swept teeth are those of tooth 1 turned to these teeth."""
    monkeypatch.setattr(TemplateBank, "has_continuous_severity", lambda self, teeth: False)
    rows = usable_rows(untied, "location")
    batches = [model.read(db, rows) for model, db in zip(models, (tied, untied), strict=True)]
    assert len(untied.templates()) == 7 > len(tied.templates()) == 3
    turned, own = (model.estimator.reducer.transform(batch) for model, batch in zip(models, batches, strict=True))
    swept = [0, 3, 7]
    # Turned templates spread their prior over 12 teeth, untied ones over 3.
    assert_allclose(own[:, swept], turned[:, swept] + np.log(12 / 3), rtol=1e-3, atol=0.02)
    assert np.isneginf(np.delete(own[:, :12], swept, axis=1)).all()
    of_turned, of_own = (
        batch.reduce(model.estimators["nearest_template"].reducer) for model, batch in zip(models, batches, strict=True)
    )
    at_swept = np.isin(of_turned[:, 1], [1, 4, 8])
    assert_allclose(of_own[at_swept], of_turned[at_swept], rtol=1e-3, atol=1e-5)


def test_a_train_goes_from_training_to_the_bound(untied, models, of_a_train, tmp_path):
    _, model = models
    evaluation = evaluate(model, untied)
    ours, best = evaluation.metrics["templates"], evaluation.bound
    assert not evaluation.above
    assert best["accuracy"].value > 0.5 > evaluation.metrics["majority"]["accuracy"].value
    assert ours["accuracy"].value > best["accuracy"].value - 0.15
    rows = usable_rows(untied, "location")
    batch = model.read(untied, rows)
    save_model(model, tmp_path, evaluation=evaluation, probe=batch, command="train")
    assert_array_equal(load_model(tmp_path).predict(batch), model.predict(batch))
    assert set(model.predict(batch)) <= {0, 1, 4, 8}


def test_damage_beyond_the_templates_of_its_tooth_is_noticed(untied, models, of_a_train):
    """The score is a standard normal number for the most severe template, and greater for twice its change."""
    bank, rows = models[1].estimator.bank, usable_rows(untied, "location")
    batch = models[1].read(untied, rows[(rows["tooth"] == 8) & (rows["stiffness_loss"] == 0.4)])
    (point,), (x,), scores = bank.points, batch.tsa.values(), TemplateScores(bank)
    most = (point.tooth == 8) & (point.severity[:, 0] == 0.4)
    change = point.hypotheses.signal[most] - point.hypotheses.signal[point.healthy]
    assert np.abs(scores.beyond(batch)).max() < 4
    assert scores.beyond(replace(batch, tsa={12: x + change})).min() > 5


def test_what_turns_templates_is_refused(untied, models, of_a_train):
    with pytest.raises(NotApplicableError, match="templates that are turned are those of rigs with one mesh"):
        Hypotheses.of(untied, speed_rpm=1.0, torque=1.0, teeth=12)
    with pytest.raises(NotApplicableError, match="averages are fused for rigs with one mesh"):
        fuse(untied)
    with pytest.raises(NotApplicableError, match="averages are fused for rigs with one mesh"):
        BankLaws(models[1].estimator.bank).at(1.0, 1.0, 12)
