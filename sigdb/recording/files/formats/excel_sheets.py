"""Sheets of spreadsheets as tables of text."""

import datetime
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from sigdb.core import InputError, Note, suggestion
from sigdb.recording.files.formats.contents import Contents, check_columns
from sigdb.recording.files.formats.text.reader import text_contents
from sigdb.recording.files.settings import RecordingSettings

FEWEST_ROWS = 3
"""Number of rows with numbers from which on a sheet holds a table."""


MOST_CELLS = 2**23
"""Largest number of cells of a sheet, with the empty ones between others."""


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A sheet: its name, its rows, each a list of fields as text, and the number of rows with numbers."""

    name: str
    rows: Sequence[Sequence[str]]
    rows_of_numbers: int


def contents_of_sheets(sheets: Iterable[Sheet], names: Sequence[str], settings: RecordingSettings) -> Contents:
    """Return the columns of a sheet: that which ``variable`` names, else the first with a table.

    Parameters
    ----------
    sheets
        The sheets; each is read when its turn comes.
    names
        Their names.
    settings
        Settings of reading.

    Raises
    ------
    InputError
        If there is no such sheet, or it holds no table of numbers.
    """
    if settings.variable is not None and settings.variable not in names:
        raise InputError(f"holds no sheet {settings.variable!r}{suggestion(settings.variable, names)}")
    for sheet in sheets:
        if settings.variable is None and sheet.rows_of_numbers < FEWEST_ROWS:
            continue
        contents = text_contents(_text(sheet), settings.model_copy(update={"separator": "\t", "decimal": "."}))
        notes = [note for note in contents.notes if note.code != "text-format"]
        if len(names) > 1:
            text = f"sheet {sheet.name} of {len(names)} was read; variable names another"
            notes.insert(0, Note(code="sheet", text=text, values={"sheet": sheet.name}))
        return replace(contents, notes=tuple(notes))
    raise InputError(f"holds no table of numbers in its sheets: {', '.join(names[:8])}")


def check_cells(cells: int) -> None:
    """Refuse more cells than ``MOST_CELLS``."""
    if cells > MOST_CELLS:
        raise InputError(f"holds a sheet of more than {MOST_CELLS} cells; export it as CSV")


def _text(sheet: Sheet) -> bytes:
    """Return the rows as lines of text with tabs between their fields."""
    width = max((len(row) for row in sheet.rows), default=0)
    check_columns(width)
    check_cells(width * sum(bool(row) for row in sheet.rows))
    lines = ("\t".join([*row, *[""] * (width - len(row))] if row else "") for row in sheet.rows)
    return "\n".join(lines).encode()


def plain(text: str) -> str:
    """Return a text in one line without tabs and double quotes, which have a meaning between fields."""
    return " ".join(text.replace('"', "'").split())


def date_text(days: float, *, since_1904: bool = False) -> str:
    """Return the date and clock time of a number of days; a clock time only for less than a day.

    Examples
    --------
    >>> date_text(45050.25), date_text(0.25)
    ('2023-05-04 06:00:00.000000', '06:00:00.000000')
    """
    if 0 <= days < 1:
        origin = datetime.datetime(2000, 1, 1)
    else:
        origin = datetime.datetime(1904, 1, 1) if since_1904 else datetime.datetime(1899, 12, 30)
    try:
        moment = origin + datetime.timedelta(days=days)
    except (OverflowError, ValueError):
        return ""
    return moment.isoformat(" ", "microseconds")[11 if 0 <= days < 1 else 0 :]
