"""Verification: sheets of spreadsheets, written part by part as ISO/IEC 29500 describes them."""

import base64
import sys
import zipfile
import zlib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.formats.excel_sheets import date_text

# Written by xlwt 1.3: sheets Notes, Run 1 (sample rate 2000; a1 = x in m/s²; tacho true for odd k; a remark) and
# Clock (32 rows a second from 2023-05-04 10:30; a = x), of 30 rows each, with x = (7k mod 30)/4 - 3.
BY_XLWT = (
    "eNrtmm2IVFUYx597Z+687by/7OzM7MtNyMx3qQ+h7K5auZ9SM8jQJGfdwbV1dmV2JbYgLV0KQgiiD0VlgiIhaC/gCwVZnyIFIwMhCrWSPkgfgrIw"
    "3ek8zzlz5zg9Ay7U1sZ9hjn33nP/v+ecc8+5978zO1+cS1w68F7+MjRED3hgshoEn1ZniHeidhAHcb5axd3aVlRB1Y0ZFcGAmDWfBR9GzvpxDnG+"
    "L4MJ73o/ESXAd+L9OOyA1SPDJXsaYyX1oWhgH7oNn1h7pliRb4gyCjnqWZLKLVSmqDxG6o+oXE41+6jsFtpLxgY417t67n1qJT9mzqJzUVEacIKY"
    "r6lmCWTgM1zJu142pNaCFZVtxe0z7ESnNwwHQUxqX2m4VMHjdjgEWYBxEQvK5QUDA/bg4NJyeeno6MLFixdfgrSY/YPwa9UG+KV2m5+23frprTdA"
    "1P9+a72/SX1AzGhj/SumF2A3VDcbuLInIAJPevGMJe7hsdIoVpy2ZMW6ncP2Eqz4Kiwr7t8+smXoBqwRiYHeYvmUiwMlu3+8BeCRYnnH9pJdKY6V"
    "ggDFJfbG8qLR9zeJZGPFLYMj4tFRKZWLlSHRXP/O8g6xeWqwNCxWZTEkUsknTfyWJ02E7r6wKAcgRvsJugfjovEb7/z85UP9a3ufoJrd1B3pQXfi"
    "CKEKzyEh4KhzRpZziZhH5fOUtUD7eSrTYpxiO3ttRu2s2kOavXR2tmjnHorzvXdp+3PE/sTVh092Tnzfe7fYP9p3+en00Qu9B2AWBEXvDXrtgfnG"
    "fOP11zBO9da2hnpWfUtl7i/PrYAZV32vKqONwU0I0a702x4zCcdRKp5r9ZiOq3oHlZ4ZfFVN9qriiJ81QzT2BKzsknqTxnqr3iQ9lvII9R7nyBRH"
    "XtWap6E1zO8h+ppwWssMiCODZhTVXkbtJXVsUqq9pDZIbTX0DNUWqc/gnSvUlsqN/bKoX5Zqyce05CP2BY9kfVpLfkbtJ3VSteTXRhFg1AFS992U"
    "owhouYOMOuhcX1QHtdwhRh0i9cemVIe03C2MuoXUz1hS3aLlDjPqMKl33ZD9Dmu5I4w6QuplamYjWu4oo46S+jdD9iSq5Y4x6hipo+qaxLTccUYd"
    "J/WJP2RP4lruBKNOkHpS9Tuh5U4y6iSpF6l+J7XcKUadIvVVtapSWu40o06T+rBPqtNa7gyjzpD6iFpVGS13K6NuJfVWdQVbtdxZRp0ldUips1ru"
    "NkbdRuqLalW1ablzjDpH6uvqeue03HlGnSf1fqXOa7kLjLpA6o3qbihoudsZdTups6rf7VruDkbdQeqCuhs6tNydjLqT1BfUk6tTy93FqLtI7VPX"
    "u0vLbTNqm9RrvFJtq9zkifBveGKX8pX/myf6lHtIT/QrvdGg95hRqktSxerqleU4RwYx6HM1H21k5Ge2hZ/WGTkL6HaceyLjIWbTXsNhpIOeaeKh"
    "yHiJeWmV6TDSR9Hrak7ayFjEnAp4HEa6abKJgyLjI+bHz+uMdFH0Pc5HkfET07rP6zB+ZyVybopMgJgH1lgOIx0VPZDzVGSCxFQSPoeRvopOyDkr"
    "MiFi3j5fZ6S7oh9y/opMCzHnXvU7jPTYZWodhBkmTMzN9QGHkU6L3sh5LTIRYublgw4j/TbaxHGRiRKz4Zs6I10XfZLzXWRixLz4VshhpPdOqvHE"
    "GSZOzPHNLQ4jHXiRGk+CYRLE/DAr7DDSh696eCdGJklM6kqdkW6M/sn5MTIpYlYcjjiM9OQjao2mGSZNzMi2qMNIZ96qrnWGYTLEvDkv5jDSn0NN"
    "HBqZVmLO/lRnpEtfVGs0yzBZYq4fizuM9Orran7aGKaNmDmVhMNIx96vmBzD5Ih59N6kw0jf3mjyzo1MnpiJa3VGundWjafAMAViPjiZchjp4QV1"
    "z7UzTDsxwhMcRjr5BfUc7WCYDmLi3RmHkX7ua+LoyHQS01OtM9LV0Yebe68bbrjhhhtuuOGGG2648d8NQ32Thd+0eOl/gPL7Mr/6B2BQ/V2Pn/TD"
    "9D0a0CfrmPrdh/ggWZ10f0YxY2MdjIjXGNjwIAyLbQXGp7R+WsEyarmM22RqvxfCWC9ar8AQ9FM/hqa8fpNgGvp4bhu0/75baKrtT06ln/9w+38C"
    "Jfdrwg=="
)

X = np.round(np.sin(np.arange(30)), 6)
PACKAGE = "http://schemas.openxmlformats.org/package/2006/relationships"
OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def cell(place, value):
    """A cell with a number, text in place, or a pair of the attributes and the value as they are to stand."""
    if isinstance(value, tuple):
        return f'<c r="{place}" {value[0]}><v>{value[1]}</v></c>'
    if isinstance(value, str):
        return f'<c r="{place}" t="inlineStr"><is><t>{value}</t></is></c>'
    return f'<c r="{place}"><v>{value!r}</v></c>'


def sheet(rows):
    """Rows of cells; None leaves a cell out."""
    text = ""
    for r, row in enumerate(rows, 1):
        cells = "".join(cell(f"{chr(65 + c)}{r}", value) for c, value in enumerate(row) if value is not None)
        text += f'<row r="{r}">{cells}</row>'
    return f'<worksheet xmlns="{MAIN}"><sheetData>{text}</sheetData></worksheet>'


def xlsx(path, sheets, *, texts=(), styles="", book=""):
    """A file of sheets, each a list of rows or XML."""
    names = "".join(f'<sheet name="{name}" sheetId="{i}" r:id="r{i}"/>' for i, name in enumerate(sheets))
    relations = "".join(
        f'<Relationship Id="r{i}" Type="{OFFICE}/worksheet" Target="worksheets/s{i}.xml"/>' for i in range(len(sheets))
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/_rels/workbook.xml.rels", f'<Relationships xmlns="{PACKAGE}">{relations}</Relationships>')
        workbook = f'<workbook xmlns="{MAIN}" xmlns:r="{OFFICE}">{book}<sheets>{names}</sheets></workbook>'
        archive.writestr("xl/workbook.xml", workbook)
        if texts:
            items = "".join(f"<si>{text}</si>" for text in texts)
            archive.writestr("xl/sharedStrings.xml", f'<sst xmlns="{MAIN}">{items}</sst>')
        if styles:
            archive.writestr("xl/styles.xml", f'<styleSheet xmlns="{MAIN}">{styles}</styleSheet>')
        for i, rows in enumerate(sheets.values()):
            archive.writestr(f"xl/worksheets/s{i}.xml", rows if isinstance(rows, str) else sheet(rows))
    return path


def table(head, x=X):
    return [*head, *([i / 2, float(value)] for i, value in enumerate(x))]


def texts(recording):
    return [note.text for note in recording.notes]


def test_a_sheet_with_names_and_units(tmp_path):
    path = xlsx(tmp_path / "run.xlsx", {"Run 1": table([["bench", "no 7"], [], ["time [ms]", "a1 [m/s²]"]])})
    (channel,) = read_recording(path).channels
    assert (channel.name, channel.unit, channel.sampling_rate) == ("a1", "m/s²", pytest.approx(2000))
    assert_array_equal(channel.samples, X)


def test_a_rate_above_the_table(tmp_path):
    rows = [["Sample rate", 2000], [], ["a1", "a2"], *([float(x), float(-x)] for x in X)]
    read = read_recording(xlsx(tmp_path / "run.xlsx", {"Run": rows}))
    assert [(one.name, one.sampling_rate) for one in read.channels] == [("a1", 2000), ("a2", 2000)]
    assert_array_equal(read.channels[1].samples, -X)


def test_the_first_sheet_with_a_table_or_the_one_that_is_named(tmp_path):
    head = [["time [ms]", "a"]]
    path = xlsx(tmp_path / "run.xlsx", {"Notes": [["by", "me"]], "A": table(head), "B": table(head, X + 1)})
    read = read_recording(path)
    assert_array_equal(read.channels[0].samples, X)
    assert "sheet A of 3 was read; variable names another" in texts(read)
    assert_array_equal(read_recording(path, variable="B").channels[0].samples, X + 1)
    with pytest.raises(InputError, match="holds no sheet 'C'; known: A, B, Notes"):
        read_recording(path, variable="C")
    with pytest.raises(InputError, match="holds no table of numbers in its first"):
        read_recording(path, variable="Notes")
    path = xlsx(tmp_path / "run.xlsx", {"Notes": [["by", "me"]], "More": []})
    with pytest.raises(InputError, match="holds no table of numbers in its sheets: Notes, More"):
        read_recording(path)


def test_cells_of_other_kinds(tmp_path):
    """Shared texts of several runs with a reading aid, flags, errors, an empty cell, a formula with its value."""
    shared = ["<r><t>ti</t></r><r><t>me [ms]</t></r>", '<t>a1 "x"</t><rPh sb="0" eb="1"><t>reading</t></rPh>']
    many = np.round(np.sin(np.arange(300)), 6)
    rows = [[("t='s'", 0), ("t='s'", 1), "on"], *([i / 2, float(x), ("t='b'", i % 2)] for i, x in enumerate(many))]
    rows[4][1], rows[6][1], rows[8][1] = ("t='e'", "#N/A"), None, ("", "0.125")
    read = read_recording(xlsx(tmp_path / "run.xlsx", {"Run": rows}, texts=shared), channels=["a1 'x'"])
    expected = many.copy()
    expected[3], expected[5], expected[7] = (many[2] + many[4]) / 2, (many[4] + many[6]) / 2, 0.125
    assert_allclose(read.channels[0].samples, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("code", "days", "epoch"),
    [
        ('<numFmt numFmtId="164" formatCode="yyyy\\-mm\\-dd hh:mm:ss.000"/>', 45_050.4375, ""),
        ('<numFmt numFmtId="164" formatCode="[$-407]h:mm:ss.000"/>', 0.25, ""),
        ('<numFmt numFmtId="164" formatCode="[h]:mm:ss.0"/>', 0.25, ""),
        ('<numFmt numFmtId="164" formatCode="dd/mm/yyyy hh:mm"/>', 40_000.5, '<workbookPr date1904="1"/>'),
        ("", 45_050.4375, ""),
    ],
)
def test_dates_are_times(tmp_path, code, days, epoch):
    style = 164 if code else 22
    styles = f'<numFmts>{code}</numFmts><cellXfs><xf numFmtId="0"/><xf numFmtId="{style}"/></cellXfs>'
    rows = [["when", "a"], *([("s='1'", repr(days + i / 86_400 / 64)), float(x)] for i, x in enumerate(X))]
    read = read_recording(xlsx(tmp_path / "run.xlsx", {"Run": rows}, styles=styles, book=epoch))
    (channel,) = read.channels
    assert (channel.name, channel.sampling_rate) == ("a", pytest.approx(64, rel=1e-5))


@pytest.mark.parametrize(
    "code", ["0.00", "General", "0.0&quot; days&quot;", "#,##0.00 [$EUR]", "[Red]0.0", "0.00E+00", "0\\d"]
)
def test_numbers_with_other_formats_are_numbers(tmp_path, code):
    styles = f'<numFmts><numFmt numFmtId="164" formatCode="{code}"/></numFmts><cellXfs><xf numFmtId="164"/></cellXfs>'
    rows = [["a", "b"], *([("s='0'", repr(float(x))), 2 * float(x)] for x in X)]
    read = read_recording(xlsx(tmp_path / "run.xlsx", {"Run": rows}, styles=styles), sampling_rate=10)
    assert_array_equal(read.channel("a").samples, X)


@pytest.mark.parametrize(
    ("days", "since_1904", "text"),
    [
        (41_462.5, False, "2013-07-07 12:00:00.000000"),
        (40_000.5, True, "2013-07-07 12:00:00.000000"),
        (0.75, True, "18:00:00.000000"),
        (1e300, False, ""),
    ],
)
def test_days_since_1900_or_1904(days, since_1904, text):
    assert date_text(days, since_1904=since_1904) == text


def test_words_among_numbers_are_refused_by_row(tmp_path):
    rows = table([["time [ms]", "a1"]])
    rows[11][1] = "OVLD"
    with pytest.raises(InputError, match=r"line 12.*OVLD"):
        read_recording(xlsx(tmp_path / "run.xlsx", {"Run": rows}))


def test_a_file_of_excel_97(tmp_path):
    (tmp_path / "run.xls").write_bytes(zlib.decompress(base64.b64decode(BY_XLWT)))
    expected = np.arange(30) * 7 % 30 / 4 - 3
    read = read_recording(tmp_path / "run.xls", channels=["a1"])
    assert [(one.name, one.unit, one.sampling_rate) for one in read.channels] == [("a1", "m/s²", 2000)]
    assert_array_equal(read.channels[0].samples, expected)
    assert "sheet Run 1 of 3 was read; variable names another" in texts(read)
    read = read_recording(tmp_path / "run.xls", variable="Clock")
    assert_array_equal(read.channels[0].samples, expected)
    assert read.channels[0].sampling_rate == pytest.approx(32, rel=1e-5)


def test_xls_without_its_library(tmp_path, monkeypatch):
    (tmp_path / "run.xls").write_bytes(zlib.decompress(base64.b64decode(BY_XLWT)))
    monkeypatch.setitem(sys.modules, "xlrd", None)
    with pytest.raises(InputError, match=r"needs xlrd, which is not installed: pip install xlrd"):
        read_recording(tmp_path / "run.xls")


HEAD = f'<worksheet xmlns="{MAIN}"><sheetData>'
END = "</sheetData></worksheet>"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (
            '<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>',
            "16384 columns",
        ),
        ('<row r="9999999"><c r="A1"><v>1</v></c></row>', "row 9999999 follows row 0"),
        ('<row r="5"/><row r="4"/>', "row 4 follows row 5"),
        ('<row r="1"><c r="B1"><v>1</v></c><c r="A1"><v>1</v></c></row>', "the cells of row 1 are not in order"),
        ('<row r="1"><c r="A1" t="s"><v>7</v></c></row>', "refers to a text that is not there"),
        ('<row r="1"><c r="A1"><v>x</v></c></row>', "cannot be read as XLSX"),
        ('<row r="1"><c r="A1"><v>1</v></c>', "cannot be read as XLSX"),
    ],
)
def test_damaged_sheets(tmp_path, rows, message):
    with pytest.raises(InputError, match=message):
        read_recording(xlsx(tmp_path / "run.xlsx", {"Run": HEAD + rows + END}), sampling_rate=10)


def test_bombs(tmp_path):
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 9))
    bomb = f'<!DOCTYPE x [<!ENTITY a0 "aaaaaaaaaa">{entities}]>{HEAD}<row r="1"><c><v>&a8;</v></c></row>{END}'
    with pytest.raises(InputError, match="holds a document type, which spreadsheets do not have"):
        read_recording(xlsx(tmp_path / "run.xlsx", {"Run": bomb}), sampling_rate=10)
    path = xlsx(tmp_path / "run.xlsx", {"Run": HEAD + " " * 2**26 + END})
    with pytest.raises(InputError, match="which measured numbers do not do"):
        read_recording(path, sampling_rate=10)
    far = "".join(f'<row r="{r}"><c r="ALJ{r}"><v>1</v></c></row>' for r in range(1, 9000))
    with pytest.raises(InputError, match="more than 8388608 cells; export it as CSV"):
        read_recording(xlsx(tmp_path / "run.xlsx", {"Run": HEAD + far + END}), sampling_rate=10)
