"""Markdown: tables of the cards."""

from collections.abc import Iterable, Sequence


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown.

    Parameters
    ----------
    head
        Headings of the columns.
    rows
        Texts of the cells; a vertical bar in one is escaped.

    Examples
    --------
    >>> print(markdown_table(("axis", "unit"), [("torque", "N m"), ("|x|", "-")]))
    | axis | unit |
    | --- | --- |
    | torque | N m |
    | \\|x\\| | - |
    """
    lines = ([text.replace("|", "\\|") for text in cells] for cells in (head, *rows))
    first, *others = ("| " + " | ".join(cells) + " |" for cells in lines)
    return "\n".join([first, "|" + " --- |" * len(head), *others])
