"""Unit: training goes on without what does not apply, and stops at what is wrong."""

import pytest

from sigdb.core import InputError, NotApplicableError
from sigdb.recognition import RecognitionSettings, TemplateBank, train, training
from sigdb.recognition.estimators import registry
from sigdb.recognition.estimators.baselines.nearest_template import NearestTemplate
from sigdb.recognition.estimators.baselines.threshold import Fm4Location
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.rows.streams import reduce_averages
from sigdb.recognition.storage.skops_file import skops_bytes
from sigdb.recognition.training import usable_rows

SETTINGS = RecognitionSettings(folds=3, learner="lda")


def test_a_wrong_sensor_of_the_bank_is_an_error(database, without_boosting, monkeypatch):
    """No reason to go on without templates: the sensor's name is wrong."""
    honest = TemplateBank.of
    monkeypatch.setattr(TemplateBank, "of", lambda *args, **options: honest(*args, **options, sensor="pinion-vertikal"))
    with pytest.raises(InputError, match="pinion-vertikal") as caught:
        train(database, "location", SETTINGS)
    assert not isinstance(caught.value, NotApplicableError)


@pytest.mark.parametrize("target", ["location", "severity", "detection"])
def test_templates_refuse_further_columns_with_the_reason(database, target):
    settings = RecognitionSettings(folds=3, learner="templates", columns=("fm4", "kurtosis"))
    with pytest.raises(InputError) as caught:
        train(database, target, settings)
    assert str(caught.value) == (
        "columns = fm4, kurtosis: the learner templates compares averages with templates, which have none of them; "
        "choose one of lda, boosting, or leave the columns out"
    )


def test_a_learner_of_sigdb_is_trained_alone_without_baselines(database, without_boosting):
    alone = train(database, "location", SETTINGS, baselines=False)
    every = train(database, "location", SETTINGS)
    assert list(alone.estimators) == ["lda"] != list(every.estimators)
    assert skops_bytes(alone.estimators) == skops_bytes({"lda": every.estimator})


def raises(error):
    def method(*args, **options):
        raise error

    return method


def test_an_estimator_that_does_not_apply_is_left_out_and_a_wrong_input_is_not(database, without_boosting, monkeypatch):
    steps = []
    monkeypatch.setattr(Fm4Location, "fit", raises(NotApplicableError("too few rows")))
    assert "fm4" not in train(database, "location", SETTINGS, on_step=steps.append).estimators
    assert "fm4 is left out: too few rows" in steps
    few = "sets and intervals of 0.9 need 9 specimens; the training rows are of 4, so these hold all answers"
    assert few in steps
    monkeypatch.setattr(Fm4Location, "fit", raises(InputError("a wrong column")))
    with pytest.raises(InputError, match="a wrong column"):
        train(database, "location", SETTINGS)


def test_a_reducer_that_does_not_apply_is_left_out_and_a_wrong_input_is_not(database, location_model, monkeypatch):
    rows = Batch(table=usable_rows(database, "location")[:20])
    reducers, sensor = location_model.reducers, location_model.sensor
    monkeypatch.setattr(NearestTemplate, "transform", raises(NotApplicableError("another tooth count")))
    reduced = reduce_averages(database, rows, reducers, sensor=sensor, needed=["template_scores"]).reduced
    assert set(reducers) - set(reduced) == {"nearest_template"}
    with pytest.raises(NotApplicableError, match="another tooth count"):
        reduce_averages(database, rows, reducers, sensor=sensor)
    monkeypatch.setattr(NearestTemplate, "transform", raises(InputError("a wrong column")))
    with pytest.raises(InputError, match="a wrong column"):
        reduce_averages(database, rows, reducers, sensor=sensor, needed=["template_scores"])
    with pytest.raises(InputError, match="pinion-vertikal"):
        reduce_averages(database, rows, reducers, sensor="pinion-vertikal", needed=[])


@pytest.fixture(scope="module")
def one_severity(make_database):
    """One loss at two teeth."""
    return make_database(specimens=3, healthy=2, grid="tooth = [3, 5]\nstiffness_loss = [0.4]")


def test_severities_that_do_not_vary_are_not_learnt(one_severity):
    with pytest.raises(InputError) as caught:
        train(one_severity, "severity", SETTINGS)
    assert str(caught.value).endswith(
        ": severity cannot be learnt, since stiffness_loss, phase_shift_deg, loss_extent, friction and damaged_teeth "
        "do not vary over its damaged rows (what varies is tooth, which severity is not about); sweep one of them"
    )


@pytest.fixture
def only_rows(monkeypatch):
    """Let training see some of the rows."""

    def only(condition):
        honest = usable_rows
        monkeypatch.setattr(training, "usable_rows", lambda *arguments: honest(*arguments).query(condition))

    return only


def test_one_tooth_is_no_location(one_severity, only_rows):
    only_rows("tooth != 3")
    with pytest.raises(InputError, match="location cannot be learnt, since tooth does not vary over its damaged rows"):
        train(one_severity, "location", SETTINGS)


@pytest.mark.parametrize("target", ["location", "severity", "detection"])
@pytest.mark.parametrize(("kind", "condition"), [("healthy", "tooth > 0"), ("damaged", "tooth == 0")])
def test_rows_of_one_kind_do_not_suffice(one_severity, only_rows, target, kind, condition):
    only_rows(condition)
    with pytest.raises(InputError, match=f"has no {kind} rows to learn from"):
        train(one_severity, target, SETTINGS)


@pytest.fixture(scope="module")
def between(make_database):
    """Two teeth and four losses, between which templates hold."""
    grid = "tooth = [1, 5]\nstiffness_loss = [0.1, 0.2, 0.3, 0.4]"
    return make_database(specimens=6, healthy=4, grid=grid, snr_db=-10.0)


@pytest.mark.parametrize("target", ["location", "severity"])
def test_a_second_training_gives_the_same_bytes(between, monkeypatch, target):
    kept = tuple(one for one in registry.REGISTRY if one.name == "templates")
    monkeypatch.setattr("sigdb.recognition.estimators.registry.REGISTRY", kept)
    settings = RecognitionSettings(folds=3, learner="templates")
    first, second = (train(between, target, settings) for _ in range(2))
    assert first.estimator.template_bank.has_continuous_severity(12)
    assert skops_bytes(first.estimators) == skops_bytes(second.estimators)
