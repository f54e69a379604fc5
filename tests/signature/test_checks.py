"""What is refused: the message names function, argument, rule, value and remedy, and the error is a ValueError."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.signature import (
    crest_factor,
    demodulate,
    difference_signal,
    energy_operator,
    energy_ratio,
    fm0,
    fm4,
    indicators,
    kurtosis,
    m6a,
    m8a,
    mesh_bands,
    mesh_pulses,
    na4,
    na4_star,
    nb4,
    nb4_star,
    order_spectrum,
    peak_to_peak,
    pooled_wigner_ville,
    regular_signal,
    residual_signal,
    rms,
    sideband_energy_ratio,
    sideband_index,
    sideband_level_factor,
    synchronous_average,
    wigner_ville,
)

X = np.random.default_rng(0).normal(size=(2, 96))
BANDS = [0.0, 10.0, 48.0]

OF_ONE_SIGNAL = {
    "order_spectrum": (order_spectrum, {}),
    "rms": (rms, {}),
    "peak_to_peak": (peak_to_peak, {}),
    "crest_factor": (crest_factor, {}),
    "kurtosis": (kurtosis, {}),
    "energy_operator": (energy_operator, {}),
    "fm4": (fm4, {}),
    "m6a": (m6a, {}),
    "m8a": (m8a, {}),
    "fm0": (fm0, {"teeth": 8}),
    "regular_signal": (regular_signal, {"teeth": 8}),
    "residual_signal": (residual_signal, {"teeth": 8}),
    "difference_signal": (difference_signal, {"teeth": 8}),
    "sideband_index": (sideband_index, {"teeth": 8}),
    "sideband_level_factor": (sideband_level_factor, {"teeth": 8}),
    "sideband_energy_ratio": (sideband_energy_ratio, {"teeth": 8}),
    "indicators": (indicators, {"teeth": 8}),
    "demodulate": (demodulate, {"teeth": 8}),
    "na4": (na4, {}),
    "na4_star": (na4_star, {"baseline": 1}),
    "nb4": (nb4, {"teeth": 8}),
    "nb4_star": (nb4_star, {"teeth": 8, "baseline": 1}),
    "wigner_ville": (wigner_ville, {}),
    "pooled_wigner_ville": (pooled_wigner_ville, {"teeth": 8, "bands": BANDS}),
}
WITH_MESH = [name for name, (_, options) in OF_ONE_SIGNAL.items() if "teeth" in options and "bands" not in options]


def call(name, x=X, **options):
    function, usual = OF_ONE_SIGNAL[name]
    return function(x, **(usual | options))


@pytest.mark.parametrize("name", OF_ONE_SIGNAL)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_samples_must_be_finite(name, bad):
    x = X.copy()
    x[1, 5] = bad
    with pytest.raises(InputError, match=rf"^{name}: \w+ must be finite, but 1 of 192 samples are nan or inf; leave"):
        call(name, x)


@pytest.mark.parametrize("name", OF_ONE_SIGNAL)
def test_there_must_be_samples_and_they_must_be_numbers(name):
    for x in (np.float64(3.0), np.empty((2, 0))):
        with pytest.raises(InputError, match=rf"^{name}: \w+ of shape .* must have samples on its last axis; pass"):
            call(name, x)
    with pytest.raises(InputError, match=rf"^{name}: \w+ must hold numbers, not <U1; convert"):
        call(name, np.array(["a", "b"]))


@pytest.mark.parametrize("name", [n for n in OF_ONE_SIGNAL if not n.endswith("wigner_ville")])
def test_only_the_wigner_ville_functions_take_complex_samples(name):
    with pytest.raises(InputError, match=rf"^{name}: \w+ must be real, not complex128; pass its real part"):
        call(name, X + 0j)


def test_complex_samples_must_be_finite_too():
    with pytest.raises(InputError, match="must be finite"):
        wigner_ville(np.array([1.0, complex(0, np.nan)]))


def test_an_input_error_is_a_value_error():
    with pytest.raises(ValueError, match="rms"):
        rms([np.nan])


@pytest.mark.parametrize("name", [*WITH_MESH, "pooled_wigner_ville"])
@pytest.mark.parametrize("teeth", [0, -3, 8.0, 2.5, True, "8", None, [8]])
def test_teeth_must_be_a_count(name, teeth):
    with pytest.raises(InputError, match=rf"^{name}: teeth = .* must be an integer >= 1; pass"):
        call(name, teeth=teeth)


@pytest.mark.parametrize("name", [*WITH_MESH, "pooled_wigner_ville"])
def test_a_numpy_integer_is_a_count(name):
    call(name, teeth=np.int32(8))


@pytest.mark.parametrize("name", WITH_MESH)
def test_the_mesh_must_lie_below_nyquist(name):
    call(name, teeth=47)
    with pytest.raises(InputError, match=rf"^{name}: teeth = 48 must be below n/2 = 48, .* more samples a revolution"):
        call(name, teeth=48)


@pytest.mark.parametrize("name", ["regular_signal", "residual_signal", "difference_signal", "indicators", "fm0"])
def test_mesh_harmonics_must_be_a_count_that_fits(name):
    call(name, mesh_harmonics=5)
    for value in (-1, 2.0):
        with pytest.raises(InputError, match=rf"^{name}: mesh_harmonics = {value} must be an integer >= \d; pass"):
            call(name, mesh_harmonics=value)
    with pytest.raises(InputError, match=rf"^{name}: mesh_harmonics = 6 must be at most 5, .*; ask for fewer"):
        call(name, mesh_harmonics=6)


@pytest.mark.parametrize("name", ["indicators", "fm0"])
def test_fm0_needs_a_mesh_harmonic(name):
    with pytest.raises(InputError, match=rf"^{name}: mesh_harmonics = 0 must be an integer >= 1"):
        call(name, mesh_harmonics=0)


@pytest.mark.parametrize("name", ["regular_signal", "residual_signal", "difference_signal", "indicators"])
def test_shaft_harmonics_must_be_a_count_that_fits(name):
    call(name, shaft_harmonics=47)
    for value in (-1, None):
        with pytest.raises(InputError, match=rf"^{name}: shaft_harmonics = {value} must be an integer >= 0; pass"):
            call(name, shaft_harmonics=value)
    with pytest.raises(InputError, match=rf"^{name}: shaft_harmonics = 48 must be at most 47"):
        call(name, shaft_harmonics=48)


@pytest.mark.parametrize("name", ["difference_signal", "indicators"])
def test_sidebands_must_be_a_count(name):
    call(name, sidebands=10**12)
    with pytest.raises(InputError, match=rf"^{name}: sidebands = -1 must be an integer >= 0; pass"):
        call(name, sidebands=-1)


def test_there_must_be_a_pair_of_sidebands():
    with pytest.raises(InputError, match=r"^sideband_energy_ratio: pairs = 0 must be an integer >= 1; pass"):
        sideband_energy_ratio(X, teeth=8, pairs=0)


@pytest.mark.parametrize("moment", [fm4, m6a, m8a, na4])
def test_scales_must_be_sizes(moment):
    name = moment.__name__
    for scale in (-1.0, np.nan, np.inf, "large"):
        with pytest.raises(InputError, match=rf"^{name}: scale = .* must be finite and >= 0; pass max"):
            moment(X, scale=scale)
    with pytest.raises(InputError, match=rf"^{name}: scale of shape \(3,\) must broadcast to \(2,\); pass one"):
        moment(X, scale=[1.0, 2.0, 3.0])


def test_energy_ratio_is_of_two_parts_of_the_same_averages():
    with pytest.raises(InputError, match=r"^energy_ratio: difference of shape \(96,\) must have the shape of regular"):
        energy_ratio(X[0], X)
    with pytest.raises(InputError, match=r"^energy_ratio: regular must be finite"):
        energy_ratio(X[0], np.full(96, np.nan))
    with pytest.raises(InputError, match=r"^energy_ratio: scale = -1"):
        energy_ratio(X[0], X[0], scale=-1)


@pytest.mark.parametrize("name", ["wigner_ville", "pooled_wigner_ville"])
def test_windows_and_bins(name):
    call(name, lag_window=48, n_bins=97)
    with pytest.raises(InputError, match=rf"^{name}: lag_window has L = 49, which must be at most n//2 = 48, half"):
        call(name, lag_window=49, n_bins=200)
    with pytest.raises(InputError, match=rf"^{name}: n_bins = 40 must be at least 41 for the lags .*; ask"):
        call(name, lag_window=20, n_bins=40)
    with pytest.raises(InputError, match=rf"^{name}: n_bins = 40 must be at least 41"):
        call(name, lag_window=np.ones(21), n_bins=40)
    with pytest.raises(InputError, match=rf"^{name}: n_bins = 95 must be at least 96"):
        call(name, lag_window="full", n_bins=95)
    for n_bins in (0, 96.0):
        with pytest.raises(InputError, match=rf"^{name}: n_bins = .* must be an integer >= 1; pass"):
            call(name, n_bins=n_bins)
    for lag_window in (-1, 5.0, True):
        with pytest.raises(InputError, match=rf"^{name}: lag_window = .* must be an integer >= 0; pass"):
            call(name, lag_window=lag_window)
    with pytest.raises(InputError, match=rf'^{name}: lag_window = .half. must be "full", a half-length L or'):
        call(name, lag_window="half")
    for lag_window in ([], [[1.0]], [0.5, 0.2], [1.0, np.nan], [1.0, 0.5j]):
        with pytest.raises(InputError, match=rf"^{name}: lag_window of shape .* must be real, finite, one-dimensional"):
            call(name, lag_window=lag_window)


def test_the_full_window_between_zeros_needs_its_lags_only():
    wigner_ville(X, lag_window="full", boundary="zero", n_bins=95)
    with pytest.raises(InputError, match="n_bins = 94 must be at least 95"):
        wigner_ville(X, lag_window="full", boundary="zero", n_bins=94)


@pytest.mark.parametrize("boundary", ["linear", None, ["zero"]])
def test_there_are_two_boundaries(boundary):
    with pytest.raises(InputError, match=r'^wigner_ville: boundary = .* must be "circular" or "zero"; pass'):
        wigner_ville(X, boundary=boundary)


def test_windows_along_time_and_on_the_record():
    for time_window in (-1, 5.0, True):
        with pytest.raises(InputError, match=r"^wigner_ville: time_window = .* must be an integer >= 0; pass"):
            wigner_ville(X, time_window=time_window)
    for time_window in ([], [0.5], [1.0, np.inf]):
        with pytest.raises(InputError, match=r"^wigner_ville: time_window of shape .* must be real, finite, one-dim"):
            wigner_ville(X, time_window=time_window)
    with pytest.raises(InputError, match=r"^wigner_ville: time_window has L = 49, which must be at most n//2 = 48"):
        wigner_ville(X, time_window=49)
    with pytest.raises(InputError, match=r"^wigner_ville: time_window sums to -1, which must be above 0; pass weights"):
        wigner_ville(X, time_window=[1.0, -1.0])
    for record_window in (np.ones(95), np.ones((2, 96)), np.full(96, np.nan), np.ones(96) + 0j, 3):
        with pytest.raises(
            InputError, match=r"^wigner_ville: record_window of shape .* must be real, finite and of shape"
        ):
            wigner_ville(X, record_window=record_window)


def test_more_tooth_passes_than_samples():
    with pytest.raises(InputError, match=r"^pooled_wigner_ville: teeth = 97 must be at most n = 96, .* more samples"):
        call("pooled_wigner_ville", teeth=97)


def test_bands_must_increase_within_the_spectrum():
    for bands in ([3.0], 3.0, [[0.0, 1.0]], ["a", "b"], []):
        with pytest.raises(InputError, match=r"^pooled_wigner_ville: bands = .* must be a one-dimensional array"):
            call("pooled_wigner_ville", bands=bands)
    for bands in ([0.0, 1.0, 1.0], [0.0, 2.0, 1.0], [0.0, np.nan], [0.0, np.inf]):
        with pytest.raises(InputError, match=r"^pooled_wigner_ville: bands = .* must be finite and increasing; sort"):
            call("pooled_wigner_ville", bands=bands)
    for bands in ([-0.5, 1.0], [0.0, 48.1]):
        with pytest.raises(InputError, match=r"^pooled_wigner_ville: bands from .* must lie within orders 0 to n/2 ="):
            call("pooled_wigner_ville", bands=bands)
    call("pooled_wigner_ville", bands=[0.0, 48.0])


def test_band_edges_may_pass_nyquist_by_rounding():
    call("pooled_wigner_ville", bands=[0.0, np.nextafter(48.0, 49.0)])


@pytest.mark.parametrize("argument", ["teeth", "per_mesh_order", "mesh_orders"])
def test_mesh_bands_takes_counts(argument):
    for value in (0, 4.0):
        with pytest.raises(InputError, match=rf"^mesh_bands: {argument} = {value} must be an integer >= 1; pass"):
            mesh_bands(**({"teeth": 8} | {argument: value}))


def test_more_bands_than_memory_holds_are_refused():
    with pytest.raises(InputError, match=r"^mesh_bands: per_mesh_order \* mesh_orders = 1000000000000 must be at most"):
        sigdb.signature.mesh_bands(8, per_mesh_order=10**12, mesh_orders=1)


def test_samples_and_counts_have_a_limit():
    x = np.cos(2 * np.pi * 8 * np.arange(96) / 96)
    assert rms(1e299 * x) == pytest.approx(1e299 * np.sqrt(0.5))
    with pytest.raises(InputError, match=r"rms: tsa has a sample of 1e\+301; give it in a unit in which it is below"):
        rms(1e301 * x)
    with pytest.raises(InputError, match=r"n_bins = 6145 must be at most 6144; pass a smaller count"):
        wigner_ville(x, n_bins=6145)
    with pytest.raises(InputError, match=r"samples_per_rev = 16777217 must be at most 16777216"):
        synchronous_average(x, fs=96.0, pulse_times=np.arange(2.0), samples_per_rev=2**24 + 1)
    with pytest.raises(InputError, match=r"teeth = 16777217 must be at most 16777216"):
        mesh_pulses(x, fs=96.0, mesh_frequency=8.0, teeth=2**24 + 1)
