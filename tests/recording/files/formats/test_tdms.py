"""Verification: TDMS files, written byte by byte as National Instruments describes them."""

import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_in_blocks, read_recording
from sigdb.recording.files.formats.tdms import read_tdms
from sigdb.recording.files.settings import RecordingSettings

TEN_O_CLOCK = 3_765_952_800
"""Seconds from the beginning of 1904 to 2023-05-04 10:00 UTC."""

X = np.arange(40) % 7 - 3.0


class Stamp(tuple):
    """Seconds since 1904 and the fraction of a second in units of 2**-64 s."""


def at(fraction):
    return Stamp((TEN_O_CLOCK, round(fraction * 2**64)))


def text(value, order="<"):
    return struct.pack(f"{order}I", len(value.encode())) + value.encode()


def stamp(value, order):
    seconds, fraction = value
    return struct.pack("<Qq", fraction, seconds) if order == "<" else struct.pack(">qQ", seconds, fraction)


def property_(name, value, order):
    head = text(name, order)
    if isinstance(value, str):
        return head + struct.pack(f"{order}I", 0x20) + text(value, order)
    if isinstance(value, Stamp):
        return head + struct.pack(f"{order}I", 0x44) + stamp(value, order)
    if isinstance(value, int):
        return head + struct.pack(f"{order}II", 7, value)
    return head + struct.pack(f"{order}Id", 10, value)


def plain_index(x, order="<"):
    """Index and bytes of numbers, time stamps or texts."""
    if isinstance(x, list) and isinstance(x[0], str):
        ends = np.cumsum([len(one) for one in x])
        raw = b"".join(struct.pack(f"{order}I", end) for end in ends) + "".join(x).encode()
        return struct.pack(f"{order}IIIQQ", 28, 0x20, 1, len(x), len(raw)), raw
    if isinstance(x, list):
        return struct.pack(f"{order}IIIQ", 20, 0x44, 1, len(x)), b"".join(stamp(one, order) for one in x)
    code = {"i1": 1, "i2": 2, "i4": 3, "i8": 4, "u1": 5, "u2": 6, "u4": 7, "u8": 8, "f4": 9, "f8": 10}[x.dtype.str[1:]]
    return struct.pack(f"{order}IIIQ", 20, code, 1, x.size), x.astype(x.dtype.newbyteorder(order)).tobytes()


def segment(objects, raw, *, new=True, order="<", extra=0):
    """A segment of (path, index, properties); the index None has no numbers, b"" is that of the segment before."""
    meta = struct.pack(f"{order}I", len(objects))
    for path, index, properties in objects:
        index_bytes = {None: b"\xff" * 4, b"": bytes(4)}.get(index, index)
        meta += text(path, order) + index_bytes + struct.pack(f"{order}I", len(properties))
        meta += b"".join(property_(name, value, order) for name, value in properties.items())
    contents = 2 | 4 * new | 8 * bool(raw) | 64 * (order == ">") | extra
    sizes = struct.pack(f"{order}IQQ", 4713, len(meta) + len(raw), len(meta))
    return b"TDSm" + struct.pack("<I", contents) + sizes + meta + raw


def write(path, channels, *, order="<", file_properties=None):
    """One segment of channels: name to (values, properties)."""
    objects, raw = [("/", None, file_properties or {}), ("/'G'", None, {})], b""
    for name, (x, properties) in channels.items():
        index, numbers = plain_index(x, order)
        objects.append((f"/'G'/'{name}'", index, properties))
        raw += numbers
    path.write_bytes(segment(objects, raw, order=order))
    return path


def columns(path, **options):
    return {column.name: column for column in read_tdms(path, RecordingSettings(**options)).columns}


def texts(recording):
    return [note.text for note in recording.notes]


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("starts", "offsets", "expected"),
    [
        ((at(0.0), at(0.05)), (0.0, 0.0), (0.0, 0.05)),
        ((at(0.75), at(0.25)), (0.0, 0.125), (0.5, 0.125)),
        ((None, None), (0.25, 0.5), (0.25, 0.5)),
        ((at(0.5), None), (0.0, 0.0), (0.0, None)),
        ((Stamp((0, 0)), Stamp((0, 0))), (1.0, 2.0), (1.0, 2.0)),
    ],
)
def test_start_times(tmp_path, order, starts, offsets, expected):
    about = [
        {"wf_increment": 0.0005, "wf_start_offset": offset, **({} if start is None else {"wf_start_time": start})}
        for start, offset in zip(starts, offsets, strict=True)
    ]
    path = write(tmp_path / "run.tdms", {"a": (X, about[0]), "b": (X, about[1])}, order=order)
    read = columns(path)
    found = [read[name].start for name in "ab"]
    assert found == pytest.approx(list(expected), abs=1e-12)
    assert [read[name].sampling_rate for name in "ab"] == pytest.approx([2000, 2000])


@pytest.mark.parametrize(
    ("about", "abscissa"),
    [
        ({}, "time"),
        ({"wf_xname": "Time", "wf_xunit_string": "s"}, "time"),
        ({"wf_xname": "Zeit"}, "time"),
        ({"wf_xname": "Messzeit", "wf_xunit_string": "ms"}, "time"),
        ({"wf_xname": "Frequency", "wf_xunit_string": "Hz"}, "Frequency in Hz"),
        ({"wf_xname": "Frequency"}, "Frequency"),
        ({"wf_xunit_string": "Hz"}, "a quantity in Hz"),
        ({"wf_xname": "Order"}, "Order"),
        ({"wf_xname": "Winkel", "wf_xunit_string": "deg"}, "Winkel in deg"),
        ({"wf_xname": "Quefrency", "wf_xunit_string": "s"}, "Quefrency in s"),
    ],
)
def test_abscissas(tmp_path, about, abscissa):
    path = write(tmp_path / "run.tdms", {"a": (X, {"wf_increment": 0.5, **about})})
    assert columns(path)["a"].abscissa == abscissa


def test_an_interval_in_milliseconds(tmp_path):
    about = {"wf_increment": 0.5, "wf_start_offset": 50.0, "wf_xname": "Time", "wf_xunit_string": "ms"}
    column = columns(write(tmp_path / "run.tdms", {"a": (X, about)}))["a"]
    assert (column.sampling_rate, column.start) == pytest.approx((2000, 0.05))


def test_a_spectrum_is_left_out_or_refused(tmp_path):
    wave, spectrum = {"wf_increment": 0.0005}, {"wf_increment": 5.0, "wf_xname": "Frequency", "wf_xunit_string": "Hz"}
    path = write(tmp_path / "run.tdms", {"a": (X, wave), "fft": (X[:20], spectrum)})
    read = read_recording(path)
    assert [(channel.name, channel.sampling_rate) for channel in read.channels] == [("a", 2000)]
    assert "fft runs over Frequency in Hz, not over time, and was left out" in texts(read)
    with pytest.raises(InputError, match="channel fft runs over Frequency in Hz, not over time"):
        read_recording(path, channels=["fft"])
    with pytest.raises(InputError, match="channel a runs over Order, not over time"):
        read_recording(write(tmp_path / "run.tdms", {"a": (X, {"wf_xname": "Order"})}), sampling_rate=10)


@pytest.mark.parametrize(
    ("channel", "file", "rate", "source"),
    [
        ({"wf_increment": 0.0005}, {}, 2000, "wf_increment of a"),
        ({"Sample Rate": 2000.0}, {}, 2000, "property 'Sample Rate' of a"),
        ({}, {"SamplingRate": 2000}, 2000, "property 'SamplingRate' of the file"),
        ({"wf_increment": 1.0}, {"Sample Rate": 2000.0}, 2000, "property 'Sample Rate' of the file"),
        ({"wf_increment": 0.0005, "dt": 0.1}, {}, 2000, "wf_increment of a"),
        ({"wf_increment": 0.0}, {}, None, "the file"),
        ({"wf_increment": 1.0}, {}, 1, "wf_increment of a"),
    ],
)
def test_sampling_rates(tmp_path, channel, file, rate, source):
    read = read_tdms(write(tmp_path / "run.tdms", {"a": (X, channel)}, file_properties=file), RecordingSettings())
    assert read.columns[0].sampling_rate == (rate if rate is None else pytest.approx(rate))
    assert read.columns[0].rate_from == source
    stated = {*channel, *file} - {"SamplingRate"}
    assert [note.code for note in read.notes] == ["ignored-sampling-rate"] * (len(stated) > 1)


@pytest.mark.parametrize("key", ["unit_string", "Unit", "units", "Engineering Units"])
def test_units(tmp_path, key):
    assert columns(write(tmp_path / "run.tdms", {"a": (X, {key: "m/s^2"})}))["a"].unit == "m/s^2"


def test_texts_are_left_out_and_time_stamps_are_seconds(tmp_path):
    stamps = [Stamp((TEN_O_CLOCK + i // 2, (i % 2) * 2**63)) for i in range(40)]
    path = write(tmp_path / "run.tdms", {"who": (["me", "you"] * 20, {}), "when": (stamps, {}), "a": (X, {})})
    read = read_tdms(path, RecordingSettings())
    assert [column.name for column in read.columns] == ["when", "a"]
    assert_array_equal(read.columns[0].values, np.arange(40) / 2)
    assert read.columns[0].unit == "s"
    assert_array_equal(read.columns[1].values, X)
    assert [note.text for note in read.notes] == ["who is text, so not a channel"]


@pytest.mark.parametrize("order", ["<", ">"])
def test_segments_change_their_lists(tmp_path, order):
    """The second adds an object, the third leaves one out, the fourth has numbers only."""
    a, b, c = (plain_index(X + i, order) for i in range(3))
    parts = [
        segment([("/'G'/'a'", a[0], {}), ("/'G'/'b'", b[0], {})], a[1] + b[1], order=order),
        segment([("/'G'/'c'", c[0], {})], a[1] + b[1] + c[1], new=False, order=order),
        segment([("/'G'/'a'", None, {})], b[1] + c[1], new=False, order=order),
        segment([("/'G'/'a'", b"", {})], a[1] + b[1] + c[1], new=False, order=order),
        segment([("/'G'/'b'", b"", {})], b[1] + b[1], order=order),
    ]
    (tmp_path / "run.tdms").write_bytes(b"".join(parts))
    read = columns(tmp_path / "run.tdms")
    assert_array_equal(read["a"].values, np.tile(X, 3))
    assert_array_equal(read["b"].values, np.tile(X + 1, 6))
    assert_array_equal(read["c"].values, np.tile(X + 2, 3))


def parts_of(tmp_path, *properties):
    """A channel in as many segments of 40 samples, each with its own properties."""
    index, raw = plain_index(X)
    parts = [segment([("/'G'/'a'", index, about)], raw) for about in properties]
    (tmp_path / "run.tdms").write_bytes(b"".join(parts))
    return tmp_path / "run.tdms"


def test_parts_that_follow_each_other_begin_with_the_first(tmp_path):
    first = {"wf_increment": 0.0005, "wf_start_time": at(0.5)}
    path = parts_of(tmp_path, first, {"wf_start_time": at(0.52)}, {"wf_start_time": at(0.54)})
    index, raw = plain_index(X)
    other = segment([("/'G'/'b'", index, {"wf_increment": 0.0005, "wf_start_time": at(0.51)})], raw)
    path.write_bytes(path.read_bytes() + other)
    read = columns(path)
    assert read["a"].values.size == 120
    assert [read["a"].start, read["b"].start] == pytest.approx([0, 0.01])


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ({"wf_start_time": at(0.6)}, "the part of channel a from sample 40 on starts 160 samples late"),
        ({"wf_start_time": at(0.51)}, "the part of channel a from sample 40 on starts 20 samples early"),
        ({"wf_start_time": at(0.51), "wf_start_offset": 0.03}, "from sample 40 on starts 40 samples late"),
        ({"wf_increment": 0.001}, "changes its sampling interval from 0.0005 s to 0.001 s at sample 40"),
    ],
)
def test_parts_with_gaps_are_refused(tmp_path, second, message):
    path = parts_of(tmp_path, {"wf_increment": 0.0005, "wf_start_time": at(0.5)}, second)
    with pytest.raises(InputError, match=message):
        read_recording(path)
    assert read_recording(path, sampling_rate=2000).channels[0].samples.size == 80


def test_a_whole_part_after_a_torn_one_is_damage(tmp_path):
    index, raw = plain_index(X)
    torn = segment([("/'G'/'a'", index, {})], raw + raw[:16])
    (tmp_path / "run.tdms").write_bytes(torn)
    assert columns(tmp_path / "run.tdms")["a"].values.size == 40
    (tmp_path / "run.tdms").write_bytes(torn + segment([("/'G'/'a'", index, {})], raw))
    with pytest.raises(InputError, match="goes on after a part that is not whole"):
        read_recording(tmp_path / "run.tdms", sampling_rate=10)


TABLE = {
    "NI_Scale[1]_Scale_Type": "Table", "NI_Scale[1]_Table_Input_Source": 0, "NI_Scale[1]_Table_Scaled_Values_Size": 3,
    "NI_Scale[1]_Table_Pre_Scaled_Values_Size": 3,
    **{f"NI_Scale[1]_Table_Pre_Scaled_Values[{i}]": x for i, x in enumerate([-10.0, 0.0, 10.0])},
    **{f"NI_Scale[1]_Table_Scaled_Values[{i}]": y for i, y in enumerate([-1.0, 0.0, 2.0])},
}  # fmt: skip
LINEAR = {
    "NI_Scale[1]_Scale_Type": "Linear", "NI_Scale[1]_Linear_Slope": 0.5, "NI_Scale[1]_Linear_Y_Intercept": -1.0,
    "NI_Scale[1]_Linear_Input_Source": 0,
}  # fmt: skip
POLYNOMIAL = {
    "NI_Scale[1]_Scale_Type": "Polynomial", "NI_Scale[1]_Polynomial_Input_Source": 0,
    "NI_Scale[1]_Polynomial_Coefficients_Size": 3,
    **{f"NI_Scale[1]_Polynomial_Coefficients[{i}]": c for i, c in enumerate([1.0, 2.0, 0.5])},
}  # fmt: skip
SCALES = {
    "linear": (LINEAR, lambda x: 0.5 * x - 1),
    "polynomial": (POLYNOMIAL, lambda x: 1 + 2 * x + 0.5 * x**2),
    "table": (TABLE, lambda x: np.where(x > 0, 0.2 * x, 0.1 * x)),
}


def daqmx_index(scalers, widths, count, *, digital=False, kind=0xFFFFFFFF):
    """Scalers are (type, buffer, byte or bit, scale)."""
    index = struct.pack("<IIIQI", 0x126A if digital else 0x1269, kind, 1, count, len(scalers))
    for code, buffer, place, scale in scalers:
        index += struct.pack("<IIIBI" if digital else "<IIIII", code, buffer, place, 0, scale)
    return index + struct.pack(f"<I{len(widths)}I", len(widths), *widths)


def scales(properties):
    return {"NI_Number_Of_Scales": 2, "NI_Scaling_Status": "unscaled", "wf_increment": 0.0005, **properties}


@pytest.mark.parametrize("scale", SCALES)
def test_raw_numbers_of_daqmx(tmp_path, scale):
    """Two channels of 16 bits and one of 32 in the rows of one buffer, in two chunks."""
    properties, physical = SCALES[scale]
    rows = np.zeros(80, [("a", "<i2"), ("b", "<i2"), ("c", "<i4")])
    rows["a"], rows["b"], rows["c"] = np.tile(X, 2), np.arange(80) - 9, np.arange(80)[::-1] * 70_000
    index = {
        name: daqmx_index([(code, 0, byte, 0)], [8], 40) for name, code, byte in (("a", 3, 0), ("b", 3, 2), ("c", 5, 4))
    }
    objects = [(f"/'G'/'{name}'", index[name], scales(properties)) for name in "abc"]
    (tmp_path / "run.tdms").write_bytes(segment(objects, rows.tobytes(), extra=128))
    read = columns(tmp_path / "run.tdms")
    for name in "abc":
        expected = physical(
            np.clip(rows[name].astype(float), -10, 10) if scale == "table" else rows[name].astype(float)
        )
        assert_allclose(read[name].values, expected, rtol=1e-15, atol=1e-12)
        assert read[name].sampling_rate == 2000


def test_several_buffers_of_daqmx(tmp_path):
    """Two devices: one of 16 bits, the other of 8 bytes with two channels, with other counts."""
    first, second = np.arange(6, dtype="<i2"), np.arange(8, dtype="<i4").reshape(4, 2) * 3
    chunk = first[:3].tobytes() + second[:2].tobytes() + first[3:].tobytes() + second[2:].tobytes()
    objects = [
        ("/'G'/'a'", daqmx_index([(3, 0, 0, 0)], [2, 8], 3), scales(LINEAR)),
        ("/'G'/'b'", daqmx_index([(5, 1, 0, 0)], [2, 8], 2), scales(LINEAR)),
        ("/'G'/'c'", daqmx_index([(5, 1, 4, 0)], [2, 8], 2), {}),
    ]
    (tmp_path / "run.tdms").write_bytes(segment(objects, chunk, extra=128))
    read = read_tdms(tmp_path / "run.tdms", RecordingSettings())
    values = [column.values for column in read.columns]
    assert_array_equal(values[0], 0.5 * first - 1)
    assert_array_equal(values[1], 0.5 * second[:, 0] - 1)
    assert_array_equal(values[2], second[:, 1])
    assert "c holds raw numbers of the converter, without a scale to a unit" in texts(read)


def test_two_scales_of_raw_numbers_are_added(tmp_path):
    rows = np.zeros(20, [("x", "<i2"), ("y", "<i2")])
    rows["x"], rows["y"] = np.arange(20), 100 * np.arange(20)
    add = {
        "NI_Number_Of_Scales": 3, "NI_Scale[2]_Scale_Type": "Add",
        "NI_Scale[2]_Add_Left_Operand_Input_Source": 0, "NI_Scale[2]_Add_Right_Operand_Input_Source": 1,
    }  # fmt: skip
    index = daqmx_index([(3, 0, 0, 0), (3, 0, 2, 1)], [4], 20)
    (tmp_path / "run.tdms").write_bytes(segment([("/'G'/'a'", index, add)], rows.tobytes(), extra=128))
    assert_array_equal(columns(tmp_path / "run.tdms")["a"].values, 101 * np.arange(20))


def test_digital_lines_of_daqmx(tmp_path):
    """Lines 0, 3 and 9 of a port of 16 lines."""
    port = np.arange(600, dtype="<u2") * 7 % 1024
    lines = (0, 3, 9)
    objects = [
        (f"/'G'/'line{i}'", daqmx_index([(0, 0, i, 0)], [2], 600, digital=True, kind=5), {"wf_increment": 0.0005})
        for i in lines
    ]
    (tmp_path / "run.tdms").write_bytes(segment(objects, port.tobytes(), extra=128))
    read = columns(tmp_path / "run.tdms")
    for i in lines:
        assert_array_equal(read[f"line{i}"].values, port >> i & 1)


def test_a_scale_of_another_kind_leaves_its_channel_out(tmp_path):
    strain = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Thermocouple"}
    path = write(tmp_path / "run.tdms", {"a": (X, {}), "temp": (X, strain)})
    read = read_tdms(path, RecordingSettings())
    assert [column.name for column in read.columns] == ["a"]
    assert "temp was left out: it has a scale of kind 'Thermocouple'" in texts(read)[0]
    with pytest.raises(InputError, match="holds no channel that can be read: temp was left out"):
        read_recording(write(tmp_path / "run.tdms", {"temp": (X, strain)}), sampling_rate=10)


@pytest.mark.parametrize("missing", ["NI_Scale[1]_Linear_Slope", "NI_Scale[1]_Linear_Input_Source"])
def test_scales_that_are_not_complete(tmp_path, missing):
    properties = scales({key: value for key, value in LINEAR.items() if key != missing})
    path = write(tmp_path / "run.tdms", {"a": (X, properties)})
    with pytest.raises(InputError, match="a was left out: it has a scale 1"):
        read_recording(path)


def test_a_scale_that_makes_numbers_infinite(tmp_path):
    properties = scales({**LINEAR, "NI_Scale[1]_Linear_Slope": 1e308})
    with pytest.raises(InputError, match="channel a: sample 0 is infinite"):
        read_recording(write(tmp_path / "run.tdms", {"a": (X, properties)}))


def test_the_scale_of_the_file_applies_to_its_channels(tmp_path):
    path = write(tmp_path / "run.tdms", {"a": (X, {})}, file_properties=scales(LINEAR))
    assert_array_equal(columns(path)["a"].values, 0.5 * X - 1)
    path = write(
        tmp_path / "run.tdms", {"a": (X, {})}, file_properties={**scales(LINEAR), "NI_Scaling_Status": "scaled"}
    )
    assert_array_equal(columns(path)["a"].values, X)


@pytest.mark.parametrize(
    ("index", "message"),
    [
        (daqmx_index([(3, 0, 7, 0)], [8], 5), "the raw DAQmx numbers of /'G'/'a' lie outside their rows"),
        (daqmx_index([(3, 1, 0, 0)], [8], 5), "lie outside their rows"),
        (daqmx_index([(99, 0, 0, 0)], [8], 5), "raw DAQmx numbers of type 0x63"),
        (struct.pack("<IIIQI", 0x1269, 0xFFFFFFFF, 1, 5, 2**31), "is cut short or damaged"),
    ],
)
def test_damaged_descriptions_of_daqmx(tmp_path, index, message):
    (tmp_path / "run.tdms").write_bytes(segment([("/'G'/'a'", index, {})], bytes(400), extra=128))
    with pytest.raises(InputError, match=message):
        read_recording(tmp_path / "run.tdms", sampling_rate=10)


def test_counts_that_no_file_holds(tmp_path):
    index = struct.pack("<IIIQ", 20, 10, 1, 2**62)
    (tmp_path / "run.tdms").write_bytes(segment([("/'G'/'a'", index, {})], bytes(80)))
    with pytest.raises(InputError, match="holds no numbers"):
        read_recording(tmp_path / "run.tdms", sampling_rate=10)


def test_one_byte_that_many_channels_share_is_not_multiplied_without_bound(tmp_path, monkeypatch):
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_VALUES", 10_000)
    index = daqmx_index([(0, 0, 0, 0)], [1], 100)
    objects = [(f"/'G'/'{i}'", index, {}) for i in range(100)]
    (tmp_path / "run.tdms").write_bytes(segment(objects, bytes(1000), extra=128))
    with pytest.raises(InputError, match="holds 100000 numbers, more than 10000"):
        read_recording(tmp_path / "run.tdms", sampling_rate=10)


def test_chunks_that_repeat_and_lines_of_digital_inputs_in_blocks(tmp_path):
    """Chunks of 7 numbers a channel that repeat in a segment; rows of DAQmx with a digital line."""
    a, b = np.sin(np.arange(2100.0)), np.arange(2100) ** 2 % 31
    pairs = zip(a.reshape(-1, 7), b.astype("<i2").reshape(-1, 7), strict=True)
    parts = [part.tobytes() for pair in pairs for part in pair]
    about = {"wf_increment": 0.001}
    indices = [plain_index(a[:7])[0], plain_index(b[:7].astype("<i2"))[0]]
    objects = [("/'G'/'a'", indices[0], about), ("/'G'/'b'", indices[1], about)]
    path = tmp_path / "run.tdms"
    path.write_bytes(segment(objects, b"".join(parts)))
    blocks = list(read_in_blocks(path, samples=300))
    assert_array_equal(np.concatenate([part.channel("a").samples for part in blocks]), a)
    assert_array_equal(np.concatenate([part.channel("b").samples for part in blocks]), b)
    rows = np.zeros(2100, [("x", "<i2"), ("lines", "u1")])
    rows["x"], rows["lines"] = np.round(1000 * a), b
    scaler = daqmx_index([(3, 0, 0, 0)], [3], 100)
    line = daqmx_index([(0, 0, 8 * 2 + 1, 0)], [3], 100, digital=True)
    path.write_bytes(segment([("/'G'/'a'", scaler, about), ("/'G'/'d'", line, about)], rows.tobytes()))
    blocks = list(read_in_blocks(path, samples=300))
    assert_array_equal(np.concatenate([part.channel("a").samples for part in blocks]), rows["x"])
    assert_array_equal(np.concatenate([part.channel("d").samples for part in blocks]), b >> 1 & 1)


@pytest.mark.parametrize(
    ("start", "seconds"),
    [
        ("2024-03-01T10:00:00.25", 1_709_287_200.25),
        ("2024-03-01 11:00:00.25+01:00", 1_709_287_200.25),
        (" 2024-03-01 10:00 ", 1_709_287_200.0),
        ("yesterday", None),
    ],
)
def test_a_start_as_text_is_read_or_noted(tmp_path, start, seconds):
    x = np.sin(np.arange(64.0))
    path = write(tmp_path / "run.tdms", {"a": (x, {"wf_increment": 0.001, "wf_start_time": start})})
    recording = read_recording(path)
    assert recording.zero_time == (None if seconds is None else pytest.approx(seconds, abs=1e-6))
    notes = [note.text for note in recording.notes if note.code == "start-not-read"]
    text = "a has the start 'yesterday' as text, which is no date of ISO 8601 and was not read"
    assert notes == ([] if seconds else [text])


@pytest.mark.parametrize("interval", [1.0, 10.0])
def test_a_channel_at_1_hz_or_less_is_left_out_with_a_note(tmp_path, interval):
    x = np.sin(np.arange(2000.0))
    channels = {"a": (x, {"wf_increment": 0.001}), "oil": (x[:20], {"wf_increment": interval})}
    path = write(tmp_path / "run.tdms", channels)
    for recording in (read_recording(path), read_in_blocks(path, samples=300).whole):
        assert [channel.name for channel in recording.channels] == ["a"]
        text = f"oil was left out: it has {1 / interval:g} Hz, at which no vibration is sampled"
        assert text in [note.text for note in recording.notes]
    with pytest.raises(InputError, match=r"channel oil: wf_increment of oil states a sampling rate of"):
        read_recording(path, channels=["a", "oil"])
