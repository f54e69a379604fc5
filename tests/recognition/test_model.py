"""Unit: a model answers plain arrays as it answers rows, and says which rows it was not trained for."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_array_equal
from pandas.testing import assert_frame_equal

from sigdb.core.errors import InputError, NotApplicableError
from sigdb.recognition import Detector, OutsideWarning, requested_rows
from sigdb.recognition.rows.batch import Batch

ARRAYS = ("speed_rpm", "torque", "averages", "scatter")


def with_learner(model, learner):
    return replace(model, learner=learner)


@pytest.fixture(scope="module", params=["lda", "templates"])
def location(request, location_model):
    return with_learner(location_model, request.param)


@pytest.fixture(scope="module", params=["lda", "templates"])
def severity(request, severity_model):
    return with_learner(severity_model, request.param)


@pytest.fixture(scope="module")
def some(held_out):
    """Rows of gears that the models have not seen."""
    return held_out[::11].copy()


def arrays(rows):
    return {name: rows[name].to_numpy() for name in ARRAYS} | {"tsa": np.stack(rows["tsa"]), "teeth": 12}


@pytest.fixture(scope="module")
def inside(location_model, some):
    return some[~with_learner(location_model, "templates").assess(some)["outside"].to_numpy()]


def test_arrays_are_answered_as_rows_are(location, severity, inside):
    np.testing.assert_array_equal(location.predict(**arrays(inside)), location.predict(inside))
    np.testing.assert_allclose(location.predict_proba(**arrays(inside)), location.predict_proba(inside), rtol=1e-4)
    pd.testing.assert_frame_equal(
        severity.predict(**arrays(inside)), severity.predict(inside).reset_index(drop=True), rtol=1e-3
    )


def test_one_average_is_one_row(location, inside):
    row = {name: values[0] for name, values in arrays(inside).items() if name != "teeth"}
    assert location.predict(**row, teeth=12).tolist() == [location.predict(inside)[0]]
    assert location.predict_proba(**row, teeth=12).shape == (1, 13)


def test_probabilities_are_of_all_answers(location, inside):
    found = location.predict_proba(inside)
    np.testing.assert_allclose(found.sum(axis=1), 1.0)
    np.testing.assert_array_equal(found.argmax(axis=1), location.predict(inside))


def test_a_model_of_severity_has_no_probabilities(severity, inside):
    with pytest.raises(NotApplicableError, match=r"a model of severity has no probabilities; predict\(\) gives"):
        severity.predict_proba(inside)


def other_unit(rows, factor):
    return rows.assign(
        tsa=[x * factor for x in rows["tsa"]],
        wigner_ville=[np.asarray(x) * factor**2 for x in rows["wigner_ville"]],
        scatter=rows["scatter"] * factor,
        rms=rows["rms"] * factor,
    )


OUTSIDE = {
    "speed": lambda rows: rows.assign(speed_rpm=3000.0),
    "torque": lambda rows: rows.assign(torque=100.0),
    "averages": lambda rows: rows.assign(averages=12),
    "mm/s": lambda rows: other_unit(rows, 1000.0),
    "g": lambda rows: other_unit(rows, 1 / 9.81),
    "samples": lambda rows: rows.assign(tsa=[x[::2] for x in rows["tsa"]]),
}


@pytest.mark.parametrize("kind", OUTSIDE)
@pytest.mark.parametrize("target", ["location", "severity"])
@pytest.mark.parametrize("learner", ["lda", "templates"])
def test_rows_outside_the_training_have_no_answer_and_are_marked(request, kind, target, learner, inside):
    model, rows = with_learner(request.getfixturevalue(f"{target}_model"), learner), OUTSIDE[kind](inside[:4])
    with pytest.warns(OutsideWarning, match=r"4 of 4 rows are outside the range of the model's training, such as row"):
        predicted = model.predict(rows)
    assert predicted.isna().all(axis=None) if target == "severity" else predicted.tolist() == [-1] * 4
    verdict = model.assess(rows)
    assert verdict["outside"].all()
    assert set(verdict["kind"]) == {"cannot be judged"}
    assert verdict["answer"].tolist() == [f"Cannot be judged: {reason}." for reason in verdict["reason"]]
    assert verdict["reason"].str.len().gt(10).all()
    if kind != "samples":  # averages of one tooth count have one length
        mixed = pd.concat([inside[:3], rows[3:]])
        assert model.assess(mixed)["outside"].tolist() == [False, False, False, True]
        with pytest.warns(OutsideWarning, match=f"1 of 4 rows .* such as row {rows.index[3]}: "):
            answered = np.asarray(model.predict(mixed), float)
        np.testing.assert_array_equal(answered[:3], np.asarray(model.predict(inside[:3]), float))
        assert np.all(answered[3] == -1) if target == "location" else np.isnan(answered[3]).all()
        if target == "location":
            with pytest.warns(OutsideWarning):
                probabilities = model.predict_proba(mixed)
            np.testing.assert_array_equal(probabilities[:3], model.predict_proba(inside[:3]))
            assert np.isnan(probabilities[3]).all()


def test_the_verdict_names_the_answer(location, inside):
    verdict, predicted = location.assess(inside), location.predict(inside)
    columns = (verdict[name] for name in ("kind", "answer", "candidates"))
    for kind, answer, members, tooth in zip(*columns, predicted, strict=True):
        expected = "one tooth" if tooth else "nothing stands out"
        assert kind == ("cannot be judged" if len(members) > 1 and 0 in members else expected)
        assert tooth in members
        assert all(str(member) in answer for member in members if member)
    np.testing.assert_allclose(verdict["probability"], location.predict_proba(inside).max(axis=1))
    assert verdict.index.equals(inside.index)


def test_an_index_may_hold_a_value_twice(location, inside):
    twice = pd.concat([inside[:2], inside[:2], inside[:1].assign(speed_rpm=3000.0)])
    verdict, once = location.assess(twice), location.assess(inside[:2])
    assert verdict.index.equals(twice.index)
    assert verdict["answer"].tolist()[:4] == [*once["answer"]] * 2
    assert verdict["outside"].tolist() == [False] * 4 + [True]
    assert np.isnan(verdict["decision"].iloc[4])
    with pytest.warns(OutsideWarning, match="1 of 5 rows"):
        np.testing.assert_array_equal(location.predict(twice), [*location.predict(inside[:2])] * 2 + [-1])


def test_the_verdict_on_severity_has_the_estimates(severity, inside):
    verdict = severity.assess(inside)
    assert verdict["kind"].isna().all()
    assert verdict["answer"].str.startswith("If a tooth is damaged, its stiffness loss is ").all()
    expected = severity.predict(inside)
    pd.testing.assert_frame_equal(verdict.drop(columns=["kind", "answer", "outside", "reason"]), expected)


def other_sensor(rows):
    """The same level at all frequencies, as another place on the casing might have."""
    return rows.assign(tsa=[np.roll(x[::-1], 5) for x in rows["tsa"]])


def test_averages_that_fit_no_template_are_marked_and_warned_of(location_model, inside):
    model, strange = with_learner(location_model, "templates"), other_sensor(inside[:4])
    with pytest.warns(OutsideWarning, match="4 of 4 rows .* none of the templates fits the average"):
        assert model.predict(strange).tolist() == [-1] * 4
    assert (model.estimator.predict(strange) >= 0).all()
    for learner in ("templates", "lda"):
        verdict = with_learner(location_model, learner).assess(strange)
        reason = "none of the templates fits the average: its residual stands out"
        assert verdict["reason"].str.startswith(reason).all()


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"unit": "mm/s"}, "unit = 'mm/s', and the model was trained on 'm/s'"),
        ({"sensor": "gear-vertical"}, "sensor = 'gear-vertical', and the model was trained on 'pinion-vertical'"),
        ({"scater": 1.0}, "predict has no argument 'scater'; did you mean 'scatter'"),
        ({"speed_rpm": "fast"}, "speed_rpm must be numbers, not str"),
        ({"speed_rpm": [1.0, 2.0]}, r"speed_rpm has shape \(2,\); give a number, or one for each of 1 rows"),
        ({"torque": np.nan}, "torque must be finite"),
        ({"teeth": 12.0}, "teeth = 12.0 must be a whole number"),
        ({"tsa": np.ma.masked_less(np.arange(768.0), 5)}, "tsa has 5 masked values"),
        ({"tsa": 1j * np.arange(768.0)}, "tsa must be real"),
        ({"tsa": np.zeros((2, 2, 8))}, r"tsa has shape \(2, 2, 8\)"),
        ({"tsa": np.zeros(0)}, "tsa has shape"),
    ],
    ids=str,
)
def test_wrong_arrays_are_named(location, inside, changed, says):
    row = {name: values[0] for name, values in arrays(inside).items() if name != "teeth"}
    with pytest.raises(InputError, match=says):
        location.predict(**row | {"unit": "m/s", "sensor": "pinion-vertical"} | changed)


def test_what_is_missing_is_named(location, inside):
    with pytest.raises(InputError, match=r"torque, averages, scatter is missing; give rows, or tsa, speed_rpm, torque"):
        location.predict(tsa=inside["tsa"].iloc[0], speed_rpm=14400.0)
    with pytest.raises(InputError, match="rows are given together with torque"):
        location.predict(inside, torque=3.0)
    with pytest.raises(InputError, match="X lacks"):
        location.predict(inside["tsa"].iloc[0])


def test_a_model_without_a_range_answers_all_rows(location, inside):
    unknown = replace(location, trained_range=None)
    assert len(unknown.predict(inside.assign(speed_rpm=3000.0))) == len(inside)


def test_a_detector_says_damage_with_its_probability(database, some, location_model):
    estimator = location_model.estimators["templates"]
    detector = Detector.of(estimator, 0.2)
    train = database.features("specimen < 4")
    train = train.assign(tsa=list(database.signals(train["id"].to_numpy())["tsa"]))
    batch = Batch.from_rows(train, detector.reads)
    detector.fit(batch, train["tooth"], train["specimen"])
    model = replace(location_model, target="detection", learner="templates", estimators={"templates": detector})
    verdict = model.assess(some)
    kept = some[~verdict["outside"].to_numpy()]
    assert set(verdict["kind"]) <= {"damage", "nothing stands out", "cannot be judged"}
    np.testing.assert_array_equal(model.assess(kept)["kind"] == "damage", model.predict(kept) == 1)
    np.testing.assert_allclose(model.predict_proba(kept).sum(axis=1), 1.0)
    assert model.assess(other_sensor(kept[:3]))["outside"].all()


def test_noise_by_order_is_an_argument_and_white_noise_changes_nothing(location_model, inside):
    model = with_learner(location_model, "templates")
    some = arrays(inside)
    orders = np.shape(some["tsa"])[1] // 2 + 1
    white = np.repeat((some["scatter"] / np.sqrt(some["averages"]))[:, None], orders, axis=1)
    expected = model.assess(**some)
    assert_frame_equal(model.assess(**some, noise=white), expected)
    quiet_above = white * np.where(np.arange(orders) < 24, 1.0, 0.3)
    assert not expected["outside"].all()
    assert model.assess(**some, noise=quiet_above)["reason"].str.contains("its residual stands out").all()
    for wrong, said in ((white[:, 1:], "give it at orders 0 to"), (-white, "at least 0"), (0 * white, "above 0")):
        with pytest.raises(InputError, match=said):
            model.assess(**some, noise=wrong)


def test_answers_to_a_database_are_in_the_order_of_the_rows(location, database):
    rows = requested_rows(location, database).iloc[::37]
    answers, turned = (location.answers(database, some) for some in (rows, rows.iloc[::-1]))
    assert list(answers) == list(location.estimators)
    for name, of_name in answers.items():
        assert_array_equal(turned[name].predicted, of_name.predicted[::-1])
    assert_array_equal(turned[location.learner].outside, answers[location.learner].outside[::-1])
