"""Unit: the estimators keep scikit-learn's conventions, and refuse what they cannot read."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sklearn import config_context, get_config
from sklearn.base import clone, is_classifier, is_regressor
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.validation import check_is_fitted

from sigdb.core.errors import InputError
from sigdb.database import QUANTITIES
from sigdb.recognition import LocationClassifier, RecognitionSettings, SeverityRegressor
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.rows.tooth_views import COLUMNS, ToothViews

ESTIMATORS = [LocationClassifier, SeverityRegressor]


def labels(estimator, rows):
    return rows["tooth"] if isinstance(estimator, LocationClassifier) else rows[["tooth", *QUANTITIES]]


@pytest.mark.parametrize("made", ESTIMATORS)
def test_parameters_are_got_set_and_cloned(made):
    others = {"coverage": 0.9, "columns": (), "coverage_by": "cell"}
    estimator = made("lda", random_state=3)
    assert estimator.get_params() == {"learner": "lda", "random_state": 3} | others
    assert estimator.set_params(learner="boosting") is estimator
    assert clone(estimator).get_params() == {"learner": "boosting", "random_state": 3} | others
    assert made().get_params() == {"learner": "boosting", "random_state": 0} | others
    with pytest.raises(ValueError, match="Invalid parameter 'depth'"):
        estimator.set_params(depth=3)


@pytest.mark.parametrize("made", ESTIMATORS)
def test_groups_are_routed_where_routing_is_on_and_importing_does_not_switch_it_on(made, rows):
    assert not get_config()["enable_metadata_routing"]
    some = rows[rows["specimen"] < 2]
    with config_context(enable_metadata_routing=True):
        steps = make_pipeline(FunctionTransformer(), made("lda").set_fit_request(groups=True))
        steps.fit(some, labels(made(), some), groups=some["specimen"].to_numpy())
    alone = made("lda").fit(some, labels(made(), some), some["specimen"])
    assert_array_equal(np.asarray(steps.predict(some)), np.asarray(alone.predict(some)))


@pytest.mark.parametrize("made", ESTIMATORS)
def test_fit_returns_the_estimator_and_a_clone_is_unfitted(made, rows):
    some = rows[rows["specimen"] < 2]
    estimator = made("lda")
    assert estimator.fit(some, labels(estimator, some), some["specimen"]) is estimator
    check_is_fitted(estimator)
    with pytest.raises(NotFittedError, match="not fitted yet"):
        clone(estimator).predict(some)


def test_types_of_estimator_are_told():
    assert is_classifier(LocationClassifier())
    assert is_regressor(SeverityRegressor())


@pytest.mark.parametrize("made", ESTIMATORS)
def test_training_twice_is_the_same_and_does_not_touch_its_input(made, rows):
    some = rows[rows["specimen"] < 3]
    before = some.copy(deep=True)
    answers = []
    for _ in range(2):
        estimator = made("lda", random_state=5)
        estimator.fit(some, labels(estimator, some), some["specimen"])
        answers.append(np.asarray(estimator.predict(some)))
    assert_array_equal(*answers)
    assert_array_equal(np.stack(some["wigner_ville"]), np.stack(before["wigner_ville"]))
    assert some.drop(columns="wigner_ville").equals(before.drop(columns="wigner_ville"))


def test_classes_are_none_and_the_teeth(location_model, held_out):
    classifier = location_model.estimators["lda"]
    assert classifier.classes_.tolist() == list(range(13))
    assert classifier.predict_proba(held_out).shape == (len(held_out), len(classifier.classes_))
    found = classifier.predict(held_out)
    assert classifier.score(held_out, held_out["tooth"]) == pytest.approx((found == held_out["tooth"]).mean())


@pytest.mark.parametrize("made", ESTIMATORS)
def test_arrays_are_refused(made, rows):
    estimator = made("lda")
    with pytest.raises(InputError, match=r"X lacks the columns \['teeth', .*Database.features\(\)"):
        estimator.fit(np.zeros((4, 3)), labels(estimator, rows))


@pytest.mark.parametrize("column", sorted(COLUMNS))
def test_a_missing_column_is_named(location_model, severity_model, held_out, column):
    lacking = held_out.drop(columns=column)
    for model in (location_model, severity_model):
        with pytest.raises(InputError, match=rf"X lacks the columns \['{column}'\]"):
            model.predict(lacking)
    with pytest.raises(InputError, match=rf"X lacks the columns \['{column}'\]"):
        ToothViews().fit(lacking)


def test_rows_without_a_result_are_refused(location_model, severity_model, held_out, rows):
    cells = list(held_out["wigner_ville"])
    failed = held_out.assign(wigner_ville=[None, *cells[1:]])
    for model in (location_model, severity_model):
        with pytest.raises(InputError, match="rows without a result; keep rows whose status is 'ok'"):
            model.predict(failed)
    with pytest.raises(InputError, match="rows without a result"):
        LocationClassifier("lda").fit(failed, failed["tooth"])


@pytest.mark.parametrize("made", ESTIMATORS)
def test_an_unknown_learner_is_refused(made, rows):
    some = rows[rows["specimen"] < 2]
    estimator = made("forest")
    with pytest.raises(InputError, match="learner = 'forest' is not known; choose one of lda, boosting"):
        estimator.fit(some, labels(estimator, some), some["specimen"])


def test_views_are_of_one_length_for_every_tooth_count(mixed_teeth):
    views = ToothViews().fit(mixed_teeth.features())
    rows = {teeth: Batch.from_rows(mixed_teeth.features(f"teeth = {teeth}"), COLUMNS) for teeth in (12, 13)}
    shapes = {teeth: views.views(batch).shape[1:] for teeth, batch in rows.items()}
    bands = 17  # 0, 1/4, ... 4 mesh orders
    assert shapes == {teeth: (teeth, 6 * bands + bands + 2) for teeth in (12, 13)}


def test_a_view_holds_the_cells_from_one_before_to_four_after(held_out):
    some = held_out.iloc[:5]
    views = ToothViews().fit(held_out)
    cells = np.stack(some["wigner_ville"].to_list()).reshape(5, 12, 17)
    for tooth in (1, 7, 12):
        seen = views.view_from(Batch.from_rows(some, COLUMNS), np.full(5, tooth))
        for i, offset in enumerate(range(-1, 5)):
            cell = np.arcsinh((cells[:, (tooth - 1 + offset) % 12] - views.centre_) / views.scale_)
            np.testing.assert_allclose(seen[:, 17 * i : 17 * (i + 1)], cell, rtol=1e-6, atol=1e-6)
        assert_array_equal(seen[:, -2:], some[["speed_rpm", "torque"]])


def test_settings_have_bounds():
    trained = {"learner": None, "coverage_by": "cell", "folds": 5, "seed": 0, "false_alarm_rate": 0.01}
    stages = {"columns": (), "targets": (), "splits": ("S1",), "evaluate_on": ()}
    stages |= {"robustness": {"points": 3, "rows": 0, "seed": 0, "rigs": 32}}
    assert RecognitionSettings().model_dump(exclude={"criteria"}) == trained | stages
    wrong_ones = ({"folds": 2}, {"learner": "forest"}, {"seed": -1}, {"depth": 3}, {"false_alarm_rate": 1.0})
    for wrong in wrong_ones:
        with pytest.raises(ValueError, match=next(iter(wrong))):
            RecognitionSettings(**wrong)
