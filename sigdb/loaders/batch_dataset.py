"""An iterable dataset: batches of rows, shuffled by runs of rows that lie together."""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

from sigdb.core import FloatArray, InputError, IntArray, blocks
from sigdb.loaders.row_dataset import RowDataset

_RUN = 1024
"""Rows that lie together and are read together."""


class BatchDataset:
    """Batches of rows for a training loop; each iteration goes through all rows once, in another order.

    Rows are shuffled by runs: the runs of 1024 rows come in random order, and the rows of ``mixed`` runs at a time are
    mixed. So a database is read in pieces, and memory holds ``mixed`` runs. torch's DataLoader takes the object as an
    iterable dataset with ``batch_size=None``, if torch is imported before the object is made; its workers share the
    runs. The order follows from ``seed``, the number of the iteration and, in workers, torch's own seed.

    Parameters
    ----------
    rows : RowDataset
        The rows.
    batch_size : int
        Rows of a batch; the last batch of an iteration, or of a worker's share, may have fewer.
    shuffle : bool
        Whether to shuffle; else rows come in the order of their ids.
    mixed : int
        Number of runs whose rows are mixed.
    seed : int
        Seed of the order.

    Raises
    ------
    InputError
        If a number is less than 1.

    Examples
    --------
    ::

        batches = sigdb.loaders.BatchDataset(rows, batch_size=256)
        for x, tooth in batches:  # (256, n) float32 and (256,) int64
            ...
        loader = torch.utils.data.DataLoader(batches, batch_size=None, num_workers=2)
    """

    def __init__(
        self, rows: RowDataset, *, batch_size: int = 256, shuffle: bool = True, mixed: int = 16, seed: int = 0
    ) -> None:
        for name, value in (("batch_size", batch_size), ("mixed", mixed)):
            if value < 1:
                raise InputError(f"{name} = {value} must be 1 or more")
        self.rows = rows
        self._batch_size, self._shuffle, self._mixed, self._seed = batch_size, shuffle, mixed, seed
        self._iteration = 0
        torch_data = sys.modules.get("torch.utils.data")
        if torch_data is not None:  # a loader of torch looks at the class
            torch_data.IterableDataset.register(type(self))

    def __iter__(self) -> Iterator[tuple[FloatArray, Any]]:
        worker, workers, torch_seed = _place_among_workers()
        rng = np.random.default_rng([self._seed, self._iteration, torch_seed])
        self._iteration += 1
        order = self._order(rng, worker, workers)
        # Whole batches, so that only the last one is shorter.
        for some in blocks(order.size, max(1, self._mixed * _RUN // self._batch_size) * self._batch_size):
            places = np.sort(order[some])
            x, labels = self.rows[places]
            mixed = rng.permutation(places.size) if self._shuffle else np.arange(places.size)
            for batch in blocks(places.size, self._batch_size):
                yield x[mixed[batch]], labels[mixed[batch]]

    def _order(self, rng: np.random.Generator, worker: int, workers: int) -> IntArray:
        """Return the places of the rows of a worker, run by run."""
        starts = np.arange(0, len(self.rows), _RUN)
        if self._shuffle:
            starts = rng.permutation(starts)
        runs = [np.arange(start, min(start + _RUN, len(self.rows))) for start in starts[worker::workers].tolist()]
        return np.concatenate(runs) if runs else np.empty(0, np.int64)


def _place_among_workers() -> tuple[int, int, int]:
    """Return the number of this worker of a loader of torch, the number of workers, and the seed that they share."""
    torch_data = sys.modules.get("torch.utils.data")
    worker = torch_data.get_worker_info() if torch_data is not None else None
    return (worker.id, worker.num_workers, worker.seed - worker.id) if worker is not None else (0, 1, 0)
