"""Verification: MF4 files, written block by block as ASAM describes them, and one by another library."""

import base64
import struct
import zlib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_in_blocks, read_recording
from sigdb.recording.files.formats.mdf4 import read_mdf4
from sigdb.recording.files.settings import RecordingSettings

# Written by asammdf 8.8, transposed and compressed: a1 = int16 (i - 7) with the linear scale 0.25 i + 1; tacho = i % 2,
# invalid at 3; 40 samples at 2 kHz; torque = i / 2, 20 samples at 400 Hz from 0.05 s on.
BY_ASAMMDF = (
    "eNrzdXFTAAETPUMDEJ2Ym5JmoWehxwAEsxgZCAJlZQ8XEJ0B5bNB6QIWCG3Bgl//CjhD8tPdNW8kQEwmrPb4gu0JQBO38XBJzs/NTc0rseOyCYnQ"
    "B5Igfn5efEFRfkFqUUlmajFIUB+hDmqeSxSIno7mR5cQRgYeIP0AKp4OpSsYk398fn59/qv4qfVrVpf/3bTmzsf0vq9vs17GBu5Pi7y3ZsodwY/H"
    "089Jv353+xaPdvi1tSIrq3d+2teRfnfa9CLt/jv/NRe9nxlkXnx653SdomnaZ/tZ7p3/efPch4/J146XRmbJ/73+MWVuQPbfFQ/it7/T6y+9dkb4"
    "/tVDUdtr3oTcePh/j1/Pw0tLbaff+S4R96o0/VZw2o9fl9ru6ZSLLvtdnTaNVfrTXrvCk4XNMe/fr5nNs2+f6j5+b4ua5fZX9G4eF3wRbVJ73tks"
    "9/+kmb/lil+wTfupJrLVL37ncxnnoEtPlqw6mT3p06pb6ufjNytrKq9fsmrj3vJPZ356X8+5tVH/Zeax13v6Ve9LyjApCQUZFXF1eZ3SWpX1Skpq"
    "9qzoqNu3rK1276qu+v1L3WeGReGlJScnS77pZLav//vv8/f79WxuamliYWZlfH56eXJxdnWMjoqJgoGGhZyempmSkZaVrf8FDjgIGAhxOmp1MjAs"
    "6FotAI+XVwyY8SIApB2g8bGLARYvRw/q8jc5SDA8MJe4c/bBnbOWz8+tb/q5hkc67MyT0xGGkzfOE+32y1dSSj8qXxi6RkLneU9Z+vfKsO8X/zC9"
    "fplsGdb9bqqiYXXhfVPOitbJlznYZ2lGS8m0azBcnj6rapFJRIjA9O6YqQ0GhisyrfU+/1F4sq1PJkCpQFMr5YRPzLM9BjacE2PbQn6qpHtYVG2+"
    "+/boQ4Hjx1Usl760PL1kS11D/U7b+wErr73ivZOz1XrJdXmeg5vWnJzOL+kV3Iqarnegp2s3D3i6BuVLYNq2Sy5KTSxJTbHRB7IhgiX5+TnxmSl2"
    "icWJucCMa6MPE0CSLkvNS8kvQlMCFURRVlScmZ9nB8r8RhZwZRBBYP5BuAfqbjcPcP6Guhc9zzYwQxnl6p+R8zUwft1BbAeoNKx42ABlaHBA6B84"
    "yxvs+mFAgQtCT2DCpT8kAqwOTbwkMzcVn3wxXL+zH4heAOVzwNIhG6r6DwTKPQFWVD4TI0SDA5IYMwP5AJc/Eg3xy6cj/OkMohNwhDMuwMiIqwQH"
    "h4o9hL5gjyscE9hRddxACycJtHD+wYpuBxPYLAEah2NJYnJGPh75MALpBR0osON3hwMWeS6oeUw09GdAZUlGfh7YH+7Y6nkYMGDFbz4H1OOw6lYD"
    "TZ4bKoczf3EOjfxVkl9UWJqKW95PIZekdGHBid8dERjyLGCzqOdP/PE+gYO0eBdBjycoDQDyPafn"
)

T = np.arange(60) / 2000
X = np.round(np.sin(T * 300), 6)


class File:
    """Blocks one after the other; a block is written after those to which it links."""

    def __init__(self):
        self.data = bytearray(64 + 104)

    def block(self, kind, links=(), body=b""):
        start = len(self.data)
        length = 24 + 8 * len(links) + len(body)
        self.data += f"##{kind}".encode() + struct.pack(f"<4xQQ{len(links)}q", length, len(links), *links) + body
        self.data += bytes(-len(self.data) % 8)
        return start

    def text(self, text):
        return self.block("TX", body=text.encode() + b"\0") if text else 0

    def unit(self, text):
        return self.block("MD", body=f"<CNunit><TX>{text}</TX></CNunit>".encode() + b"\0") if text else 0

    def conversion(self, kind, numbers, unit=""):
        body = struct.pack("<BBHHHdd", kind, 0, 0, 0, len(numbers), 0, 0) + struct.pack(f"<{len(numbers)}d", *numbers)
        return self.block("CC", (0, self.text(unit), 0, 0), body)

    def channel(self, after, name, *, kind=0, synchronised=0, data_type=4, bit=0, byte=0, bits=64, flags=0, invalid=0,
                conversion=0, unit="", composition=0):  # fmt: skip
        body = struct.pack("<4B4I", kind, synchronised, data_type, bit, byte, bits, flags, invalid) + bytes(52)
        links = (after, composition, self.text(name), 0, conversion, 0, self.unit(unit), 0)
        return self.block("CN", links, body)

    def group(self, after, channels, cycles, size, *, name="", id_=0, flags=0, invalid=0, master=()):
        body = struct.pack("<QQHHIII", id_, cycles, flags, 46, 0, size, invalid)
        return self.block("CG", (after, channels, self.text(name), 0, 0, 0, *master), body)

    def data_group(self, after, groups, data, *, id_size=0):
        return self.block("DG", (after, groups, data, 0), struct.pack("<B7x", id_size))

    def compressed(self, raw, *, transposed=0, size=None):
        shown = raw
        if transposed:
            rows = len(raw) // transposed
            whole = np.frombuffer(raw, np.uint8, rows * transposed).reshape(rows, transposed).T
            shown = whole.tobytes() + raw[rows * transposed :]
        packed = zlib.compress(shown)
        sizes = struct.pack("<BBIQQ", bool(transposed), 0, transposed, size or len(raw), len(packed))
        return self.block("DZ", (), b"DT" + sizes + packed)

    def write(self, path, data_groups, *, version=b"4.10    ", mark=b"MDF     "):
        self.data[:64] = (mark + version + b"test    ").ljust(28, b"\0").ljust(64, b"\0")
        head = b"##HD" + struct.pack("<4xQQ6q", 104, 6, data_groups, 0, 0, 0, 0, 0)
        self.data[64:168] = head.ljust(104, b"\0")
        path.write_bytes(bytes(self.data))
        return path


def plain(path, *, data="DT", kind=0, numbers=X, times=T, write=None, **about):
    """One group: times and a channel ``a`` of float64."""
    file = File()
    raw = np.stack([times, numbers], 1).astype("<f8").tobytes()
    if data == "DT":
        start = file.block("DT", (), raw)
    elif data == "DZ":
        start = file.compressed(raw)
    else:
        parts = [raw[:160], raw[160:500], raw[500:]]
        blocks = [file.compressed(part, transposed=16) if "T" in data else file.block("DT", (), part) for part in parts]
        last = file.block("DL", (0, *blocks[2:]), struct.pack("<IIQ", 0, 1, 0))
        start = file.block("DL", (last, *blocks[:2]), struct.pack("<IIQQ", 0, 2, 0, 160))
        start = file.block("HL", (start,), bytes(8)) if "HL" in data else start
    channel = file.channel(0, "a", byte=8, unit="g", **about)
    master = file.channel(channel, "t", kind=2, synchronised=1, unit="s")
    group = file.group(0, master, times.size, 16, name="vibration")
    return file.write(path, file.data_group(0, group, start), **(write or {}))


def read(path, **options):
    return read_mdf4(path, RecordingSettings(**options))


def texts(contents):
    return [note.text for note in contents.notes]


def test_a_file_of_another_library(tmp_path):
    (tmp_path / "run.mf4").write_bytes(zlib.decompress(base64.b64decode(BY_ASAMMDF)))
    columns = {column.name: column for column in read(tmp_path / "run.mf4").columns}
    i = np.arange(40)
    assert [(one.unit, round(one.sampling_rate, 6), one.start) for one in columns.values()] == [
        ("g", 2000, 0), ("V", 2000, 0), ("N m", 400, 0.05),
    ]  # fmt: skip
    assert_array_equal(columns["a1"].values, 0.25 * (i - 7) + 1)
    assert_array_equal(columns["tacho"].values, np.where(i == 3, np.nan, i % 2))
    assert_array_equal(columns["torque"].values, i[:20] / 2)


@pytest.mark.parametrize("data", ["DT", "DZ", "DL", "DL T", "DL HL", "DL T HL"])
def test_data_in_blocks(tmp_path, data):
    recording = read_recording(plain(tmp_path / "run.mf4", data=data))
    (channel,) = recording.channels
    assert (channel.name, channel.unit, channel.sampling_rate) == ("a", "g", pytest.approx(2000))
    assert_array_equal(channel.samples, X)


@pytest.mark.parametrize(
    ("data_type", "bit", "bits", "numbers", "stored"),
    [
        (0, 0, 16, [0, 1, 65_535], "<u2"),
        (1, 0, 16, [0, 1, 65_535], ">u2"),
        (2, 0, 32, [-(2**31), -1, 5], "<i4"),
        (3, 0, 32, [-(2**31), -1, 5], ">i4"),
        (4, 0, 32, [-1.5, 0.25, 1e30], "<f4"),
        (5, 0, 32, [-1.5, 0.25, 8.0], ">f4"),
        (5, 0, 64, [-1.5, 0.25, 1e300], ">f8"),
        (4, 0, 16, [-1.5, 0.25, 8.0], "<f2"),
        (0, 3, 5, [0b10110, 0, 31], None),
        (2, 3, 5, [-16, -1, 15], None),
        (0, 7, 12, [4095, 1, 2048], None),
        (2, 1, 24, [-(2**23), -1, 2**23 - 1], None),
        (2, 0, 8, [-128, -1, 127], "<i1"),
    ],
)
def test_numbers_of_any_bits(tmp_path, data_type, bit, bits, numbers, stored):
    size = (bit + bits + 7) // 8
    if stored:
        rows = np.array(numbers, stored).view(np.uint8).reshape(3, size)
    else:
        garbage = 0b1010101 & ((1 << bit) - 1)
        whole = [((one & ((1 << bits) - 1)) << bit | garbage).to_bytes(size, "little") for one in numbers]
        rows = np.frombuffer(b"".join(whole), np.uint8).reshape(3, size)
    table = np.concatenate([np.full((3, 2), 255, np.uint8), rows, np.full((3, 1), 255, np.uint8)], 1)
    file = File()
    data = file.block("DT", (), table.tobytes())
    channel = file.channel(0, "a", data_type=data_type, bit=bit, byte=2, bits=bits)
    group = file.group(0, channel, 3, size + 3)
    (column,) = read(file.write(tmp_path / "run.mf4", file.data_group(0, group, data))).columns
    assert_allclose(column.values.astype(float), numbers, rtol=1e-7)
    assert column.sampling_rate is None


@pytest.mark.parametrize(
    ("kind", "numbers", "physical"),
    [
        (0, [], X),
        (1, [0.5, 2.0], 0.5 + 2 * X),
        (2, [0.0, 2.0, 0.5, 0.0, 0.0, 4.0], (2 * X + 0.5) / 4),
        (2, [1.0, 0.0, 0.0, 0.0, 1.0, 3.0], X**2 / (X + 3)),
        (4, [-1.0, -10.0, 0.0, 0.0, 1.0, 20.0], np.where(X < 0, 10 * X, 20 * X)),
    ],
)
def test_conversions(tmp_path, kind, numbers, physical):
    file = File()
    data = file.block("DT", (), X.astype("<f8").tobytes())
    channel = file.channel(0, "a", conversion=file.conversion(kind, numbers, unit="m/s^2"))
    path = file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, channel, X.size, 8), data))
    (column,) = read(path).columns
    assert_allclose(column.values, physical, rtol=1e-14, atol=1e-15)
    assert column.unit == "m/s^2"


@pytest.mark.parametrize(
    ("about", "message"),
    [
        ({"conversion": (3, [])}, "a has a conversion by a formula, which is not read"),
        ({"conversion": (7, [1.0])}, "a has a conversion by texts, which is not read"),
        ({"conversion": (5, [0.0, 1.0])}, "a has a conversion by a table without interpolation"),
        ({"data_type": 7}, "a holds text or bytes, not numbers"),
        ({"kind": 1}, "a has no numbers of a fixed length"),
        ({"composition": 64}, "a is an array or a structure"),
        ({"flags": 1}, "a states that all its numbers are invalid"),
        ({"bits": 72}, "a has its bits outside the record"),
        ({"bits": 40, "data_type": 4}, "a holds floating-point numbers of 40 bits"),
    ],
)
def test_channels_that_are_left_out(tmp_path, about, message):
    file = File()
    data = file.block("DT", (), np.stack([X, X], 1).astype("<f8").tobytes())
    if "conversion" in about:
        about = {"conversion": file.conversion(*about["conversion"])}
    channel = file.channel(file.channel(0, "a", **about), "b", byte=8)
    path = file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, channel, X.size, 16), data))
    contents = read(path)
    assert [one.name for one in contents.columns] == ["b"]
    assert message in texts(contents)[0]


def test_invalid_numbers_are_missing(tmp_path):
    table = np.zeros(X.size, [("a", "<f8"), ("b", "<f8"), ("bits", "u1")])
    table["a"], table["b"] = X, X
    table["bits"][5], table["bits"][9] = 0b100, 0b1
    file = File()
    data = file.block("DT", (), table.tobytes())
    channel = file.channel(file.channel(0, "b", byte=8, flags=2, invalid=0), "a", flags=2, invalid=2)
    path = file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, channel, X.size, 16, invalid=1), data))
    columns = {one.name: one.values for one in read(path).columns}
    assert np.flatnonzero(np.isnan(columns["a"])).tolist() == [5]
    assert np.flatnonzero(np.isnan(columns["b"])).tolist() == [9]


def groups_of_two_rates(path, *, sort=True):
    """Vibration at 2 kHz from 0.01 s on; torque at 100 Hz from 0.05 s on; sorted, or with records as they came."""
    file = File()
    slow, torque = 0.05 + np.arange(20) / 100, np.arange(20) + 0.5
    records = {1: np.stack([T + 0.01, X], 1).astype("<f8"), 2: np.stack([slow, torque], 1).astype("<f8")}
    pair = {}
    for number in (1, 2):
        master = file.channel(file.channel(0, "a", byte=8), "t", kind=2, synchronised=1)
        about = {"name": f"rate {number}", "id_": number}
        pair[number] = master, len(records[number]), about
    if sort:
        after = 0
        for number in (2, 1):
            master, cycles, about = pair[number]
            data = file.block("DT", (), records[number].tobytes())
            after = file.data_group(after, file.group(0, master, cycles, 16, **about), data)
        return file.write(path, after)
    order = sorted([(row[0], number, row) for number in (1, 2) for row in records[number]], key=lambda one: one[0])
    raw = b"".join(struct.pack("<B", number) + row.tobytes() for _, number, row in order)
    raw = b"\x03" + struct.pack("<I", 5) + b"hello" + raw
    words = file.group(0, 0, 1, 0, id_=3, flags=1)
    second = file.group(words, pair[2][0], pair[2][1], 16, **pair[2][2])
    first = file.group(second, pair[1][0], pair[1][1], 16, **pair[1][2])
    return file.write(path, file.data_group(0, first, file.block("DT", (), raw), id_size=1))


@pytest.mark.parametrize("sort", [True, False])
def test_groups_have_their_own_rates_and_starts(tmp_path, sort):
    path = groups_of_two_rates(tmp_path / "run.mf4", sort=sort)
    columns = {one.name: one for one in read(path).columns}
    assert set(columns) == {"rate 1/a", "rate 2/a"}
    assert [one.sampling_rate for one in columns.values()] == pytest.approx([2000, 100])
    assert [one.start for one in columns.values()] == pytest.approx([0.01, 0.05])
    assert columns["rate 1/a"].rate_from == "the times of rate 1"
    assert_array_equal(columns["rate 1/a"].values, X)
    assert_array_equal(columns["rate 2/a"].values, np.arange(20) + 0.5)
    assert [one.name for one in read(path, variable="rate 2").columns] == ["a"]


def test_a_group_with_uneven_times_is_left_out(tmp_path):
    file = File()
    master = file.channel(file.channel(0, "event", byte=8), "t", kind=2, synchronised=1)
    uneven = np.stack([np.array([0.0, 0.1, 0.5, 0.6]), np.arange(4.0)], 1)
    group = file.group(0, master, 4, 16, name="events")
    events = file.data_group(0, group, file.block("DT", (), uneven.astype("<f8").tobytes()))
    master = file.channel(file.channel(0, "a", byte=8), "t", kind=2, synchronised=1)
    data = file.block("DT", (), np.stack([T, X], 1).astype("<f8").tobytes())
    path = file.write(tmp_path / "run.mf4", file.data_group(events, file.group(0, master, X.size, 16), data))
    contents = read(path)
    assert [one.name for one in contents.columns] == ["a"]
    assert "events was left out: column t of events" in texts(contents)[0]
    with pytest.raises(InputError, match="column t of events"):
        read(path, channels=["event"])


@pytest.mark.parametrize(
    ("synchronised", "abscissa", "rate"),
    [(1, "time", 2000), (2, "angle (t)", None), (3, "distance (t)", None), (4, "time", None)],
)
def test_masters_other_than_time(tmp_path, synchronised, abscissa, rate):
    file = File()
    data = file.block("DT", (), np.stack([T, X], 1).astype("<f8").tobytes())
    master = file.channel(file.channel(0, "a", byte=8), "t", kind=2, synchronised=synchronised)
    path = file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, master, X.size, 16), data))
    (column,) = read(path).columns
    assert (column.abscissa, column.sampling_rate) == (abscissa, rate and pytest.approx(rate))


def test_a_virtual_master_counts_the_records(tmp_path):
    file = File()
    data = file.block("DT", (), X.astype("<f8").tobytes())
    clock = file.conversion(1, [0.25, 1 / 2000])
    master = file.channel(file.channel(0, "a"), "t", kind=3, synchronised=1, data_type=0, bits=0, conversion=clock)
    path = file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, master, X.size, 8), data))
    (column,) = read(path).columns
    assert (column.sampling_rate, column.start) == (pytest.approx(2000), 0.25)


def test_columns_share_the_master_of_another_group(tmp_path):
    file = File()
    times = file.group(0, file.channel(0, "t", kind=2, synchronised=1), T.size, 8)
    after = 0
    for name, values in (("b", -X), ("a", X)):
        listed = file.block(
            "LD", (0, file.block("DV", (), values.astype("<f8").tobytes())), struct.pack("<IIQ", 1, 1, 480)
        )
        group = file.group(0, file.channel(0, name), X.size, 8, flags=8, master=(times,))
        after = file.data_group(after, group, listed)
    clock = file.data_group(after, times, file.block("DV", (), T.astype("<f8").tobytes()))
    path = file.write(tmp_path / "run.mf4", clock, version=b"4.20    ")
    columns = {one.name: one for one in read(path).columns}
    assert_array_equal(columns["a"].values, X)
    assert_array_equal(columns["b"].values, -X)
    assert [one.sampling_rate for one in columns.values()] == pytest.approx([2000, 2000])


def test_bus_messages_are_left_out(tmp_path):
    file = File()
    raw = file.block("DT", (), X.astype("<f8").tobytes())
    bus = file.data_group(0, file.group(0, file.channel(0, "CAN"), X.size, 8, name="bus", flags=2), raw)
    group = file.group(0, file.channel(0, "a"), X.size, 8)
    contents = read(file.write(tmp_path / "run.mf4", file.data_group(bus, group, file.block("DT", (), X.tobytes()))))
    assert [one.name for one in contents.columns] == ["a"]
    assert texts(contents) == ["bus is a group of bus messages, so no channels"]


def test_fewer_records_than_stated(tmp_path):
    file = File()
    data = file.block("DT", (), X[:50].astype("<f8").tobytes() + b"abc")
    path = file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, file.channel(0, "a"), 60, 8), data))
    contents = read(path)
    assert contents.columns[0].values.size == 50
    assert texts(contents) == ["group 1 states 60 records and holds 50: the file is cut short"]


@pytest.mark.parametrize(
    ("write", "message"),
    [
        ({"version": b"3.30    "}, "is MDF of version 3.30, and version 4 is read; convert it"),
        ({"mark": b"UnFinMF "}, "was not closed by its recorder"),
    ],
)
def test_other_versions(tmp_path, write, message):
    with pytest.raises(InputError, match=message):
        read_recording(plain(tmp_path / "run.mdf", write=write))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda file, master: (file.group(0, master, 60, 16), 10**9), "refers to byte 1000000000"),
        (lambda file, master: (file.group(0, master, 60, 16), master), "no block DT or DV"),
        (
            lambda file, master: (file.group(0, master, 60, 16), file.compressed(bytes(960), size=961)),
            "states 961 bytes",
        ),
        (lambda file, master: (file.group(0, master, 60, 16), file.compressed(bytes(960), size=2**40)), "more than"),
        (lambda file, master: (file.group(0, master, 60, 16), file.compressed(bytes(2**26))), "do not do"),
        (lambda file, master: (file.group(0, master, 60, 16), file.block("DL", (168,) * 5, bytes(16))), "no block"),
        (lambda file, master: (file.group(0, master, 2**60, 0), file.block("DT", (), bytes(960))), "holds no channels"),
        (
            lambda file, master: (file.group(0, master, 2**60, 2**31), file.block("DT", (), bytes(9))),
            "holds no channels",
        ),
    ],
)
def test_damaged_files(tmp_path, change, message):
    file = File()
    master = file.channel(file.channel(0, "a", byte=8), "t", kind=2, synchronised=1)
    group, data = change(file, master)
    with pytest.raises(InputError, match=message):
        read_recording(file.write(tmp_path / "run.mf4", file.data_group(0, group, data)), sampling_rate=10)


def test_rings_of_blocks(tmp_path):
    file = File()
    ring = file.block("DL", (len(file.data),), bytes(16))
    group = file.group(0, file.channel(0, "a"), 60, 8)
    with pytest.raises(InputError, match="leads back to itself"):
        read_recording(file.write(tmp_path / "run.mf4", file.data_group(0, group, ring)), sampling_rate=10)
    file = File()
    channel = file.channel(len(file.data) + 64, "a")
    with pytest.raises(InputError, match="is damaged"):
        read_recording(file.write(tmp_path / "run.mf4", file.data_group(0, file.group(0, channel, 60, 8), 168)))


def test_groups_that_share_their_data_do_not_multiply_it(tmp_path):
    file = File()
    data = file.compressed(bytes(2**24))
    after = 0
    for _ in range(3):
        after = file.data_group(after, file.group(0, file.channel(0, "a"), 2**21, 8), data)
    with pytest.raises(InputError, match="which measured numbers do not do"):
        read_recording(file.write(tmp_path / "run.mf4", after), sampling_rate=10)


LONG_T = 3 + np.arange(2003) / 2000
LONG_X = np.sin(np.arange(2003) / 3)


@pytest.mark.parametrize("data", ["DT", "DZ", "DL", "DL T HL"])
@pytest.mark.parametrize("samples", [256, 700])
def test_blocks_hold_what_the_whole_file_holds(tmp_path, data, samples):
    numbers = np.where(np.arange(2003) == 900, np.nan, LONG_X)
    path = plain(tmp_path / "run.mf4", data=data, times=LONG_T, numbers=numbers)
    (whole,) = read_recording(path).channels
    blocks = read_in_blocks(path, samples=samples)
    (channel,) = blocks.channels
    assert (channel.name, channel.unit, channel.start) == ("a", "g", pytest.approx(whole.start))
    assert channel.sampling_rate == pytest.approx(whole.sampling_rate, rel=1e-9)
    assert_array_equal(np.concatenate([part.channels[0].samples for part in blocks]), whole.samples)


def test_the_rate_in_blocks_is_the_slope_of_all_times(tmp_path):
    """Times in whole tens of microseconds at 2048 Hz."""
    path = plain(tmp_path / "run.mf4", times=np.round(np.arange(2003) / 2048, 5), numbers=LONG_X)
    rate = read_in_blocks(path, samples=400).channels[0].sampling_rate
    assert rate == pytest.approx(2048, rel=3e-6)


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (LONG_T + 0.1 * (np.arange(2003) >= 1000), r"leap by 0\.1 s .* at sample 1000"),
        (
            np.where(np.arange(2003) < 1000, LONG_T, 3.5 + np.arange(-1000, 1003) / 1900),
            "rate changes from 2000 to 1900",
        ),
    ],
)
def test_times_of_blocks_that_do_not_go_on_are_refused(tmp_path, times, message):
    with pytest.raises(InputError, match=message):
        read_in_blocks(plain(tmp_path / "run.mf4", times=times, numbers=LONG_X), samples=500)


def _groups(path, *, id_size=0):
    """A group at 2 kHz, and one at 0.5 Hz with a channel of the same name; or both in one list of data."""
    file = File()
    fast = np.stack([LONG_T, LONG_X], 1).astype("<f8")
    slow = np.stack([np.arange(20) / 0.5, np.cos(np.arange(20))], 1).astype("<f8")

    def group(after, table, name, id_=0):
        master = file.channel(file.channel(0, "a", byte=8), "t", kind=2, synchronised=1, unit="s")
        return file.group(after, master, len(table), 16, name=name, id_=id_)

    if id_size:
        rows = [b"\1" + row.tobytes() for row in fast] + [b"\2" + row.tobytes() for row in slow]
        groups = group(group(0, slow, "oil", 2), fast, "run", 1)
        return file.write(path, file.data_group(0, groups, file.block("DT", (), b"".join(rows)), id_size=1))
    after = 0
    for table, name in ((slow, "oil"), (fast, "run")):
        after = file.data_group(after, group(0, table, name), file.block("DT", (), table.tobytes()))
    return file.write(path, after)


def test_a_group_that_is_left_out_is_left_out_of_all_blocks(tmp_path):
    path = _groups(tmp_path / "run.mf4")
    blocks = read_in_blocks(path, samples=300)
    assert [channel.name for channel in blocks.channels] == [read_recording(path).channels[0].name] == ["a"]
    assert_array_equal(np.concatenate([part.channels[0].samples for part in blocks]), LONG_X)
    assert "group-left-out" in [note.code for note in blocks.whole.notes]


def test_records_that_are_not_sorted_are_not_read_in_blocks(tmp_path):
    path = _groups(tmp_path / "run.mf4", id_size=1)
    assert_array_equal(read_recording(path).channels[0].samples, LONG_X)
    with pytest.raises(InputError, match="several groups in turn, which are not read in blocks; sort it"):
        read_in_blocks(path, samples=300)


def test_times_that_count_records_go_on_in_blocks(tmp_path):
    file = File()
    conversion = file.conversion(1, [3.0, 1 / 2000])
    channel = file.channel(0, "a", unit="g")
    master = file.channel(channel, "t", kind=3, synchronised=1, bits=0, conversion=conversion, unit="s")
    group = file.group(0, master, len(LONG_X), 8, name="run")
    path = file.write(tmp_path / "run.mf4", file.data_group(0, group, file.block("DT", (), LONG_X.tobytes())))
    blocks = read_in_blocks(path, samples=300)
    assert blocks.channels[0].sampling_rate == pytest.approx(2000, rel=1e-9)
    assert_array_equal(np.concatenate([part.channels[0].samples for part in blocks]), LONG_X)
