"""Validation: every format reads as it was written, by other libraries where there are any."""

import base64
import io
import sys
import zlib

import h5py
import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from pyarrow import parquet
from scipy.io import savemat, wavfile
from scipy.sparse import eye

from sigdb.core.errors import InputError
from sigdb.recording import RecordingSettings, read_recording
from sigdb.recording.files.formats.tdms import read_tdms

FORMATS = [
    "plain.csv", "packed.csv.gz", "german.txt", "four.mat", "five.mat", "struct.mat", "seven.mat", "run.h5", "run.wav",
    "run.npz", "run.npy", "run.parquet", "binary.uff", "text.uff", "run.tdms", "run.mf4",
]  # fmt: skip
SILENT = {"plain.csv", "packed.csv.gz", "run.npy"}

# Written by npTDMS 1.13: two segments; a1 = i/2 - 3; it's = int16 (i - 7) with the linear scale 0.25 i + 1; 20 samples.
NP_TDMS = (
    "eNrtUs1OwkAQXkClAiGKDUEPyq1H9AmKiYkhMXhoL8aYTYEFm9ClabdB9J18Bbx68xHwDTz6X2fbqSAheuLmJJtvuv3229mZzzwynCIh5LJE"
    "yGGaRHGfinEFlkxrIYRMsrAcq8OqrVEV/12tSYLmBVyTLHks/71T06wDTYXPHLILsTBJYz7sUpu3PeYwLiTnRr09frxWdSkRcFtQX3g27yWX"
    "9Yoz0rbQND9ST8+pZ/9Q34K82aDNwGkxj552qdG2+szPoEw5/h1tnu9fxAk1Ry6Tdcj3nticWV5ljhfvUqM/cFmOJPGg7y7mndEGF8xrM1dM"
    "2U/63mJ2g7uBoMYggANyLkmzN6d0aBQ1hCUCX9apRC30pUwn1lbucKyIBPF5jHcjTsbkR0z0pDbkI5I66tVfwtfwLXwPP8LPqKwUjCQD9jFn"
    "zLW9dHMpSzWX8m+uX82FZiggbiCWEFXEMmIFcae+Cq/OguI6DDIPrf0CHOj7kg=="
)


def texts(recording):
    return [note.text for note in recording.notes]


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_reads_as_it_was_written(files, tmp_path, name):
    data = files.channels()
    path = tmp_path / name
    files.MAKERS[name](path, data)
    read = read_recording(path, **({"sampling_rate": files.RATE} if name in SILENT else {}))
    assert [one.samples.dtype for one in read.channels] == [np.float64] * 2
    assert [one.sampling_rate for one in read.channels] == pytest.approx([files.RATE] * 2, rel=1e-9)
    for one, x in zip(read.channels, data.values(), strict=True):
        # Text files hold nine digits, UFF's text twelve.
        assert_allclose(one.samples, x, rtol=0, atol=1e-9 if name.endswith((".csv", ".gz", ".txt", ".uff")) else 0)


def test_all_formats_are_tried(files):
    assert list(files.MAKERS) == FORMATS


@pytest.mark.parametrize("name", ["run.h5", "run.parquet", "binary.uff", "text.uff", "run.tdms", "run.mf4"])
def test_units_of_files(files, tmp_path, name):
    files.MAKERS[name](tmp_path / name, files.channels())
    unit = read_recording(tmp_path / name).channels[0].unit
    assert unit == {"run.parquet": "g", "run.tdms": "g", "run.mf4": "g"}.get(name, "m/s^2")


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.int32, np.float32, np.float64])
def test_full_scale_of_wav_is_one(tmp_path, dtype):
    kind = np.dtype(dtype)
    stored = np.array([0.5, -0.25, 0.0, -1.0])
    low = {"u": 128, "i": 0, "f": 0}[kind.kind]
    factor = 1 if kind.kind == "f" else 2.0 ** (8 * kind.itemsize - 1)
    wavfile.write(tmp_path / "run.wav", 8000, (stored * factor + low).astype(dtype))
    read = read_recording(tmp_path / "run.wav")
    assert read.channels[0].sampling_rate == 8000
    assert_array_equal(read.channels[0].samples, stored)
    assert ("integers of a WAV file: full scale is 1" in texts(read)) == (kind.kind != "f")


def test_wav_of_24_bits(tmp_path):
    stored = np.array([2**22, -(2**21), 0, -(2**23)])
    data = b"".join(int(one).to_bytes(3, "little", signed=True) for one in stored)
    head = b"WAVEfmt " + np.array([16], "<u4").tobytes() + np.array([1, 1], "<u2").tobytes()
    head += np.array([8000, 24_000], "<u4").tobytes() + np.array([3, 24], "<u2").tobytes()
    body = head + b"data" + np.array([len(data)], "<u4").tobytes() + data
    (tmp_path / "run.wav").write_bytes(b"RIFF" + np.array([len(body)], "<u4").tobytes() + body)
    assert read_recording(tmp_path / "run.wav", units="V", scale=10).channels[0].samples.tolist() == [5, -2.5, 0, -10]


def test_a_wav_file_that_was_cut_is_told(files, tmp_path):
    files.wav(tmp_path / "run.wav", files.channels())
    data = (tmp_path / "run.wav").read_bytes()
    (tmp_path / "run.wav").write_bytes(data[:-400])
    read = read_recording(tmp_path / "run.wav")
    assert read.channels[0].samples.size == 300
    assert "the file is cut short: its header states 1600 bytes of samples, it has 1200" in texts(read)


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize("dtype", [np.int8, np.uint16, np.int64, np.float32, np.float64, bool])
def test_types_of_mat_5(tmp_path, dtype, compressed):
    x = (np.arange(60) % 5 > 2).astype(dtype) if dtype is bool else (np.arange(60) * 7 % 60).astype(dtype)
    savemat(tmp_path / "run.mat", {"x": x.reshape(20, 3), "row": x[None]}, do_compression=compressed)
    read = read_recording(tmp_path / "run.mat", sampling_rate=10, variable="x")
    assert_array_equal(np.stack([one.samples for one in read.channels], 1), x.reshape(20, 3).astype(float))
    read = read_recording(tmp_path / "run.mat", sampling_rate=10, channels=["row"])
    assert_array_equal(read.channels[0].samples, x.astype(float))


def test_structures_and_cells_of_mat_5(tmp_path):
    x = np.arange(20) * 7.0 % 20
    runs = np.empty(2, dtype=[("a", object), ("note", object)])
    runs[0], runs[1] = (x, "first"), (x + 1, "second")
    cells = np.empty((1, 2), dtype=object)
    cells[0, 0], cells[0, 1] = x + 2, {"deep": x + 3}
    savemat(tmp_path / "run.mat", {"runs": runs, "c": cells, "load": 3.5, "s": eye(20)})
    read = read_recording(tmp_path / "run.mat", sampling_rate=10)
    assert [one.name for one in read.channels] == ["runs(1).a", "runs(2).a", "c{1}", "c{2}.deep"]
    assert [one.samples[0] for one in read.channels] == [0, 1, 2, 3]
    assert "load: fewer than 16 numbers, so not a channel" in texts(read)
    assert "s is a sparse matrix, which cannot be read; save its columns as arrays of numbers" in texts(read)
    assert [one.name for one in read_recording(tmp_path / "run.mat", sampling_rate=10, variable="c").channels] == [
        "c{1}",
        "c{2}.deep",
    ]


def mat5_element(kind, data):
    return np.array([kind, len(data)], "<u4").tobytes() + data + bytes(-len(data) % 8)


def test_a_table_of_matlab_is_a_clear_error(tmp_path):
    """An opaque variable as MATLAB writes a timetable: flags, name, system, class, reference."""
    flags = mat5_element(6, np.array([17, 0], "<u4").tobytes())
    inner = flags + b"".join(mat5_element(1, word) for word in (b"tt", b"MCOS", b"timetable"))
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (tmp_path / "run.mat").write_bytes(header + mat5_element(14, inner))
    with pytest.raises(
        InputError, match="no arrays of numbers: tt is an object, which cannot be read; save its columns as arrays"
    ):
        read_recording(tmp_path / "run.mat")


def test_the_last_of_two_variables_of_a_name_is_taken(tmp_path):
    one, two = io.BytesIO(), io.BytesIO()
    savemat(one, {"x": np.arange(20.0) % 7, "fs": 10.0})
    savemat(two, {"x": np.arange(30.0) % 5})
    (tmp_path / "run.mat").write_bytes(one.getvalue() + two.getvalue()[128:])
    read = read_recording(tmp_path / "run.mat")
    assert_array_equal(read.channels[0].samples, np.arange(30) % 5)
    assert "x is stored more than once; the last one was taken" in texts(read)


def test_complex_numbers_are_refused(tmp_path):
    savemat(tmp_path / "run.mat", {"z": np.arange(20) * 1j})
    with pytest.raises(InputError, match="z holds complex numbers; a channel is real"):
        read_recording(tmp_path / "run.mat")


def test_two_rates_in_a_file_are_not_chosen_from(tmp_path):
    np.savez(tmp_path / "run.npz", x=np.arange(20) * 7 % 20, fs=10, dt=0.2)
    with pytest.raises(InputError, match="does not state the sampling rate"):
        read_recording(tmp_path / "run.npz")
    assert "fs, dt state different sampling rates" in texts(read_recording(tmp_path / "run.npz", sampling_rate=3))[0]


def test_times_beside_arrays(tmp_path):
    np.savez(tmp_path / "run.npz", x=np.arange(20) * 7 % 20, t=np.arange(20) / 500)
    assert read_recording(tmp_path / "run.npz").channels[0].sampling_rate == pytest.approx(500)
    np.savez(tmp_path / "run.npz", x=np.arange(20) * 7 % 20, t=np.arange(21) / 500)
    with pytest.raises(InputError, match="t has 21 times, channel x 20 samples"):
        read_recording(tmp_path / "run.npz")


def test_integers_are_not_scaled_and_told(tmp_path):
    np.save(tmp_path / "run.npy", np.arange(-20, 20, dtype=np.int16) ** 2)
    read = read_recording(tmp_path / "run.npy", sampling_rate=10)
    assert read.channels[0].samples[0] == 400
    assert texts(read) == ["column holds integers (int16) and was not scaled; see scale"]


def test_samples_run_along_the_longer_side(tmp_path):
    np.save(tmp_path / "run.npy", np.arange(60).reshape(3, 20) * 7.0 % 60)
    read = read_recording(tmp_path / "run.npy", sampling_rate=10)
    assert [one.samples[1] for one in read.channels] == [7, 21 * 7 % 60, 41 * 7 % 60]
    assert texts(read) == ["column of shape (3, 20) was read with its samples along the rows"]


def test_fields_rates_and_links_of_hdf5(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        table = np.zeros(20, [("x", "<f4"), ("n", "<i2")])
        table["x"], table["n"] = np.arange(20) * 7 % 20, np.arange(20) * 3 % 20
        file.create_dataset("table", data=table).attrs["fs"] = 10.0
        file.create_dataset("fast", data=np.arange(40) * 7.0 % 40).attrs["dt"] = 0.05
        file["again"] = h5py.SoftLink("/fast")
        file["far"] = h5py.ExternalLink("/etc/passwd", "/")
        file["text"] = "words"
        file["fast"].attrs["unit"] = "m/s"
    read = read_recording(tmp_path / "run.h5")
    assert [(one.name, one.sampling_rate) for one in read.channels] == [("fast", 20), ("table.x", 10), ("table.n", 10)]
    assert {"again is a link, which is not followed", "far is a link, which is not followed"} < set(texts(read))
    assert read.channel("fast").unit == "m/s"
    assert "channels have 2 sampling rates" in texts(read)


def test_numbers_kept_in_other_files_are_not_read(tmp_path):
    (tmp_path / "secret.bin").write_bytes(bytes(800))
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_dataset("x", (100,), "f8", external=[(str(tmp_path / "secret.bin"), 0, 800)])
        layout = h5py.VirtualLayout((100,), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "y", (100,))
        file.create_virtual_dataset("v", layout)
    with pytest.raises(InputError, match="v is kept in other files, which are not read; x is kept in other files"):
        read_recording(tmp_path / "run.h5")


def test_cells_and_objects_of_mat_73(files, tmp_path):
    path = tmp_path / "run.mat"
    files.mat73(path, files.channels())
    with h5py.File(path, "r+") as file:
        hidden = file.create_group("#refs#").create_dataset("b", data=np.arange(20)[None] * 7.0 % 20)
        file.create_dataset("c", data=[[hidden.ref]], dtype=h5py.ref_dtype).attrs["MATLAB_class"] = np.bytes_("cell")
        table = file.create_dataset("tt", data=np.zeros((1, 6), np.uint32))
        table.attrs["MATLAB_class"], table.attrs["MATLAB_object_decode"] = np.bytes_("timetable"), 3
    read = read_recording(path, variable="c")
    assert [(one.name, one.samples.size) for one in read.channels] == [("c{1}", 20)]
    notes = texts(read_recording(path, variable=None, channels=["run.a1"]))
    assert (
        "tt is a timetable, which cannot be read (the file holds no properties of objects); save its columns as "
        "arrays of numbers"
    ) in notes


def test_hdf5_without_its_library(files, tmp_path, monkeypatch):
    files.hdf5(tmp_path / "run.h5", files.channels())
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"needs h5py, which is not installed: pip install h5py"):
        read_recording(tmp_path / "run.h5")


def test_columns_of_parquet_that_are_no_numbers(tmp_path):
    table = pa.table({"x": np.arange(40, dtype=np.int32) * 7 % 40, "on": [True, False] * 20, "who": ["a"] * 40})
    parquet.write_table(table, tmp_path / "run.parquet")
    read = read_recording(tmp_path / "run.parquet", sampling_rate=10)
    assert [one.name for one in read.channels] == ["x", "on"]
    assert read.channel("on").samples[:3].tolist() == [1, 0, 1]
    assert "who: not numbers, so not a channel" in texts(read)


def test_uff_of_spectra_is_no_recording(files, tmp_path):
    files.uff58(tmp_path / "run.uff", files.channels(), function=4)
    with pytest.raises(InputError, match=r"holds no time record .*: a1 of function type 4, a2 of function type 4"):
        read_recording(tmp_path / "run.uff")


def test_bytes_that_look_like_an_end_are_read_as_numbers(files, tmp_path):
    x = np.frombuffer(b"\n    -1\n" * 40, "<f8").copy()
    files.uff58(tmp_path / "run.uff", {"a1": x})
    assert_array_equal(read_recording(tmp_path / "run.uff").channels[0].samples, x)


@pytest.mark.parametrize("options", [{"interleaved": True}, {"segments": 1}, {"segments": 7}])
def test_layouts_of_tdms(files, tmp_path, options):
    data = files.channels()
    files.tdms(tmp_path / "run.tdms", data, **options)
    read = read_recording(tmp_path / "run.tdms", variable="run")
    for one, x in zip(read.channels, data.values(), strict=True):
        assert_array_equal(one.samples, x)


def test_tdms_as_another_library_writes_it(tmp_path):
    (tmp_path / "run.tdms").write_bytes(zlib.decompress(base64.b64decode(NP_TDMS)))
    columns = read_tdms(tmp_path / "run.tdms", RecordingSettings()).columns
    i = np.arange(20)
    assert [(one.name, one.unit, one.sampling_rate) for one in columns] == [
        ("a1", "g", 12_800.0),
        ("it's", "", 12_800.0),
    ]
    assert_array_equal(columns[0].values, i / 2 - 3)
    assert_array_equal(columns[1].values, 0.25 * (i - 7) + 1)
    with pytest.raises(InputError, match="holds no vibration: a1 only rises"):
        read_recording(tmp_path / "run.tdms")


def test_a_tdms_file_that_was_cut(files, tmp_path):
    data = files.channels()
    files.tdms(tmp_path / "run.tdms", data, interleaved=True)
    (tmp_path / "run.tdms").write_bytes((tmp_path / "run.tdms").read_bytes()[:-20])
    read = read_recording(tmp_path / "run.tdms")
    assert_array_equal(read.channel("a2").samples, data["a2"][:-2])
    assert "the last part is not whole and was left out" in texts(read)
