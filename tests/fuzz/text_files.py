"""Text files of known recordings: the same numbers under other signs, places of units, times, comments, encodings."""

import datetime
import gzip

import numpy as np
from known_recordings import Expected

CHOICES = {
    "separator": (",", ";", "\t", " ", "  "),
    "decimal": (".", ","),
    "number": ("short", "fixed", "scientific", "signed", "wide", "fortran", "single"),
    "line_end": ("\n", "\r\n", "\r"),
    "encoding": ("utf-8", "utf-8-sig", "utf-16", "cp1252", "utf-16-be"),
    "gzip": (False, True),
    "quotes": ("none", "header", "all", "single"),
    "trailing": (False, True, "rows"),
    "blank_lines": ("none", "below header", "above header", "within header", "between rows", "end", "all"),
    "comment": ("", "#", "# ", "%", "//", "! ", "* ", "' "),
    "units_at": ("brackets", "parentheses", "slash", "comma", "row", "bracket row", "parenthesis row", "row above",
                 "none", "labelled row", "dash"),
    "third_row": ("none", "description", "axes", "range", "sensor", "blank names"),
    "time_at": ("first", "last", "second", "none"),
    "time_name": ("time", "Time", "t", "Zeit", "Temps", "Tiempo", "Tempo", "elapsed time", "Time Stamp", "X_Value",
                  "X", "TIME", "时间", "Tid", "Čas", "Time - Plot 0", "x-axis", "seconds",
                  "Sample time", "Relative time"),
    "time_unit": ("s", "ms", "us", "sec", "µs", "min", "none", "clock", "iso", "date and clock", "seconds"),
    "time_digits": ("all", "rounded", "scientific"),
    "start": (0.0, -0.05, 123.5, 3600.0),
    "rate_at": ("option", "# fs", "Sample rate", "Sampling Frequency (Hz)", "dt", "kHz", "Abtastrate"),
    "index": ("none", "pandas", "Sample", "No.", "#", "Index", "from one", "unnamed"),
    "extra": ("none", "words", "flags", "empty", "constant date"),
    "preamble": ("none", "title", "facts", "colon facts", "long", "numbers", "date"),
    "footer": ("none", "end", "statistics", "blank", "comment"),
    "final_newline": (True, False),
    "missing": ("none", "empty", "NaN", "nan", "NULL"),
    "spoilt": ("none", "word first", "word middle", "row lost", "row twice", "rows swapped", "torn", "short row",
               "header again", "long row"),
    "suffix": (".csv", ".txt", ".dat", ".asc", ".tsv", ".CSV"),
}  # fmt: skip
"""Ways to write a table; the first of each is the plain one."""

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "sec": 1.0, "seconds": 1.0, "min": 60.0, "none": 1.0}
CLOCKS = {"clock": "%H:%M:%S.%f", "iso": "%Y-%m-%dT%H:%M:%S.%f", "date and clock": "%d.%m.%Y %H:%M:%S.%f"}
DIGITS = {"short": ".9g", "fixed": ".7f", "scientific": ".9e", "signed": "+.8E", "wide": "18.9e", "fortran": ".9e",
          "single": ".7g"}  # fmt: skip


def text_file(path, known, random, **how):
    """Write a recording as a table, and return what it must be read as."""
    if how["time_name"] in known.names:
        how["time_name"] = "time"
    columns, fields, rate_tolerance = _columns(known, how)
    n = len(fields[0])
    gaps = _gaps(n, how["missing"], random)
    body = [[column[i] for column in fields] for i in range(n)]
    for i in gaps:
        body[i][next(k for k, (kind, *_) in enumerate(columns) if kind == "signal")] = _missing(how["missing"])
    lost = _spoil(body, columns, how, random)
    header = _header(columns, how)
    lines = [_line(row, how, part="header") for row in header]
    rows = [_line(row, how, part="rows") for row in body]
    if how["spoilt"] == "header again" and lines:
        rows.insert(len(rows) // 2, lines[0])
    lines = _with_blank_lines(_preamble(known, how), lines, rows, how)
    text = how["line_end"].join(lines + _footer(columns, how)) + (how["line_end"] if how["final_newline"] else "")
    _write(path, text, how)
    return _expected(known, how, gaps, lost, rate_tolerance)


def _columns(known, how):
    """Columns as (kind, name, unit) with their fields as text, and the tolerance of the rate."""
    signals = [
        (("signal", name, unit), [_number(value, how) for value in values])
        for name, unit, values in zip(known.names, known.units, known.samples, strict=True)
    ]
    columns, rate_tolerance = list(signals), 1e-6
    n = known.samples.shape[1]
    if how["time_at"] != "none":
        values, rate_tolerance = _times(known, how)
        unit = "" if how["time_unit"] in (*CLOCKS, "none") else how["time_unit"]
        place = {"first": 0, "second": 1, "last": len(columns)}[how["time_at"]]
        columns.insert(place, (("time", how["time_name"], unit), values))
    match how["extra"]:
        case "words":
            columns.append((("extra", "status", ""), ["ok" if i % 5 else "overload" for i in range(n)]))
        case "flags":
            columns.append((("extra", "valid", ""), ["TRUE"] * n))
        case "empty":
            columns.append((("extra", "comment", ""), [""] * n))
        case "constant date":
            columns.insert(0, (("extra", "Date", ""), ["2024-03-05"] * n))
    first = {"from one": 1}.get(how["index"], 0)
    if how["index"] != "none":
        name = {"pandas": "", "unnamed": "", "from one": "Sample"}.get(how["index"], how["index"])
        columns.insert(0, (("index", name, ""), [str(first + i) for i in range(n)]))
    return [head for head, _ in columns], [values for _, values in columns], rate_tolerance


def _times(known, how):
    t = known.times + how["start"]
    kind = how["time_unit"]
    if kind in CLOCKS:
        first = datetime.datetime(2024, 3, 5, 10, 20, 30, tzinfo=datetime.UTC)
        stamps = [(first + datetime.timedelta(microseconds=round(float(x) * 1e6))).strftime(CLOCKS[kind]) for x in t]
        step = 1e-6
        text = [stamp.replace(".", how["decimal"]) if kind == "clock" else stamp for stamp in stamps]
    else:
        t = t / SECONDS[kind]
        step = {"all": 0.0, "rounded": 10.0 ** np.ceil(np.log10(0.3 / known.rate / SECONDS[kind])), "scientific": None}
        step = step[how["time_digits"]]
        if step is None:
            text = [f"{x:.9e}" for x in t]
            step = abs(t).max() * 1e-9
        elif step:
            text = [f"{x:.{max(0, round(-np.log10(step)))}f}" for x in t]
        else:
            text = [f"{x:.12g}" for x in t]
        step *= SECONDS[kind]
        text = [x.replace(".", how["decimal"]) for x in text]
    return text, 1e-6 + 1.5 * step * known.rate / t.size  # slope by least squares


def _number(value, how):
    text = f"{value:{DIGITS[how['number']]}}".replace(".", how["decimal"])
    return text.replace("e", "D") if how["number"] == "fortran" else text


def _gaps(n, missing, random):
    return [] if missing == "none" else sorted(int(i) for i in random.choice(np.arange(5, n - 5), 2, replace=False))


def _missing(kind):
    return "" if kind == "empty" else kind


def _spoil(body, columns, how, random):
    """Spoil rows in place; return the index of a sample that is lost by it, or how it shortens the recording."""
    at = int(random.integers(len(body) // 3, 2 * len(body) // 3))
    signal = next(k for k, (kind, *_) in enumerate(columns) if kind == "signal")
    match how["spoilt"]:
        case "word first":
            body[0][signal] = "OVLD"
            return 0
        case "word middle":
            body[at][signal] = "Overrange"
            return at
        case "row lost":
            del body[at]
        case "row twice":
            body.insert(at, list(body[at]))
        case "rows swapped":
            body[at], body[at + 3] = body[at + 3], body[at]
        case "torn":
            body[-1] = body[-1][:1]
            return "torn"
        case "short row":
            body[at] = body[at][:-1]
            return at if len(columns) - 1 == signal else None
        case "long row":
            body[at].append("7" if how["decimal"] == "." else "7,5")
    return None


def _header(columns, how):
    """Header lines as lists of fields."""
    names, units = [name for _, name, _ in columns], [unit for *_, unit in columns]
    inline = {"brackets": "{} [{}]", "parentheses": "{} ({})", "slash": "{}/{}", "comma": "{}, {}", "dash": "{} - {}"}
    if how["units_at"] in inline:
        both = inline[how["units_at"]]
        rows = [[both.format(name, unit) if unit else name for name, unit in zip(names, units, strict=True)]]
    else:
        shown = {"bracket row": "[{}]", "parenthesis row": "({})"}.get(how["units_at"], "{}")
        row = [shown.format(unit) if unit else "" for unit in units]
        rows = {"none": [names], "row above": [row, names]}.get(how["units_at"], [names, row])
        if how["units_at"] == "labelled row":
            rows = [["Channel", *names[1:]], ["Unit", *units[1:]]] if columns[0][0] == "index" else [names, units]
    third = {
        "description": [f"sensor at place {i}" for i in range(len(names))],
        "axes": ["+X"] * len(names),
        "range": ["+-10"] * len(names),
        "sensor": [f"SN{1000 + i}" for i in range(len(names))],
        "blank names": [""] * len(names),
    }
    return rows + ([third[how["third_row"]]] if how["third_row"] in third else [])


def _line(row, how, *, part):
    sign = how["separator"]
    quoted = how["quotes"] == "all" or (how["quotes"] == "header" and part == "header")
    if quoted or (how["quotes"] == "single" and part == "header"):
        mark = "'" if how["quotes"] == "single" else '"'
        row = [f"{mark}{field}{mark}" for field in row]
    elif sign == ",":
        row = [f'"{field}"' if "," in field and part == "header" else field for field in row]
    elif sign in " ":
        row = [f'"{field}"' if " " in field.strip() else field for field in row]
    if sign == "  ":
        row = [field.rjust(20) for field in row]
    line = sign.join(row)
    if how["trailing"] is True or (how["trailing"] == "rows" and part == "rows"):
        line += sign
    return how["comment"] + line if part == "header" else line


def _with_blank_lines(preamble, header, rows, how):
    places = how["blank_lines"]
    lines = [*preamble]
    lines += [""] if places in ("above header", "all") else []
    for i, line in enumerate(header):
        lines += [""] if i and places in ("within header", "all") else []
        lines.append(line)
    lines += [""] if places in ("below header", "all") else []
    for i, row in enumerate(rows):
        lines.append(row)
        lines += [""] if places in ("between rows", "all") and i % 20 == 19 else []
    return lines + (["", ""] if places in ("end", "all") else [])


def _preamble(known, how):
    def fact(key, value):
        return f"{key}: {value}" if how["preamble"] == "colon facts" else f"{key}{how['separator'][:1]}{value}"

    facts = {
        "none": [],
        "title": ["Gearbox test 7"],
        "facts": [fact("Device", "Recorder 9"), fact("Channels", len(known.names)), fact("Operator", "NN")],
        "colon facts": [fact("Device", "Recorder 9"), fact("Serial", 4711), fact("Points", known.samples.shape[1])],
        "long": [f"Remark {i} on the test" for i in range(230)],
        "numbers": [fact("Load", 12), fact("Filter", 5000), fact("Gain", 100)],
        "date": [fact("Date", "05.03.2024"), fact("Start", "10:20:30")],
    }[how["preamble"]]
    if how["time_at"] == "none":
        rate = f"{known.rate:g}".replace(".", how["decimal"])
        facts += {
            "option": [], "# fs": [f"# fs = {rate} Hz"], "Sample rate": [fact("Sample rate", rate)],
            "Sampling Frequency (Hz)": [fact("Sampling Frequency (Hz)", rate)],
            "dt": [fact("dt", f"{1 / known.rate:.12g}".replace(".", how["decimal"]))],
            "kHz": [fact("Sampling rate", f"{known.rate / 1000:.9g} kHz".replace(".", how["decimal"]))],
            "Abtastrate": [fact("Abtastrate", f"{rate} Hz")],
        }[how["rate_at"]]  # fmt: skip
    return [how["comment"] + line for line in facts]


def _footer(columns, how):
    return {
        "none": [], "end": ["End of file"], "blank": ["", "  ", ""], "comment": ["# end"],
        "statistics": ["", _line(["Mean", *["0"] * (len(columns) - 1)], how, part="rows")],
    }[how["footer"]]  # fmt: skip


def _write(path, text, how):
    if how["encoding"] == "utf-16":
        data = b"\xff\xfe" + text.encode("utf-16-le")
    elif how["encoding"] == "utf-16-be":
        data = b"\xfe\xff" + text.encode("utf-16-be")
    else:
        data = text.encode(how["encoding"], "replace" if how["encoding"] == "cp1252" else "strict")
    path.write_bytes(gzip.compress(data) if how["gzip"] else data)


def _expected(known, how, gaps, lost, rate_tolerance):
    samples = known.samples.copy()
    samples[0, gaps] = np.nan
    if isinstance(lost, int):
        samples[:, lost] = np.nan
    names, units = known.names, known.units
    if how["encoding"] == "cp1252":
        names, units = (tuple(_western(x) for x in texts) for texts in (names, units))
    options = {}
    if how["time_at"] == "none" and how["rate_at"] == "option":
        options["sampling_rate"] = known.rate
    return Expected(
        names=names, units=units if how["units_at"] != "none" else ("",) * len(units), samples=tuple(samples),
        rate=known.rate, options=options, rate_tolerance=rate_tolerance,
        loose_names=how["separator"] in "  ",
        whole_names=how["units_at"] in ("slash", "comma", "dash"), extra=frozenset({"valid"}),
        tolerance={"fixed": 1e-7 / abs(known.samples).max(axis=1).min(), "single": 1e-6}.get(how["number"], 1e-8),
        doubts=frozenset({"rounded-times"}) if how["spoilt"].startswith("row ") else frozenset(),
        shorter=1 if lost == "torn" or how["spoilt"] == "short row" else 0,
    )  # fmt: skip


def _western(text):
    return text.encode("cp1252", "replace").decode("cp1252")
