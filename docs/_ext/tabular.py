"""A table of text as docutils nodes, for the directives in this folder."""

from collections.abc import Collection, Sequence

from docutils import nodes

Cell = str | tuple[str, str]
"""Text, or text with a line of code below it."""


def text_table(
    head: Sequence[str], rows: Sequence[Sequence[Cell]], *, code: Collection[int] = (), sentence: int = -1
) -> nodes.table:
    """Return a table with a head; columns in ``code`` are set as code, and column ``sentence`` is wide."""
    group = nodes.tgroup(cols=len(head))
    group += [nodes.colspec(colwidth=1) for _ in head]
    group += nodes.thead("", _row(head))
    group += nodes.tbody("", *(_row(row, code, sentence) for row in rows))
    return nodes.table("", group, classes=["table", "generated"])


def _row(cells: Sequence[Cell], code: Collection[int] = (), sentence: int = -1) -> nodes.row:
    row = nodes.row()
    for i, cell in enumerate(cells):
        entry = nodes.entry("", classes=["sentence"] if i == sentence else [])
        first, below = cell if isinstance(cell, tuple) else (cell, "")
        entry += nodes.paragraph("", "", _inline(first, i in code))
        if below:
            entry += nodes.paragraph("", "", _inline(below, True))
        row += entry
    return row


def _inline(text: str, code: bool) -> nodes.Node:
    return nodes.literal("", text) if code and text else nodes.Text(text)
