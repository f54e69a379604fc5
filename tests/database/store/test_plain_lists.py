"""Unit: rows that are stored plainly are read by place, bit for bit, and each block is compared once."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

import sigdb
from sigdb.core import CorruptionError, DatabaseError
from sigdb.database.store.integrity import read_file
from sigdb.database.store.plain_lists import PlainLists
from sigdb.database.store.receipts import read_receipt
from sigdb.database.store.store import Store
from sigdb.database.store.writer import write_part

ROWS, WIDTH = 600, 40


def lists(rows):
    return pa.array([None if row is None else row.tolist() for row in rows], pa.list_(pa.float32()))


@pytest.fixture
def numbers():
    return np.random.default_rng(1).standard_normal((ROWS, WIDTH)).astype(np.float32)


@pytest.fixture
def store(tmp_path):
    return Store.at(tmp_path)


def written(store, columns):
    rows = pa.table({"id": np.arange(ROWS), "status": ["ok"] * ROWS, **columns})
    write_part(
        store, "rows", 0, [{"features": rows.select(["id", "status"]), "signals": rows}], plan="p", first=0, started=0.0
    )
    return read_receipt(store, "rows", 0).file("signals")


def test_rows_in_ascending_order_also_repeated(store, numbers):
    file = PlainLists(store, written(store, {"tsa": lists(numbers)}))
    places = np.sort(np.random.default_rng(2).integers(0, ROWS, 300))
    assert file.lengths("tsa", places).tolist() == [WIDTH] * 300
    assert np.array_equal(file.read("tsa", places, WIDTH), numbers[places])
    assert np.array_equal(file.read("tsa", np.arange(ROWS), WIDTH), numbers)


def test_a_row_group_whose_lists_differ_is_not_plain(store, numbers):
    """Lists of 39 and 41 numbers take as much room as those of 40."""
    rows = list(numbers)
    rows[3], rows[4] = np.zeros(39, np.float32), np.zeros(41, np.float32)
    file = PlainLists(store, written(store, {"tsa": lists(rows)}))
    assert file.lengths("tsa", np.array([0, 255, 256, 511, 512])).tolist() == [0, 0, WIDTH, WIDTH, WIDTH]
    assert file.lengths("id", np.array([0])).tolist() == [0]
    assert np.array_equal(file.read("tsa", np.arange(256, 512), WIDTH), numbers[256:512])


def test_rows_without_a_list_are_nan_and_the_others_in_their_places(store, numbers):
    lacking = np.random.default_rng(4).random(ROWS) < 0.3
    lacking[[0, 255, 256, ROWS - 1]] = True
    lacking[300:420] = False
    rows = [None if lacks else row for lacks, row in zip(lacking, numbers, strict=True)]
    file = PlainLists(store, written(store, {"tsa": lists(rows)}))
    expected = np.where(lacking[:, None], np.nan, numbers).astype(np.float32)
    for places in (np.arange(ROWS), np.array([0]), np.sort(np.random.default_rng(5).integers(0, ROWS, 200))):
        assert file.lengths("tsa", places).tolist() == [WIDTH] * len(places)
        assert np.array_equal(file.read("tsa", places, WIDTH), expected[places], equal_nan=True)


def test_a_row_group_without_any_list_is_not_plain(store, numbers):
    rows = [None] * 256 + list(numbers[256:])
    file = PlainLists(store, written(store, {"tsa": lists(rows)}))
    assert file.lengths("tsa", np.array([0, 256])).tolist() == [0, WIDTH]


def test_every_flipped_byte_of_a_row_is_an_error(store, numbers, tmp_path):
    record = written(store, {"tsa": lists(numbers)})
    path, (first, _, _) = tmp_path / record.path, record.plain["tsa"][1]
    content = path.read_bytes()
    for byte in range(4 * WIDTH):
        flipped = bytearray(content)
        flipped[first + 4 * WIDTH * 7 + byte] ^= 1 << byte % 8
        path.write_bytes(flipped)
        with pytest.raises(
            CorruptionError, match=r"is damaged: bytes \d+ to \d+ are not as they were written; make it"
        ):
            PlainLists(store, record).read("tsa", np.array([256 + 7]), WIDTH)
    assert np.array_equal(PlainLists(store, record).read("tsa", np.array([5]), WIDTH), numbers[[5]])


def test_only_blocks_of_the_rows_are_read_and_each_is_compared_once(store, numbers, monkeypatch):
    record = written(store, {"tsa": lists(numbers)})
    file, read = PlainLists(store, record), []
    compare = PlainLists._compare

    def counted(self, opened, blocks):
        read.append(blocks[~self._whole[blocks]].tolist())
        compare(self, opened, blocks)

    monkeypatch.setattr(PlainLists, "_compare", counted)
    first = record.plain["tsa"][0][0]
    for _ in range(2):
        file.read("tsa", np.array([0, 200]), WIDTH)
    blocks = {(first + at) // record.block for row in (0, 200) for at in (4 * WIDTH * row, 4 * WIDTH * (row + 1) - 1)}
    assert read == [sorted(blocks), []]
    assert len(blocks) < -(-record.bytes // record.block)


def test_a_file_that_becomes_shorter_is_an_error(parts_copy):
    database = sigdb.open(parts_copy)
    path = parts_copy / "signals" / "part-00000.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(DatabaseError, match=r"part-00000\.parquet cannot be read"):
        database.signals([0])


def test_a_database_is_read_by_place_as_it_is_decoded(folder, parts_folder):
    for where in (folder, parts_folder):
        database = sigdb.open(where)
        ok = database.sql("select id from features where status = 'ok' and teeth = 11")["id"].to_numpy()
        ids = np.random.default_rng(3).permutation(np.concatenate([ok, ok[:5]]))
        signals = database.signals(ids)
        stored = database.dataset("signals").to_table().to_pandas().set_index("id").loc[ids]
        for key in ("tsa", "spectrum"):
            assert np.array_equal(signals[key], np.stack(stored[key]))
    assert {*database._plain} == {0, 1, 2}


def test_a_receipt_that_says_another_place_is_damage(store, numbers):
    record = written(store, {"tsa": lists(numbers)})
    assert read_file(store, record, ROWS, None)[1] == ""
    (first, length, _), *others = record.plain["tsa"]
    for run in ((first + 4, length, ""), (first, length - 1, ""), (first, length, "1")):
        other = replace(record, plain={"tsa": (run, *others)})
        assert read_file(store, other, ROWS, None) == (None, "its receipt does not say where its numbers lie")
