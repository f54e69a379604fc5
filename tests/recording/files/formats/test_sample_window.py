"""Verification: windows of samples hold what the whole file holds, in each format that is read by windows."""

import tracemalloc

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core import InputError
from sigdb.recording import read_in_blocks, read_recording, recorded_signature
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow

N = 2503
RATE = 12_800.0
FIRST = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def data(files):
    return files.channels(N)


@pytest.mark.parametrize("total", [0, 1, 255, 256, 1000, 1255, 1256, 2000, 5003])
@pytest.mark.parametrize("length", [256, 1000])
def test_windows_cover_each_sample_once(total, length):
    parts = [SampleWindow(first, length).of(total) for first in range(0, 6000, length)]
    assert [i for part in parts for i in range(total)[part]] == list(range(total))
    assert all(part.stop - part.start >= 256 for part in parts[1:] if part.stop > part.start)
    assert WHOLE.of(total) == slice(0, total)


def _matrix(path, data, *, wide):
    with h5py.File(path, "w") as file:
        x = np.stack(list(data.values()), 0 if wide else 1)
        file["run"] = x
        file["run"].attrs["fs"] = RATE
        file["run"].attrs["start"] = 12.5


def _with_dates(path, data):
    with h5py.File(path, "w") as file:
        for name, x in data.items():
            file[name] = x
            file[name].attrs.update({"fs": RATE, "start_time": "2024-02-29T23:59:59.5+00:00", "unit": "g"})


def _with_times(path, data):
    rows = np.zeros(N, [("time", "<f8"), ("a1", "<f4"), ("pair", "<f8", (2,)), ("state", "S4")])
    rows["time"], rows["a1"], rows["pair"][:, 1] = 3 + np.arange(N) / RATE, data["a1"], data["a2"]
    rows["pair"][:, 0] = data["a1"] ** 2
    with h5py.File(path, "w") as file:
        file["table"] = rows
        file["speed_rpm"] = 1200.0


def _frame(path, data, *, fixed, dates):
    ticks = np.round(np.arange(N) * 78_125).astype(np.int64) + FIRST if dates else np.arange(N)
    kind = "datetime64[ns]" if dates else "integer"
    with h5py.File(path, "w") as file:
        group = file.create_group("df")
        if fixed:
            group.attrs.update({"CLASS": np.bytes_("GROUP"), "pandas_type": np.bytes_("frame")})
            group["axis0"] = group["block0_items"] = np.array([b"a1", b"a2"])
            group["axis1"] = ticks
            group["axis1"].attrs["kind"] = np.bytes_(kind)
            group["block0_values"] = np.stack(list(data.values()), 1)
            return
        rows = np.zeros(N, [("index", "<i8"), ("a1", "<f8"), ("a2", "<f8")])
        rows["index"], rows["a1"], rows["a2"] = ticks, data["a1"], data["a2"]
        group.attrs["pandas_type"] = np.bytes_("frame_table")
        group["table"] = rows
        group["table"].attrs["index_kind"] = np.bytes_(kind)


def _mat_matrix(path, data, files):
    files.mat73(path, {"x": data["a1"]})
    with h5py.File(path, "r+") as file:
        del file["run"]["x"]
        matrix = file["run"].create_dataset("x", data=np.stack(list(data.values())))
        matrix.attrs["MATLAB_class"] = np.bytes_("double")


def _write(path, data, files):
    """Write channels in the layout of a name, and return the options of reading."""
    rate = {"sampling_rate": RATE}
    match path.name:
        case "groups.h5":
            files.hdf5(path, data)
        case "wide.h5" | "tall.h5":
            _matrix(path, data, wide=path.name == "wide.h5")
        case "dates.h5":
            _with_dates(path, data)
        case "fields.h5":
            _with_times(path, data)
        case "columns.mat":
            files.mat73(path, data)
        case "segments.tdms" | "one segment.tdms" | "interleaved.tdms":
            segments = 1 if path.name == "one segment.tdms" else 37
            files.tdms(path, data, interleaved=path.name == "interleaved.tdms", segments=segments)
        case "one list.mf4":
            files.mdf4(path, data)
        case "matrix.mat":
            _mat_matrix(path, data, files)
        case _:
            _frame(path, data, fixed="fixed" in path.name, dates="dates" in path.name)
            return {} if "dates" in path.name else rate
    return {}


FILES = [
    "groups.h5", "wide.h5", "tall.h5", "dates.h5", "fields.h5", "columns.mat", "matrix.mat", "fixed counts.h5",
    "fixed dates.h5", "table counts.h5", "table dates.h5", "segments.tdms", "one segment.tdms", "interleaved.tdms",
    "one list.mf4",
]  # fmt: skip


@pytest.mark.parametrize("samples", [300, 1000])
@pytest.mark.parametrize("name", FILES)
def test_blocks_hold_what_the_whole_file_holds(tmp_path, files, data, name, samples):
    path = tmp_path / name
    options = _write(path, data, files)
    whole, blocks = read_recording(path, **options), read_in_blocks(path, samples=samples, **options)
    parts = list(blocks)
    assert len(parts) > 2
    assert [channel.name for channel in blocks.channels] == [channel.name for channel in whole.channels]
    for channel in whole.channels:
        read = [part.channel(channel.name) for part in parts]
        assert_array_equal(np.concatenate([part.samples for part in read]), channel.samples)
        extent = blocks.whole.channel(channel.name)
        assert (extent.unit, extent.samples.size) == (channel.unit, channel.samples.size)
        assert extent.sampling_rate == pytest.approx(channel.sampling_rate, rel=1e-9)
        assert extent.start == pytest.approx(channel.start, abs=1e-9)
        sizes = np.cumsum([0, *(part.samples.size for part in read[:-1])])
        assert_allclose([part.start for part in read], channel.start + sizes / RATE, atol=1e-6)
    assert blocks.whole.zero_time == pytest.approx(whole.zero_time)
    assert blocks.whole.speed_rpm == whole.speed_rpm
    assert {note.code for note in whole.notes} <= {note.code for note in blocks.whole.notes}


def _gear(files):
    """A shaft of 50 rev/s with a gear of 12 teeth, and its tacho."""
    rev = 50 * np.arange(N) / RATE + 0.05 * np.sin(np.arange(N) / 900)
    noise = np.random.default_rng(3).normal(size=N)
    return {"a1": np.cos(24 * np.pi * rev) + 0.2 * noise, "a2": 5.0 * (rev % 1 < 0.1)}


@pytest.mark.parametrize("name", ["columns.mat", "segments.tdms"])
def test_a_signature_of_blocks_is_that_of_the_file(tmp_path, files, name):
    path = tmp_path / name
    _write(path, _gear(files), files)
    prefix = {"columns.mat": "run."}.get(name, "")
    options = {"channels": (f"{prefix}a1",), "tacho": f"{prefix}a2"}
    whole = recorded_signature(read_recording(path, **options), teeth=12)
    blocks = recorded_signature(read_in_blocks(path, samples=700, **options), teeth=12)
    assert blocks.averages == whole.averages
    assert_allclose(blocks.tsa, whole.tsa, atol=1e-9)
    assert_allclose(list(blocks.indicators.values()), list(whole.indicators.values()), rtol=1e-6)


@pytest.mark.parametrize("name", ["groups.h5", "columns.mat", "fixed counts.h5", "segments.tdms"])
@pytest.mark.parametrize(("missing", "reason"), [(slice(990, 1010), "samples are missing"), (slice(700, 702), None)])
def test_missing_samples_are_filled_or_refused_as_in_the_file(tmp_path, files, data, name, missing, reason):
    path = tmp_path / name
    x = data["a1"].copy()
    x[missing] = np.nan
    options = _write(path, {**data, "a1": x}, files)
    for read in (read_recording, lambda path, **options: read_in_blocks(path, samples=1000, **options)):
        if reason is None:
            assert [note.code for note in getattr(read(path, **options), "whole", read(path, **options)).notes].count(
                "filled-gaps"
            ) == 1
        else:
            with pytest.raises(InputError, match=reason):
                read(path, **options)


def test_channels_of_another_length_are_left_to_the_choice_of_channels(tmp_path, data):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        for name, x, rate in (("a1", data["a1"], RATE), ("slow", data["a2"][: N // 4], RATE / 4)):
            file[name] = x
            file[name].attrs["fs"] = rate
    with pytest.raises(InputError, match=r"which are not read in blocks; choose .*by channels"):
        read_in_blocks(path, samples=300)
    for name, x in (("a1", data["a1"]), ("slow", data["a2"][: N // 4])):
        parts = list(read_in_blocks(path, samples=300, channels=[name]))
        assert_array_equal(np.concatenate([part.channel(name).samples for part in parts]), x)


def test_an_index_that_leaps_after_the_first_block_is_refused(tmp_path, data):
    path = tmp_path / "table counts.h5"
    _write(path, data, None)
    with h5py.File(path, "r+") as file:
        rows = file["df/table"][()]
        rows["index"][1500:] += 70
        file["df/table"][...] = rows
    with pytest.raises(InputError, match=r"leaps between rows 1000 and 2000: rows are missing"):
        read_in_blocks(path, samples=1000, sampling_rate=RATE)


def test_tables_of_matlab_are_not_read_in_blocks(tmp_path, data, matlab):
    path = tmp_path / "run.mat"
    matlab.timetable_73(path, data)
    with pytest.raises(InputError, match=r"timetable, which cannot be read \(in blocks.*save its columns as arrays"):
        read_in_blocks(path)


def _long_hdf5(path, x):
    with h5py.File(path, "w") as file:
        file.create_dataset("a1", data=x, chunks=(4096,), compression="gzip", compression_opts=1)
        file["a1"].attrs["fs"] = RATE


@pytest.mark.parametrize("name", ["run.h5", "run.tdms"])
def test_memory_does_not_grow_with_the_file(tmp_path, files, monkeypatch, name):
    path, size, block = tmp_path / name, 100_000, 2**12
    x = np.random.default_rng(0).normal(size=size)
    if name == "run.h5":
        _long_hdf5(path, x)
    else:
        files.tdms(path, {"a1": x}, segments=3)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 500_000)
    with pytest.raises(InputError, match="in blocks"):
        read_recording(path)
    read_in_blocks(path, samples=50_000)  # modules are loaded
    tracemalloc.start()
    try:
        blocks = read_in_blocks(path, samples=block)
        assert sum(part.channels[0].samples.size for part in blocks) == size
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 16 * 8 * block < 8 * size, peak
