"""The evaluation of a model as text for a terminal."""

import textwrap

from sigdb.recognition import (
    EstimateTable,
    Evaluation,
    bound_text,
    criteria_table,
    efficiency_cells,
    limitation_texts,
    metric_table,
)
from sigdb.report.text_table import PLAIN, Terminal, TextTable

_WIDTH = 120


def evaluation_text(evaluation: Evaluation, *, terminal: Terminal = PLAIN) -> str:
    """Return the metrics of an evaluation, its comparison with the bound and its criteria as text.

    Parameters
    ----------
    evaluation : Evaluation
        From :func:`sigdb.recognition.evaluate`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    rows = f"{evaluation.rows} rows of {evaluation.specimens} specimens"
    lines = [
        f"{evaluation.target}: {rows}. {evaluation.split}, {evaluation.split_text}.",
        _table(metric_table(evaluation)).text(terminal),
        f"In brackets: 95 % interval over specimens. {bound_text(evaluation)}",
    ]
    if efficiency := efficiency_cells(evaluation):
        lines += ["", "Against the best possible, by signal-to-noise ratio of one revolution:"]
        lines += [_table(efficiency).text(terminal)]
    lines += [_filled(text, terminal) for text in limitation_texts(evaluation)]
    if criteria := criteria_table(evaluation):
        table = _table(criteria)
        without_reasons = TextTable(table.head[:-1], [row[:-1] for row in table.rows])
        lines += ["", "Criteria:", without_reasons.text(terminal)]
        lines += [_filled(f"{title}: {reason}", terminal) for title, *_, reason in table.rows if reason]
    return "\n".join(lines) + "\n"


def _table(table: EstimateTable) -> TextTable:
    head, *rows = table.lines
    return TextTable(head, rows)


def _filled(text: str, terminal: Terminal) -> str:
    return textwrap.fill(text, min(terminal.width or _WIDTH, _WIDTH), subsequent_indent="  ")
