"""Tables of text: any width and no colours in a file or a pipe; within the width of a terminal."""

import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any, TypeVar

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from sigdb.core import visible_text

if TYPE_CHECKING:
    import pandas as pd

Row = TypeVar("Row")

Column = tuple[str, Callable[[Row], str]]
"""A heading, and a function from a row to its text in that column."""

_GAP = 2
_ANY_WIDTH = 1_000_000
_LEAST_WIDTH = 16
"""Characters below which a column of words is not made narrower."""
_WHOLE_LIST = 6
"""Items up to which a list is shown whole."""


@dataclass(frozen=True, kw_only=True)
class Terminal:
    """Where text is shown.

    Attributes
    ----------
    width
        Characters in a line; None for any number of them, as in a file or a pipe.
    styled
        Whether it shows bold text and rules.
    """

    width: int | None = None
    styled: bool = False

    @classmethod
    def of(cls, stream: IO[Any]) -> "Terminal":
        """Return the terminal that a stream writes to; without limit and style if it is a file or a pipe."""
        if not stream.isatty():
            return cls()
        console = Console(file=stream)
        return cls(width=console.width, styled=console.color_system is not None and "NO_COLOR" not in os.environ)


PLAIN = Terminal()


@dataclass(frozen=True)
class TextTable:
    """A table of texts, for text, Markdown or a page.

    Attributes
    ----------
    head
        Headings of the columns.
    rows
        Texts of the cells, row by row. Characters that steer a terminal are escaped.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "head", [visible_text(cell, lines=False) for cell in self.head])
        object.__setattr__(self, "rows", [[visible_text(cell, lines=False) for cell in row] for row in self.rows])

    @classmethod
    def of(cls, columns: Sequence[Column[Row]], rows: Iterable[Row]) -> "TextTable":
        """Return the table whose columns read the rows."""
        return cls([head for head, _ in columns], [[cell(row) for _, cell in columns] for row in rows])

    @classmethod
    def of_records(cls, names: Sequence[str], records: Iterable[Mapping[str, object]]) -> "TextTable":
        """Return the table of some keys of records, with their values as text."""
        return cls(names, [[value_text(record[name]) for name in names] for record in records])

    @classmethod
    def of_frame(cls, frame: "pd.DataFrame") -> "TextTable":
        """Return the table of a frame, with its values as text."""
        return cls(
            [str(name) for name in frame],
            [[value_text(value) for value in row] for row in frame.itertuples(index=False)],
        )

    def text(self, terminal: Terminal = PLAIN, *, indent: int = 0) -> str:
        """Return aligned text: numbers to the right, words to the left.

        A table that is too wide for the terminal folds its words. Where that is not enough, its columns follow in
        blocks, each of which begins with the first column. No cell is cut.
        """
        width = _ANY_WIDTH if terminal.width is None else max(terminal.width - indent, 1)
        numeric = [all(_is_number(row[i]) for row in self.rows) for i in range(len(self.head))]
        blocks = _blocks([self._least(i, numeric[i]) for i in range(len(self.head))], width)
        parts = [self._block(columns, numeric, width, terminal.styled) for columns in blocks]
        return "\n\n".join("\n".join(" " * indent + line for line in part) for part in parts)

    def _least(self, column: int, numeric: bool) -> int:
        """Return the least width of a column."""
        longest = max(cell_len(cells[column]) for cells in (self.head, *self.rows))
        return longest if numeric else min(longest, _LEAST_WIDTH)

    def _block(self, columns: Sequence[int], numeric: Sequence[bool], width: int, styled: bool) -> list[str]:
        """Return the lines of some columns, which stand next to each other."""
        gap = _GAP - 1 if styled else _GAP  # a box has a space between columns
        grid = Table(box=box.SIMPLE_HEAD if styled else None, show_edge=False, padding=(0, gap, 0, 0), pad_edge=False)
        width = max(width, sum(self._least(i, numeric[i]) + _GAP for i in columns))
        for i in columns:
            grid.add_column(
                Text(self.head[i], style="bold" if styled else ""),
                justify="right" if numeric[i] else "left",
                no_wrap=numeric[i],
                min_width=self._least(i, numeric[i]),
                overflow="fold",
            )
        for row in self.rows:
            grid.add_row(*(Text(row[i]) for i in columns))
        out = io.StringIO()
        Console(file=out, width=width, force_terminal=styled, color_system="standard" if styled else None).print(grid)
        return [line.rstrip() for line in out.getvalue().splitlines()]


def _blocks(widths: Sequence[int], available: int) -> list[list[int]]:
    """Return the columns of each block: as many as fit after the first column."""
    blocks = [[0]]
    for i in range(1, len(widths)):
        if len(blocks[-1]) > 1 and sum(widths[j] + _GAP for j in (*blocks[-1], i)) - _GAP > available:
            blocks.append([0])
        blocks[-1].append(i)
    return blocks


def number(value: float | None, digits: int = 4) -> str:
    """Return a number with its significant digits, or a dash for none and nan."""
    return "-" if value is None or value != value else f"{value:.{digits}g}"


def word(value: object) -> str:
    """Return a value as a word, or a dash for none."""
    return "-" if value is None else str(value)


def value_text(value: object) -> str:
    """Return a value of a result: six digits of a number, the beginning of a long list, a dash for none."""
    if value is None or value != value:
        return "-"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        shown = [value_text(item) for item in value[: _WHOLE_LIST if len(value) <= _WHOLE_LIST else 3]]
        return f"[{', '.join(shown)}{f', ... {len(value)} in all' if len(value) > len(shown) else ''}]"
    return str(value)


def _is_number(text: str) -> bool:
    text = text.strip("()")
    return text in ("-", "...") or text.replace(".", "").replace("-", "").replace("e", "").replace("+", "").isdigit()
