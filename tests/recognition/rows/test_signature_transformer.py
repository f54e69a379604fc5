"""Unit: averages to named features in a scikit-learn pipeline, the same features as a database's columns."""

import warnings

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator

from sigdb.core.errors import InputError
from sigdb.recognition import SignatureTransformer
from sigdb.signature import INDICATORS, indicators, mesh_bands, order_spectrum, pooled_wigner_ville

X = 0.2 + np.random.default_rng(0).normal(size=(5, 768))
ALL = ("indicators", "spectrum", "wigner_ville")


def fitted(**options):
    return SignatureTransformer(12, **options).fit(X)


def test_indicators_have_their_names():
    names = fitted(features=["indicators"]).get_feature_names_out()
    assert names.tolist() == list(INDICATORS)
    values = indicators(X, teeth=12)
    found = fitted(features=["indicators"]).transform(X)
    assert_allclose(found, np.column_stack([values[name] for name in names]), rtol=1e-13)


def test_options_of_the_indicators_are_passed_on():
    options = {"mesh_harmonics": 3, "shaft_harmonics": 4, "sidebands": 2}
    values = indicators(X, teeth=12, **options)
    found = fitted(features=["indicators"], **options).transform(X)
    assert_allclose(found, np.column_stack(list(values.values())), rtol=1e-13)


def test_amplitudes_are_named_by_order():
    transformer = fitted(features=["spectrum"])
    assert transformer.get_feature_names_out()[[0, 12, -1]].tolist() == ["order_0", "order_12", "order_384"]
    assert_allclose(transformer.transform(X), np.abs(order_spectrum(X)[1]), rtol=1e-13)


def test_cells_are_named_by_tooth_and_band_and_are_those_of_a_database():
    transformer = fitted(features=["wigner_ville"])
    names = transformer.get_feature_names_out().tolist()
    assert len(names) == 12 * 17
    assert names[:2] + names[16:18] + names[-1:] == [
        *("wigner_ville_1_0", "wigner_ville_1_0.25", "wigner_ville_1_4"),
        *("wigner_ville_2_0", "wigner_ville_12_4"),
    ]
    # As in a database: three of 384 bins to a band, lags up to two tooth passes, over bins and samples.
    cells = pooled_wigner_ville(X, teeth=12, bands=mesh_bands(12), lag_window=128, n_bins=384) / (384 * 64)
    assert_allclose(transformer.transform(X), cells.reshape(5, -1), atol=1e-13)


def test_a_tone_is_in_the_band_of_its_name():
    theta = 2 * np.pi * np.arange(768) / 768
    row = fitted(features=["wigner_ville"]).set_output(transform="pandas").transform([np.cos(24 * theta)] * 2).iloc[0]
    for tooth in range(1, 13):
        of_tooth = row.filter(like=f"wigner_ville_{tooth}_")
        assert of_tooth.idxmax() == f"wigner_ville_{tooth}_2"


def test_kinds_follow_one_another_as_asked():
    several = fitted(features=["spectrum", "indicators"])
    assert several.get_feature_names_out()[[0, 385]].tolist() == ["order_0", "rms"]
    assert_array_equal(several.transform(X)[:, 385:], fitted(features="indicators").transform(X))
    assert fitted().get_feature_names_out().size == 13 + 12 * 17
    names = fitted(features=ALL).get_feature_names_out()
    assert np.unique(names).size == names.size == fitted(features=ALL).transform(X).shape[1]


def test_output_as_a_frame():
    frame = pd.DataFrame(X, index=list("abcde"), columns=[f"s{i}" for i in range(768)])
    transformer = SignatureTransformer(12).set_output(transform="pandas").fit(frame)
    features = transformer.transform(frame)
    assert features.columns.tolist() == transformer.get_feature_names_out().tolist()
    assert features.index.tolist() == list("abcde")
    assert_allclose(features["fm4"], indicators(X, teeth=12)["fm4"], rtol=1e-13)


def test_single_precision_is_taken():
    found = fitted().transform(X.astype(np.float32))
    assert found.dtype == np.float64
    assert_allclose(found, fitted().transform(X), rtol=2e-3)


def test_signals_are_transformed_one_by_one():
    assert_allclose(fitted().transform(X[2:3]), fitted().transform(X)[2:3], rtol=1e-10, atol=1e-14)


def test_parameters_are_searched_in_a_pipeline():
    theta = 2 * np.pi * np.arange(768) / 768
    damaged = np.arange(40) % 2
    mesh = (1 + 0.5 * damaged[:, None] * np.exp(-50 * (theta - 3) ** 2)) * np.cos(12 * theta)
    averages = mesh + 0.1 * np.random.default_rng(1).normal(size=mesh.shape)
    model = make_pipeline(SignatureTransformer(12), StandardScaler(), LogisticRegression())
    grid = {"signaturetransformer__features": [("indicators",), ("wigner_ville",), ALL]}
    search = GridSearchCV(model, grid, cv=3).fit(averages[:30], damaged[:30])
    assert search.score(averages[30:], damaged[30:]) == 1.0
    assert np.isfinite(search.cv_results_["mean_test_score"]).all()


def test_parameters_are_got_and_cloned():
    transformer = SignatureTransformer(12, features=["indicators"], sidebands=2)
    assert clone(transformer).get_params() == transformer.get_params()
    assert transformer.get_params()["teeth"] == 12
    with pytest.raises(NotFittedError):
        transformer.transform(X)
    with pytest.raises(NotFittedError):
        transformer.get_feature_names_out()


def problems(transformer):
    """Names of scikit-learn's common checks that fail, with their messages."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        results = check_estimator(transformer, on_fail=None, on_skip=None)
    assert len(results) > 40
    return {one["check_name"]: str(one["exception"]) for one in results if one["status"] == "failed"}


def test_the_common_checks():
    assert problems(SignatureTransformer(1, features=["spectrum"])) == {}
    # The others pass where the checks' data have a spectrum with a mesh: some have one or two samples a revolution.
    for kind, options in (("indicators", {"shaft_harmonics": 0}), ("wigner_ville", {"mesh_orders": 1})):
        failed = problems(SignatureTransformer(1, features=[kind], **options))
        assert len(failed) < 10
        assert all(" 2 samples a revolution" in why or "n/2 = " in why or "1 feature" in why for why in failed.values())


def test_unknown_kinds_are_refused():
    with pytest.raises(InputError, match=r"features has 'indicator'; did you mean 'indicators'\?"):
        fitted(features=["indicator"])
    for features in ([], ["spectrum", "spectrum"]):
        with pytest.raises(InputError, match=r"features = .* must name at least one kind, each once"):
            fitted(features=features)


def test_bands_beyond_the_spectrum_are_refused():
    with pytest.raises(
        InputError, match=r"mesh_orders = 40 needs bands up to order 481.5, but 768 samples a revolution"
    ):
        fitted(mesh_orders=40)
    fitted(mesh_orders=40, features=["indicators"])


def test_options_are_checked_at_fit():
    with pytest.raises(InputError, match="teeth = 0 must be an integer >= 1"):
        SignatureTransformer(0, features=["indicators"]).fit(X)
    with pytest.raises(InputError, match="sidebands = -1 must be an integer >= 0"):
        fitted(sidebands=-1)


def test_signals_are_checked():
    for bad in (X[:, :700], np.where(X > 3, np.nan, X), X[0]):
        with pytest.raises(ValueError, match=r"features|NaN|1D array"):
            fitted().transform(bad)
    with pytest.raises(InputError, match="input_features should have length equal to n_features_in_ = 768"):
        fitted().get_feature_names_out(["a"])
