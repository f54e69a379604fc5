"""Indicators with a history, and demodulation, against values that follow from their definitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.signature import demodulate, fm4, na4, na4_star, nb4, nb4_star

N, TEETH = 768, 12
THETA = 2 * np.pi * np.arange(N) / N
EPS = np.finfo(np.float64).eps


def literal(d, baseline=None):
    """n sum d_m^4 / (mean over records of sum d_j^2)^2, record by record."""
    d = d - d.mean(axis=-1, keepdims=True)
    squares = np.sum(d**2, axis=-1)
    values = []
    for m in range(len(d)):
        history = squares[: m + 1] if baseline is None else squares[:baseline]
        values.append(d.shape[-1] * np.sum(d[m] ** 4) / np.mean(history) ** 2)
    return values


def test_growing_tones():
    # A tone of amplitude a has sum d^2 = n a^2 / 2 and sum d^4 = 3 n a^4 / 8.
    a = np.array([1.0, 1.0, 2.0, 3.0])
    residuals = a[:, None] * np.sin(17 * THETA) + 5.0
    means = np.cumsum(a**2) / np.arange(1, 5)
    assert_allclose(na4(residuals), 1.5 * a**4 / means**2, rtol=1e-12)
    assert_allclose(na4_star(residuals, baseline=2), 1.5 * a**4, rtol=1e-12)
    assert_allclose(na4_star(residuals, baseline=4), 1.5 * a**4 / (15 / 4) ** 2, rtol=1e-12)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 40), records=st.integers(1, 6), exponent=st.integers(-800, 800))
def test_the_literal_sums_in_any_unit(seed, n, records, exponent):
    r = 0.3 + np.random.default_rng(seed).normal(size=(records, n))
    assert_allclose(na4(r * 2.0**exponent), literal(r), rtol=1e-10)
    for baseline in (1, records):
        assert_allclose(na4_star(r * 2.0**exponent, baseline=baseline), literal(r, baseline), rtol=1e-10)


def test_the_first_record_is_its_own_history():
    r = np.random.default_rng(0).normal(size=(3, 100))
    assert_allclose(na4(r)[0], fm4(r[0]), rtol=1e-13)
    assert_allclose(na4_star(r, baseline=1)[0], fm4(r[0]), rtol=1e-13)


def test_steady_noise_gives_three():
    # Five standard errors of sum d^4 / n over 3 sigma^4: sqrt(96 / n), and less for the mean of the squares.
    r = np.random.default_rng(5).normal(size=(10, 20_000))
    assert_allclose(na4(r), 3.0, atol=5 * np.sqrt(96 / 20_000))
    assert_allclose(na4_star(r, baseline=8), 3.0, atol=5 * np.sqrt(96 / 20_000))


def test_later_records_do_not_matter():
    r = np.random.default_rng(1).normal(size=(6, 50))
    assert_allclose(na4(r[:4]), na4(r)[:4], rtol=1e-13)
    assert_allclose(na4_star(r[:4], baseline=3), na4_star(r, baseline=3)[:4], rtol=1e-13)


def modulated(depth, mesh=(1.0, 0.4), order=2):
    """A mesh of two harmonics of which the first has an envelope 1 + depth cos(order theta)."""
    return mesh[0] * (1 + depth * np.cos(order * THETA)) * np.cos(TEETH * THETA) + mesh[1] * np.cos(2 * TEETH * THETA)


def test_envelopes_of_a_modulated_mesh():
    depths = np.array([0.1, 0.1, 0.3])
    averages = np.stack([modulated(a) for a in depths])
    means = np.cumsum(depths**2) / np.arange(1, 4)
    assert_allclose(nb4(averages, teeth=TEETH), 1.5 * depths**4 / means**2, rtol=1e-9)
    assert_allclose(nb4_star(averages, teeth=TEETH, baseline=1), 1.5 * (depths / 0.1) ** 4, rtol=1e-9)


def test_the_band_is_half_way_to_the_next_harmonics():
    # Twelve teeth: 5 orders to either side. A modulation of order 6 is outside of it, one of order 5 is inside.
    inside, outside = modulated(0.2, order=5), modulated(0.2, order=6)
    assert_allclose(nb4([inside], teeth=TEETH), 1.5, rtol=1e-9)
    assert np.isnan(nb4([outside], teeth=TEETH)).all()


def test_the_dominant_harmonic_is_that_of_the_mean_over_all_records():
    # The second harmonic is weaker in one record and stronger on the whole; only it is modulated.
    tooth = TEETH * THETA
    strong = (1 + 0.2 * np.cos(THETA)) * np.cos(2 * tooth)
    averages = np.stack([np.cos(tooth) + 0.9 * strong, 0.5 * np.cos(tooth) + strong])
    assert_allclose(nb4_star(averages, teeth=TEETH, baseline=1), [1.5, 1.5 * (1 / 0.9) ** 4], rtol=1e-9)
    assert np.isnan(nb4(averages[:1], teeth=TEETH)).all()  # the first harmonic, which is steady


def test_each_history_chooses_its_own_harmonic():
    first = np.stack([modulated(0.1), modulated(0.2)])
    second = np.stack([modulated(0.1, mesh=(0.2, 1.0)), modulated(0.2, mesh=(0.2, 1.0))])
    both = nb4(np.stack([first, second]), teeth=TEETH)
    assert both.shape == (2, 2)
    assert_allclose(both[0], nb4(first, teeth=TEETH), rtol=1e-10)
    assert np.isnan(both[1]).all()


def test_batches_of_histories():
    r = np.random.default_rng(0).normal(size=(2, 3, 5, 96))
    for indicator, options in ((na4, {}), (na4_star, {"baseline": 2})):
        assert_allclose(indicator(r, **options)[1, 2], indicator(r[1, 2], **options), rtol=1e-12)
    for indicator, options in ((nb4, {}), (nb4_star, {"baseline": 2})):
        assert_allclose(indicator(r, teeth=8, **options)[1, 2], indicator(r[1, 2], teeth=8, **options), rtol=1e-10)
    assert na4(r[:, :, :0]).shape == nb4(r[:, :, :0], teeth=8).shape == (2, 3, 0)
    assert na4(r[:, :0]).shape == (2, 0, 5)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turn=st.integers(-100, 100))
def test_turning_changes_nothing(seed, turn):
    r = np.random.default_rng(seed).normal(size=(3, 96))
    turned = np.roll(r, turn, axis=-1)
    assert_allclose(na4(turned), na4(r), rtol=1e-11)
    assert_allclose(nb4(turned, teeth=8), nb4(r, teeth=8), rtol=1e-9)


LIMIT = np.sqrt(2) * 64 * EPS
"""Amplitude of a tone, over the scale, up to which it counts as rounding."""


def test_a_history_without_variance():
    silent, tone = np.zeros(N), np.sin(5 * THETA)
    values = na4([silent, silent, tone])
    assert np.isnan(values).tolist() == [True, True, False]
    assert_allclose(values[2], 1.5 * 9, rtol=1e-12)
    assert np.isnan(na4_star([silent, tone], baseline=1)).all()
    assert_array_equal(na4_star([tone, silent], baseline=1)[1], 0.0)
    assert np.isnan(nb4([silent, np.full(N, 3.0)], teeth=TEETH)).all()


def test_the_limit_is_that_of_the_scales_of_the_same_records():
    tone = np.sin(5 * THETA)
    assert np.isnan(na4([0.999 * LIMIT * tone], scale=[1.0])).all()
    assert np.isfinite(na4([1.001 * LIMIT * tone], scale=[1.0])).all()
    # A scale of one record serves the mean over both: a tone of the larger is needed.
    both = [LIMIT * tone, 1.1 * 3 * LIMIT * tone]
    assert np.isfinite(na4(both, scale=[0.5, 3.0])).all()
    assert np.isnan(na4(both, scale=[2.0, 3.5])).all()
    with pytest.raises(InputError, match=r"^na4: scale of shape \(3,\) must broadcast to \(2,\); pass one"):
        na4(both, scale=[1.0, 1.0, 1.0])


def test_a_steady_envelope_has_no_variance():
    # Separation leaves rounding, which by itself looks like a signal.
    assert np.isnan(nb4([1e6 * modulated(0.0)], teeth=TEETH)).all()
    assert np.isnan(nb4([modulated(0.0).astype(np.float32)], teeth=TEETH)).all()
    assert np.isfinite(nb4([modulated(1e-12)], teeth=TEETH)).all()


def test_the_limits_of_an_envelope_and_of_a_carrier():
    # An envelope 1 + depth cos(2 theta) has the variance depth^2 / 2, the record the scale 1 + depth.
    assert np.isnan(nb4([modulated(0.97 * LIMIT, mesh=(1.0, 0.0))], teeth=TEETH)).all()
    assert np.isfinite(nb4([modulated(1.03 * LIMIT, mesh=(1.0, 0.0))], teeth=TEETH)).all()
    # A carrier of amplitude a has |c| = a.
    for factor, found in ((0.9, False), (1.1, True)):
        x = np.cos(5 * THETA) + factor * 64 * EPS * np.cos(30 * THETA)
        assert np.isfinite(demodulate(x, teeth=30, half_width=0)[0]).all() == found


@pytest.mark.parametrize("teeth", [1, 2])
def test_a_band_of_one_order_has_a_constant_envelope(teeth):
    assert np.isnan(nb4(np.random.default_rng(0).normal(size=(2, 32)), teeth=teeth)).all()


def test_there_must_be_records():
    for call in (
        lambda x: na4(x),
        lambda x: na4_star(x, baseline=1),
        lambda x: nb4(x, teeth=8),
        lambda x: nb4_star(x, teeth=8, baseline=1),
    ):
        with pytest.raises(
            InputError, match=r"^n\w4\w*: \w+ of shape \(96,\) must be \(..., records, n\); pass a history"
        ):
            call(np.zeros(96))


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("na4_star", lambda b: na4_star(np.eye(3), baseline=b)),
        ("nb4_star", lambda b: nb4_star(np.eye(3), teeth=1, baseline=b)),
    ],
)
def test_a_baseline_is_a_count_of_records(name, call):
    for value in (0, 1.0, None):
        with pytest.raises(InputError, match=rf"^{name}: baseline = {value} must be an integer >= 1; pass"):
            call(value)
    with pytest.raises(InputError, match=rf"^{name}: baseline = 4 must be at most 3, the count of records; pass the"):
        call(4)


A, B = 0.3 * np.cos(THETA + 0.4), 0.1 * np.sin(2 * THETA)


def test_modulations_of_a_carrier():
    # In the band of 12 teeth, 5 orders, the modulation by b is cut where J_k(0.1) < 1e-5: three times order 2.
    amplitude, phase = demodulate(7.0 + 2.0 * (1 + A) * np.cos(TEETH * THETA + B + 1.3), teeth=TEETH)
    assert_allclose(amplitude, A, atol=1e-4)
    assert_allclose(phase, B, atol=1e-4)


@pytest.mark.parametrize("harmonic", [1, 3, 20])
def test_narrow_modulations_are_exact(harmonic):
    # c = 1 + m e^(j theta) + conj: a carrier with amplitude modulation alone, or with one sideband.
    carrier = harmonic * TEETH * THETA
    amplitude, phase = demodulate((1 + A) * np.cos(carrier + 0.5), teeth=TEETH, harmonic=harmonic)
    assert_allclose(amplitude, A, atol=1e-12)
    assert_allclose(phase, 0, atol=1e-12)
    c = 1 + 0.4 * np.exp(3j * THETA)
    amplitude, phase = demodulate(np.cos(carrier) + 0.4 * np.cos(carrier + 3 * THETA), teeth=TEETH, harmonic=harmonic)
    assert_allclose(amplitude, np.abs(c) / np.abs(c).mean() - 1, atol=1e-12)
    assert_allclose(phase, np.angle(c), atol=1e-12)


def test_other_harmonics_are_outside_the_band():
    x = (1 + A) * np.cos(TEETH * THETA) + 3 * np.cos(2 * TEETH * THETA) + np.cos(6 * THETA) + np.cos(18 * THETA)
    assert_allclose(demodulate(x, teeth=TEETH)[0], A, atol=1e-12)
    assert np.abs(demodulate(x, teeth=TEETH, half_width=6)[0] - A).max() > 0.1


def test_the_half_width_can_be_chosen():
    x = (1 + A + 0.2 * np.cos(3 * THETA)) * np.cos(TEETH * THETA)
    assert_allclose(demodulate(x, teeth=TEETH, half_width=2)[0], A, atol=1e-12)
    assert_allclose(demodulate(x, teeth=TEETH, half_width=0)[0], 0, atol=1e-12)
    assert_allclose(demodulate(x, teeth=TEETH, half_width=10**9)[0], A + 0.2 * np.cos(3 * THETA), atol=1e-12)


def test_a_phase_that_turns_over_is_unwrapped():
    # The stronger tone is one order above the carrier: the phase gains a turn.
    phase = demodulate(np.cos((TEETH + 1) * THETA), teeth=TEETH)[1]
    assert_allclose(phase, THETA - THETA.mean(), atol=1e-12)


def test_orders_outside_the_spectrum_are_not_in_the_band():
    theta = 2 * np.pi * np.arange(16) / 16
    x = 4.0 + np.cos(6 * theta) + 0.5 * np.cos(7 * theta) + (-1.0) ** np.arange(16)
    amplitude, phase = demodulate(x, teeth=6, half_width=20)
    c = 1 + 0.5 * np.exp(1j * theta)
    assert_allclose(amplitude, np.abs(c) / np.abs(c).mean() - 1, atol=1e-12)
    assert_allclose(phase, np.angle(c), atol=1e-12)


def test_demodulation_turns_with_the_signal_by_teeth():
    x = np.random.default_rng(0).normal(size=N)
    for before, after in zip(demodulate(x, teeth=TEETH), demodulate(np.roll(x, 64), teeth=TEETH), strict=True):
        # A phase that winds is cut at the record's start, so only its steps are compared.
        steps = np.diff(np.exp(1j * after))
        assert_allclose(np.abs(steps)[64:], np.abs(np.diff(np.exp(1j * np.roll(before, 64))))[64:], atol=1e-9)


def test_without_a_carrier_there_is_no_modulation():
    x = np.stack([np.cos(30 * THETA), np.cos(TEETH * THETA), np.zeros(N)])
    for modulation in demodulate(x, teeth=TEETH):
        assert modulation.shape == (3, N)
        assert np.isnan(modulation).all(axis=-1).tolist() == [True, False, True]


def test_harmonics_and_half_widths_are_counts():
    x = np.random.default_rng(0).normal(size=96)
    for value in (0, 1.0):
        with pytest.raises(InputError, match=rf"^demodulate: harmonic = {value} must be an integer >= 1; pass"):
            demodulate(x, teeth=8, harmonic=value)
    with pytest.raises(
        InputError, match=r"^demodulate: harmonic = 6 must be at most 5, the harmonics of order 8 below"
    ):
        demodulate(x, teeth=8, harmonic=6)
    with pytest.raises(InputError, match=r"^demodulate: half_width = -1 must be an integer >= 0; pass"):
        demodulate(x, teeth=8, half_width=-1)
