"""Unit: known limitations of a model on rows, as notes whose values the program reads."""

from dataclasses import replace

import numpy as np
import pytest

from sigdb.recognition import Detector, LocationClassifier, TemplateBank, TemplateLocation
from sigdb.recognition.evaluated_rows import Selection
from sigdb.recognition.limitations import limitations

PLAIN = Selection(split="S1", text="by specimen: specimens held out of training, the same cases")


@pytest.fixture(scope="module")
def bank(database):
    return TemplateBank.of(database)


@pytest.fixture(scope="module")
def model(location_model, bank):
    return replace(location_model, learner="bank", estimators={"bank": TemplateLocation(bank)})


def test_a_bank_lists_what_it_has_no_templates_of(database, model):
    rows = database.features()
    assert limitations(model, rows, PLAIN, 1e-6) == []
    away = rows.assign(speed_rpm=rows["speed_rpm"] * np.where(rows["tooth"] > 0, 1.02, 1.0))
    (note,) = limitations(model, away, PLAIN)
    share = 100 * (rows["tooth"] > 0).mean()
    assert note.code == "off-operating-points"
    assert note.values == pytest.approx({"share": share, "speed": 2.0, "torque": 0.0}, abs=1e-9)
    assert note.text.startswith(f"{share:.0f} % of the rows are at operating points that the bank has no templates of")
    assert "2 % in speed and 0 % in torque" in note.text
    other = rows.assign(stiffness_loss=rows["stiffness_loss"].replace(0.2, 0.3), teeth=12)
    (note,) = limitations(model, other, PLAIN)
    assert (note.code, note.values) == ("no-templates-of-severities", {"severities": 8, "lacking": 4})
    (note,) = limitations(model, rows.assign(teeth=13), PLAIN)
    assert note.text == "The bank has no templates of 13 teeth; it has 12."
    (note,) = limitations(model, rows, PLAIN, 2e-6)
    assert note.text == "The index errors of the rows are 2 um, those of the bank 1 um."


def test_the_selection_is_read_from_its_fields_whatever_its_text(database, model):
    """The split and the parts that differ were cut out of the sentence before."""
    changed = Selection(split="S5", text="a better sentence.", changed_parts=("rig.bearings", "solver"))
    (note,) = limitations(model, database.features(), changed)
    assert (note.code, note.values) == ("other-model-form", {"parts": "rig.bearings, solver"})
    (note,) = limitations(model, database.features(), Selection(split="S2", text="A better sentence."))
    assert (note.code, note.values) == ("unseen-cases", {"split": "S2"})


def test_detectors_have_the_bank_of_their_scorer_and_pooled_learners_none(database, model, location_model, bank):
    detector = Detector(TemplateLocation(bank))
    assert limitations(replace(model, estimators={"bank": detector}), database.features(), PLAIN, 1e-6) == []
    pooled = replace(location_model, learner="lda", estimators={"lda": LocationClassifier("lda")})
    assert [note.code for note in limitations(pooled, database.features(), PLAIN)] == ["pooled-features"]
