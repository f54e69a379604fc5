"""Unit: criteria of a recipe, which none has unless it sets them."""

import numpy as np
import pandas as pd
import pytest

from sigdb.core import InputError, validated
from sigdb.recognition import CriteriaSettings, RecognitionSettings, evaluate
from sigdb.recognition.criteria import assess_criteria
from sigdb.recognition.targets.all_targets import TARGETS

PROJECT = CriteriaSettings(loss_db=0.25, a90_ratio=1.05, mae_ratio=1.05, ece=0.01, undercovered_cells=0.01)


def assess(target, table, cells=None, **options):
    """The project's criteria, of a model that gives sets where there are cells."""
    metrics, tables = ([], {}) if cells is None else (["set_coverage"], {"coverage": cells})
    return assess_criteria(PROJECT, TARGETS[target], metrics, table, tables, **options)


def a_table(**columns):
    """Two bands and all rows."""
    bands = {"band": ["-8 to -4 dB", "-4 to 0 dB", "all"], "rows": 100, "bound_error": 0.3, "chance": 0.9}
    ends = {f"{name}_{end}": value for name, value in columns.items() for end in ("low", "high")}
    return pd.DataFrame(bands | columns | ends)


def test_no_criterion_is_set_by_default(location_model, database):
    assert RecognitionSettings().criteria.limits == {}
    evaluation = evaluate(location_model, database, bound=False)
    assert evaluation.criteria == ()
    only = evaluate(location_model, database, bound=False, criteria=CriteriaSettings(ece=0.02, mae_ratio=1.0))
    assert [(result.criterion, result.limit, result.met) for result in only.criteria] == [("ece", 0.02, None)]
    assert only.criteria[0].note.code == "few-rows"


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("loss_dB", 0.25, "unknown key criteria.loss_dB; did you mean 'loss_db'"),
        ("ece", -0.1, "criteria.ece = -0.1 must be greater than 0"),
        ("undercovered_cells", 2.0, "criteria.undercovered_cells = 2.0 must be less than or equal to 1"),
    ],
)
def test_a_criterion_is_a_number_of_a_name_that_exists(key, value, message):
    with pytest.raises(InputError, match=message):
        validated(RecognitionSettings, {"criteria": {key: value}}, owner="recipe")


def test_the_worst_band_counts():
    table = a_table(
        loss_db=[0.1, 0.4, 0.9], a90_ratio=[1.0, np.nan, 1.2], a90=0.1, ece=np.nan, confidence=0.5, error_of_answers=0.5
    )
    loss, a90, ece, sets = assess("location", table)
    assert (loss.met, loss.value, loss.band) == (False, 0.4, "-4 to 0 dB")
    assert loss.note.text == "Exceeded in 1 of 2 noise bands: 0.4 at -4 to 0 dB."
    assert loss.note.values == {"bands": 2, "exceeded": 1, "band": "-4 to 0 dB"}
    assert (a90.met, a90.value, a90.note) == (True, 1.0, None)
    assert (ece.met, ece.note.code, ece.note.values) == (None, "few-rows", {"rows": 100, "needed": 20_000})
    assert (sets.met, sets.note.code) == (None, "no-sets")
    over = a_table(ece=[0.004, 0.03, 0.01], confidence=0.6, error_of_answers=0.43)
    loss, _, ece, _ = assess("location", over.assign(loss_db=np.nan))
    assert loss.note.code == "bound-out-of-range"
    assert loss.note.values["least"] == pytest.approx(1 / 3)
    assert ece.note.text.endswith("There the mean probability of the answers is 0.600, and 0.570 are correct.")


def test_ratios_of_severity_count_where_the_bound_is_not_saturated():
    table = a_table(mae_ratio=[1.2, 1.01, 1.3]).assign(quantity="stiffness_loss", bound_error=[0.001, 0.3, 0.3])
    mae, _ = assess("severity", table, pd.DataFrame())
    assert (mae.met, mae.value, mae.band) == (True, 1.01, "-4 to 0 dB")
    assert assess("severity", table.assign(bound_error=0.0), pd.DataFrame())[0].met is None
    unknown = assess("severity", pd.DataFrame(), bounded=False)
    assert [(result.met, result.note.code) for result in unknown] == [(None, "no-bound"), (None, "no-sets")]
    assert assess("severity", pd.DataFrame())[0].note.code == "one-severity"


def test_few_cells_may_cover_too_little():
    cell = {
        "stiffness_loss": 0.1,
        "damaged_teeth": 1.0,
        "snr_db": -8.0,
        "speed_rpm": 1.0,
        "torque": 2.0,
        "rows": 3000,
        "target": "tooth",
    }
    cells = pd.DataFrame([cell | {"coverage": 0.9, "below": False}] * 99 + [cell | {"coverage": 0.8, "below": True}])
    once = assess("location", a_table(loss_db=0.1), cells)[-1]
    assert (once.value, once.met) == (0.01, True)
    twice = assess("location", a_table(loss_db=0.1), pd.concat([cells, cells[-1:]]))[-1]
    assert not twice.met
    assert twice.note.text.startswith(
        "2 of 101 cells; the least coverage is 0.800, of 3000 rows (tooth; loss 0.1, 1 damaged teeth, -8 dB"
    )
