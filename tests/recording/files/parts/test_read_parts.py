"""Verification: recordings in the files of a folder or a ZIP archive."""

import io
import zipfile

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from pyarrow import parquet
from scipy.io import wavfile

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.parts import members

RATE = 2000.0
X = np.random.default_rng(7).integers(-999, 999, (300, 2)) / 8.0


def csv(first, end, *, start=None, names="a1 [g],tacho [V]", columns=2):
    """Rows of text with a time from ``start`` on, in s; without a time if it is None."""
    times = [] if start is None else [f"{start + i / RATE:.6f}," for i in range(end - first)]
    rows = [",".join(f"{value:.4f}" for value in row[:columns]) for row in X[first:end]]
    head = names if start is None else f"time [s],{names}"
    return "\n".join([head, *(f"{a}{b}" for a, b in zip(times or [""] * len(rows), rows, strict=True))]) + "\n"


@pytest.fixture(params=["folder", "zip"])
def put(request, tmp_path):
    """Writes files into a folder or an archive and returns its path."""

    def write(contents, **options):
        if request.param == "folder":
            folder = tmp_path / "run"
            folder.mkdir()
            for name, data in contents.items():
                (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
            return folder
        with zipfile.ZipFile(tmp_path / "run.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in contents.items():
                archive.writestr(name, data)
        return tmp_path / "run.zip"

    return write


def texts(recording):
    return [note.text for note in recording.notes]


def refusal(path, **options):
    with pytest.raises(InputError) as caught:
        read_recording(path, **options)
    line = str(caught.value)
    assert line.isprintable()
    assert line.startswith(str(path))
    return line


def in_parts(starts=(0.0, 0.05, 0.1)):
    return {f"run_{9 + i}.csv": csv(100 * i, 100 * i + 100, start=starts[i]) for i in range(3)}


def test_parts_whose_times_follow_each_other(put):
    path = put({**in_parts(), "README.txt": "notes"})
    read = read_recording(path, tacho="tacho")
    assert [(one.name, one.unit, one.sampling_rate) for one in read.channels] == [
        ("a1", "g", pytest.approx(RATE)), ("tacho", "V", pytest.approx(RATE)),
    ]  # fmt: skip
    assert_array_equal(read.channel("a1").samples, X[:, 0])
    assert_array_equal(read.channel("tacho").samples, X[:, 1])
    assert read.tacho == "tacho"
    assert "run_9, run_10, run_11: 3 files were joined end to end, by their times" in texts(read)
    assert "README.txt: not read" in texts(read)


@pytest.mark.parametrize(
    ("starts", "told"),
    [
        ((0.0, 0.06, 0.11), r"run_10 begins 0.01 s \(20 samples\) after the end of run_9; read them one by one"),
        ((0.0, 0.05, 0.099), r"run_11 begins 0.001 s \(2 samples\) before the end of run_10"),
        ((0.1, 0.05, 0.0), "before the end of run_9"),
    ],
)
@pytest.mark.parametrize("parts", [None, "contiguous"])
def test_gaps_and_overlaps_are_refused(put, starts, told, parts):
    path = put(in_parts(starts))
    with pytest.raises(InputError, match=told):
        read_recording(path, parts=parts)


@pytest.mark.parametrize("start", [None, 0.0])
def test_files_that_do_not_say_when_they_begin(put, start):
    path = put({name: csv(100 * i, 100 * i + 100, start=start) for i, name in enumerate(["1.csv", "2.csv", "10.csv"])})
    options = {} if start == 0 else {"sampling_rate": RATE}
    line = refusal(path, **options)
    assert "holds 3 files (1, 2, 10) that do not state at what time each begins; give parts = 'contiguous'" in line
    read = read_recording(path, parts="contiguous", **options)
    assert_array_equal(read.channel("a1").samples, X[:, 0])
    told = "1, 2, 10: 3 files were joined end to end, because parts = 'contiguous' says that they follow each other"
    assert told in texts(read)


def test_copies_of_a_file_are_refused(put):
    path = put({"1.csv": csv(0, 100), "2.csv": csv(100, 200), "1 copy.csv": csv(0, 100)})
    line = refusal(path, parts="contiguous", sampling_rate=RATE)
    assert "holds the same samples as" in line
    assert line.endswith("leave out the copy")


def test_an_end_that_is_missing_breaks_the_row(put):
    lost = csv(100, 200).replace(csv(199, 200).splitlines()[1], ",0.5")
    path = put({"1.csv": csv(0, 100), "2.csv": lost, "3.csv": csv(200, 300)})
    assert "2 lacks samples at an end" in refusal(path, parts="contiguous", sampling_rate=RATE)


@pytest.mark.parametrize("names", [("x.csv", "y.csv"), ("acc_left.csv", "acc_right.csv")])
def test_a_channel_in_each_file(put, names):
    path = put({name: _column(i) for i, name in enumerate(names)})
    read = read_recording(path, units={names[0][:-4]: "g"}, scale={names[1][:-4]: 2.0}, tacho=names[1][:-4])
    assert [(one.name, one.unit) for one in read.channels] == [(names[0][:-4], "g"), (names[1][:-4], "")]
    assert_array_equal(read.channels[0].samples, X[:, 0])
    assert_array_equal(read.channels[1].samples, 2 * X[:, 1])
    assert any("2 files were read as channels measured at once" in text for text in texts(read))


def _column(i, *, count=300, start=0.0, name="value"):
    return f"time [s],{name}\n" + "".join(f"{start + j / RATE:.6f},{X[j, i]:.4f}\n" for j in range(count))


def test_files_of_one_channel_with_numbers_are_asked_about(put):
    path = put({"ch1.csv": _column(0), "ch2.csv": _column(1)})
    assert "or parts = 'channels' if they were measured at once" in refusal(path)
    read = read_recording(path, parts="channels", channels=["ch2"])
    assert [one.name for one in read.channels] == ["ch2"]
    assert_array_equal(read.channels[0].samples, X[:, 1])
    assert read_recording(path, parts="contiguous").channels[0].samples.size == 600


def test_channels_of_different_lengths_or_starts(put):
    path = put({"x.csv": _column(0), "y.csv": _column(1, count=250)})
    assert "x holds 300 samples at 2000 Hz, y 250 at 2000 Hz; if they follow each other" in refusal(path)


def test_channels_that_begin_later(put):
    path = put({"x.csv": _column(0), "y.csv": _column(1, start=0.05)})
    assert "y begins 0.05 s after the first file" in refusal(path)


def test_wave_files(put):
    def wave(part):
        file = io.BytesIO()
        wavfile.write(file, 8000, (part * 8).astype(np.int16))
        return file.getvalue()

    path = put({"day.wav": wave(X[:150]), "night.wav": wave(X[150:])})
    assert "parts = 'contiguous'" in refusal(path)
    read = read_recording(path, parts="contiguous")
    assert_allclose(read.channels[1].samples, X[:, 1] * 8 / 2**15)


@pytest.mark.parametrize(
    ("second", "told"),
    [
        (csv(100, 200, start=0.05, names="a1 [g],b [V]"), "run_2 holds the channels a1, b, run_1 a1, tacho"),
        (csv(100, 200, start=0.05, names="a1 [m/s^2],tacho [V]"), "a1 is in 'g' in run_1 and in 'm/s^2' in run_2"),
        ("words\nand more words\n", "run_2.csv: "),
        (b"PK\x03\x04" + bytes(99), "run_2.csv: "),
    ],
)
def test_files_that_do_not_belong_together(put, second, told):
    path = put({"run_1.csv": csv(0, 100, start=0.0), "run_2.csv": second})
    if second[:2] == b"PK" and path.suffix == ".zip":
        told = "holds the archive run_2.csv; unpack that first"
    assert told in refusal(path)


def test_dates_of_parquet_follow_each_other(put):
    def table(first, end):
        times = pa.array(1_700_000_000_000_000 + 500 * np.arange(first, end), pa.timestamp("us"))
        file = io.BytesIO()
        parquet.write_table(pa.table({"time": times, "a1": X[first:end, 0], "a2": X[first:end, 1]}), file)
        return file.getvalue()

    path = put({"1.parquet": table(0, 100), "2.parquet": table(100, 300)})
    read = read_recording(path)
    assert_array_equal(read.channels[1].samples, X[:, 1])
    assert read.zero_time == 1.7e9


def test_archives_beyond_the_limits(tmp_path, monkeypatch):
    path = tmp_path / "run.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("run.csv", b"0\n" * 2**25)
    assert "which measured numbers do not do" in refusal(path)
    with zipfile.ZipFile(path, "w") as archive:
        for name, first in (("../../a.csv", 0), ("/etc/b.csv", 100)):
            archive.writestr(name, csv(first, first + 100))
    read = read_recording(path, parts="contiguous", sampling_rate=RATE)  # names are only names
    assert read.channels[0].samples.size == 200
    monkeypatch.setattr(members, "MAX_FILES", 1)
    assert "holds more than 1 files" in refusal(path)


def test_archives_that_are_damaged_or_closed(tmp_path):
    path = tmp_path / "run.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("run.csv", csv(0, 100))
    whole = path.read_bytes()
    path.write_bytes(whole[:-40])
    assert "cannot be read as ZIP" in refusal(path)
    data = bytearray(whole)
    data[80] ^= 1
    path.write_bytes(data)
    assert "is damaged (Bad CRC-32" in refusal(path)
    data = bytearray(whole)
    data[data.index(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(data)
    assert "is encrypted (run.csv); pack it again without a password" in refusal(path)
    path.write_bytes(b"PK\x05\x06" + bytes(18))
    assert refusal(path)
    (tmp_path / "empty").mkdir()
    assert refusal(tmp_path / "empty").endswith("holds no files of a recording")


def test_hdf5_is_unpacked_first(put, files, tmp_path):
    files.hdf5(tmp_path / "one.h5", files.channels())
    path = put({"one.h5": (tmp_path / "one.h5").read_bytes()})
    if path.is_dir():
        assert len(read_recording(path).channels) == 2
    else:
        assert "one.h5: is HDF5, which is not read from an archive; unpack it" in refusal(path)


def test_damaged_archives_end_in_one_line(tmp_path):
    path = tmp_path / "run.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in in_parts().items():
            archive.writestr(name, data)
    whole, random = path.read_bytes(), np.random.default_rng(3)
    lines = [_outcome(path, whole, random) for _ in range(150)]
    assert all(line.isprintable() for line in lines)
    assert sum("run.zip: " in line for line in lines) > 100


def _outcome(path, whole, random):
    data = bytearray(whole)
    for _ in range(int(random.integers(1, 5))):
        data[int(random.integers(len(data)))] = int(random.integers(256))
    path.write_bytes(data)
    try:
        return f"{read_recording(path).channels[0].samples.size} samples"
    except InputError as error:
        return str(error)
