"""Validation: MAT-files of version 4 read as SciPy and MATLAB write them."""

import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.io import savemat

from sigdb.core.errors import InputError
from sigdb.recording import read_recording


def texts(recording):
    return [note.text for note in recording.notes]


def stored(name, values, *, kind="f8", order="<", text=0):
    """A matrix as the format describes it: type, rows, columns, imaginary part, length of the name, name, numbers."""
    precision = ["f8", "f4", "i4", "i2", "u2", "u1"].index(kind)
    values = np.atleast_2d(values)
    head = struct.pack(f"{order}5i", 1000 * (order == ">") + 10 * precision + text, *values.shape, 0, len(name) + 1)
    return head + name.encode() + b"\0" + values.astype(order + kind).tobytes(order="F")


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.int32, np.float32, np.float64])
def test_types_as_scipy_writes_them(tmp_path, dtype):
    x = (np.arange(60) % 7).astype(dtype).reshape(20, 3)
    savemat(tmp_path / "run.mat", {"x": x, "row": x[:, 0], "fs": 50.0, "about": "a text"}, format="4")
    read = read_recording(tmp_path / "run.mat", variable="x")
    assert_array_equal(np.stack([one.samples for one in read.channels], 1), x.astype(float))
    assert [one.sampling_rate for one in read.channels] == [50.0] * 3
    assert [one.name for one in read_recording(tmp_path / "run.mat").channels] == ["x1", "x2", "x3", "row"]


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["f8", "f4", "i4", "i2", "u2", "u1"])
def test_both_orders_of_bytes(tmp_path, order, kind):
    x = np.arange(20) % 7
    data = stored("x", x, kind=kind, order=order) + stored("fs", 10.0, order=order)
    (tmp_path / "run.mat").write_bytes(data)
    read = read_recording(tmp_path / "run.mat")
    assert_array_equal(read.channels[0].samples, x)
    assert read.channels[0].sampling_rate == 10


def test_the_last_of_two_variables_of_a_name_is_taken(tmp_path):
    parts = [stored("x", np.arange(20) % 7), stored("fs", 10.0), stored("x", np.arange(20) % 5)]
    (tmp_path / "run.mat").write_bytes(b"".join(parts))
    read = read_recording(tmp_path / "run.mat")
    assert_array_equal(read.channels[0].samples, np.arange(20) % 5)
    assert "x is stored more than once; the last one was taken" in texts(read)


def test_sparse_matrices_are_left_out(tmp_path):
    parts = stored("s", np.ones((4, 3)), text=2), stored("x", np.arange(20) % 7)
    (tmp_path / "run.mat").write_bytes(b"".join(parts))
    read = read_recording(tmp_path / "run.mat", sampling_rate=10)
    assert [one.name for one in read.channels] == ["x"]
    assert "s is a sparse matrix, which cannot be read; save its columns as arrays of numbers" in texts(read)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (stored("x", np.arange(20))[:-4], "is cut short: x has 160 bytes, 156 are left"),
        (stored("x", np.arange(20)) + b"rest", "is damaged: no matrix begins at byte 182 of 186"),
        (struct.pack("<5i", 0, 2**30, 2**30, 0, 2) + b"x\0", "numbers, more than"),
        (struct.pack("<5i", 2000, 2, 3, 0, 2) + b"x\0" + bytes(48), "does not begin like it"),
        (struct.pack("<5i", 60, 2, 3, 0, 2) + b"x\0" + bytes(48), "does not begin like it"),
        (struct.pack("<5i", 0, -2, 3, 0, 2) + b"x\0" + bytes(48), "does not begin like it"),
        (struct.pack("<5i", 0, 2, 3, 0, 3) + b"1x\0" + bytes(48), "does not begin like it"),
        (bytes(5000), "does not begin like it"),
    ],
)
def test_damaged_files(tmp_path, data, told):
    (tmp_path / "run.mat").write_bytes(data)
    with pytest.raises(InputError, match=told):
        read_recording(tmp_path / "run.mat", sampling_rate=10)


def test_other_files_do_not_begin_like_version_4(files, tmp_path):
    from sigdb.recording.files.formats.mat4 import begins_like_mat4

    for name, make in files.MAKERS.items():
        make(tmp_path / name, files.channels())
        assert (name == "four.mat") == begins_like_mat4((tmp_path / name).read_bytes()[:4096])
