"""Unit: learners read indicators and added features besides their own columns, of the function of the training only."""

import json
import re
import shutil
from functools import partial

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.pipeline import train_model
from sigdb.recognition import LocationClassifier, evaluate, load_model
from sigdb.recognition.estimators import registry
from sigdb.recognition.estimators.pooled_severity import SeverityRegressor
from sigdb.recognition.estimators.registry import make_estimators
from sigdb.recognition.rows.further_columns import further_columns, missing_numbers
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.storage.skops_file import skops_bytes, skops_estimators
from sigdb.recognition.training import usable_rows
from sigdb.sweep import add_features

MODULE = """
def own(tsa):
    if tsa.argmax() % 5 == 0:
        raise ValueError("a fifth")
    return {"own_peak": tsa.max(), "own_rms": tsa.std()}
"""


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = re.sub(r"\W", "_", f"further_{tmp_path.name}")
    (tmp_path / f"{name}.py").write_text(MODULE, encoding="utf-8")
    return name


@pytest.fixture
def place(database, tmp_path):
    return shutil.copytree(database.store.folder, tmp_path / "signatures")


def test_names_of_columns_and_of_functions(place, shapes):
    add_features(place, f"{shapes}:own", jobs=1)
    database = sigdb.open(place)
    assert further_columns(database, ["fm4", f"{shapes}:own", "own_rms"]) == ("fm4", "own_peak", "own_rms")
    assert further_columns(database, ["added"]) == ("own_peak", "own_rms")
    for name, says in {
        "tooth": "tooth is no number that is computed from the average",
        "stiffness_loss": "is no number that is computed",
        "snr_db": "is no number that is computed",
        "wigner_ville": "is no number that is computed",
        "own_status": "is no number that is computed",
        "fm5": r"has no column fm5; did you mean 'fm4'\?",
        f"{shapes}:other": f"has no features of {shapes}:other; add them with: sigdb add-features",
    }.items():
        with pytest.raises(InputError, match=f"columns: .*{says}"):
            further_columns(database, [name])


def test_missing_numbers_are_told_and_missing_parts_refused(place, shapes):
    add_features(place, f"{shapes}:own", jobs=1)
    database = sigdb.open(place)
    rows = usable_rows(database, "location", ("own_peak",))
    missing = int(rows["own_peak"].isna().sum())
    assert 0 < missing < len(rows)
    says = f"own_peak has no number in {missing} of {len(rows)} rows; the median of the others stands for it"
    assert list(missing_numbers(database, rows, ("own_peak",))) == [says]
    assert list(missing_numbers(database, rows, ())) == []
    with pytest.raises(InputError, match="own_peak has no number in any row"):
        list(missing_numbers(database, rows.assign(own_peak=np.nan), ("own_peak",)))
    next((place / "receipts").glob("added.*")).unlink()
    with pytest.raises(InputError, match=rf"{len(database)} rows, the first with id 0, have no features of .* yet"):
        list(missing_numbers(sigdb.open(place), rows, ("own_peak",)))


@pytest.mark.parametrize("learner", ["lda", "boosting"])
def test_a_column_that_knows_the_answer_is_used(rows, learner):
    """Healthy or damaged stands in the column, with gaps; the cells show nothing."""
    stream = np.random.default_rng(3)
    oracle = np.where(rows["tooth"] > 0, 1.0, 0.0) + 0.01 * stream.standard_normal(len(rows))
    oracle[::50] = np.nan
    blind = rows.assign(wigner_ville=[np.zeros(len(cells)) for cells in rows["wigner_ville"]], oracle=oracle)
    damaged, known, groups = (blind["tooth"] > 0).to_numpy(), ~np.isnan(oracle), blind["specimen"].to_numpy()
    without = LocationClassifier(learner).fit(blind, blind["tooth"], groups).predict_proba(blind)[:, 0]
    assert np.ptp(without) < 1e-9
    with_it = LocationClassifier(learner, columns=("oracle",)).fit(blind, blind["tooth"], groups)
    none = with_it.predict_proba(blind)[:, 0]
    assert np.median(none[known & ~damaged]) > 0.9
    assert np.median(none[known & damaged]) < 0.1
    assert np.isfinite(with_it.predict_proba(blind.assign(oracle=np.nan))).all()


def test_estimators_of_all_targets_take_them_and_keep_them_in_a_file(rows):
    settings = RecognitionSettings(columns=("fm4",))
    for target in ("location", "severity", "detection"):
        made = make_estimators(target, settings, None)
        assert {name for name, each in made.items() if "fm4" in each.columns} == {"lda", "boosting"}
        assert all("fm4" in made[name].columns_read for name in ("lda", "boosting"))
    regressor = SeverityRegressor("lda", columns=("fm4", "kurtosis"))
    labels = rows[["tooth", "stiffness_loss", "phase_shift_deg", "damaged_teeth"]]
    regressor.fit(rows, labels, rows["specimen"].to_numpy())
    (kept,) = skops_estimators(skops_bytes({"lda": regressor})).values()
    assert kept.columns == ("fm4", "kurtosis")
    np.testing.assert_array_equal(kept.predict(rows[:9]), regressor.predict(rows[:9]))


def test_a_model_keeps_its_function_and_refuses_features_of_another(place, shapes, tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "REGISTRY", tuple(each for each in registry.REGISTRY if each.name == "lda"))
    monkeypatch.setattr("sigdb.pipeline.models.evaluate", partial(evaluate, bound=False))
    add_features(place, f"{shapes}:own", jobs=1)
    database = sigdb.open(place)
    steps = []
    out = tmp_path / "model"
    evaluation = train_model(
        database, "location", out, columns=[f"{shapes}:own"], command="made by a test", on_step=steps.append
    )
    assert any("own_peak has no number in" in step for step in steps)
    model = load_model(out)
    assert model.columns == ("own_peak", "own_rms")
    assert model.estimator.columns == model.columns
    assert json.loads((out / "model.json").read_text(encoding="utf-8"))["added"].keys() == {f"{shapes}:own"}
    assert "own_peak" in (out / "README.md").read_text(encoding="utf-8")
    again = evaluate(model, database, bound=False)
    assert str(again.metrics["lda"]["accuracy"]) == str(evaluation.metrics["lda"]["accuracy"])
    with pytest.raises(InputError, match="reads the columns own_peak, own_rms, which an average alone does not have"):
        model.predict(tsa=np.zeros(768), speed_rpm=1.0, torque=1.0, averages=1, scatter=1.0)
    (tmp_path / f"{shapes}.py").write_text(MODULE + "\n# changed", encoding="utf-8")
    add_features(place, f"{shapes}:own", jobs=1, replace=True)
    with pytest.raises(InputError, match=r"by a module with the SHA-256 .*--replace, or train again"):
        evaluate(model, sigdb.open(place), bound=False)
