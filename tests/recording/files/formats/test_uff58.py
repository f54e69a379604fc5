"""Verification: data sets 58 as Fortran writes them, with fields of a width that the data set prescribes."""

import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.formats.uff58 import read_uff58
from sigdb.recording.files.settings import RecordingSettings

X = np.round(-1 - np.sin(np.pi * np.arange(401) / 20), 5)
RATE = 2000
SINGLE, DOUBLE = (13, 5), (20, 12)


def field(value, form, digits=2):
    """A number as Fortran's E13.5 or E20.12 with an exponent of some digits; 0 is without its letter E."""
    width, decimals = form
    mantissa, exponent = f"{value:.{decimals}E}".split("E")
    sign, size = exponent[0], int(exponent[1:])
    letter = "E" if digits else ""
    return f"{mantissa}{letter}{sign}{size:0{digits or 3}d}".rjust(width)


def lines(values, forms, digits):
    """Numbers in lines of these fields."""
    fields = [field(value, forms[i % len(forms)], digits) for i, value in enumerate(values)]
    return ["".join(fields[i : i + len(forms)]) for i in range(0, len(fields), len(forms))]


def head(count, *, kind=2, spacing=1, function=1, title="NONE", node=1, direction=3, entity="NONE", minimum=0.0,
         interval=1 / RATE, abscissa=(17, "Time", "s"), ordinate=(12, "Acceleration", "g")):  # fmt: skip
    def axis(code, label, unit):
        return f"{code:10d}{0:5d}{0:5d}{0:5d} {label:20s} {unit:20s}"

    return [
        *(f"{text:80s}" for text in (title, "NONE", "04-May-23 10:00:00", "NONE", "NONE")),
        f"{function:5d}{0:10d}{1:5d}{0:10d} {entity:10s}{node:10d}{direction:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{kind:10d}{count:10d}{spacing:10d}{field(minimum, SINGLE)}{field(interval, SINGLE)}{field(0.0, SINGLE)}",
        axis(*abscissa), axis(*ordinate), axis(0, "NONE", "NONE"), axis(0, "NONE", "NONE"),
    ]  # fmt: skip


def write(path, *sets, end="\n"):
    """A file of data sets, each a list of lines, or a binary one as (header, bytes, byte order)."""
    data = b""
    for one in sets:
        if isinstance(one, tuple):
            header, raw, order = one
            first = f"    58b{order:6d}{2:6d}{11:12d}{len(raw):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
            data += end.join(["    -1", first, *header, ""]).encode() + raw + end.join(["", "    -1", ""]).encode()
        else:
            kind = one[0] if one[0].strip() in ("164", "15") else "    58"
            data += end.join(["    -1", kind, *(one[1:] if kind == one[0] else one), "    -1", ""]).encode()
    path.write_bytes(data)
    return path


def read(path, **options):
    return read_uff58(path, RecordingSettings(**options))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("digits", [2, 3, 0])
@pytest.mark.parametrize(("kind", "forms"), [(2, (SINGLE,) * 6), (4, (DOUBLE,) * 4)])
def test_fields_of_even_spacing(tmp_path, kind, forms, digits, end):
    path = write(tmp_path / "run.uff", head(X.size, kind=kind) + lines(X, forms, digits), end=end)
    (column,) = read(path).columns
    assert_allclose(column.values, X, rtol=0, atol=1e-12)
    assert (column.sampling_rate, column.start, column.unit) == (RATE, 0, "g")


@pytest.mark.parametrize("coding", ["utf-8", "cp1252"])
def test_texts_that_are_not_ascii(tmp_path, coding):
    path = write(tmp_path / "run.uff", head(X.size, title="Gehäuse", ordinate=(12, "Größe", "m/s²")) +
                 lines(X, (SINGLE,) * 6, 2))  # fmt: skip
    path.write_bytes(path.read_bytes().decode().encode(coding))
    (column,) = read(path).columns
    assert (column.name, column.unit) == ("Gehäuse", "m/s²")


@pytest.mark.parametrize("digits", [2, 3])
@pytest.mark.parametrize(("kind", "forms"), [(2, (SINGLE,) * 6), (4, (SINGLE, DOUBLE, SINGLE, DOUBLE))])
def test_pairs_with_even_times(tmp_path, kind, forms, digits):
    t = np.arange(X.size) / RATE + 0.25
    pairs = np.stack([t, X], 1).reshape(-1)
    path = write(tmp_path / "run.uff", head(X.size, kind=kind, spacing=0) + lines(pairs, forms, digits))
    (column,) = read(path).columns
    assert_allclose(column.values, X, rtol=0, atol=1e-12)
    assert column.sampling_rate == pytest.approx(RATE, rel=1e-6)
    assert column.start == pytest.approx(0.25)


def test_pairs_with_uneven_times_are_refused(tmp_path):
    t = (np.arange(X.size) / X.size) ** 2
    pairs = np.stack([t, X], 1).reshape(-1)
    path = write(tmp_path / "run.uff", head(X.size, spacing=0) + lines(pairs, (SINGLE,) * 6, 2))
    with pytest.raises(InputError, match="column of the times of node 1"):
        read_recording(path)
    assert read_recording(path, sampling_rate=100).channels[0].sampling_rate == 100


@pytest.mark.parametrize("kind", [2, 4])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("spacing", [0, 1])
def test_binary_numbers(tmp_path, kind, order, spacing):
    number = {1: "<", 2: ">"}[order] + {2: "f4", 4: "f8"}[kind]
    t = np.arange(X.size) / RATE
    values = X if spacing else np.stack([t, X], 1).reshape(-1)
    path = write(
        tmp_path / "run.uff", (head(X.size, kind=kind, spacing=spacing), values.astype(number).tobytes(), order)
    )
    (column,) = read(path).columns
    assert_array_equal(column.values, X.astype(number).astype(float))
    assert column.sampling_rate == pytest.approx(RATE, rel=1e-6)


def test_binary_pairs_with_times_of_single_precision(tmp_path):
    pairs = b"".join(struct.pack("<fd", i / RATE, x) for i, x in enumerate(X))
    (column,) = read(write(tmp_path / "run.uff", (head(X.size, kind=4, spacing=0), pairs, 1))).columns
    assert_array_equal(column.values, X)


@pytest.mark.parametrize(
    "text",
    ["\n".join(f" {x:.5g}" for x in X), " ".join(f"{x:.7f}" for x in X), "\n".join(f"{x:.5E}\t1.0" for x in X[::2])],
)
def test_numbers_between_blanks(tmp_path, text):
    count = X.size if "\t" not in text else 402
    (column,) = read(write(tmp_path / "run.uff", [*head(count), *text.split("\n")])).columns
    assert_allclose(column.values[::2], X[::2], atol=1e-4)


@pytest.mark.parametrize("digits", [2, 3])
@pytest.mark.parametrize("indent", ["cut off", "of numbers cut off"])
def test_lines_without_their_indent(tmp_path, indent, digits):
    path = write(tmp_path / "run.uff", head(X.size, node=12) + lines(X, (SINGLE,) * 6, digits))
    rows = path.read_text().split("\n")
    if indent == "cut off":
        path.write_text("\n".join(row.strip() for row in rows))
    else:
        path.write_text("\n".join(row.strip() if i > 12 and row != "    -1" else row for i, row in enumerate(rows)))
    (column,) = read(path).columns
    assert_array_equal(column.values, X)
    assert (column.name, column.sampling_rate, column.unit) == ("node 12 +Z", RATE, "g")
    assert read_recording(path).channels[0].samples.size == X.size


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: [*rows[:-1], rows[-1].replace("E", "*")], "holds other things than numbers"),
        (lambda rows: ["*" * 13 + rows[0][13:], *rows[1:]], "holds other things than numbers"),
        (lambda rows: rows[:-2], "is cut short: it states 401 numbers and holds 390"),
        (lambda rows: rows + rows, "states 401 numbers and holds 802"),
    ],
)
def test_damaged_numbers_are_refused(tmp_path, change, message):
    touching = lines(np.where(np.arange(401) % 2, X, X - 3), (SINGLE,) * 6, 3)
    with pytest.raises(InputError, match=message):
        read(write(tmp_path / "run.uff", head(401) + change(touching)))


def test_names_by_node_and_direction(tmp_path):
    rows = lines(X, (SINGLE,) * 6, 2)
    places = [(12, 1), (12, -2), (13, 3)]
    sets = [head(X.size, title="Run 1", node=node, direction=way) + rows for node, way in places]
    assert [one.name for one in read(write(tmp_path / "run.uff", *sets)).columns] == [
        "node 12 +X", "node 12 -Y", "node 13 +Z",
    ]  # fmt: skip
    sets.append(head(X.size, title="tacho", node=20, direction=0, entity="SHAFT") + rows)
    assert [one.name for one in read(write(tmp_path / "run.uff", *sets)).columns] == [
        "Run 1 node 12 +X", "Run 1 node 12 -Y", "Run 1 node 13 +Z", "tacho",
    ]  # fmt: skip
    sets = [head(X.size, node=20, direction=0, entity="SHAFT") + rows]
    assert [one.name for one in read(write(tmp_path / "run.uff", *sets)).columns] == ["SHAFT 20"]


@pytest.mark.parametrize(
    ("about", "reason"),
    [
        ({"abscissa": (18, "Frequency", "Hz")}, "over frequency"),
        ({"abscissa": (19, "NONE", "NONE")}, "over speed"),
        ({"abscissa": (20, "NONE", "NONE")}, "over order"),
        ({"abscissa": (0, "Frequency", "Hz")}, "over Frequency in Hz"),
        ({"abscissa": (0, "NONE", "Hz")}, "over a quantity in Hz"),
        ({"abscissa": (0, "NONE", "NONE"), "function": 0}, "of function type 0, which does not state its abscissa"),
        ({"function": 2}, "of function type 2"),
        ({"function": 12}, "of function type 12"),
        ({"kind": 5}, "of complex numbers"),
    ],
)
def test_records_that_are_not_over_time(tmp_path, about, reason):
    rows = lines(X, (SINGLE,) * 6, 2)
    spectrum = head(X.size, title="fft", **about) + rows
    with pytest.raises(InputError, match=f"holds no time record .*: fft {reason}"):
        read(write(tmp_path / "run.uff", spectrum))
    contents = read(write(tmp_path / "run.uff", spectrum, head(X.size, title="a") + rows))
    assert [one.name for one in contents.columns] == ["a"]
    assert [note.text for note in contents.notes] == [f"left out: fft {reason}"]


@pytest.mark.parametrize(
    ("about", "rate", "start"),
    [
        ({"function": 0}, RATE, 0),
        ({"abscissa": (0, "NONE", "NONE")}, RATE, 0),
        ({"abscissa": (0, "Time", "NONE"), "function": 0}, RATE, 0),
        ({"minimum": -0.125}, RATE, -0.125),
        ({"abscissa": (17, "Time", "ms"), "interval": 0.5, "minimum": 20.0}, RATE, 0.02),
        ({"interval": 1 / 51_200}, 51_200, 0),
        ({"interval": 1 / 44_100}, 44_100, 0),
        ({"interval": 1 / 65_536}, 65_536, 0),
        ({"interval": 0.0}, None, 0),
    ],
)
def test_rates_and_starts(tmp_path, about, rate, start):
    (column,) = read(write(tmp_path / "run.uff", head(X.size, **about) + lines(X, (SINGLE,) * 6, 2))).columns
    assert (column.sampling_rate, column.start) == (rate, start)


@pytest.mark.parametrize(
    ("code", "factor", "kind", "unit"),
    [
        (1, 1.0, 12, "m/s^2"), (5, 1000.0, 11, "mm/s"), (7, 39.37, 11, "in/s"), (9, 1000.0, 12, "mm/s^2"),
        (2, 3.28084, 8, "ft"), (1, 1000.0, 12, ""), (1, 1.0, 13, ""), (6, 100.0, 12, "cm/s^2"),
    ],
)  # fmt: skip
def test_units_of_data_set_164(tmp_path, code, factor, kind, unit):
    rows = lines(X, (SINGLE,) * 6, 2)
    numbers = "".join(f"{value:25.16E}".replace("E", "D") for value in (factor, 1.0, 1.0))
    units = ["   164", f"{code:10d}{'units':20s}{2:10d}", numbers, f"{273.15:25.16E}"]
    record = head(X.size, ordinate=(kind, "NONE", "NONE")) + rows
    assert read(write(tmp_path / "run.uff", units, record)).columns[0].unit == unit
    labelled = head(X.size, ordinate=(kind, "NONE", "g")) + rows
    assert read(write(tmp_path / "run.uff", units, labelled)).columns[0].unit == "g"
