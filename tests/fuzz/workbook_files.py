"""XLSX and MDF files of known recordings: kinds of cells and of records, sheets and groups, places of rates."""

import struct
import zipfile
import zlib
from xml.sax.saxutils import escape

import numpy as np
from known_recordings import Expected

XLSX = {
    "rate_at": ("time", "Time in ms", "row above", "option"), "unit": ("brackets", "row below", "none"),
    "texts": ("inline", "shared"), "other": ("none", "notes before", "sheet after", "remark", "title"),
    "places": ("all", "none"), "suffix": (".xlsx", ".xlsm"),
}  # fmt: skip

MDF = {
    "rate_at": ("times", "ticks", "count", "option"), "type": ("f8", "f4", "i2", "big-endian"),
    "layout": ("plain", "compressed", "list", "transposed list"), "groups": ("one", "one each"),
    "other": ("none", "slow group", "invalid", "bus"), "unit": ("channel", "conversion", "none"),
    "suffix": (".mf4", ".mdf"),
}  # fmt: skip

PACKAGE = "http://schemas.openxmlformats.org/package/2006/relationships"
OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def xlsx_file(path, known, random, **how):
    """Write the parts of a workbook by ISO/IEC 29500; Excel states the place of each cell, others may not."""
    names, columns, above = list(known.names), list(known.samples), []
    factor = {"time": 1.0, "Time in ms": 1000.0}.get(how["rate_at"])
    units = list(known.units)
    if factor is not None:
        names, units = ["Time", *names], ["s" if factor == 1 else "ms", *units]
        columns = [known.times * factor, *columns]
    elif how["rate_at"] == "row above":
        above = [["Sample rate [Hz]", known.rate], []]
    if how["other"] == "title":
        above = [["Bench run"], [], *above]
    in_brackets = how["unit"] == "brackets" or (how["unit"] == "none" and factor is not None)
    kept = [unit if how["unit"] != "none" or (i == 0 and factor is not None) else "" for i, unit in enumerate(units)]
    head = [f"{name} [{unit}]" if in_brackets and unit else name for name, unit in zip(names, kept, strict=True)]
    rows = [*above, head, *([units] if how["unit"] == "row below" else [])]
    rows += [[float(f"{value:.15g}") for value in row] for row in zip(*columns, strict=True)]
    if how["other"] == "remark":
        rows[len(above)] = [*rows[len(above)], "Remark"]
        rows[-2] = [*rows[-2], "loose bolt"]
    sheets = {"Run 1": rows}
    if how["other"] == "notes before":
        sheets = {"Notes": [["Operator", "nn"], ["Rig", "no 7"]], **sheets}
    if how["other"] == "sheet after":
        sheets["Spectrum"] = [["Frequency [Hz]", "Level"], *([5.0 * i, 1.0 / (i + 1)] for i in range(40))]
    _write_workbook(path, sheets, shared=how["texts"] == "shared", places=how["places"] == "all")
    options = {"sampling_rate": known.rate} if how["rate_at"] == "option" else {}
    return Expected(
        names=known.names, units=() if how["unit"] == "none" else known.units, samples=tuple(known.samples),
        rate=known.rate, options=options, whole_names=True,
    )  # fmt: skip


def _write_workbook(path, sheets, *, shared, places):
    names = "".join(f'<sheet name="{name}" sheetId="{i}" r:id="r{i}"/>' for i, name in enumerate(sheets))
    relations = "".join(
        f'<Relationship Id="r{i}" Type="{OFFICE}/worksheet" Target="worksheets/s{i}.xml"/>' for i in range(len(sheets))
    )
    texts: dict[str, int] = {}

    def cell(place, value):
        at = f' r="{place}"' if places else ""
        if not isinstance(value, str):
            return f"<c{at}><v>{value!r}</v></c>"
        if shared:
            return f'<c{at} t="s"><v>{texts.setdefault(value, len(texts))}</v></c>'
        return f'<c{at} t="inlineStr"><is><t>{escape(value)}</t></is></c>'

    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/_rels/workbook.xml.rels", f'<Relationships xmlns="{PACKAGE}">{relations}</Relationships>')
        book = f'<workbook xmlns="{MAIN}" xmlns:r="{OFFICE}"><sheets>{names}</sheets></workbook>'
        archive.writestr("xl/workbook.xml", book)
        for i, rows in enumerate(sheets.values()):
            text = ""
            for number, row in enumerate(rows, 1):
                cells = "".join(cell(f"{chr(65 + c)}{number}", value) for c, value in enumerate(row))
                text += f'<row r="{number}">{cells}</row>' if places else f"<row>{cells}</row>"
            sheet = f'<worksheet xmlns="{MAIN}"><sheetData>{text}</sheetData></worksheet>'
            archive.writestr(f"xl/worksheets/s{i}.xml", sheet)
        items = "".join(f"<si><t>{escape(text)}</t></si>" for text in texts)
        archive.writestr("xl/sharedStrings.xml", f'<sst xmlns="{MAIN}">{items}</sst>')


class _Blocks:
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
        return self.block("TX", (), text.encode() + b"\0") if text else 0

    def linear(self, offset, slope, unit=""):
        body = struct.pack("<BBHHHdd", 1, 0, 0, 0, 2, 0, 0) + struct.pack("<2d", offset, slope)
        return self.block("CC", (0, self.text(unit), 0, 0), body)

    def channel(self, after, name, *, kind=0, data_type=4, byte=0, bits=64, conversion=0, unit="", invalid=None):
        flags = 0 if invalid is None else 2
        body = struct.pack("<4B4I", kind, 1 if kind else 0, data_type, 0, byte, bits, flags, invalid or 0) + bytes(52)
        return self.block("CN", (after, 0, self.text(name), 0, conversion, 0, self.text(unit), 0), body)

    def records(self, raw, layout, size):
        if layout == "plain":
            return self.block("DT", (), raw)
        if layout == "compressed":
            return self.compressed(raw, 0)
        parts = [raw[: size * 7 + 3], raw[size * 7 + 3 : size * 50], raw[size * 50 :]]
        blocks = [self.compressed(x, size) if "transposed" in layout else self.block("DT", (), x) for x in parts if x]
        return self.block("DL", (0, *blocks), struct.pack(f"<II{len(blocks)}Q", 0, len(blocks), *[0] * len(blocks)))

    def compressed(self, raw, width):
        rows = len(raw) // width if width else 0
        shown = raw
        if rows:
            turned = np.frombuffer(raw, np.uint8, rows * width).reshape(rows, width).T
            shown = turned.tobytes() + raw[rows * width :]
        packed = zlib.compress(shown)
        head = struct.pack("<BBIQQ", 1 if rows else 0, 0, width if rows else 0, len(raw), len(packed))
        return self.block("DZ", (), b"DT" + head + packed)


def mdf_file(path, known, random, **how):
    """Write blocks by ASAM's published description of version 4."""
    blocks = _Blocks()
    factors = [np.abs(x).max() / 30_000 if how["type"] == "i2" else 1.0 for x in known.samples]
    stored = [np.round(x / factor) if how["type"] == "i2" else x
              for x, factor in zip(known.samples, factors, strict=True)]  # fmt: skip
    kind, code = {"f8": ("<f8", 4), "f4": ("<f4", 4), "i2": ("<i2", 2), "big-endian": (">f8", 5)}[how["type"]]
    width = int(kind[2])
    numbers = range(len(stored))
    groups = [[i] for i in numbers] if how["groups"] == "one each" else [list(numbers)]
    n = known.samples.shape[1]
    lost = random.choice(n - 4, n // 120, replace=False) + 2 if how["other"] == "invalid" else []
    after = _other_groups(blocks, how)
    for group in reversed(groups):
        table = np.zeros((n, 8 + width * len(group) + 1), np.uint8)
        table[:, :8] = _times(known, how).view(np.uint8).reshape(n, 8)
        chain = 0
        for place, i in reversed(list(enumerate(group))):
            byte = 8 + width * place
            table[:, byte : byte + width] = stored[i].astype(kind).view(np.uint8).reshape(n, width)
            unit = known.units[i]
            by_conversion = unit if how["unit"] == "conversion" else ""
            conversion = blocks.linear(0.0, factors[i], by_conversion) if factors[i] != 1 or by_conversion else 0
            chain = blocks.channel(
                chain, known.names[i], data_type=code, byte=byte, bits=8 * width, conversion=conversion,
                unit=unit if how["unit"] == "channel" else "", invalid=0 if len(lost) else None,
            )  # fmt: skip
        table[lost, -1] = 1
        if how["rate_at"] != "option":
            chain = _master(blocks, chain, known, how)
        body = struct.pack("<QQHHIII", 0, n, 0, 46, 0, table.shape[1] - 1, 1)
        record_group = blocks.block("CG", (0, chain, blocks.text("run"), 0, 0, 0), body)
        records = blocks.records(table.tobytes(), how["layout"], table.shape[1])
        after = blocks.block("DG", (after, record_group, records, 0), bytes(8))
    blocks.data[:64] = b"MDF     4.10    test".ljust(64, b"\0")
    head = b"##HD" + struct.pack("<4xQQ6q", 104, 6, after, 0, 0, 0, 0, 0)
    blocks.data[64:168] = head.ljust(104, b"\0")
    path.write_bytes(bytes(blocks.data))
    samples = [x * factor for x, factor in zip(stored, factors, strict=True)]
    for x in samples:
        x[lost] = np.nan
    return Expected(
        names=known.names, units=() if how["unit"] == "none" else known.units, samples=tuple(samples),
        rate=known.rate, options={"sampling_rate": known.rate} if how["rate_at"] == "option" else {},
        tolerance=1e-6, rate_tolerance=1e-4 if how["rate_at"] == "ticks" else 1e-6,
    )  # fmt: skip


def _times(known, how):
    """The eight bytes of a record that hold its time."""
    if how["rate_at"] == "ticks":
        return np.round(known.times * 1e9).astype("<i8")
    return known.times.astype("<f8")


def _master(blocks, chain, known, how):
    if how["rate_at"] == "times":
        return blocks.channel(chain, "t", kind=2, unit="s")
    if how["rate_at"] == "ticks":
        return blocks.channel(chain, "t", kind=2, data_type=2, conversion=blocks.linear(0.0, 1e-9), unit="s")
    return blocks.channel(chain, "t", kind=3, bits=0, conversion=blocks.linear(0.0, 1 / known.rate), unit="s")


def _other_groups(blocks, how):
    """A group of temperatures at 0.5 Hz, or of bus messages, behind the others."""
    if how["other"] not in ("slow group", "bus"):
        return 0
    table = np.stack([np.arange(20) * 2.0, 40 + np.cos(np.arange(20))], 1).astype("<f8")
    chain = blocks.channel(blocks.channel(0, "Oil", byte=8, unit="degC"), "t", kind=2, unit="s")
    body = struct.pack("<QQHHIII", 0, 20, 2 if how["other"] == "bus" else 0, 46, 0, 16, 0)
    group = blocks.block("CG", (0, chain, blocks.text("slow"), 0, 0, 0), body)
    return blocks.block("DG", (0, group, blocks.block("DT", (), table.tobytes()), 0), bytes(8))
