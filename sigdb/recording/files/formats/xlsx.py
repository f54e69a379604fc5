"""XLSX: sheets of Office Open XML (ISO/IEC 29500-1), without formulas, charts or macros."""

import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.parsers import expat

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import Contents, check_bytes, check_columns, check_parts, check_ratio
from sigdb.recording.files.formats.excel_sheets import Sheet, check_cells, contents_of_sheets, date_text, plain
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = (
    zipfile.BadZipFile, zlib.error, expat.ExpatError, EOFError, NotImplementedError, RuntimeError, ValueError, OSError,
)  # fmt: skip

MOST_ROWS = 2**20
_DATES = {*range(14, 23), 27, 30, 36, *range(45, 48), 50, 57}
_NOT_DATE = re.compile(r'"[^"]*"|\\.|\[[^\]hms]*\]|_.|\*.')
_CELL = re.compile(r"([A-Z]{1,3})([0-9]{1,7})")


def read_xlsx(path: Path, settings: RecordingSettings) -> Contents:
    """Read the first sheet that holds a table of numbers, or the sheet that ``variable`` names."""
    check_bytes(path.stat().st_size)
    with zipfile.ZipFile(path) as archive:
        members = {info.filename.lstrip("/"): info for info in archive.infolist()}
        check_parts(len(members))
        check_ratio(sum(info.file_size for info in members.values()), path.stat().st_size)
        book = _Book(archive, members)
        wanted = [(name, member) for name, member in book.sheets.items() if settings.variable in (None, name)]
        return contents_of_sheets((book.sheet(name, member) for name, member in wanted), list(book.sheets), settings)


class _Book:
    """A workbook: its sheets by name, its texts, and its formats of dates."""

    def __init__(self, archive: zipfile.ZipFile, members: dict[str, zipfile.ZipInfo]) -> None:
        self._archive, self._members = archive, members
        self._since_1904 = False
        self.sheets = self._named_sheets()
        self._texts = list(self._shared_texts())
        self._dates = list(self._formats_of_dates())

    def sheet(self, name: str, member: str) -> Sheet:
        """Return the cells of a sheet."""
        cells = _Cells(self._texts, self._dates, since_1904=self._since_1904)
        self._parse(member, start=cells.start, end=cells.end, text=cells.text)
        return Sheet(name=name, rows=cells.rows, rows_of_numbers=cells.rows_of_numbers)

    def _parse(
        self,
        member: str,
        *,
        start: Callable[[str, dict[str, str]], None],
        end: Callable[[str], None] | None = None,
        text: Callable[[str], None] | None = None,
    ) -> None:
        """Run the handlers over a part; a part with a document type is refused, since it may expand without end."""
        if member not in self._members:
            raise InputError(f"is damaged: it has no part {plain(member)[:80]!r}")
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = _refuse_document_type
        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.CharacterDataHandler = text
        with self._archive.open(self._members[member]) as file:
            parser.ParseFile(file)

    def _named_sheets(self) -> dict[str, str]:
        """Return the part of each sheet by its name."""
        targets: dict[str, str] = {}
        names: dict[str, str] = {}

        def relation(tag: str, attributes: dict[str, str]) -> None:
            if _local(tag) == "Relationship" and attributes.get("Type", "").endswith("/worksheet"):
                target = attributes.get("Target", "")
                targets[attributes.get("Id", "")] = target[1:] if target.startswith("/") else f"xl/{target}"

        def sheet(tag: str, attributes: dict[str, str]) -> None:
            if _local(tag) == "sheet":
                id_ = next((value for key, value in attributes.items() if key.endswith(" id")), "")
                names[plain(attributes.get("name", ""))] = id_
            elif _local(tag) == "workbookPr":
                self._since_1904 = attributes.get("date1904", "0") in ("1", "true")

        self._parse("xl/_rels/workbook.xml.rels", start=relation)
        self._parse("xl/workbook.xml", start=sheet)
        return {name: targets[id_] for name, id_ in names.items() if id_ in targets}

    def _shared_texts(self) -> Iterator[str]:
        if "xl/sharedStrings.xml" not in self._members:
            return
        items: list[list[str]] = []
        state = {"in_text": False, "phonetic": False}

        def start(tag: str, attributes: dict[str, str]) -> None:
            name = _local(tag)
            if name == "si":
                items.append([])
            state["phonetic"] = state["phonetic"] or name == "rPh"
            state["in_text"] = name == "t" and not state["phonetic"]

        def end(tag: str) -> None:
            state["in_text"] = False
            state["phonetic"] = state["phonetic"] and _local(tag) != "rPh"

        def text(data: str) -> None:
            if state["in_text"] and items:
                items[-1].append(data)

        self._parse("xl/sharedStrings.xml", start=start, end=end, text=text)
        yield from (plain("".join(parts)) for parts in items)

    def _formats_of_dates(self) -> Iterator[bool]:
        """Yield for each style of cells whether it shows numbers as dates or clock times."""
        if "xl/styles.xml" not in self._members:
            return
        custom: dict[str, bool] = {}
        styles: list[str] = []
        state = {"cells": False}

        def start(tag: str, attributes: dict[str, str]) -> None:
            name = _local(tag)
            if name == "numFmt":
                code = _NOT_DATE.sub("", attributes.get("formatCode", "").split(";")[0]).lower()
                custom[attributes.get("numFmtId", "")] = any(letter in code for letter in "dyhs") or "mm" in code
            elif name == "cellXfs":
                state["cells"] = True
            elif name == "xf" and state["cells"]:
                styles.append(attributes.get("numFmtId", "0"))

        def end(tag: str) -> None:
            state["cells"] = state["cells"] and _local(tag) != "cellXfs"

        self._parse("xl/styles.xml", start=start, end=end)
        yield from (custom.get(style, style.isdigit() and int(style) in _DATES) for style in styles)


class _Cells:
    """Handlers that collect the rows of a sheet as fields of text."""

    def __init__(self, texts: list[str], dates: list[bool], *, since_1904: bool) -> None:
        self.rows: list[list[str]] = []
        self.rows_of_numbers = 0
        self._texts, self._dates, self._since_1904 = texts, dates, since_1904
        self._kind, self._style, self._column = "n", 0, 0
        self._parts: list[str] = []
        self._cells = 0
        self._reads = False
        self._numbers = False

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Note where the next value belongs."""
        name = _local(tag)
        if name == "row":
            self._begin_row(int(attributes.get("r", len(self.rows) + 1)))
        elif name == "c" and self.rows:
            self._begin_cell(attributes)
        elif name in ("v", "t"):
            self._reads = True

    def text(self, data: str) -> None:
        """Add to the value of the cell."""
        if self._reads:
            self._parts.append(data)

    def end(self, tag: str) -> None:
        """Put the value of a cell into its row."""
        name = _local(tag)
        if name in ("v", "t"):
            self._reads = False
        elif name == "c" and self.rows:
            self.rows[-1].append(self._field("".join(self._parts)))
        elif name == "row":
            self.rows_of_numbers += self._numbers
            self._numbers = False

    def _begin_row(self, number: int) -> None:
        if not len(self.rows) < number <= MOST_ROWS:
            raise InputError(f"is damaged: row {number} follows row {len(self.rows)}")
        self.rows += [[]] * (number - len(self.rows) - 1)  # rows between are never added to
        self.rows.append([])

    def _begin_cell(self, attributes: dict[str, str]) -> None:
        row = self.rows[-1]
        place = _CELL.fullmatch(attributes.get("r", ""))
        column = len(row)
        if place:
            column = 0
            for letter in place[1]:
                column = 26 * column + ord(letter) - ord("A") + 1
            column -= 1
        check_columns(column + 1)
        if column < len(row):
            raise InputError(f"is damaged: the cells of row {len(self.rows)} are not in order")
        self._cells += column + 1 - len(row)
        check_cells(self._cells)
        row.extend([""] * (column - len(row)))
        self._kind, style = attributes.get("t", "n"), attributes.get("s", "0")
        self._style = int(style) if style.isdigit() else 0
        self._parts = []

    def _field(self, value: str) -> str:
        value = value.strip()
        if self._kind == "s":
            if not value.isdigit() or int(value) >= len(self._texts):
                raise InputError(f"is damaged: row {len(self.rows)} refers to a text that is not there")
            return self._texts[int(value)]
        if self._kind == "b":
            return "TRUE" if value == "1" else "FALSE"
        if self._kind == "e" or not value:
            return ""
        if self._kind == "d":
            return plain(value.replace("T", " "))
        if self._kind != "n":
            return plain(value)
        number = float(value)
        self._numbers = True
        if self._style < len(self._dates) and self._dates[self._style]:
            return date_text(number, since_1904=self._since_1904)
        return value


def _local(tag: str) -> str:
    return tag.rpartition(" ")[2]


def _refuse_document_type(*_: object) -> None:
    raise InputError("holds a document type, which spreadsheets do not have")
