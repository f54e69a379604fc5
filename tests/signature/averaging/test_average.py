"""Synchronous averages of records whose average is known: tones, run-ups, ripple, comb, ends, blocks."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.signature import SynchronousAverager, synchronous_average

GAIN = 3e-6
"""What the kernel's gain is stated to be within, of 1, up to 0.38 of the sampling rate."""


def angle(n):
    return 2 * np.pi * np.arange(n) / n


def tones(theta, amplitudes):
    """A sum of cosines of an angle in radians, each with a phase of its own."""
    return sum(a * np.cos(o * theta + 0.3 * o) for o, a in amplitudes.items())


def times_at(revolutions, inverse, rate):
    """Times at which an increasing angle, in revolutions, reaches the given ones, by Newton's rule."""
    t = np.asarray(revolutions, dtype=float) / rate(0.0)
    for _ in range(60):
        t = t - (inverse(t) - revolutions) / rate(t)
    return t


AMPLITUDES = {1: 0.4, 12: 1.0, 11: 0.2, 24: 0.5, 96: 0.3, 140: 0.1}


@pytest.mark.parametrize("fs", [1.0, 20_000.0])
@pytest.mark.parametrize("length", [500.0, 431.7, 612.3])
def test_whole_orders_of_a_steady_record_stay_what_they_are(fs, length):
    # From the first sample to the last there are whole revolutions: no end leaves a mark.
    M, n = 12, 384
    N = int(np.ceil(M * length))
    x = tones(2 * np.pi * np.arange(N) / length, AMPLITUDES)
    average = synchronous_average(x, fs, np.arange(M + 1) * length / fs, samples_per_rev=n)
    assert average.revolutions == M
    size = sum(AMPLITUDES.values())
    assert_allclose(average.tsa, tones(angle(n), AMPLITUDES), atol=GAIN * size)
    assert_allclose(average.scatter, 0, atol=GAIN * size)


@pytest.mark.parametrize("fraction", [0.001, 0.01, 0.1, 0.2, 0.3, 0.38])
def test_the_gain_of_the_interpolation(fraction):
    # One revolution of 1000 samples, taken at 4096 angles: every place between two samples.
    record = np.arange(-200, 1300)
    x = np.cos(2 * np.pi * fraction * record + 0.4)
    average = synchronous_average(x, 1.0, [200.0, 1200.0], samples_per_rev=4096)
    expected = np.cos(2 * np.pi * fraction * 1000 * np.arange(4096) / 4096 + 0.4)
    assert_allclose(average.tsa, expected, atol=GAIN)


@pytest.mark.parametrize("tone", [0.02, 0.1, 0.3])
def test_the_ends_of_the_record_leave_no_mark(tone):
    # Phases at the ends are arbitrary; a mirrored or zero continuation is wrong by 0.1 and more.
    x = np.cos(2 * np.pi * tone * np.arange(1000) + 1.1) + 3.0
    average = synchronous_average(x, 1.0, [0.0, 1000.0], samples_per_rev=4000)
    assert_allclose(average.tsa, np.cos(2 * np.pi * tone * np.arange(4000) / 4 + 1.1) + 3.0, atol=4 * GAIN)


def test_a_constant_stays_exactly_what_it_is():
    average = synchronous_average(np.full(700, -2.5), 1.0, [3.3, 103.3, 203.3], samples_per_rev=77)
    assert_allclose(average.tsa, -2.5, rtol=1e-13)


@pytest.mark.parametrize("order", [3.3, 7.5, 12.04])
@pytest.mark.parametrize("M", [1, 5, 8])
def test_other_orders_pass_as_a_comb_lets_them(order, M):
    # 1/M sum_r exp(2 pi j nu r) = sin(pi M nu) / (M sin(pi nu)) exp(j pi nu (M - 1)).
    n, length = 256, 400
    x = np.cos(2 * np.pi * order * np.arange((M + 1) * length) / length + 0.2)
    average = synchronous_average(x, 1.0, np.arange(M + 1) * float(length), samples_per_rev=n, revolutions=M)
    gain = np.sin(np.pi * M * order) / (M * np.sin(np.pi * order)) * np.exp(1j * np.pi * order * (M - 1))
    assert_allclose(average.tsa, np.real(gain * np.exp(1j * (order * angle(n) + 0.2))), atol=2 * GAIN)


def run_up(fs=5000.0, start=8.0, acceleration=2.0, seconds=6.0):
    """Record and angle of a shaft under constant acceleration, rev/s^2; the k-th part of a turn in closed form."""
    t = np.arange(int(seconds * fs)) / fs
    theta = 2 * np.pi * (start * t + acceleration * t**2 / 2)
    turns = start * seconds + acceleration * seconds**2 / 2

    def pulses(k):
        p = np.arange(int(turns * k) + 1) / k
        return (np.sqrt(start**2 + 2 * acceleration * p) - start) / acceleration

    return fs, theta, pulses


@pytest.mark.parametrize(("k", "error"), [(1, 2e-3), (4, 1e-5)])
def test_a_run_up(k, error):
    fs, theta, pulses = run_up()
    n = 64 * 12
    average = synchronous_average(tones(theta, {1: 0.5, 12: 1.0}), fs, pulses(k), samples_per_rev=n, pulses_per_rev=k)
    assert_allclose(average.tsa, tones(angle(n), {1: 0.5, 12: 1.0}), atol=error)
    assert np.max(average.scatter) < 10 * error
    # A straight line from pulse to pulse is off by up to alpha T^2 / 8 rev of the shaft, here 12 times that in phase.
    straight = 12 * 2 * np.pi * 2.0 / 8**2 / 8
    assert error < straight / 15


def test_a_pulse_wheel_follows_a_ripple_of_the_speed():
    # The speed swings by 5 %, three times and a half a revolution: one pulse a revolution cannot see it, 60 can.
    fs, f, n = 20_000.0, 10.0, 12 * 64

    def turned(t):
        return f * t + 0.05 * f / (2 * np.pi * 35) * np.sin(2 * np.pi * 35 * t)

    def rate(t):
        return f + 0.05 * f * np.cos(2 * np.pi * 35 * t)

    record = tones(2 * np.pi * turned(np.arange(40_000) / fs), {2: 0.3, 12: 1.0})
    expected = tones(angle(n), {2: 0.3, 12: 1.0})
    wheel = times_at(np.arange(60 * 19 + 1) / 60, turned, rate)
    good = synchronous_average(record, fs, wheel, samples_per_rev=n, pulses_per_rev=60)
    assert_allclose(good.tsa, expected, atol=2e-4)
    blind = synchronous_average(record, fs, wheel[::60], samples_per_rev=n)
    assert np.abs(blind.tsa - expected).max() > 0.01


def test_the_average_of_a_gear_that_the_tacho_s_shaft_drives():
    # 12 teeth drive 36: the tacho's shaft turns three times in a revolution of the gear.
    length = 900.0
    gear = {1: 0.7, 36: 1.0, 37: 0.2}
    x = tones(2 * np.pi * np.arange(20_000) / length, gear) + tones(6 * np.pi * np.arange(20_000) / length, {1: 0.3})
    pulses = 57.3 + np.arange(61) * length / 3
    average = synchronous_average(x, 1.0, pulses, samples_per_rev=512, ratio=12 / 36)
    assert average.revolutions == 20
    turned = angle(512) + 2 * np.pi * 57.3 / length
    assert_allclose(average.tsa, tones(turned, gear) + tones(3 * turned, {1: 0.3}), atol=1e-5)


@pytest.mark.parametrize("ratio", [1 / 3, 12 / 41, 0.1, 7 / 5])
def test_a_ratio_loses_no_revolution_to_rounding(ratio):
    whole = {1 / 3: 3, 12 / 41: 41, 0.1: 10, 7 / 5: 5}[ratio]  # turns of the tacho for whole ones of the gear
    turns = round(whole * ratio)
    pulses = np.arange(4 * whole + 1) * 100.0
    average = synchronous_average(np.zeros(400 * whole), 1.0, pulses, samples_per_rev=50, ratio=ratio)
    assert average.revolutions == 4 * turns


def test_pulses_of_a_wheel_bound_whole_revolutions():
    # 4 k + 1 pulses bound 4 revolutions; three more do not make a fifth.
    x = np.zeros(3000)
    for surplus, revolutions in ((0, 4), (3, 4), (5, 5), (-1, 3)):
        pulses = 10.0 + np.arange(4 * 5 + 1 + surplus) * 100.0
        average = synchronous_average(x, 1.0, pulses, samples_per_rev=64, pulses_per_rev=5)
        assert average.revolutions == revolutions
        assert type(average.revolutions) is int


def test_revolutions_after_the_record_do_not_count():
    x = tones(angle(100)[np.arange(1050) % 100], {3: 1.0})
    average = synchronous_average(x, 1.0, np.arange(40) * 100.0, samples_per_rev=64)
    assert average.revolutions == 10
    assert_allclose(average.tsa, tones(angle(64), {3: 1.0}), atol=1e-5)


def test_the_number_of_revolutions_can_be_chosen():
    rng = np.random.default_rng(0)
    x, pulses = rng.normal(size=5000), np.arange(50) * 100.0
    chosen = synchronous_average(x, 1.0, pulses, samples_per_rev=64, revolutions=12)
    assert chosen.revolutions == 12
    cut = synchronous_average(x[:1400], 1.0, pulses[:14], samples_per_rev=64, revolutions=12)
    assert_allclose(chosen.tsa, cut.tsa, atol=1e-12)


def test_the_scatter_is_the_deviation_between_revolutions():
    # Half an order changes its sign from one revolution to the next: +-cos(theta / 2), M of them, mean 0 for even M.
    M, length = 10, 300
    t = np.arange((M + 1) * length) / length
    x = tones(2 * np.pi * t, {4: 1.0}) + 0.5 * np.cos(np.pi * t)
    average = synchronous_average(x, 1.0, np.arange(M + 1) * float(length), samples_per_rev=128, revolutions=M)
    assert_allclose(average.tsa, tones(angle(128), {4: 1.0}), atol=1e-5)
    assert_allclose(average.scatter, 0.5 * np.abs(np.cos(angle(128) / 2)) * np.sqrt(M / (M - 1)), atol=1e-5)


def test_one_revolution_has_no_scatter():
    average = synchronous_average(np.arange(300.0), 1.0, [100.0, 200.0], samples_per_rev=10)
    assert np.isnan(average.scatter).all()
    assert_allclose(average.tsa, 100 + 10 * np.arange(10), rtol=1e-6)


def test_noise_goes_down_with_the_root_of_the_revolutions():
    x = np.random.default_rng(3).normal(size=100_500)
    average = synchronous_average(x, 1.0, 100.5 + np.arange(401) * 250.0, samples_per_rev=500)
    ratio = np.std(average.tsa) / np.sqrt(np.mean(average.scatter**2))
    # The standard error of a standard deviation from some 250 independent samples is 1 / sqrt(500).
    assert_allclose(ratio * np.sqrt(average.revolutions), 1.0, atol=5 / np.sqrt(500))


ALIAS = {10: 1.0, 90: 0.5, 300: 0.8, 700: 0.6}


def test_orders_above_half_the_samples_do_not_fold_back():
    # At 256 samples order 300 would appear at 44 and order 700 at 68.
    x = tones(2 * np.pi * np.arange(20_480) / 2048, ALIAS)
    average = synchronous_average(x, 1.0, np.arange(11) * 2048.0, samples_per_rev=256)
    assert_allclose(average.tsa, tones(angle(256), {o: ALIAS[o] for o in (10, 90)}), atol=1e-5)


def test_noise_above_half_the_samples_does_not_fold_back_either():
    x = np.random.default_rng(4).normal(size=64 * 3000)
    average = synchronous_average(x, 1.0, np.arange(64) * 3000.0, samples_per_rev=300)
    # White noise keeps the tenth of its variance that lies below order 150, short of the edge of the kernel.
    assert 0.085 < np.mean(average.scatter**2) < 0.105


@pytest.mark.parametrize("length", [1023.999, 1024.0, 1024.001, 1030.0])
def test_rounding_does_not_decide_on_the_filter(length):
    # Order 0.37 of the sampling rate is in the transition of any wider kernel.
    x = np.cos(2 * np.pi * 380 * np.arange(4500) / length)
    average = synchronous_average(x, 1.0, np.arange(5) * length, samples_per_rev=1024)
    assert_allclose(average.tsa, np.cos(380 * angle(1024)), atol=1e-5)


def test_a_shaft_that_slows_down_is_filtered_revolution_by_revolution():
    fs, theta, pulses = run_up(start=10.0, acceleration=-0.8, seconds=10.0)
    x = tones(theta, {5: 1.0, 100: 0.7})
    average = synchronous_average(x, fs, pulses(60), samples_per_rev=128, pulses_per_rev=60)
    assert_allclose(average.tsa, tones(angle(128), {5: 1.0}), atol=1e-4)


@settings(max_examples=15, deadline=None)
@given(shift=st.integers(0, 7))
def test_a_later_mark_turns_the_average(shift):
    length, n = 513.7, 64 * 8
    x = tones(2 * np.pi * np.arange(9000) / length, AMPLITUDES)
    pulses = np.arange(8 * 16 + 1) * length / 8
    whole = synchronous_average(x, 1.0, pulses, samples_per_rev=n, pulses_per_rev=8)
    later = synchronous_average(x, 1.0, pulses[shift:], samples_per_rev=n, pulses_per_rev=8)
    assert_allclose(later.tsa, np.roll(whole.tsa, -shift * 64), atol=2e-5)


def test_channels_share_a_tacho():
    x = np.random.default_rng(0).normal(size=(2, 3, 4000))
    pulses = np.arange(13) * 301.3 + 5
    average = synchronous_average(x, 1.0, pulses, samples_per_rev=256)
    assert average.tsa.shape == average.scatter.shape == (2, 3, 256)
    one = synchronous_average(x[1, 2], 1.0, pulses, samples_per_rev=256)
    assert_allclose(average.tsa[1, 2], one.tsa, atol=1e-13)
    assert_allclose(average.scatter[1, 2], one.scatter, atol=1e-13)


def test_the_average_is_linear():
    rng = np.random.default_rng(1)
    (x, y), pulses = rng.normal(size=(2, 4000)), np.cumsum(rng.uniform(290, 310, size=13))
    options = {"fs": 1.0, "pulse_times": pulses, "samples_per_rev": 256}
    both = synchronous_average(2 * x - 3 * y, **options).tsa
    apart = 2 * synchronous_average(x, **options).tsa - 3 * synchronous_average(y, **options).tsa
    # The ends are predicted, which is not linear: three of the twelve revolutions' samples there are.
    assert_allclose(both[20:-20], apart[20:-20], atol=1e-10)


def test_single_precision_in_double_precision_out():
    x = np.random.default_rng(2).normal(size=3000).astype(np.float32)
    single = synchronous_average(x, 1.0, np.arange(11) * 300.0, samples_per_rev=256)
    double = synchronous_average(x.astype(np.float64), 1.0, np.arange(11) * 300.0, samples_per_rev=256)
    assert single.tsa.dtype == np.float64
    assert_array_equal(single.tsa, double.tsa)


def test_the_record_is_left_as_it_is():
    x = np.random.default_rng(2).normal(size=3000)
    before = x.copy()
    x.flags.writeable = False
    synchronous_average(x, 1.0, np.arange(11) * 300.0, samples_per_rev=256)
    assert_array_equal(x, before)


def in_blocks(x, pulses, sizes, **options):
    """Feed a record in blocks, each with the pulses that fall into it and, at the end, all the rest."""
    averager = SynchronousAverager(1.0, **options)
    start = 0
    for size in sizes:
        stop = min(start + size, x.shape[-1])
        until = np.inf if stop == x.shape[-1] else stop
        averager.push(x[..., start:stop], pulses[(pulses >= start) & (pulses < until)])
        start = stop
        if start == x.shape[-1]:
            break
    return averager.result()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.sampled_from([60, 256, 700]), k=st.sampled_from([1, 4]), big=st.booleans())
def test_blocks_give_the_same_numbers(seed, n, k, big):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(2, 30_000))
    # The speed drifts by a half: kernels of several widths.
    pulses = 30 + np.cumsum(300 * (1.25 + 0.5 * np.sin(np.arange(74 * k) / (10 * k)))) / k
    sizes = rng.integers(1, 9000 if big else 900, size=400)
    sizes[-1] = 30_000
    options = {"samples_per_rev": n, "pulses_per_rev": k}
    whole, parts = synchronous_average(x, 1.0, pulses, **options), in_blocks(x, pulses, sizes, **options)
    assert parts.revolutions == whole.revolutions > 50
    assert_allclose(parts.tsa, whole.tsa, atol=1e-11)
    assert_allclose(parts.scatter, whole.scatter, atol=1e-11)


def test_pulses_may_come_early_or_late():
    x = np.random.default_rng(0).normal(size=20_000)
    pulses = 30.0 + np.arange(66) * 300.7
    whole = synchronous_average(x, 1.0, pulses, samples_per_rev=256)
    early = SynchronousAverager(1.0, samples_per_rev=256)
    early.push(x[:100], pulses)
    for start in range(100, 20_000, 97):
        early.push(x[start : min(start + 97, 20_000)])
    late = SynchronousAverager(1.0, samples_per_rev=256)
    late.push(x[:-100])
    late.push(x[-100:], pulses)
    for averager in (early, late):
        assert_allclose(averager.result().tsa, whole.tsa, atol=1e-12)


def test_short_revolutions_wait_for_what_the_beginning_is_predicted_from():
    # 80 samples a revolution and two between pulses: several revolutions lie within the first 256 samples.
    x = np.random.default_rng(0).normal(size=5000)
    pulses = np.arange(2400) * 2.0
    options = {"samples_per_rev": 64, "pulses_per_rev": 40}
    whole = synchronous_average(x, 1.0, pulses, **options)
    parts = in_blocks(x, pulses, [30] * 167, **options)
    assert parts.revolutions == whole.revolutions
    assert_allclose(parts.tsa, whole.tsa, atol=1e-12)


def test_a_result_on_the_way_is_that_of_the_record_so_far():
    x = np.random.default_rng(0).normal(size=20_000)
    pulses = 30.0 + np.arange(66) * 300.7
    averager = SynchronousAverager(1.0, samples_per_rev=256)
    for stop in range(1000, 20_001, 1000):
        averager.push(x[stop - 1000 : stop], pulses[(pulses >= stop - 1000) & (pulses < stop)])
        so_far = averager.result()
        whole = synchronous_average(x[:stop], 1.0, pulses[pulses < stop], samples_per_rev=256)
        assert so_far.revolutions == whole.revolutions
        assert_allclose(so_far.tsa, whole.tsa, atol=1e-12)


@pytest.mark.parametrize("most", [None, 40])
def test_blocks_take_bounded_memory(most):
    block, length = np.random.default_rng(0).normal(size=20_000), 400.0
    averager = SynchronousAverager(1.0, samples_per_rev=256, revolutions=most)

    def push(i):
        averager.push(block, i * 20_000 + np.arange(50) * length)

    for i in range(4):
        push(i)
    tracemalloc.start()
    for i in range(4, 40):
        push(i)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 2 * block.nbytes  # of 36 blocks
    assert averager.result().revolutions == (most or 1999)


def test_what_comes_after_the_last_revolution_asked_for_is_let_go():
    averager = SynchronousAverager(1.0, samples_per_rev=16, pulses_per_rev=3, ratio=0.7, revolutions=5)
    averager.push(np.random.default_rng(0).normal(size=6000), np.arange(300) * 20.0)
    before = averager.result()
    tracemalloc.start()
    for i in range(1, 100):
        averager.push(np.zeros(6000), i * 6000 + np.arange(300) * 20.0)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 20_000  # bytes; the pulses alone are 240 000
    assert_array_equal(averager.result().tsa, before.tsa)


def test_a_sudden_slowness_gives_the_same_numbers_in_blocks():
    # Within a few revolutions one takes four times as long as those before.
    x = np.random.default_rng(0).normal(size=40_000)
    slow = [540.0, 800.0, 1200.0, 800.0, 540.0]
    pulses = np.cumsum(np.r_[10.0, np.full(40, 300.0), np.full(25, 360.0), slow, np.full(25, 400.0)])
    whole = synchronous_average(x, 1.0, pulses, samples_per_rev=128)
    parts = in_blocks(x, pulses, [500] * 80, samples_per_rev=128)
    assert parts.revolutions == whole.revolutions == 95
    assert_allclose(parts.tsa, whole.tsa, atol=1e-11)


def test_coasting_down_gives_the_same_numbers_in_blocks():
    # With 40 pulses a revolution, each 5 % longer than the last, a revolution takes seven times as long as the last.
    x = np.random.default_rng(0).normal(size=120_000)
    pulses = np.cumsum(np.r_[np.full(8000, 2.0), 2.0 * 1.05 ** np.arange(159)])
    options = {"samples_per_rev": 16, "pulses_per_rev": 40}
    whole = synchronous_average(x, 1.0, pulses, **options)
    parts = in_blocks(x, pulses, [300] * 400, **options)
    assert parts.revolutions == whole.revolutions == 203
    assert_allclose(parts.tsa, whole.tsa, atol=1e-11)


def test_pulses_that_bend_the_spline_back_are_refused():
    pulses = np.cumsum(np.r_[10.0, np.full(20, 100.0), 1000.0, 1000.0, np.full(20, 100.0)])
    with pytest.raises(InputError, match=r"pulse_times are so uneven near \d+ s that .* runs backwards; a pulse"):
        synchronous_average(np.zeros(6100), 1.0, pulses, samples_per_rev=64)


EVEN = 100.0 * np.arange(40)


@pytest.mark.parametrize("per_rev", [1, 5])
@pytest.mark.parametrize(
    ("pulses", "where"),
    [
        (np.delete(EVEN, 20), 1900),
        (np.sort(np.append(EVEN, 1550.0)), 1500),
        (np.sort(np.append(EVEN, 1501.0)), 1400),
        (np.sort(np.append(EVEN, 1590.0)), 1500),
        (100.0 * (np.delete(EVEN, 20) / 100.0) ** 1.1, None),
    ],
    ids=["missing", "halfway", "at once", "late", "missing while slowing down"],
)
def test_a_missing_or_a_false_pulse_is_refused(pulses, where, per_rev):
    """Every angle behind it would be off by a pulse, without any other sign of it."""
    at = r"\d+(\.\d+)?" if where is None else str(where)
    with pytest.raises(
        InputError, match=rf"an interval of pulse_times about {at} s stands out .* missing or false there"
    ):
        synchronous_average(np.zeros(7000), 1.0, pulses, samples_per_rev=64, pulses_per_rev=per_rev)


def test_uneven_wheels_and_steep_run_ups_are_not_refused():
    rng = np.random.default_rng(2)
    wheel = np.cumsum(100.0 * (1 + 0.2 * rng.uniform(-1, 1, 60)))
    run_up = 1000.0 * np.sqrt(np.arange(1, 60))
    for pulses in (wheel, run_up):
        synchronous_average(np.zeros(8000), 1.0, pulses, samples_per_rev=64)


X, PULSES = np.zeros(1000), np.arange(10) * 100.0


@pytest.mark.parametrize("name", ["fs", "ratio"])
def test_rates_must_be_positive(name):
    for value in (0.0, -1.0):
        with pytest.raises(InputError, match=rf"^synchronous_average: {name} = {value} must be above 0; check"):
            synchronous_average(**({"x": X, "fs": 1.0, "pulse_times": PULSES, "samples_per_rev": 64} | {name: value}))
    for value in (np.nan, np.inf, "1", None, [1.0]):
        with pytest.raises(InputError, match=rf"^synchronous_average: {name} = .* must be a finite number; pass one"):
            synchronous_average(**({"x": X, "fs": 1.0, "pulse_times": PULSES, "samples_per_rev": 64} | {name: value}))


@pytest.mark.parametrize("name", ["samples_per_rev", "pulses_per_rev", "revolutions"])
def test_counts_must_be_counts(name):
    for value in (0, 2.0, True):
        with pytest.raises(InputError, match=rf"^synchronous_average: {name} = {value} must be an integer >= 1"):
            synchronous_average(X, 1.0, PULSES, **({"samples_per_rev": 64} | {name: value}))


def test_samples_must_be_real_and_finite():
    for bad in (X + 0j, np.where(np.arange(1000) == 3, np.nan, X), X[:0]):
        with pytest.raises(InputError, match=r"^synchronous_average: x "):
            synchronous_average(bad, 1.0, PULSES, samples_per_rev=64)


def test_pulses_must_be_increasing_times():
    for bad, why in (
        ([[0.0, 1.0]], r"of shape \(1, 2\) must be a one-dimensional array of times"),
        (["a"], r"of shape \(1,\) must be a one-dimensional array"),
        ([0.0, np.nan], "must be finite; leave out"),
        ([0.0, 100.0, 100.0], "must increase, but entry 2, 100 s, is not after 100 s; sort"),
        ([-1.0, 99.0], "begin at -1 s, before the record's first sample, at 0; leave out"),
    ):
        with pytest.raises(InputError, match=f"^synchronous_average: pulse_times {why}"):
            synchronous_average(X, 1.0, bad, samples_per_rev=64)


def test_later_pulses_must_come_after_earlier_ones():
    averager = SynchronousAverager(1.0, samples_per_rev=64)
    averager.push(X, PULSES)
    with pytest.raises(InputError, match="entry 0, 900 s, is not after 900 s"):
        averager.push(X, [900.0, 1000.0])


def test_there_must_be_a_revolution():
    for few in ([], [0.0], [0.0, 1001.0], [500.0, 1500.0]):
        with pytest.raises(InputError, match=r"record of 1000 s bound no revolution of 1 pulses; record longer, or"):
            synchronous_average(X, 1.0, few, samples_per_rev=64)
    with pytest.raises(InputError, match="bound no revolution of 60 pulses"):
        synchronous_average(X, 1.0, PULSES, samples_per_rev=64, pulses_per_rev=60)
    with pytest.raises(InputError, match="bound no revolution"):
        SynchronousAverager(1.0, samples_per_rev=64).result()


def test_no_more_revolutions_than_there_are():
    with pytest.raises(InputError, match="revolutions = 10 must be at most 9, those within pulses and record; ask"):
        synchronous_average(X, 1.0, PULSES, samples_per_rev=64, revolutions=10)


def test_blocks_must_have_the_same_channels():
    averager = SynchronousAverager(1.0, samples_per_rev=64)
    averager.push(np.zeros((2, 100)))
    with pytest.raises(InputError, match=r"x has channels of shape \(3,\), but the blocks before have \(2,\); push"):
        averager.push(np.zeros((3, 100)))


def test_short_records():
    # Too short for a prediction: held at the last sample.
    average = synchronous_average([1.0, 1.0, 1.0], 1.0, [0.0, 3.0], samples_per_rev=6)
    assert_allclose(average.tsa, 1.0, rtol=1e-13)
    average = synchronous_average([5.0], 1.0, [0.0, 1.0], samples_per_rev=2)
    assert_allclose(average.tsa, 5.0, rtol=1e-13)


@pytest.mark.parametrize("samples", [160, 700], ids=["stretched", "not stretched"])
def test_the_first_revolution_is_the_average_of_one(samples):
    """Several channels, a kernel as wide as the record's steps, and a wider one."""
    stream, pulses = np.random.default_rng(5), np.arange(1, 39) / 10 + 0.002 * np.sin(np.arange(38))
    x = stream.normal(size=(2, 4000))
    averager = SynchronousAverager(1000.0, samples_per_rev=samples, pulses_per_rev=5, revolutions=1)
    expected = synchronous_average(x, 1000.0, pulses, samples_per_rev=samples, pulses_per_rev=5, revolutions=1).tsa
    # Rounding of a place may choose the next cell of the kernel, whose parabola differs by 3e-10.
    assert_allclose(averager.first_revolution(x, pulses), expected, rtol=0, atol=1e-9)


def test_the_first_revolution_needs_a_new_averager_and_a_revolution():
    averager = SynchronousAverager(1000.0, samples_per_rev=96)
    with pytest.raises(InputError, match="bound no revolution"):
        averager.first_revolution(np.zeros(1000), [0.1])
    with pytest.raises(InputError, match="take a new averager"):
        averager.first_revolution(np.zeros(1000), [0.1, 0.2])
