"""Unit: choices, types and comparisons follow from the registry; an entry and a class are all that a learner needs."""

import sys
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_array_equal

from sigdb.cli.main import cli
from sigdb.core import InputError
from sigdb.recognition import LEARNERS, RecognitionSettings, TemplateBank, evaluate, load_model, save_model, train
from sigdb.recognition.estimators import registry
from sigdb.recognition.estimators.baselines.threshold import ThresholdLocation
from sigdb.recognition.estimators.registry import Entry, estimator_class, own_classes, trusted_types
from sigdb.recognition.rows.batch import TSA


def test_choices_of_settings_and_of_the_command_line_are_those_of_the_registry():
    help_text = CliRunner().invoke(cli, ["train", "--help"]).output
    assert f"[{'|'.join(LEARNERS)}]" in help_text
    for learner in LEARNERS:
        assert RecognitionSettings(learner=learner).learner == learner
    with pytest.raises(ValueError, match="learner"):
        RecognitionSettings(learner="fm4")


def test_every_registered_class_can_be_made_and_is_trusted():
    for entry in registry.REGISTRY:
        for target in entry.classes:
            kind = estimator_class(entry, target)
            assert f"{kind.__module__}.{kind.__name__}" in trusted_types()
            assert own_classes()[kind.__name__] == kind.__module__


class CrestLocation(ThresholdLocation):
    """The tooth pass that holds the greatest sample, where that exceeds a threshold; it reads averages whole."""

    reads = frozenset({"teeth", TSA})

    def indicator(self, X):
        return self._crest(X)[:, 0]

    def tooth(self, X):
        return self._crest(X)[:, 1].astype(int)

    def _crest(self, X):
        batch = self._batch(X)
        crest = np.empty((len(batch), 2))
        for teeth, at, x in batch.averages():
            crest[at] = np.column_stack([x.max(axis=1), 1 + x.argmax(axis=1) * teeth // x.shape[1]])
        return crest


@pytest.fixture
def with_crest(monkeypatch):
    """The registry with LDA and a learner that this file defines."""
    module = ModuleType("sigdb.recognition.estimators.crest")
    module.CrestLocation = CrestLocation
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(CrestLocation, "__module__", module.__name__)
    entry = Entry(name="crest", text="greatest sample", learner=True, classes={"location": "crest.CrestLocation"})
    monkeypatch.setattr(registry, "REGISTRY", (registry.REGISTRY[0], entry))
    monkeypatch.setitem(registry.LEARNERS, entry.name, entry.text)


def test_a_learner_is_trained_compared_saved_and_loaded(database, held_out, with_crest, tmp_path):
    settings = RecognitionSettings.model_construct(**RecognitionSettings(folds=3).model_dump() | {"learner": "crest"})
    model = train(database, "location", settings)
    assert list(model.estimators) == ["lda", "crest"]
    evaluation = evaluate(model, database, bound=False)
    assert set(evaluation.metrics) == {"lda", "crest"}
    save_model(model, tmp_path, evaluation=evaluation, probe=held_out, command="train")
    assert_array_equal(load_model(tmp_path).predict(held_out), model.predict(held_out))
    with pytest.raises(InputError, match="learner = 'crest' is not one of those for severity; choose one of lda"):
        train(database, "severity", settings)


def test_the_default_learner_is_that_of_templates_where_there_is_a_bank():
    bank = TemplateBank(sensor="casing", index_error=1e-6, points=())
    assert (registry.default_learner(bank), registry.default_learner(None)) == ("templates", "boosting")
