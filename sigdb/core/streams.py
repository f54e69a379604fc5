"""Random streams: one for each specimen and one for each block of rows, from one seed.

A stream depends on the seed and on what it is for, never on the order of work, so a row is the same
for any number of workers and after any interruption.
"""

import numpy as np

NOISE_BLOCK = 256
"""Rows that share one noise stream; a part of a database always holds whole blocks."""


def specimen_stream(seed: int, specimen: int) -> np.random.Generator:
    """The stream of one specimen, shared by all the cases that it appears in.

    Examples
    --------
    >>> from sigdb.core.streams import specimen_stream
    >>> bool(specimen_stream(1, 5).random() == specimen_stream(1, 5).random())
    True
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0, specimen)))


def noise_stream(seed: int, block: int) -> np.random.Generator:
    """The noise stream of rows ``NOISE_BLOCK * block`` up to the next block."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1, block)))


def sample_stream(seed: int, grid: int) -> np.random.Generator:
    """The stream of the points that a grid of a design samples."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2, grid)))
