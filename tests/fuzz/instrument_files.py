"""Text files as instruments and programs write them, each with the layout of its header, made up from memory of it."""

import numpy as np
from known_recordings import Expected

SHORTEST_UNITS = {"V": "Volt", "g": "g"}


def _join(rows, sign):
    return [sign.join(str(field) for field in row) for row in rows]


def _table(known, *, time=True, digits=".9g", start=0.0, factor=1.0):
    """Rows of numbers as text, with the time first."""
    t = (known.times + start) * factor
    columns = [*([t] if time else []), *known.samples]
    return [[f"{value:{digits}}" for value in row] for row in zip(*columns, strict=True)]


def tektronix_side_facts(known, path):
    """Older oscilloscopes: facts in the first columns of the first rows."""
    facts = [("Record Length", f"{known.samples.shape[1]:e}"), ("Sample Interval", f"{1 / known.rate:.9e}"),
             ("Trigger Point", "0.0e+00"), ("", ""), ("Source", "CH1"), ("Vertical Units", known.units[0]),
             ("Vertical Scale", "1.0e+00"), ("Horizontal Units", "s")]  # fmt: skip
    rows = _table(known, start=-0.01, digits="013.9f")
    return _join([[*(facts[i] if i < len(facts) else ("", "")), "", *row[:2]] for i, row in enumerate(rows)], ",")


def tektronix(known, path):
    """Later oscilloscopes: facts, blank line, names."""
    rows = [["Model", "MDO3024"], ["Firmware Version", "1.26"], [], ["Waveform Type", "ANALOG"],
            ["Point Format", "Y"], ["Horizontal Units", "s"], ["Horizontal Scale", "0.004"],
            ["Horizontal Delay", "0.0"], ["Sample Interval", f"{1 / known.rate:.12g}"],
            ["Record Length", known.samples.shape[1]], ["Vertical Units", *known.units], [],
            ["TIME", *known.names]]  # fmt: skip
    return _join(rows + _table(known, digits=".9e"), ",")


def keysight(known, path):
    units = [SHORTEST_UNITS.get(unit, unit) for unit in known.units]
    return _join([["x-axis", *known.names], ["second", *units], *_table(known, digits="+.9E")], ",")


def rigol(known, path):
    """Sequence numbers; start and increment stand in the line of units."""
    width = len(known.names)
    rows = [["X", *known.names, "Start", "Increment", ""],
            ["Sequence", *known.units, "-1.000000e-02", f"{1 / known.rate:.9e}", ""]]  # fmt: skip
    rows += [[i, *row, "", "", ""] for i, row in enumerate(_table(known, time=False))]
    return _join([row[: width + 4] for row in rows], ",")


def picoscope(known, path):
    rows = [["Time", *known.names], ["(ms)", *(f"({unit})" for unit in known.units)], []]
    return _join(rows + _table(known, start=-0.05, factor=1e3), ",")


def siglent(known, path):
    rows = [["Record Length", f"Analog:{known.samples.shape[1]}"], ["Sample Interval", f"{1 / known.rate:.9g}"],
            ["Vertical Units", *known.units], ["Vertical Scale", *["1.00"] * len(known.names)],
            ["Horizontal Units", "s"], ["Model Number", "SDS1104X"], ["Source", *known.names],
            ["Second", *["Value"] * len(known.names)]]  # fmt: skip
    return _join(rows + _table(known), ",")


def yokogawa(known, path):
    width = len(known.names)
    rows = [['"Header Size"', 12], ['"Model Name"', '"DLM2000"'], ['"Comment"', '""'], ['"BlockNumber"', 1],
            ['"TraceName"', *(f'"{name}"' for name in known.names)], ['"BlockSize"', *[known.samples.shape[1]] * width],
            ['"VUnit"', *(f'"{unit}"' for unit in known.units)], ['"SampleRate"', *[f"{known.rate:.7E}"] * width],
            ['"HResolution"', *[f"{1 / known.rate:.9E}"] * width], ['"HOffset"', *["-1.000000E-02"] * width],
            ['"HUnit"', *['"s"'] * width], ['"Date"', *['"2024/03/05"'] * width], []]  # fmt: skip
    return _join(rows + [["", *row] for row in _table(known, time=False)], ",")


def lvm(known, path, *, columns="One", decimal="."):
    """LabVIEW's measurement file; X_Columns may be One, Multi or No."""
    names, width = known.names, len(known.names)
    wide = 2 if columns == "Multi" else 1
    blank = [""] * width

    def spread(values):
        return [field for value in values for field in [value, *[""] * (wide - 1)]]

    rows = [["LabVIEW Measurement"], ["Writer_Version", "2"], ["Reader_Version", "2"], ["Separator", "Tab"],
            ["Decimal_Separator", decimal], ["Multi_Headings", "Yes"], ["X_Columns", columns],
            ["Time_Pref", "Relative"], ["Operator", "nn"], ["Date", "2024/03/05"], ["Time", "10:20:30.1"],
            ["***End_of_Header***"], [], ["Channels", str(width), *blank],
            ["Samples", *spread([str(known.samples.shape[1])] * width)],
            ["Date", *spread(["2024/03/05"] * width)], ["Time", *spread(["10:20:30.1"] * width)],
            ["Y_Unit_Label", *spread(known.units)], ["X_Dimension", *spread(["Time"] * width)],
            ["X0", *spread(["0.0000000000000000E+0"] * width)],
            ["Delta_X", *spread([f"{1 / known.rate:.12f}"] * width)], ["***End_of_Header***"]]  # fmt: skip
    if columns == "Multi":
        rows.append([part for name in names for part in ("X_Value", name)] + ["Comment"])
        body = [[part for field in row[1:] for part in (row[0], field)] for row in _table(known)]
    else:
        rows.append(["X_Value", *names, "Comment"])
        body = [row if columns == "One" else ["", *row[1:]] for row in _table(known)]
    head, lines = _join(rows, "\t"), _join(body, "\t")
    if decimal == ",":
        head = [line.replace(".", ",") if line.startswith(("X0", "Delta_X")) else line for line in head]
        lines = [line.replace(".", ",") for line in lines]
    return head + lines


def lvm_multi(known, path):
    return lvm(known, path, columns="Multi")


def lvm_without_times(known, path):
    return lvm(known, path, columns="No")


def lvm_with_comma(known, path):
    return lvm(known, path, decimal=",")


def signal_express(known, path):
    stamps = ["03/05/2024 10:20:30.000000"] * len(known.names)
    rows = [["channel names:"], known.names, ["start times:"], stamps, ["dt:"],
            [f"{1 / known.rate:.9f}"] * len(known.names), ["data:"]]  # fmt: skip
    return _join(rows + _table(known, time=False), "\t")


def labview_waveform(known, path):
    width = len(known.names)
    rows = [["waveform", *(f"[{i}]" for i in range(width))], ["t0", *["05.03.2024 10:20:30,000000"] * width],
            ["delta t", *[f"{1 / known.rate:.9f}"] * width], [],
            ["time", *(f"Y[{i}]" for i in range(width))]]  # fmt: skip
    return _join(rows + _table(known), "\t")


def catman(known, path):
    rows = [["HBM-CATMAN-DATEIFORMAT 5.0"], ["T0 = 05.03.2024 10:20:30"], [f"Rate: {known.rate:g} Hz"] * 2, [],
            ["Zeit 1", *known.names], ["s", *known.units]]  # fmt: skip
    return _join(rows + _table(known), "\t")


def dewesoft(known, path):
    rows = [["File name:", "run.dxd"], ["Sample rate:", f"{known.rate:g}"], ["Start time:", "05/03/2024 10:20:30.000"],
            ["Number of channels:", len(known.names)], ["Data header"], []]  # fmt: skip
    rows.append(["Time (s)", *(f"{name} ({unit})" for name, unit in zip(known.names, known.units, strict=True))])
    return _join(rows + _table(known), "\t")


def diadem(known, path):
    head = _join([["Time", *known.names], ["s", *known.units]], ";")
    return head + [line.replace(".", ",") for line in _join(_table(known), ";")]


def pandas_table(known, path):
    rows = [["", "time", *known.names]]
    return _join(rows + [[i, *row] for i, row in enumerate(_table(known))], ",")


def r_table(known, path):
    """``write.table``: names of rows without a name of their own."""
    rows = [[f'"{name}"' for name in ("time", *known.names)]]
    return _join(rows + [[f'"{i + 1}"', *row] for i, row in enumerate(_table(known))], " ")


def savetxt(known, path):
    head = "# " + " ".join(("time", *(name.replace(" ", "_") for name in known.names)))
    return [head, *_join(_table(known, digits=".18e"), " ")]


def savetxt_bare(known, path):
    return _join(_table(known, digits=".18e"), " ")


def me_scope(known, path):
    """Facts as keyword=value, then a section of data."""
    facts = ["[Header]", "Version=2", f"SampleRate={known.rate:g}", f"NumberOfChannels={len(known.names)}"]
    facts += [f"Channel{i + 1}={name}, {known.units[i]}" for i, name in enumerate(known.names)]
    return [*facts, "[Data]", "\t".join(known.names), *_join(_table(known, time=False), "\t")]


def two_blocks(known, path):
    """The same table twice, one below the other: the second is another measurement."""
    one = _join([["Time [s]", *known.names], *_table(known)], ",")
    return [*one, "", *one]


LAYOUTS = {
    function.__name__: function
    for function in (
        tektronix_side_facts, tektronix, keysight, rigol, picoscope, siglent, yokogawa, lvm, lvm_multi,
        lvm_without_times, lvm_with_comma, signal_express, labview_waveform, catman, dewesoft, diadem, pandas_table,
        r_table, savetxt, savetxt_bare, me_scope, two_blocks,
    )
}  # fmt: skip
WITHOUT_UNITS = {"pandas_table", "r_table", "savetxt", "savetxt_bare", "labview_waveform", "two_blocks",
                 "signal_express", "yokogawa", "me_scope", "tektronix_side_facts", "tektronix"}  # fmt: skip
WITHOUT_NAMES = {"savetxt_bare", "tektronix_side_facts", "labview_waveform", "yokogawa"}

CHOICES = {
    "layout": tuple(LAYOUTS), "line_end": ("\n", "\r\n"), "encoding": ("utf-8", "utf-8-sig", "utf-16"),
    "suffix": (".csv", ".txt", ".lvm", ".dat"), "blank_end": (False, True),
}  # fmt: skip


def _of_interval(known, layout):
    """Relative rounding of an interval that is written with nine decimals."""
    return 5e-10 * known.rate if layout == "signal_express" else 0.0


def instrument_file(path, known, random, *, layout, line_end, encoding, suffix, blank_end):
    """Write a recording in the layout of an instrument, and return what it must be read as."""
    lines = LAYOUTS[layout](known, path)
    path.write_text(
        line_end.join([*lines, "", *([""] if blank_end else [])]), encoding=encoding, errors="replace", newline=""
    )
    samples, names = known.samples, known.names
    if layout == "tektronix_side_facts":
        samples, names = samples[:1], names[:1]
    units = known.units[: len(names)]
    if layout == "keysight":
        units = tuple(SHORTEST_UNITS.get(unit, unit) for unit in units)
    if layout == "savetxt":
        names = tuple(name.replace(" ", "_") for name in names)
    unnamed = layout in WITHOUT_NAMES or (layout == "siglent" and names[0][:2] != "CH")
    unnamed |= layout == "rigol" and "X" in names  # the name of its times, so the channel is called X (2)
    return Expected(
        names=() if unnamed else names, units=() if layout in WITHOUT_UNITS else units,
        samples=tuple(np.array(x) for x in samples), rate=known.rate, tolerance=1e-7,
        rate_tolerance=1e-6 + 1e-7 * known.rate / samples.shape[1] + _of_interval(known, layout),
    )  # fmt: skip
