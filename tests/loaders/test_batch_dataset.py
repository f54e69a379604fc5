"""Unit: batches hold each row once, mixed, in another order each time; workers share the rows."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.loaders import BatchDataset, RowDataset, batch_dataset


@pytest.fixture
def rows(database, monkeypatch):
    """Rows whose input is their id, in runs of 32."""
    monkeypatch.setattr(batch_dataset, "_RUN", 32)
    rows = RowDataset(database, "location")
    monkeypatch.setattr(rows, "_inputs", lambda places: rows.ids[places][:, None])
    return rows


def ids_of(batches):
    return [x[:, 0] for x, _ in batches]


def test_each_row_comes_once_with_its_label(rows):
    batches = [*BatchDataset(rows, batch_size=50, mixed=3)]
    assert [len(x) for x, _ in batches[:-1]] == [50] * (len(rows) // 50)
    ids, labels = (np.concatenate(parts) for parts in ([x[:, 0] for x, _ in batches], [y for _, y in batches]))
    order = np.argsort(ids)
    assert np.array_equal(ids[order], rows.ids)
    assert np.array_equal(labels[order], rows.labels)


def test_rows_of_the_mixed_runs_are_mixed_and_of_no_others(rows):
    for batch in ids_of(BatchDataset(rows, batch_size=64, mixed=2))[:-1]:
        runs = np.unique(np.searchsorted(rows.ids, batch) // 32)
        assert 2 <= len(runs) <= 3  # the last run of the database is shorter
        assert not np.array_equal(batch, np.sort(batch))


def test_the_order_is_that_of_the_seed_and_another_each_time(rows):
    first, second = BatchDataset(rows, seed=5), BatchDataset(rows, seed=5)
    one, two = np.concatenate(ids_of(first)), np.concatenate(ids_of(first))
    assert np.array_equal(one, np.concatenate(ids_of(second)))
    assert not np.array_equal(one, two)
    assert not np.array_equal(one, np.concatenate(ids_of(BatchDataset(rows, seed=6))))


def test_runs_come_in_random_order(rows):
    runs = [
        int(np.searchsorted(rows.ids, batch[0])) // 32 for batch in ids_of(BatchDataset(rows, batch_size=32, mixed=1))
    ]
    assert runs != sorted(runs)
    assert len({*runs}) > len(runs) // 2


def test_without_shuffling_rows_come_in_order(rows):
    assert np.array_equal(np.concatenate(ids_of(BatchDataset(rows, batch_size=48, shuffle=False))), rows.ids)


def test_workers_of_a_loader_share_the_rows(rows, monkeypatch):
    shares = []
    for worker in range(3):
        info = SimpleNamespace(id=worker, num_workers=3, seed=100 + worker)
        torch_data = SimpleNamespace(get_worker_info=lambda info=info: info)
        monkeypatch.setitem(sys.modules, "torch.utils.data", torch_data)
        shares.append(np.concatenate(ids_of(BatchDataset.__iter__(_unregistered(rows)))))
    assert np.array_equal(np.sort(np.concatenate(shares)), rows.ids)
    assert all(len(share) > len(rows) // 4 for share in shares)


def _unregistered(rows):
    dataset = BatchDataset.__new__(BatchDataset)
    dataset.rows, dataset._iteration = rows, 0
    dataset._batch_size, dataset._shuffle, dataset._mixed, dataset._seed = 40, True, 2, 1
    return dataset


@pytest.mark.parametrize("name", ["batch_size", "mixed"])
def test_what_is_refused(rows, name):
    with pytest.raises(InputError, match=f"{name} = 0 must be 1 or more"):
        BatchDataset(rows, **{name: 0})


def test_a_real_batch_is_read_from_the_database(database):
    rows = RowDataset(database, "location")
    for x, tooth in BatchDataset(rows, batch_size=300):
        assert (x.dtype, x.shape[1], tooth.shape) == (np.float32, 384, (len(x),))
        assert np.isfinite(x).all()
