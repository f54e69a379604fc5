"""Unit: a random stream depends on the seed and on what it is for, never on the order of work."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core.streams import NOISE_BLOCK, noise_stream, specimen_stream

PLAN, OTHER = "0123456789abcdef" * 4, "fedcba9876543210" * 4


def noise_of(seed, block):
    return noise_stream(seed, PLAN, block)


@pytest.mark.parametrize("stream", [specimen_stream, noise_of])
def test_the_order_of_work_changes_nothing(stream):
    forwards = {i: stream(7, i).standard_normal(5) for i in range(4)}
    backwards = {i: stream(7, i).standard_normal(5) for i in reversed(range(4))}
    for i in range(4):
        assert_array_equal(forwards[i], backwards[i])


@pytest.mark.parametrize("stream", [specimen_stream, noise_of])
def test_drawing_from_one_stream_leaves_the_next_alone(stream):
    first, second = stream(7, 0), stream(7, 1)
    first.standard_normal(1000)
    assert_array_equal(second.standard_normal(5), stream(7, 1).standard_normal(5))


def test_specimens_noise_blocks_and_seeds_all_have_different_streams():
    draws = [
        make(seed, i).integers(2**62) for make in (specimen_stream, noise_of) for seed in range(20) for i in range(50)
    ]
    assert len(set(draws)) == len(draws)


def test_databases_of_one_seed_have_different_noise():
    """Their plans differ, from the first digits of the hash on; the seed still counts too."""
    streams = [noise_stream(7, plan, 3) for plan in (PLAN, OTHER)] + [noise_stream(8, PLAN, 3)]
    draws = np.array([stream.standard_normal(4000) for stream in streams])
    off_diagonal = np.corrcoef(draws)[~np.eye(3, dtype=bool)]
    assert np.abs(off_diagonal).max() < 5 / np.sqrt(4000)


def test_streams_of_neighbours_are_uncorrelated():
    draws = np.array([specimen_stream(3, i).standard_normal(4000) for i in range(12)])
    off_diagonal = np.corrcoef(draws)[~np.eye(12, dtype=bool)]
    assert np.abs(off_diagonal).max() < 5 / np.sqrt(4000)


def test_a_noise_block_holds_whole_rows():
    assert isinstance(NOISE_BLOCK, int)
    assert NOISE_BLOCK > 0


def test_global_random_state_is_not_touched():
    np.random.seed(1)  # noqa: NPY002 - the state that must stay as it is
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    specimen_stream(1, 1).random(10)
    noise_of(1, 1).random(10)
    assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002
