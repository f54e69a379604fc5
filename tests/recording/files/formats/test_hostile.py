"""Verification: files from anywhere end in a recording or in an error of one line, in bounded memory and time."""

import gzip
import io
import os
import time

import h5py
import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from scipy.io import savemat, wavfile

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.formats import contents as limits

LARGE = 2**22 + 2**18
"""Numbers whose bytes are more than any part may expand to freely."""


def refusal(path, **options):
    """The error in one line."""
    with pytest.raises(InputError) as caught:
        read_recording(path, sampling_rate=1000, **options)
    line = str(caught.value)
    assert line.isprintable()
    assert line.startswith(str(path))
    return line


@pytest.fixture(autouse=True)
def _bounded_time():
    """What is quadratic in the length of these files takes hours."""
    start = time.process_time()
    yield
    assert time.process_time() - start < 10


@pytest.mark.parametrize(
    "name",
    [
        "a.csv",
        "a.csv.gz",
        "a.mat",
        "a.h5",
        "a.wav",
        "a.parquet",
        "a.npz",
        "a.npy",
        "a.uff",
        "a.tdms",
        "a.mf4",
        "a.xlsx",
        "a.xls",
    ],
)
def test_empty_files_and_garbage(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"")
    assert refusal(path).endswith("is empty")
    path.write_bytes(np.random.default_rng(2).bytes(5000))
    assert "but does not begin like it; it is damaged or another format" in refusal(path)


def test_the_suffix_and_the_first_bytes_agree(files, tmp_path):
    files.npz(tmp_path / "run.npz", files.channels())
    (tmp_path / "run.npz").rename(tmp_path / "run.wav")
    assert "is WAV by its suffix .wav, but begins like NPZ; give it the suffix .npz" in refusal(tmp_path / "run.wav")
    (tmp_path / "run.wav").rename(tmp_path / "run.doc")
    (tmp_path / "run.csv").write_bytes(gzip.compress(b"1,2\n3,4\n"))
    assert "is text by its suffix .csv, but begins like gzip; give it the suffix .csv.gz" in refusal(
        tmp_path / "run.csv"
    )


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "run.csv")
    assert refusal(tmp_path / "run.csv").endswith("not a file")


def test_gzip_bombs(tmp_path):
    path = tmp_path / "run.csv.gz"
    path.write_bytes(gzip.compress(b"0,0\n" * 2 * LARGE))
    assert "which measured numbers do not do" in refusal(path)
    path.write_bytes(gzip.compress(b"1.5,2.5\n" * 100)[:-20])
    assert "ends in the middle of its gzip data; copy it again" in refusal(path)


def test_npz_bombs_and_pickles(files, tmp_path):
    path = tmp_path / "run.npz"
    np.savez_compressed(path, x=np.zeros(LARGE))
    assert "which measured numbers do not do" in refusal(path)
    np.savez(path, x=np.array([{}, []], dtype=object))
    assert "holds no arrays of numbers: x is an array of Python objects, not of numbers" in refusal(path)
    files.zip_of(path, {f"{i}.npy": b"" for i in range(limits.MAX_PARTS + 1)})
    assert "holds more than 10000 parts" in refusal(path)


@pytest.mark.parametrize(
    ("header", "told"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }", "holds 1000000000000 numbers, more"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000, 1000), }", "is cut short: an array of shape"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }", "of shape"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (3,), }", "is an array of Python objects, not of numbers"),
        ("(" * 9000, "cannot be read as NPY"),
        ("{" * 65000, "cannot be read as NPY"),
    ],
)
def test_headers_of_npy(tmp_path, header, told):
    path = tmp_path / "run.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + bytes(80))
    assert told in refusal(path)


def element(kind, data):
    return np.array([kind, len(data)], "<u4").tobytes() + data + bytes(-len(data) % 8)


def mat5(path, *elements):
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"".join(elements))
    return path


def matrix(kind, shape, *parts):
    flags = element(6, np.array([kind, 0], "<u4").tobytes()) + element(5, np.array(shape, "<i4").tobytes())
    return element(14, flags + element(1, b"x") + b"".join(parts))


def test_mat_5_bombs(tmp_path):
    path = tmp_path / "run.mat"
    savemat(path, {"x": np.zeros(LARGE)}, do_compression=True)
    assert "which measured numbers do not do" in refusal(path)
    savemat(path, {f"x{i}": np.zeros(LARGE // 4) for i in range(5)}, do_compression=True)
    assert "which measured numbers do not do" in refusal(path)


def test_dimensions_and_depth_of_mat_5(tmp_path):
    path = tmp_path / "run.mat"
    huge = [2**31 - 1, 2**31 - 1]
    assert "more than 134217728" in refusal(mat5(path, matrix(6, huge, element(9, bytes(80)))))
    assert "more than 134217728" in refusal(mat5(path, matrix(1, huge)))
    assert "of dimensions (5, 1) holds 10 numbers" in refusal(mat5(path, matrix(6, [5, 1], element(9, bytes(80)))))
    deep = matrix(6, [1, 1], element(9, bytes(8)))
    for _ in range(1000):
        deep = matrix(1, [1, 1], deep)
    assert "16 levels deep" in refusal(mat5(path, deep))
    assert "more than 10000 parts" in refusal(mat5(path, matrix(1, [1, 9], element(14, b"") * 20_000)))


def test_hdf5_bombs(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (2**40,), "f8", chunks=(2**20,))
    assert "holds 1099511627776 numbers, more than" in refusal(path)
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.zeros(LARGE), chunks=(2**20,), compression=9)
    assert "which measured numbers do not do" in refusal(path)
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (20,), "f8", maxshape=(None,), chunks=(2**28,), compression=1)
    assert "bytes, more than" in refusal(path)


def test_depth_and_rings_of_hdf5(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.create_group("g")["ring"] = file["/"]
    assert "16 levels deep" in refusal(path)
    with h5py.File(path, "w") as file:
        for i in range(limits.MAX_PARTS + 1):
            file.create_group(f"{i}")
    assert "holds more than 10000 parts" in refusal(path)


def test_parquet_bombs(tmp_path):
    parquet.write_table(pa.table({"x": np.zeros(LARGE)}), tmp_path / "run.parquet")
    assert "which measured numbers do not do" in refusal(tmp_path / "run.parquet")


def test_wav_of_no_samples_or_many_channels(tmp_path):
    wavfile.write(tmp_path / "run.wav", 8000, np.zeros(0, np.int16))
    assert "holds no samples" in refusal(tmp_path / "run.wav")
    file = io.BytesIO()
    wavfile.write(file, 8000, np.zeros((4, 2000), np.int16))
    (tmp_path / "run.wav").write_bytes(file.getvalue())
    assert "holds 2000 columns, more than 1024" in refusal(tmp_path / "run.wav")


@pytest.mark.parametrize(
    "text",
    [
        b"1" * 2**21,
        b"1" * 65_000 + b"x",
        b"(" * 2**20,
        b" [" * 2**19 + b"\n1\n2\n",
        b"\n" * 2**20,
        b"1," * 2**20,
        b"1.5\n" * 5 + b"2" * 2**21,
        b"a" * 2**20 + b"\n1\n2\n",
    ],
)
def test_long_fields_and_lines_take_no_time(tmp_path, text):
    (tmp_path / "run.csv").write_bytes(text)
    assert refusal(tmp_path / "run.csv")


def test_many_marks_of_uff_take_no_time(tmp_path):
    path = tmp_path / "run.uff"
    path.write_bytes(b"    -1\n    58\n" + b"x\n" * 11 + b"    -1" * 2**20)
    assert "has no end" in refusal(path)
    path.write_bytes(b"    -1\n" * 2**18)
    assert "holds more than 10000 parts" in refusal(path)


def test_many_segments_of_tdms_take_no_time(tmp_path):
    lead = b"TDSm" + np.array([0, 4713], "<u4").tobytes() + bytes(16)
    (tmp_path / "run.tdms").write_bytes(lead * 2**17)
    assert "holds no numbers" in refusal(tmp_path / "run.tdms")


@pytest.mark.parametrize("name", ["plain.csv", "packed.csv.gz", "five.mat", "run.wav", "run.npz", "run.npy", "run.h5",
                                  "run.parquet", "binary.uff", "run.tdms", "run.mf4"])  # fmt: skip
def test_files_over_the_limits_are_refused(files, tmp_path, monkeypatch, name):
    files.MAKERS[name](tmp_path / name, files.channels(n=4000))
    for limit, least, told in (("MAX_VALUES", 2000, "more than 2000; cut"), ("MAX_BYTES", 1000, "more than 1000; cut")):
        with monkeypatch.context() as patch:
            patch.setattr(limits, limit, least)
            assert told in refusal(tmp_path / name)


def test_names_from_a_file_do_not_reach_a_terminal(files, tmp_path):
    np.savez(tmp_path / "run.npz", **{"\x1b[31m\nx": np.arange(20) * 7 % 20})
    assert [one.name for one in read_recording(tmp_path / "run.npz", sampling_rate=1).channels] == ["[31mx"]
    np.savez(tmp_path / "run.npz", **{"\x1b[31m\nz": np.arange(20.0) * 1j})
    assert refusal(tmp_path / "run.npz").endswith(r"\x1b[31m; z holds complex numbers; a channel is real")
