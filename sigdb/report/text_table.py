"""Tables of text: columns that say how they read a row."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd

Column = tuple[str, Callable[[Any], str]]
"""A heading, and the text of a row in that column."""


def number(key: str, digits: int = 4, scale: float = 1.0) -> Callable[[Mapping[str, Any]], str]:
    """A number by its key, or a dash for none."""
    return lambda row: "-" if row[key] is None else f"{row[key] * scale:.{digits}g}"


def word(key: str) -> Callable[[Mapping[str, Any]], str]:
    """A word by its key, or a dash for none."""
    return lambda row: "-" if row[key] is None else str(row[key])


def lists(key: str) -> Callable[[Mapping[str, Any]], str]:
    """A list of numbers by its key."""
    return lambda row: " ".join(f"{one:g}" for one in row[key])


def hertz(key: str) -> Callable[[Mapping[str, Any]], str]:
    """A frequency by its key."""
    return lambda row: f"{row[key]:.6g}"


def rows_of(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a data frame, with None for numbers that are nan."""
    records = frame.astype(object).where(frame.notna(), None).to_dict("records")
    return [{str(name): value for name, value in record.items()} for record in records]


def table(columns: Sequence[Column], rows: Sequence[Any]) -> str:
    """Columns of text: numbers to the right, words to the left."""
    cells = [[head for head, _ in columns], *([cell(row) for _, cell in columns] for row in rows)]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    right = [all(_is_number(line[i]) for line in cells[1:]) for i in range(len(columns))]
    return "\n".join(
        "  "
        + "  ".join(
            cell.rjust(width) if to_right else cell.ljust(width)
            for cell, width, to_right in zip(line, widths, right, strict=True)
        ).rstrip()
        for line in cells
    )


def _is_number(text: str) -> bool:
    text = text.strip("()")
    return text == "-" or text.replace(".", "").replace("-", "").replace("e", "").replace("+", "").isdigit()
