"""Validation: facts in HDF5 files, and frames as pandas stores them."""

import itertools
import pickle

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_recording

X = np.sin(np.arange(60.0))
FIRST = 1_700_000_000_000_000_000


def texts(recording):
    return [note.text for note in recording.notes]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.h5"


@pytest.mark.parametrize("text", [np.bytes_, str, "latest", "after 512 bytes"])
@pytest.mark.parametrize(
    ("key", "value"), [("fs", 800.0), ("sampling_rate", 800), ("dt", 1 / 800), ("SampleRate", "800 Hz")]
)
@pytest.mark.parametrize("unit", ["unit", "units", "Unit"])
def test_facts_of_a_dataset(path, text, key, value, unit):
    layout = {"libver": "latest"} if text == "latest" else {"userblock_size": 512} if text == "after 512 bytes" else {}
    with h5py.File(path, "w", **layout) as file:
        made = file.create_dataset("a1", data=X)
        made.attrs[key] = value
        made.attrs[unit] = text("m/s^2") if callable(text) else "m/s^2"
        file["about"] = "a run"
    (channel,) = read_recording(path).channels
    assert (channel.name, channel.unit, channel.sampling_rate) == ("a1", "m/s^2", pytest.approx(800))
    assert_array_equal(channel.samples, X)


def test_facts_of_a_group_hold_in_it(path):
    with h5py.File(path, "w") as file:
        file.attrs["fs"] = 800.0
        file.attrs["units"] = "g"
        file["run/a1"] = X
        file["run/t"] = X + 1
        file["run/t"].attrs["units"] = "V"
    read = read_recording(path, channels=["run/a1", "run/t"], time=False)
    assert [(one.unit, one.sampling_rate) for one in read.channels] == [("g", 800.0), ("V", 800.0)]


def test_texts_and_fields_that_are_no_numbers(path):
    with h5py.File(path, "w") as file:
        table = np.zeros(60, [("a1", "<f8"), ("state", "S4"), ("pair", "<f4", (2,))])
        table["a1"], table["pair"][:, 1] = X, X
        file["table"] = table
        file["words"] = ["a", "b"] * 30
        file["about"] = "a run"
        mixed = np.zeros(60, [("a2", "<f8"), ("who", h5py.string_dtype())])
        mixed["a2"], mixed["who"] = X, "x"
        file.create_dataset("mixed", data=mixed)
    read = read_recording(path, sampling_rate=10)
    assert [one.name for one in read.channels] == ["mixed.a2", "table.a1", "table.pair1", "table.pair2"]
    assert_array_equal(read.channel("table.pair2").samples, X.astype("f4"))
    assert {
        "table.state is not numbers, so not a channel",
        "mixed.who is not numbers, so not a channel",
        "words is not numbers, so not a channel",
    } <= set(texts(read))


def test_starts_as_numbers_and_dates(path):
    """Two channels of one rate that begin 50 ms apart are laid on one time axis."""
    from sigdb.recording.files.formats.hdf5 import read_hdf5
    from sigdb.recording.files.settings import RecordingSettings

    with h5py.File(path, "w") as file:
        for name, start in (("a", "2024-01-01T10:00:00"), ("b", "2024-01-01T12:00:00.050+02:00"), ("c", 2.5), ("d", 3)):
            file[name] = X
            file[name].attrs["start_time"] = start
    starts = {column.name: column.start for column in read_hdf5(path, RecordingSettings()).columns}
    assert starts["b"] - starts["a"] == pytest.approx(0.05, abs=1e-6)
    assert (starts["c"], starts["d"]) == (2.5, 3.0)


def test_a_compression_that_is_not_there(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file.create_dataset("a1", data=X, chunks=(60,), compression="lzf")
    monkeypatch.setattr(h5py.h5z, "filter_avail", lambda code: False)
    with pytest.raises(InputError, match="a1 is compressed by lzf, which is not read; write it with gzip, or without"):
        read_recording(path, sampling_rate=10)


def test_a_dataset_over_frequencies_is_no_channel(path):
    """A spectrum, whose dimension scale states so."""
    with h5py.File(path, "w") as file:
        file["bins"] = np.arange(60) * 5.0
        file["bins"].attrs["units"] = "Hz"
        file["a1"], file["spectrum"] = X, X**2
        file["bins"].make_scale("bins")
        file["spectrum"].dims[0].attach_scale(file["bins"])
    read = read_recording(path, sampling_rate=800)
    assert "spectrum" not in {one.name for one in read.channels}
    assert "a1" in {one.name for one in read.channels}


def test_an_abscissa_that_an_attribute_names(path):
    with h5py.File(path, "w") as file:
        file["a1"], file["spectrum"] = X, X**2
        file["a1"].attrs["xunit"], file["spectrum"].attrs["xunit"] = "s", "Hz"
    assert [one.name for one in read_recording(path, sampling_rate=800).channels] == ["a1"]


@pytest.mark.parametrize("unit", ["s", "ms"])
def test_a_scale_of_times(path, unit):
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(60) / 800 * (1000 if unit == "ms" else 1)
        file["t"].attrs["units"] = unit
        file["a1"] = X
        file["t"].make_scale("time")
        file["a1"].dims[0].attach_scale(file["t"])
    (channel,) = read_recording(path).channels
    assert (channel.name, channel.sampling_rate) == ("a1", pytest.approx(800))


def no_heap(data, at):
    data[at] = 0


def endless(data, at):
    """An object without a number and without a length, at which the library would stay for ever."""
    data[at + 16 : at + 32] = b"\0\0" + bytes(14)


def long_object(data, at):
    data[at + 24 : at + 32] = b"\xf0" + b"\xff" * 7


def other_version(data, at):
    data[at + 4] = 9


def long_text(data, at):
    """The library would ask for 4 GiB."""
    place = data.index((3).to_bytes(4, "little") + at.to_bytes(8, "little"))
    data[place : place + 4] = b"\xf0\xff\xff\xff"


@pytest.mark.parametrize("damage", [no_heap, endless, long_object, other_version, long_text])
def test_texts_in_a_damaged_heap_are_not_read(path, damage):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=X).attrs["unit"] = "m/s"
    data = bytearray(path.read_bytes())
    damage(data, data.index(b"GCOL"))
    path.write_bytes(data)
    read = read_recording(path, sampling_rate=10)
    assert read.channels[0].unit == ""
    assert "some texts of variable length, such as units, cannot be read; give units" in texts(read)


# Frames as PyTables writes them for pandas 3.1: attributes are fixed texts, lists are pickled.
def attributes(item, **values):
    for key, value in values.items():
        item.attrs[key] = np.bytes_(value) if isinstance(value, str | bytes) else value


def index_of(kind):
    i = np.arange(60)
    return {
        "integer": i, "float": i / 200, "datetime64[ns]": FIRST + i * 5_000_000, "datetime64": FIRST + i * 5_000_000,
        "timedelta64[us]": i * 5000,
    }[kind]  # fmt: skip


KINDS = ["integer", "float", "datetime64[ns]", "datetime64", "timedelta64[us]"]


def fixed_frame(path, kind, *, name="N."):
    with h5py.File(path, "w") as file:
        group = file.create_group("df")
        attributes(group, CLASS="GROUP", pandas_type="frame", nblocks=2, ndim=2, encoding="UTF-8")
        group["axis0"] = np.array([b"a1", b"n", b"a2"])
        group["axis1"] = index_of(kind)
        attributes(group["axis1"], kind=kind, name=name)
        group["block0_items"], group["block0_values"] = np.array([b"a1", b"a2"]), np.stack([X, X**2], 1)
        group["block1_items"], group["block1_values"] = np.array([b"n"]), np.arange(60)[:, None] ** 2 % 7


def frame_as_table(path, kind, *, data_columns=False):
    fields = [("a1", "<f8"), ("a2", "<f8")] if data_columns else [("values_block_0", "<f8", (2,))]
    rows = np.zeros(60, [("index", np.asarray(index_of(kind)).dtype.str), *fields])
    rows["index"] = index_of(kind)
    if data_columns:
        rows["a1"], rows["a2"] = X, X**2
    else:
        rows["values_block_0"] = np.stack([X, X**2], 1)
    with h5py.File(path, "w") as file:
        group = file.create_group("df")
        attributes(group, CLASS="GROUP", pandas_type="frame_table", table_type="appendable_frame")
        group["table"] = rows
        names = {} if data_columns else {"values_block_0_kind": pickle.dumps(["a1", "a2"], 0)}
        attributes(group["table"], index_kind=kind, values_block_0_dtype="float64", **names)
        # The search index of PyTables is no signal.
        group.create_group("_i_table").create_group("index")["sortedLR"] = np.arange(500)


MAKERS = {
    "fixed": fixed_frame, "table": frame_as_table,
    "data columns": lambda path, kind: frame_as_table(path, kind, data_columns=True),
}  # fmt: skip


@pytest.mark.parametrize(("made", "kind"), list(itertools.product(MAKERS, KINDS)))
def test_frames_of_pandas(path, made, kind):
    MAKERS[made](path, kind)
    read = read_recording(path, sampling_rate=None if "64" in kind else 200)
    assert_array_equal(read.channel("df/a1").samples, X)
    assert_array_equal(read.channel("df/a2").samples, X**2)
    assert [one.sampling_rate for one in read.channels] == pytest.approx([200.0] * len(read.channels))
    names = {one.name for one in read.channels} - ({"df/index"} if kind == "float" else set())
    assert names == {"df/a1", "df/a2"} | ({"df/n"} if made == "fixed" else set())


def test_a_frame_with_a_named_index(path):
    fixed_frame(path, "float", name="time")
    assert read_recording(path).channels[0].sampling_rate == pytest.approx(200)


def test_a_date_as_a_column_is_in_seconds(path):
    fixed_frame(path, "integer")
    with h5py.File(path, "r+") as file:
        group = file["df"]
        del group["axis0"], group["block1_items"], group["block1_values"]
        group["axis0"] = np.array([b"a1", b"time", b"a2"])
        group["block1_items"], group["block1_values"] = np.array([b"time"]), index_of("datetime64")[:, None]
        attributes(group["block1_values"], value_type="datetime64[ns]")
    assert_allclose(read_recording(path).channels[0].sampling_rate, 200)


def test_pickled_names_are_not_run(path):
    frame_as_table(path, "integer")

    class Harm:
        def __reduce__(self):
            return (open, (str(path.with_name("harm")), "w"))

    with h5py.File(path, "r+") as file:
        attributes(file["df/table"], values_block_0_kind=pickle.dumps(Harm(), 0))
    read = read_recording(path, sampling_rate=10)
    assert [one.name for one in read.channels] == ["df/values_block_01", "df/values_block_02"]
    assert not path.with_name("harm").exists()
