"""One recipe of features: a sweep, a recording and the transformer compute the same numbers for any tooth count."""

import math

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core import InputError
from sigdb.recognition import SignatureTransformer
from sigdb.recording import MeshPresence, RecordedSignature
from sigdb.signature import (
    FEATURES,
    INDICATORS,
    features,
    indicators,
    mesh_bands,
    order_spectrum,
    pooled_wigner_ville,
)
from sigdb.sweep.work import rows as sweep_rows

STEP = 16
TEETH = range(3, 41)
PRESENT = MeshPresence(present=True, reason="the mesh stands out", p_value=1e-9)


def average(teeth):
    return 0.2 + np.random.default_rng(teeth).normal(size=STEP * teeth)


def of_a_sweep(x, teeth):
    """The row's values, as lists and numbers, of an average with one sensor."""
    return {name: values[0, 0] for name, values in sweep_rows._signature(x[None, None], teeth, list(FEATURES)).items()}


def of_a_recording(x, teeth):
    """The row of a recording whose average is ``x``."""
    empty = pd.DataFrame()
    recorded = RecordedSignature(
        intervals=pd.DataFrame({"indicator": [], "low": [], "high": []}),
        envelope=None,
        shafts=pd.DataFrame(),
        order_map=None,
        source="file",
        channel="a",
        unit="m/s^2",
        gear=None,
        shaft=None,
        teeth=teeth,
        angle="tacho",
        absolute=False,
        tsa=x,
        scatter=0.0,
        noise=np.zeros(len(x) // 2 + 1),
        groups=np.asarray(x)[None],
        averages=1,
        dropped=0,
        cycle=None,
        speed_rpm=60.0,
        speed_track=empty,
        kept=1.0,
        presence=PRESENT,
        highest_order=1.0,
        order_spectrum=empty,
        record_spectrum=empty,
        lines=empty,
        indicators={name: float(value) for name, value in indicators(x, teeth=teeth).items()},
        notes=(),
    )
    return recorded.row(torque=1.0).iloc[0]


def of_the_transformer(x, teeth):
    """Values of the transformer, a feature's in one array."""
    found = {}
    for kind in ("spectrum", "wigner_ville"):
        found[kind] = SignatureTransformer(teeth, features=[kind]).fit(x[None]).transform(x[None])[0]
    transformer = SignatureTransformer(teeth, features=["indicators"]).fit(x[None])
    return found | dict(zip(transformer.get_feature_names_out(), transformer.transform(x[None])[0], strict=True))


@pytest.mark.parametrize("teeth", TEETH)
def test_three_users_agree(teeth):
    x = average(teeth)
    sweep, recording, transformer = (user(x, teeth) for user in (of_a_sweep, of_a_recording, of_the_transformer))
    for name in FEATURES:
        assert_array_equal(recording[name], sweep[name], err_msg=name)
        assert_array_equal(transformer[name], sweep[name], err_msg=name)


@pytest.mark.parametrize("teeth", [4, 5, 7, 8, 23])
def test_the_recipe(teeth):
    """Amplitudes, indicators, and the distribution of three bins to a band with a lag window of two tooth passes."""
    x = np.stack([average(teeth), -2 * average(teeth)])
    values = features(x, teeth=teeth)
    assert list(values) == list(FEATURES)
    assert_array_equal(values["spectrum"], np.abs(order_spectrum(x)[1]))
    for name, value in indicators(x, teeth=teeth).items():
        assert_array_equal(values[name], value)
    cells = pooled_wigner_ville(x, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * STEP, n_bins=6 * STEP)
    assert_array_equal(values["wigner_ville"], cells / (6 * STEP * STEP))


def test_the_lag_window_is_at_most_half_a_revolution():
    x = average(3)
    cells = pooled_wigner_ville(x, teeth=3, bands=mesh_bands(3), lag_window=3 * STEP // 2, n_bins=6 * STEP)
    assert_array_equal(features(x, teeth=3)["wigner_ville"], cells / (6 * STEP * STEP))


@pytest.mark.parametrize(("teeth", "n", "mesh_orders"), [(3, 48, 4), (12, 768, 4), (7, 100, 2), (12, 192, 1)])
def test_shapes_are_those_declared(teeth, n, mesh_orders):
    x = np.random.default_rng(n).normal(size=(2, 3, n))
    for name, values in features(x, teeth=teeth, mesh_orders=mesh_orders).items():
        shape = FEATURES[name].shape(teeth=teeth, n=n, mesh_orders=mesh_orders)
        assert values.shape == (2, 3, *shape), name
        assert values.dtype == np.float64
        assert math.prod(shape) > 1 or name in INDICATORS


def test_units_are_those_declared():
    x = average(12)
    before, after = features(x, teeth=12), features(8.0 * x, teeth=12)
    for name, feature in FEATURES.items():
        factor = {"signal": 8.0, "(signal)^2": 64.0, "-": 1.0}[feature.unit]
        assert_allclose(after[name], factor * before[name], rtol=1e-10, atol=1e-14, err_msg=name)


def test_some_features_only():
    x = average(12)
    every = features(x, teeth=12)
    some = features(x, teeth=12, names=["wigner_ville", "fm4"])
    assert list(some) == ["fm4", "wigner_ville"]
    for name, values in some.items():
        assert_array_equal(values, every[name])
    with pytest.raises(InputError, match=r"features: names has 'fm_4'; did you mean 'fm4'\?"):
        features(x, teeth=12, names=["fm_4"])


def test_options_of_the_separation_are_passed_on():
    x, options = average(12), {"mesh_harmonics": 2, "shaft_harmonics": 1, "sidebands": 2}
    values = features(x, teeth=12, **options)
    for name, value in indicators(x, teeth=12, **options).items():
        assert_array_equal(values[name], value)


def test_a_complex_average_is_refused():
    with pytest.raises(InputError, match="features: tsa must be real"):
        features(np.ones(96, dtype=complex), teeth=12)
