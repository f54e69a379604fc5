"""Unit: LabVIEW measurement files, as LabVIEW's manual describes them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_in_blocks, read_recording

N, DT = 200, 0.0005
X = np.round(np.random.default_rng(8).normal(size=(2 * N, 2)), 6)


def lvm(segments, *, columns="One", separator="\t", decimal=".", headings="Yes", extra=()):
    """Text of a file; each segment has samples, X0 of each channel and clock times of each channel."""
    words = {"\t": "Tab", ",": "Comma", ";": "Semicolon"}
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", f"Separator\t{words[separator]}",
            f"Decimal_Separator\t{decimal}", f"Multi_Headings\t{headings}", f"X_Columns\t{columns}",
            "Time_Pref\tRelative", "Operator\tWeber", "Date\t2024/03/01", "Time\t10:00:00,1230000000000000", *extra,
            "***End_of_Header***"]  # fmt: skip
    lines = [line.replace("\t", separator) for line in head]
    for x, starts, times in segments:
        samples = [int(np.count_nonzero(~np.isnan(column))) for column in x.T]
        header = [
            ["Channels", x.shape[1]], ["Samples", *samples], ["Date", *["2024/03/01"] * x.shape[1]], ["Time", *times],
            ["Y_Unit_Label", "m/s^2", "V"], ["X_Dimension", "Time", "Time"], ["X0", *starts],
            ["Delta_X", *[f"{DT:.6f}"] * x.shape[1]],
        ]  # fmt: skip
        lines += ["", *(separator.join([*map(str, row), ""]).replace(".", decimal) for row in header)]
        lines.append("***End_of_Header***")
        heads = ["X_Value", "Front bearing", "Tacho", "Comment"]
        if columns == "Multi":
            heads = ["X_Value", "Front bearing", "X_Value", "Tacho", "Comment"]
        lines.append(separator.join(heads))
        for i, row in enumerate(x):
            fields = ["" if np.isnan(value) else f"{value:.6f}" for value in row]
            t = [f"{float(start) + DT * i:.6f}" for start in starts]
            if columns == "Multi":
                fields = [t[0], fields[0], t[1], fields[1]]
            else:
                fields = [t[0] if columns == "One" else "", *fields]
            lines.append(separator.join(fields).replace(".", decimal) + (f"{separator}bump" if i == 3 else ""))
    return "\n".join(lines) + "\n"


def segment(x=X[:N], starts=("0.0", "0.0"), times=("10:00:00.123", "10:00:00.123")):
    return x, starts, times


def read(path, text, **options):
    path.write_bytes(text.replace("\n", "\r\n").encode("cp1252"))
    return read_recording(path, **options)


@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
@pytest.mark.parametrize(("separator", "decimal"), [("\t", "."), ("\t", ","), (",", "."), (";", ",")])
@pytest.mark.parametrize("suffix", [".lvm", ".txt"])
def test_channels_of_a_segment(tmp_path, columns, separator, decimal, suffix):
    text = lvm([segment()], columns=columns, separator=separator, decimal=decimal)
    found = read(tmp_path / f"run{suffix}", text)
    assert [(c.name, c.unit, c.sampling_rate) for c in found.channels] == [
        ("Front bearing", "m/s^2", pytest.approx(2000)), ("Tacho", "V", pytest.approx(2000))
    ]  # fmt: skip
    assert_array_equal(np.stack([c.samples for c in found.channels], 1), X[:N])


@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
def test_facts_of_a_file_in_utf_16(tmp_path, columns):
    (tmp_path / "run.txt").write_text(lvm([segment()], columns=columns), encoding="utf-16")
    assert [c.name for c in read_recording(tmp_path / "run.txt").channels] == ["Front bearing", "Tacho"]


def test_facts_over_the_columns_of_channels(tmp_path):
    """Where each channel has its column of X, the fields over those columns may be empty."""
    keys = ("Samples", "Date", "Time", "Y_Unit", "X_Dim", "X0", "Delta_X")
    starts = ("0.0", "0.05")
    head, rest = lvm([segment(X[:N], starts)], columns="Multi").split("Channels", 1)
    lines = [
        line.replace("\t", "\t\t").replace("\t\t", "\t", 1) if line.startswith(keys) else line
        for line in rest.split("\n")
    ]
    found = read(tmp_path / "run.lvm", head + "Channels" + "\n".join(lines))
    assert [(c.name, c.unit) for c in found.channels] == [("Front bearing", "m/s^2"), ("Tacho", "V")]
    assert_array_equal(found.channels[0].samples, X[100:N, 0])
    assert_array_equal(found.channels[1].samples, X[: N - 100, 1])


@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
def test_segments_that_continue_each_other_are_joined(tmp_path, columns):
    second = segment(X[N:], (f"{N * DT}", f"{N * DT}"))
    found = read(tmp_path / "run.lvm", lvm([segment(), second], columns=columns))
    assert_array_equal(np.stack([c.samples for c in found.channels], 1), X)
    assert "2 segments that continue each other were joined" in [note.text for note in found.notes]


def test_segments_may_continue_by_their_clock(tmp_path):
    second = segment(X[N:], times=("10:00:00.223", "10:00:00.223"))
    assert_array_equal(read(tmp_path / "run.lvm", lvm([segment(), second])).channels[0].samples, X[:, 0])


@pytest.mark.parametrize("late", [-0.05, 0.01, 3.0])
def test_segments_with_a_gap_between_are_refused(tmp_path, late):
    second = segment(X[N:], (f"{N * DT + late}",) * 2)
    with pytest.raises(InputError, match=f"segment 2 of channel Front bearing begins {late:.6g} s after the end"):
        read(tmp_path / "run.lvm", lvm([segment(), second]))


@pytest.mark.parametrize(("starts", "times"), [(("0.0", "0.05"), ("10:00:00.123", "10:00:00.123")),
                                               (("0.0", "0.0"), ("10:00:00.123", "10:00:00.173"))])  # fmt: skip
def test_channels_that_start_at_different_times(tmp_path, starts, times):
    found = read(tmp_path / "run.lvm", lvm([segment(X[:N], starts, times)], columns="Multi"))
    assert_array_equal(found.channels[0].samples, X[100:N, 0])
    assert_array_equal(found.channels[1].samples, X[: N - 100, 1])


def test_channels_of_different_lengths(tmp_path):
    x = X[:N].copy()
    x[190:, 1] = np.nan
    found = read(tmp_path / "run.lvm", lvm([segment(x)], columns="No"))
    assert_array_equal(found.channels[0].samples[:190], X[:190, 0])
    assert found.channels[1].samples.size == 190


def test_times_that_contradict_the_step_are_refused(tmp_path):
    text = lvm([segment()]).replace("Delta_X\t0.000500\t0.000500", "Delta_X\t0.001000\t0.001000")
    with pytest.raises(InputError, match=r"Delta_X states 0.001 s, and its times \(X_Value\) rise by 0.0005 s"):
        read(tmp_path / "run.lvm", text)


def test_times_give_the_rate_where_no_step_is_stated(tmp_path):
    text = "\n".join(line for line in lvm([segment()]).split("\n") if not line.startswith("Delta_X"))
    assert_allclose(read(tmp_path / "run.lvm", text).channels[0].sampling_rate, 2000)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("***End_of_Header***", "", r"no line \*\*\*End_of_Header\*\*\* in its first 100 lines"),
        ("Delta_X\t0.000500", "Delta_X\tfast", "delta_x of channel 1 is 'fast', which is not a number"),
        ("X0\t0.0", "X0\tinf", "x0 of channel 1 is 'inf', which is not a number"),
        ("X_Value", "Y_Value", "is no head of columns"),
        (f"{X[7, 0]:.6f}", "OVLD", r"'OVLD' marks an overload or no number"),
        ("X_Dimension\tTime\tTime", "X_Dimension\tFrequency\tFrequency", "Frequency"),
        ("Delta_X\t0.000500", "Delta_X\t0", "Delta_X is 0 s"),
    ],
)
def test_damaged_files_are_refused(tmp_path, old, new, message):
    text = lvm([segment()])
    assert old in text
    with pytest.raises(InputError, match=message):
        read(tmp_path / "run.lvm", text.replace(old, new))


def test_no_bytes_give_a_traceback(tmp_path):
    random = np.random.default_rng(3)
    whole = lvm([segment(X[:20]), segment(X[20:40], ("0.01", "0.01"))]).encode()
    for case in range(150):
        data = bytearray(whole)
        for _ in range(int(random.integers(1, 6))):
            at = int(random.integers(len(data)))
            data[at : at + int(random.integers(0, 9))] = (
                random.bytes(int(random.integers(0, 5))) if case % 2 else b"\t\n"
            )
        (tmp_path / "run.lvm").write_bytes(data)
        try:
            read_recording(tmp_path / "run.lvm")
        except InputError:
            continue


LONG = np.round(np.random.default_rng(9).normal(size=(2311, 2)), 6)


def parts_of(x, size):
    """Consecutive segments, each with the time of its first row."""
    return [segment(x[i : i + size], (f"{i * DT:.6f}",) * 2) for i in range(0, len(x), size)]


@pytest.mark.parametrize("samples", [256, 900])
@pytest.mark.parametrize("size", [2311, 1000, 70])
@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
def test_blocks_hold_what_the_whole_file_holds(tmp_path, columns, size, samples):
    path = tmp_path / "run.lvm"
    whole = read(path, lvm(parts_of(LONG, size), columns=columns, extra=("Description\tPr\xfcfstand",)))
    blocks = read_in_blocks(path, samples=samples)
    parts = list(blocks)
    assert len(parts) > 1
    for channel in whole.channels:
        extent = blocks.whole.channel(channel.name)
        assert (extent.unit, extent.start) == (channel.unit, pytest.approx(channel.start))
        assert extent.sampling_rate == pytest.approx(channel.sampling_rate, rel=1e-9)
        assert_array_equal(np.concatenate([part.channel(channel.name).samples for part in parts]), channel.samples)
    codes = {note.code for note in whole.notes} - {"joined-segments"}
    assert codes <= {note.code for note in blocks.whole.notes}


def test_blocks_without_a_step_take_their_rate_from_the_times(tmp_path):
    text = lvm([segment(LONG)])
    text = "\n".join(line for line in text.split("\n") if not line.startswith("Delta_X"))
    whole = read(tmp_path / "run.lvm", text)
    blocks = read_in_blocks(tmp_path / "run.lvm", samples=500)
    assert blocks.channels[0].sampling_rate == pytest.approx(whole.channels[0].sampling_rate, rel=1e-6)
    given = read_in_blocks(tmp_path / "run.lvm", samples=500, sampling_rate=4000)
    assert given.channels[0].sampling_rate == 4000
    assert sum(part.channels[0].samples.size for part in given) == len(LONG)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda parts: [*parts[:2], parts_of(LONG, 500)[3]], "begins 0.25 s after the end|leap by 0.25 s"),
        (lambda parts: [*parts[:2], segment(LONG[:500], ("1.0", "1.0"), ("10:00:05.123",) * 2)], "5 s"),
    ],
)
def test_blocks_with_a_gap_between_segments_are_refused(tmp_path, change, message):
    path = tmp_path / "run.lvm"
    path.write_text(lvm(change(parts_of(LONG, 500))))
    for samples in (300, 500):
        with pytest.raises(InputError, match=message):
            read_in_blocks(path, samples=samples)


def test_times_of_later_blocks_that_contradict_the_step_are_refused(tmp_path):
    lines = lvm([segment(LONG)]).split("\n")
    late = [f"{float(line.split()[0]) + 0.5:.6f}\t" + line.split("\t", 1)[1] for line in lines[-1000:-1]]
    (tmp_path / "run.lvm").write_text("\n".join([*lines[:-1000], *late, ""]))
    with pytest.raises(InputError, match=r"Delta_X states 0\.0005 s, and its times"):
        read_in_blocks(tmp_path / "run.lvm", samples=400)


def test_rows_without_a_header_after_a_segment_are_refused_in_blocks(tmp_path):
    text = lvm(parts_of(LONG, 1000))
    for broken in (text.replace("Channels", "Kanaele"), text[: text.rindex("***End")], text.replace("X_Value", "Y")):
        (tmp_path / "run.lvm").write_text(broken)
        with pytest.raises(InputError):
            read_in_blocks(tmp_path / "run.lvm", samples=400)


def test_rows_after_the_stated_samples_are_left_out_of_blocks_too(tmp_path):
    text = lvm([segment(LONG)]).replace("Samples\t2311\t2311", "Samples\t2000\t2000")
    whole = read(tmp_path / "run.lvm", text)
    blocks = read_in_blocks(tmp_path / "run.lvm", samples=600)
    for k, channel in enumerate(whole.channels):
        read_parts = np.concatenate([part.channel(channel.name).samples for part in blocks])
        assert_array_equal(read_parts, channel.samples)
        assert_array_equal(read_parts, LONG[:2000, k])
