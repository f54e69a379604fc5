"""Unit: training goes on without what does not apply, and stops at what is wrong."""

import pytest

from sigdb.core import InputError, NotApplicableError
from sigdb.recognition import RecognitionSettings, TemplateBank, train
from sigdb.recognition.estimators.baselines.nearest_template import NearestTemplate
from sigdb.recognition.estimators.baselines.threshold import Fm4Location
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.rows.streams import reduce_averages
from sigdb.recognition.training import usable_rows

SETTINGS = RecognitionSettings(folds=3, learner="lda")


def test_a_wrong_sensor_of_the_bank_is_an_error(database, without_boosting, monkeypatch):
    """No reason to go on without templates: the sensor's name is wrong."""
    honest = TemplateBank.of
    monkeypatch.setattr(TemplateBank, "of", lambda *args, **options: honest(*args, **options, sensor="pinion-vertikal"))
    with pytest.raises(InputError, match="pinion-vertikal") as caught:
        train(database, "location", SETTINGS)
    assert not isinstance(caught.value, NotApplicableError)


def raises(error):
    def method(*args, **options):
        raise error

    return method


def test_an_estimator_that_does_not_apply_is_left_out_and_a_wrong_input_is_not(database, without_boosting, monkeypatch):
    steps = []
    monkeypatch.setattr(Fm4Location, "fit", raises(NotApplicableError("too few rows")))
    assert "fm4" not in train(database, "location", SETTINGS, on_step=steps.append).estimators
    assert "fm4 is left out: too few rows" in steps
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
