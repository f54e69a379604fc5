"""Random streams: one for each specimen and one for each block of rows.

A specimen's stream depends on the seed, a block's on the seed and the plan's hash. Neither depends on the order of
work. So a row is the same for any number of workers and after any interruption.
"""

import numpy as np

NOISE_BLOCK = 256
"""Rows that share one noise stream; a part of a database always holds whole blocks."""


def specimen_stream(seed: int, specimen: int) -> np.random.Generator:
    """Return the stream of one specimen, shared by all cases that it appears in.

    Examples
    --------
    >>> from sigdb.core.streams import specimen_stream
    >>> bool(specimen_stream(1, 5).random() == specimen_stream(1, 5).random())
    True
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0, specimen)))


def noise_stream(seed: int, plan_hash: str, block: int) -> np.random.Generator:
    """Return the noise stream of rows ``NOISE_BLOCK * block`` up to the next block, in the database of one plan.

    It depends on the plan's hash too: databases of one seed share their specimens, never their noise, so that one may
    be the test of what the other trained.

    Parameters
    ----------
    seed
        Seed of the plan.
    plan_hash
        Hash of the plan in hexadecimal, of which the first 16 digits count.
    block
        Number of the block.

    Examples
    --------
    >>> from sigdb.core.streams import noise_stream
    >>> bool(noise_stream(1, "0123456789abcdef", 5).random() == noise_stream(1, "fedcba9876543210", 5).random())
    False
    """
    return np.random.default_rng(np.random.SeedSequence([seed, int(plan_hash[:16], 16)], spawn_key=(1, block)))


def sample_stream(seed: int, grid: int) -> np.random.Generator:
    """Return the stream of the cases that a grid of a design samples."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2, grid)))


def nuisance_stream(seed: int) -> np.random.Generator:
    """Return the stream of the rigs that stand for what is not known of a machine."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(3,)))


def colour_stream(seed: int) -> np.random.Generator:
    """Return the stream of the colours that noise may have."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(4,)))
