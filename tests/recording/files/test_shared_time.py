"""Unit: channels that start at different times, or have different rates, on one time axis."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording.files.sampling_rates import SeriesTiming
from sigdb.recording.files.shared_time import share_time

X = np.random.default_rng(2).normal(size=300)


def shared(series, starts, rates):
    timing = [SeriesTiming(sampling_rate=fs, source="", start=start) for fs, start in zip(rates, starts, strict=True)]
    return share_time(series, [f"x{i}" for i in range(len(series))], timing)


def test_starts_a_whole_number_of_samples_apart():
    cut, starts, (note,) = shared([X, X], [0.0, 0.05], [2000.0] * 2)
    assert_array_equal(cut[0], X[100:])
    assert_array_equal(cut[1], X[:200])
    assert starts == [0.05, 0.05]
    assert note.code == "cut-to-shared-time"
    assert note.text == "channels start at different times; cut to 0.05 to 0.15 s, which all channels have (x0, x1)"


@pytest.mark.parametrize("offset", [0.3, 0.5, 40.25, 99.9])
def test_starts_between_two_samples_are_kept(offset):
    cut, starts, notes = shared([X, X], [7.0, 7.0 + offset / 2000], [2000.0] * 2)
    first = int(np.ceil(offset))
    assert_array_equal(cut[0], X[first : first + cut[0].size])
    assert_array_equal(cut[1], X[: cut[1].size])
    assert cut[0].size == cut[1].size == 300 - first
    assert_allclose(np.subtract(starts, 7.0) * 2000, [first, offset], atol=1e-6)
    assert notes[-1].code == "starts-between-samples"


def test_several_rates_share_seconds():
    fast, slow = np.arange(1000.0), np.arange(260.0)
    cut, starts, notes = shared([fast, slow], [1.0, 1.01], [1000.0, 250.0])
    assert cut[0][0] == 10
    assert cut[1].size == 248
    assert starts == [1.01, 1.01]
    assert {note.code for note in notes} == {"several-sampling-rates", "cut-to-shared-time"}
    assert 1.01 + cut[0].size / 1000 == pytest.approx(2.0)


def test_missing_ends_count_in_seconds():
    holed = X.copy()
    holed[:4] = np.nan
    cut, starts, _ = shared([holed, X], [0.0, 0.001], [2000.0] * 2)
    assert_array_equal(cut[0], X[4:])
    assert_array_equal(cut[1], X[2:298])
    assert starts == [0.002, 0.002]


def test_recordings_of_different_times_are_refused():
    told = r"x1 begins at 0\.1 s and x0 ends at 0\.15 s, so 0\.05 of 0\.15 s are shared"
    with pytest.raises(InputError, match=told):
        shared([X, X], [0.0, 0.1], [2000.0] * 2)
    with pytest.raises(InputError, match=r"so 0 of 0\.15 s are shared"):
        shared([X, X], [0.0, 3600.0], [2000.0] * 2)


def test_a_start_that_is_not_stated():
    with pytest.raises(InputError, match="and the start of x2 is not stated; choose channels whose start is stated"):
        shared([X, X, X], [0.0, 0.05, None], [2000.0] * 3)
    _, starts, notes = shared([X, X], [0.25, None], [2000.0] * 2)
    assert starts == [0.25, 0.25]
    assert not notes


def test_equal_starts_keep_all():
    cut, starts, notes = shared([X, X], [3.0, 3.0], [2000.0] * 2)
    assert [x.size for x in cut] == [300, 300]
    assert starts == [3.0, 3.0]
    assert not notes


def test_several_rates_that_share_too_little():
    with pytest.raises(InputError, match="the channels do not cover the same time"):
        shared([np.arange(1000.0), np.arange(200.0)], [None, None], [1000.0, 250.0])
