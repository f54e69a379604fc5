"""TDMS, UFF and WAV files of known recordings: places of rates, types of numbers, segments, starts."""

import struct

import numpy as np
from known_recordings import Expected

TDMS = {
    "rate_at": ("wf_increment", "time", "Time in ms", "property", "group property", "increment one", "option"),
    "type": ("f8", "f4", "i2", "i4"), "segments": (1, 2, 5), "layout": ("contiguous", "interleaved"),
    "unit": ("unit_string", "NI_UnitDescription", "none"), "starts": ("none", "same", "offset", "late tacho"),
    "big_endian": (False, True), "other": ("none", "spectrum", "properties", "empty channel"),
}  # fmt: skip

_TYPES = {"f8": 10, "f4": 9, "i2": 2, "i4": 3}


def _text(value, order):
    return struct.pack(f"{order}I", len(value.encode())) + value.encode()


def _property(name, value, order):
    head = _text(name, order)
    if isinstance(value, str):
        return head + struct.pack(f"{order}I", 0x20) + _text(value, order)
    if isinstance(value, tuple):  # a time stamp: seconds since 1904 and fractions of 2^-64
        seconds, fraction = value
        stamp = struct.pack("<Qq", fraction, seconds) if order == "<" else struct.pack(">qQ", seconds, fraction)
        return head + struct.pack(f"{order}I", 0x44) + stamp
    return head + struct.pack(f"{order}Id", 10, value)


def tdms_file(path, known, random, **how):
    """Write segments by the published description of the format."""
    order = ">" if how["big_endian"] else "<"
    group, channels, expected = _tdms_channels(known, how)
    pieces = {name: np.array_split(x, how["segments"]) for name, (x, _) in channels.items()}
    interleaved = how["layout"] == "interleaved" and len({x.size for x, _ in channels.values()}) == 1
    data = b""
    for i in range(how["segments"]):
        objects = [_text("/'run'", order) + struct.pack(f"{order}I", 0xFFFFFFFF) + _properties(group, order)]
        for name, (_, about) in channels.items():
            kind = "f8" if name in ("Time", "Time [ms]") else how["type"]
            size = pieces[name][i].size
            words = (20, _TYPES[kind], 1, size) if size else (2**32 - 1,)
            index = struct.pack(order + ("IIIQ" if size else "I"), *words)
            path_text = "/'run'/'" + name.replace("'", "''") + "'"
            objects.append(_text(path_text, order) + index + _properties(about if i == 0 else {}, order))
        meta = struct.pack(f"{order}I", len(objects)) + b"".join(objects)
        raw = _raw([(pieces[name][i], "f8" if name in ("Time", "Time [ms]") else how["type"]) for name in channels],
                   order, interleaved)  # fmt: skip
        flags = 2 | 4 | 8 | (32 if interleaved else 0) | (64 if how["big_endian"] else 0)
        lead = struct.pack("<4sI", b"TDSm", flags) + struct.pack(f"{order}IQQ", 4713, len(meta) + len(raw), len(meta))
        data += lead + meta + raw
    path.write_bytes(data)
    return expected


def _properties(about, order):
    return struct.pack(f"{order}I", len(about)) + b"".join(_property(*pair, order) for pair in about.items())


def _raw(parts, order, interleaved):
    if interleaved:
        table = np.zeros(parts[0][0].size, [(str(i), order + kind) for i, (_, kind) in enumerate(parts)])
        for i, (x, _) in enumerate(parts):
            table[str(i)] = x
        return table.tobytes()
    return b"".join(np.asarray(x).astype(order + kind).tobytes() for x, kind in parts)


def _tdms_channels(known, how):
    """Properties of the group; channels with their properties, by name; what the file must be read as."""
    samples = known.samples
    if how["type"] in ("i2", "i4"):
        samples = np.round(samples / abs(samples).max() * 30_000)
    group, channels, options, starts = {}, {}, {}, []
    late = max(1, known.samples.shape[1] // 8) / known.rate
    for i, (name, unit) in enumerate(zip(known.names, known.units, strict=True)):
        about = {} if how["unit"] == "none" else {how["unit"]: unit}
        start = late if how["starts"] == "late tacho" and i == len(known.names) - 1 and i else 0.0
        if how["rate_at"] in ("wf_increment", "increment one"):
            about["wf_increment"] = 1.0 if how["rate_at"] == "increment one" else 1 / known.rate
            about["wf_start_offset"] = start if how["starts"] == "offset" else 0.0
            if how["starts"] in ("same", "late tacho"):
                about["wf_start_time"] = (3_792_456_000, int(start * 2**64))
        elif how["rate_at"] == "property":
            about["Sample Rate"] = known.rate
        starts.append(start if "wf_start_time" in about else 0.0)
        channels[name] = (samples[i], about)
    match how["rate_at"]:
        case "time" | "increment one":
            channels = {"Time": (known.times, {}), **channels}
        case "Time in ms":
            channels = {"Time [ms]": (known.times * 1000, {}), **channels}
        case "group property":
            group["Sampling Rate"] = known.rate
        case "option":
            options["sampling_rate"] = known.rate
    match how["other"]:
        case "spectrum":
            about = {"wf_increment": 5.0, "wf_xname": "Frequency", "wf_xunit_string": "Hz"}
            channels["FFT"] = (np.abs(np.fft.rfft(samples[0])) % 1000, about)
        case "properties":
            group |= {"Operator": "nn", "Filter": 5000.0, "Load": 12.0}
        case "empty channel":
            channels["Empty"] = (np.zeros(0), {"wf_increment": 1 / known.rate})
    expected = Expected(
        names=known.names, units=() if how["unit"] != "unit_string" else known.units, samples=tuple(samples),
        rate=known.rate, options=options, tolerance=1e-6 if how["type"] == "f4" else 1e-12, starts=tuple(starts),
    )  # fmt: skip
    return group, channels, expected


UFF = {
    "numbers": ("text 6E13.5", "text 4E20.12", "binary 4", "binary 8", "text 3 digits of exponent", "pairs"),
    "line_end": ("\n", "\r\n"), "indent": (True, False), "start": (0.0, 1.5),
    "function": (1, 0), "big_endian": (False, True), "titles": ("names", "same"),
    "other": ("none", "spectrum", "set 151", "set 164"),
    "suffix": (".uff", ".unv", ".u58"),
}  # fmt: skip


def uff_file(path, known, random, **how):
    """Write data sets 58 by the published description, with their fixed fields."""
    end = how["line_end"].encode()
    data = b""
    if how["other"] in ("set 151", "set 164"):
        number = how["other"].split()[1]
        body = [["model", "note", "prog"], ["1 SI", "1.0", "1.0"]][number == "164"]
        data += end.join([b"    -1", f"{number:>6}".encode(), *(line.encode() for line in body), b"    -1"]) + end
    for i, x in enumerate(known.samples):
        data += _data_set(x, known, i, how, end)
    if how["other"] == "spectrum":
        data += _data_set(np.abs(known.samples[0]), known, 0, how, end, spectrum=True)
    if not how["indent"] and not how["numbers"].startswith("binary"):
        data = end.join(line.strip() for line in data.split(end))
    path.write_bytes(data)
    names = known.names if how["titles"] == "names" and how["other"] != "spectrum" else ()
    digits = {"text 4E20.12": 1e-11, "binary 4": 1e-6, "binary 8": 1e-14}.get(how["numbers"], 1e-5)
    return Expected(
        names=names, units=known.units, samples=tuple(known.samples), rate=known.rate, tolerance=digits,
        rate_tolerance=1e-4 if how["numbers"] == "pairs" else 5e-6,
    )  # fmt: skip


def _data_set(x, known, i, how, end, *, spectrum=False):
    order = ">" if how["big_endian"] else "<"
    double = how["numbers"] in ("text 4E20.12", "binary 8")
    pairs = how["numbers"] == "pairs"
    title = "Spectrum" if spectrum else known.names[i] if how["titles"] == "names" else "Run 1"
    step, axis, unit = (5.0, 18, "Hz") if spectrum else (1 / known.rate, 17, "s")
    function = 12 if spectrum else how["function"]
    head = [
        title, "NONE", "05-MAR-24 10:20:30", "NONE", "NONE",
        f"{function:5d}{1:10d}{0:5d}{0:10d} {'NONE':<10}{i + 1:10d}{3:4d} {'NONE':<10}{0:10d}{0:4d}",
        f"{4 if double else 2:10d}{x.size:10d}{0 if pairs else 1:10d}{how['start']:13.5E}{step:13.5E}{0.0:13.5E}",
        _axis(axis, "Frequency" if spectrum else "Time", unit), _axis(12, "Acceleration", known.units[i]),
        _axis(0, "NONE", "NONE"), _axis(0, "NONE", "NONE"),
    ]  # fmt: skip
    if how["numbers"].startswith("binary"):
        raw = x.astype(order + ("f8" if double else "f4")).tobytes()
        mark = f"{58:6d}b{2 if order == '>' else 1:6d}{2:6d}{11:12d}{len(raw):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
        return end.join([b"    -1", mark.encode(), *(line.encode() for line in head), raw + end + b"    -1"]) + end
    values = np.stack([how["start"] + step * np.arange(x.size), x], 1).ravel() if pairs else x
    width = 4 if double else 6
    fields = [f"{value:20.12E}" if double else f"{value:13.5E}" for value in values]
    if how["numbers"] == "text 3 digits of exponent":
        fields = [f"{value:.5E}".replace("E+", "E+0").replace("E-", "E-0").rjust(13) for value in values]
    rows = ["".join(fields[k : k + width]) for k in range(0, len(fields), width)]
    return end.join(line.encode() for line in ["    -1", f"{58:6d}", *head, *rows, "    -1"]) + end


def _axis(kind, label, unit):
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"


WAV = {
    "type": ("i2", "f4", "f8", "i4", "u1", "i3"), "chunk": ("none", "LIST before", "LIST after", "bext", "odd"),
    "extensible": (False, True), "size": ("right", "zero", "huge"),
}  # fmt: skip


def wav_file(path, known, random, **how):
    """Write a RIFF file by hand; integers are fractions of full scale."""
    x = known.samples / (1.01 * abs(known.samples).max())
    raw, bits, floats, samples, tolerance = _coded(x, how["type"])
    rate = round(known.rate)
    width = bits // 8 * len(x)
    code = 0xFFFE if how["extensible"] else 3 if floats else 1
    form = struct.pack("<HHIIHH", code, len(x), rate, rate * width, width, bits)
    if how["extensible"]:
        form += struct.pack("<HHI", 22, bits, 0) + struct.pack("<H", 3 if floats else 1)
        form += b"\x00\x00\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71"
    other = {"LIST before": _chunk(b"LIST", b"INFOISFT\x04\x00\x00\x00abc\0"), "bext": _chunk(b"bext", bytes(602)),
             "odd": _chunk(b"note", b"abc")}.get(how["chunk"], b"")  # fmt: skip
    after = _chunk(b"LIST", b"INFOISFT\x04\x00\x00\x00abc\0") if how["chunk"] == "LIST after" else b""
    body = b"WAVE" + _chunk(b"fmt ", form) + other + _chunk(b"data", raw) + after
    size = {"right": len(body), "zero": 0, "huge": 2**32 - 1}[how["size"]]
    path.write_bytes(b"RIFF" + struct.pack("<I", size) + body)
    return Expected(names=(), units=(), samples=tuple(samples), rate=float(rate), tolerance=tolerance)


def _chunk(name, data):
    return name + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)


def _coded(x, kind):
    if kind in ("f4", "f8"):
        return x.T.astype("<" + kind).tobytes(), 8 * int(kind[1]), True, x, 1e-6
    bits = 8 * int(kind[1])
    full = 2.0 ** (bits - 1)
    whole = np.round(x.T * full).astype(np.int64)
    if kind == "u1":
        raw = (whole + 128).astype(np.uint8).tobytes()
    elif kind == "i3":
        raw = np.ascontiguousarray(whole.astype("<i4")[..., None].view(np.uint8)[..., :3]).tobytes()
    else:
        raw = whole.astype("<" + kind).tobytes()
    return raw, bits, False, whole.T / full, 1e-9
