"""Verification: blocks of a file hold what the whole file holds, in each format; leaps, gaps and limits are refused."""

import gzip
import struct

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import wavfile

from sigdb.core import InputError
from sigdb.recording import read_in_blocks, read_recording
from sigdb.recording.files.formats.wav_chunks import stated_size

FS = 8000.0
N = 10_007


@pytest.fixture(scope="module")
def numbers():
    return np.random.default_rng(0).normal(size=(N, 2))


def _table(numbers, **more):
    return pd.DataFrame({"time": np.arange(N) / FS, "a1": numbers[:, 0], "a2": numbers[:, 1]} | more)


def _dates():
    return pd.to_datetime("2024-02-28 23:59:59") + pd.to_timedelta(np.arange(N) * 125, unit="us")


def _wav_24(path, x):
    data = (x * 2**20).astype("<i4").reshape(-1).view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    header = struct.pack("<4sI4s4sIHHIIHH", b"RIFF", 36 + len(data), b"WAVE", b"fmt ", 16, 1, 2, 8000, 48000, 6, 24)
    path.write_bytes(header + struct.pack("<4sI", b"data", len(data)) + data)


def _spaced(table):
    lines = table.to_csv(index=False).split("\n")
    return "\n".join([lines[0], *(f"{line}\n" for line in lines[1:-1])])


def _members(data):
    """A gzip file of three members, one of them empty."""
    return gzip.compress(data[:70_001], 1) + gzip.compress(b"") + gzip.compress(data[70_001:], 1)


def _write(path, x):
    """Write numbers in the format of a name, and return the options of reading."""
    table = _table(x)
    match path.name:
        case "tall.npy":
            np.save(path, x)
        case "wide.npy":
            np.save(path, np.asfortranarray(x.T))
        case "series.npy":
            np.save(path, x[:, 0])
        case "fields.npy":
            fields = [("time", "f8"), ("a1", "f4"), ("a2", "f8")]
            np.save(path, np.array([tuple(row) for row in table.to_numpy()], dtype=fields))
        case "16.wav":
            wavfile.write(path, 8000, (x * 5000).astype(np.int16))
        case "24.wav":
            _wav_24(path, x)
        case "float.wav":
            wavfile.write(path, 8000, x.astype(np.float32))
        case "plain.csv":
            table.to_csv(path, index=False)
        case "german.csv":
            path.write_text("Messung 7\n\n" + table.to_csv(index=False, sep=";", decimal=","), encoding="cp1252")
        case "blanks.txt":
            path.write_text(table.to_csv(index=False, sep=" ") + "end of file\n")
        case "spaced.csv":
            path.write_text(_spaced(table))
        case "dates.csv":
            table.assign(time=_dates().strftime("%Y-%m-%d %H:%M:%S.%f")).to_csv(path, index=False)
        case "plain.csv.gz":
            path.write_bytes(_members(table.to_csv(index=False).encode()))
        case "utf-16.csv":
            path.write_text("Durée;µ\n" + table.to_csv(index=False, sep=";"), encoding="utf-16")
        case "utf-16-be.csv.gz":
            path.write_bytes(_members(b"\xfe\xff" + table.to_csv(index=False).encode("utf-16-be")))
        case "groups.parquet":
            table.to_parquet(path, row_group_size=3000)
        case "dates.parquet":
            table.assign(time=_dates()).to_parquet(path, row_group_size=777)
    return {"sampling_rate": FS} if path.name in ("tall.npy", "wide.npy", "series.npy") else {}


FILES = [
    "tall.npy", "wide.npy", "series.npy", "fields.npy", "16.wav", "24.wav", "float.wav", "plain.csv", "german.csv",
    "blanks.txt", "spaced.csv", "plain.csv.gz", "utf-16.csv", "utf-16-be.csv.gz", "dates.csv", "groups.parquet",
    "dates.parquet",
]  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_blocks_hold_what_the_whole_file_holds(tmp_path, numbers, name):
    path = tmp_path / name
    options = _write(path, numbers)
    whole, blocks = read_recording(path, **options), read_in_blocks(path, samples=1999, **options)
    parts = list(blocks)
    assert len(parts) == (10 if name == "spaced.csv" else 5)
    assert [channel.name for channel in blocks.channels] == [channel.name for channel in whole.channels]
    # Dates are rounded to 0.2 us as seconds since 1970.
    tolerance = 1e-6 if "dates" in name else 1e-9
    for channel in whole.channels:
        read = [part.channel(channel.name) for part in parts]
        assert_array_equal(np.concatenate([part.samples for part in read]), channel.samples)
        extent = blocks.whole.channel(channel.name)
        assert (extent.unit, extent.samples.size) == (channel.unit, channel.samples.size)
        assert extent.sampling_rate == pytest.approx(channel.sampling_rate, rel=tolerance)
        assert extent.start == pytest.approx(channel.start, abs=1e-9)
        sizes = np.cumsum([0, *(part.samples.size for part in read[:-1])])
        assert_allclose([part.start for part in read], channel.start + sizes / FS, atol=1e-6)
        assert {part.sampling_rate for part in read} == {extent.sampling_rate}
    assert blocks.whole.zero_time == pytest.approx(whole.zero_time)
    codes = {note.code for note in whole.notes} - {"samples-along-rows"}
    assert codes <= {note.code for note in blocks.whole.notes}


def test_overview_of_blocks_has_the_extent_of_all_samples(tmp_path, numbers):
    options = _write(tmp_path / "tall.npy", numbers)
    overview = read_in_blocks(tmp_path / "tall.npy", samples=1000, **options).overview()
    assert_allclose(overview["least"], numbers.min(axis=0))
    assert_allclose(overview["greatest"], numbers.max(axis=0))
    assert_allclose(overview["rms"], np.sqrt(np.mean(numbers**2, axis=0)))
    assert overview["samples"].tolist() == [N, N]
    assert overview["clipped"].isna().all()


def test_parts_may_hold_some_channels_with_their_scale_and_unit(tmp_path, numbers):
    _write(tmp_path / "plain.csv", numbers)
    options = {"units": {"a1": "g", "a2": "V", "time": "s"}, "scale": {"a2": 10.0}, "tacho": "a1"}
    blocks = read_in_blocks(tmp_path / "plain.csv", samples=3000, **options)
    parts = list(blocks.parts("a2"))
    assert [[channel.name for channel in part.channels] for part in parts] == [["a2"]] * 4
    assert_allclose(np.concatenate([part.channels[0].samples for part in parts]), 10 * numbers[:, 1])
    assert {part.channels[0].unit for part in parts} == {"V"}


def _leap(table):
    table["time"] += np.where(np.arange(N) >= 4000, 0.5, 0.0)


def _back(table):
    table["time"] -= np.where(np.arange(N) >= 4000, 0.25, 0.0)


def _other_rate(table):
    table["time"] = np.where(np.arange(N) < 4000, table["time"], 0.5 + (np.arange(N) - 4000) / (0.99 * FS))


def _missing_at_the_edge(table):
    table.loc[3999:4001, "a1"] = np.nan


def _long_gap(table):
    table.loc[5000:5020, "a1"] = np.nan


@pytest.mark.parametrize("samples", [1000, 2000, 4000])
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (_leap, r"leap by 0\.5 s \(4e\+03 steps\) at sample 4000, 1 s: samples are missing"),
        (_back, r"leap by -0\.25 s .* at sample 4000, 0\.25 s: the times go back"),
        (_other_rate, r"changes from 8000 to 7920 Hz at sample 4000"),
        (_missing_at_the_edge, r"samples are missing at its edge, from sample"),
    ],
)
def test_blocks_that_do_not_go_on_are_refused(tmp_path, numbers, samples, change, reason):
    table = _table(numbers)
    change(table)
    path = tmp_path / "run.parquet"
    table.to_parquet(path)
    with pytest.raises(InputError, match=reason) as refused:
        read_in_blocks(path, samples=samples)
    assert str(refused.value).startswith(str(path))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (_leap, r"in the block of samples 3000 to 6000.*time leaps by 4e\+03 steps after sample 1000"),
        (_long_gap, r"in the block of samples 3000 to 6000.*21 samples are missing from sample 2000"),
    ],
)
def test_faults_inside_a_block_are_refused_with_its_place(tmp_path, numbers, change, reason):
    table = _table(numbers)
    change(table)
    table.to_csv(tmp_path / "run.csv", index=False)
    with pytest.raises(InputError, match=reason):
        read_in_blocks(tmp_path / "run.csv", samples=3000)


def test_short_gaps_inside_blocks_are_filled_as_in_a_file_and_noted_once(tmp_path, numbers):
    table = _table(numbers)
    table.loc[[1500, 5200, 5201], "a1"] = np.nan
    table.to_csv(tmp_path / "run.csv", index=False)
    blocks = read_in_blocks(tmp_path / "run.csv", samples=1000)
    whole = read_recording(tmp_path / "run.csv")
    x = np.concatenate([part.channel("a1").samples for part in blocks])
    assert_allclose(x, whole.channel("a1").samples)
    (note,) = [note for note in blocks.whole.notes if note.code == "filled-gaps"]
    assert note.values["blocks"] == 2
    assert "samples 1000 to 2000" in note.text


@pytest.mark.parametrize("row", ["nonsense,1,2", "1,2", "", '"end",,', "0.5,overload,1"])
def test_a_line_of_text_that_is_no_row_is_refused_with_its_number(tmp_path, numbers, row):
    lines = _table(numbers).to_csv(index=False).split("\n")
    lines[7000] = row
    (tmp_path / "run.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="line 7001"):
        read_in_blocks(tmp_path / "run.csv", samples=1000)


def test_a_file_above_the_limit_is_read_in_blocks_and_its_refusal_says_so(tmp_path, numbers, monkeypatch):
    options = _write(tmp_path / "tall.npy", numbers)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 100_000)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_VALUES", 10_000)
    with pytest.raises(InputError, match=r"more than 100000.*read it in blocks: sigdb.recording.read_in_blocks, as"):
        read_recording(tmp_path / "tall.npy", **options)
    assert sum(part.channels[0].samples.size for part in read_in_blocks(tmp_path / "tall.npy", samples=1000, **options))
    np.savez(tmp_path / "run.npz", a=numbers)
    with pytest.raises(InputError, match=r"write it as one of text.*LVM.*NPY, MDF, TDMS"):
        read_recording(tmp_path / "run.npz", **options)


def test_formats_that_are_not_read_in_blocks_name_those_that_are(tmp_path, numbers):
    np.savez(tmp_path / "run.npz", a=numbers)
    with pytest.raises(InputError, match=r"not read in blocks; write it as one of text.*LVM.*NPY, MDF, TDMS"):
        read_in_blocks(tmp_path / "run.npz", sampling_rate=FS)
    with pytest.raises(InputError, match="no such file"):
        read_in_blocks(tmp_path / "none.csv")
    with pytest.raises(InputError, match="folder is not read in blocks"):
        read_in_blocks(tmp_path)


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path, numbers):
    options = _write(tmp_path / "tall.npy", numbers)
    blocks = read_in_blocks(tmp_path / "tall.npy", samples=1000, **options)
    np.save(tmp_path / "tall.npy", numbers[:9000])
    with pytest.raises(InputError, match="now holds 9000 samples"):
        list(blocks)


@pytest.mark.parametrize(
    ("stated", "present", "size"), [(0, 2**32 + 40, 2**32 + 40), (2**32 - 1, 5 * 2**30, 5 * 2**30), (40, 48, 40)]
)
def test_samples_of_a_wav_file_above_4_gib_are_all_read(stated, present, size):
    assert stated_size(stated, present, is_64_bit=False)[0] == size


def test_a_wav_file_above_4_gib_with_other_chunks_after_the_samples_is_refused():
    with pytest.raises(InputError, match="above 4 GiB need RF64"):
        stated_size(1000, 2**32 + 1060, is_64_bit=False)


def test_rf64_states_its_size_in_64_bits(tmp_path, numbers):
    x = (numbers * 5000).astype("<i2")
    data = x.tobytes()
    sizes = struct.pack("<4sIQQQI", b"ds64", 28, 72 + len(data), len(data), N, 0)
    form = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, 2, 8000, 32000, 4, 16)
    after = struct.pack("<4sI4s", b"LIST", 4, b"INFO")
    head = struct.pack("<4sI4s", b"RF64", 2**32 - 1, b"WAVE") + sizes + form
    (tmp_path / "run.wav").write_bytes(head + struct.pack("<4sI", b"data", 2**32 - 1) + data + after)
    parts = list(read_in_blocks(tmp_path / "run.wav", samples=1000))
    assert_array_equal(np.concatenate([part.channels[1].samples for part in parts]), x[:, 1] / 2**15)
