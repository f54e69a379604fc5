"""XLS: sheets of Excel 97 to 2003, read by xlrd."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import Contents, bounded_bytes, check_parts
from sigdb.recording.files.formats.excel_sheets import Sheet, contents_of_sheets, date_text, plain
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = ()

TEXT, NUMBER, DATE, FLAG = 1, 2, 3, 4


def read_xls(path: Path, settings: RecordingSettings) -> Contents:
    """Read the first sheet that holds a table of numbers, or the sheet that ``variable`` names."""
    try:
        import xlrd
    except ImportError:
        raise InputError("is XLS, which needs xlrd, which is not installed: pip install xlrd") from None
    data = bounded_bytes(path)
    try:
        book = xlrd.open_workbook(file_contents=data, logfile=io.StringIO(), ragged_rows=True, on_demand=True)
        names = [plain(name) for name in book.sheet_names()]
    except Exception as error:  # damaged files raise errors of any kind in xlrd
        raise _damaged(error) from None
    check_parts(len(names))
    return contents_of_sheets(_sheets(book, names, settings.variable), names, settings)


def _sheets(book: Any, names: list[str], wanted: str | None) -> Iterator[Sheet]:
    for i, name in enumerate(names):
        if wanted in (None, name):
            try:
                sheet = book.sheet_by_index(i)
                kinds = [list(sheet.row_types(row)) for row in range(sheet.nrows)]
                values = [sheet.row_values(row) for row in range(sheet.nrows)]
            except Exception as error:
                raise _damaged(error) from None
            yield _sheet(name, kinds, values, since_1904=bool(book.datemode))
            book.unload_sheet(i)


def _sheet(name: str, kinds: list[Any], values: list[list[Any]], *, since_1904: bool) -> Sheet:
    rows = [
        [_field(kind, value, since_1904=since_1904) for kind, value in zip(row_kinds, row, strict=True)]
        for row_kinds, row in zip(kinds, values, strict=True)
    ]
    numbers = sum(any(kind in (NUMBER, DATE) for kind in row) for row in kinds)
    return Sheet(name=name, rows=rows, rows_of_numbers=numbers)


def _field(kind: int, value: Any, *, since_1904: bool) -> str:
    if kind == NUMBER:
        return repr(float(value))
    if kind == DATE:
        return date_text(float(value), since_1904=since_1904)
    if kind == FLAG:
        return "TRUE" if value else "FALSE"
    return plain(str(value)) if kind == TEXT else ""


def _damaged(error: Exception) -> InputError:
    reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return InputError(f"cannot be read as XLS ({reason}); save it as XLSX")
