"""Unit: false and lost pulses anywhere in a train, and changes of speed that are none."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.recording.tacho.pulse_train import pulse_train


def at(places):
    """Add pulses at places of the train's count."""
    return lambda t: np.sort(np.append(t, np.interp(places, np.arange(t.size), t)))


def without(*numbers):
    return lambda t: np.delete(t, numbers)


@pytest.mark.parametrize("each", [1, 2, 8, 60])
@pytest.mark.parametrize("motion", ["steady", "wandering", "run-up", "torsion", "load"])
def test_an_honest_train_stays_as_it_is(shaft, motion, each):
    times = shaft(motion).marks(np.arange(each) / each)
    train = pulse_train(times, each)
    np.testing.assert_array_equal(train.times, times)
    assert (len(train.dropped), len(train.filled)) == (0, 0)


@pytest.mark.parametrize("each", [1, 2, 8, 60])
@pytest.mark.parametrize("motion", ["from rest", "to rest"])
def test_at_rest_a_few_pulses_are_left_out(shaft, motion, each):
    times = shaft(motion).marks(np.arange(each) / each)
    train = pulse_train(times, each)
    assert len(train.times) >= len(times) - 3
    assert np.isin(train.times, times).all()


@pytest.mark.parametrize("each", [1, 2, 8, 60])
def test_a_stop_is_refused_with_its_seconds(shaft, each):
    with pytest.raises(InputError, match=r"do not go on evenly at [3456]\.?\d* s: .* stood still; leave out"):
        pulse_train(shaft("stop").marks(np.arange(each) / each), each)


FALSE = {
    "one": [60.5],
    "a pair": [60.5, 61.5],
    "a pair not midway": [60.3, 61.3],
    "right behind": [60.03],
    "right before": [60.97],
    "the first": [0.5],
    "the last": [157.5],
    "twenty": np.arange(60, 80) + 0.5,
    "twenty not midway": np.arange(60, 80) + 0.3,
    "twenty bounces": np.arange(60, 80) + 0.04,
    "twenty at the beginning": np.arange(0, 20) + 0.5,
    "twenty at the end": np.arange(138, 158) + 0.5,
    "three a revolution": np.sort(np.append(np.arange(60, 70) + 1 / 3, np.arange(60, 70) + 2 / 3)),
    "scattered": np.random.default_rng(0).uniform(0, 158, 30),
}


@pytest.mark.parametrize("places", FALSE.values(), ids=FALSE.keys())
def test_false_pulses_are_dropped(shaft, places):
    times = shaft("wandering").marks()
    train = pulse_train(at(places)(times), 1)
    np.testing.assert_array_equal(train.times, times)
    assert len(train.dropped) == len(places)


@pytest.mark.parametrize("each", [8, 60])
def test_false_pulses_of_many_marks_are_dropped(shaft, each):
    times = shaft("wandering").marks(np.arange(each) / each)
    for places in ([100.5], [100.3, 101.3], np.arange(200, 330) + 0.5, np.arange(200, 330) + 0.8):
        train = pulse_train(at(places)(times), each)
        np.testing.assert_array_equal(train.times, times)


@pytest.mark.parametrize(
    "numbers", [(60,), (60, 61), (60, 90, 91), (5,), (152,), tuple(range(60, 80, 2))], ids=lambda n: str(len(n))
)
def test_lost_pulses_are_filled_in(shaft, numbers):
    times = shaft("wandering").marks()
    train = pulse_train(without(*numbers)(times), 1)
    assert len(train.filled) == len(numbers)
    # The speed wanders by 0.3 % within eight revolutions or more; two lost ones bend by less than 0.5 % of one.
    assert_allclose(train.times, times, atol=0.005 / 20)


@pytest.mark.parametrize("number", [1, 2, 157, 158])
def test_near_an_end_the_pulses_beyond_a_lost_one_are_left_out(shaft, number):
    times = shaft("wandering").marks()
    train = pulse_train(np.delete(times, number), 1)
    np.testing.assert_array_equal(train.times, times[number + 1 :] if number < 10 else times[:number])
    assert len(train.dropped)


def test_long_gaps_are_refused(shaft):
    times = shaft("wandering").marks()
    for lost in (range(60, 63), range(60, 80)):
        with pytest.raises(InputError, match=r"do not go on evenly at \S+ s: pulses are false or lost there"):
            pulse_train(np.delete(times, lost), 1)


def test_a_displaced_pulse_is_put_right(shaft):
    times = shaft("wandering").marks()
    for share in (0.12, 0.2, -0.2):
        wrong = times.copy()
        wrong[60] -= share * 0.05
        train = pulse_train(wrong, 1)
        assert_allclose(train.times, times, atol=0.005 / 20)
        assert len(train.dropped) == len(train.filled) == 1


def test_what_could_be_either_is_refused(shaft):
    times = shaft("wandering").marks()
    for wrong in (at(np.arange(0, 100) + 0.5), without(*range(20, 140, 2)), at(np.arange(60, 100) + 0.5)):
        with pytest.raises(
            InputError, match=r"from \S+ to \S+ s, if a revolution has 1: too many|do not go on evenly at"
        ):
            pulse_train(wrong(times), 1)


def test_another_number_of_pulses_is_named(shaft):
    wheel = shaft("wandering").marks(np.arange(35) / 36)
    with pytest.raises(InputError, match=r"repeat after 35 pulses, not 1; .* perhaps 35 or, with missing teeth, 36"):
        pulse_train(wheel, 1)
    with pytest.raises(InputError, match="repeat after 2 pulses, not 1"):
        pulse_train(shaft("wandering").marks([0, 0.3]), 1)


@pytest.mark.parametrize("each", [1, 8])
def test_noise_is_no_train(each):
    times = np.sort(np.random.default_rng(1).uniform(0, 8, 160 * each))
    with pytest.raises(InputError, match=r"follow no order|do not go on evenly|lie far from|too many"):
        pulse_train(times, each)


def test_jitter_and_rounding_are_no_false_pulses(shaft):
    times = shaft("wandering").marks(np.arange(60) / 60)
    for noisy in (times + 3e-5 * np.random.default_rng(2).normal(size=times.size), np.round(times * 5000) / 5000):
        noisy = np.sort(noisy)
        np.testing.assert_array_equal(pulse_train(noisy, 60).times, noisy)
