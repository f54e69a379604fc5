"""The page of recordings' signatures: one file that needs no network, and the same as JSON."""

import html
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from sigdb.core import __version__
from sigdb.report.page import html_table, page, picture, png
from sigdb.report.recording.pictures import history_figure, recorded_figures
from sigdb.report.recording.tables import (
    INDICATOR_COLUMNS,
    LINE_COLUMNS,
    fact_rows,
    history_columns,
    indicator_rows,
    line_rows,
)
from sigdb.report.text_table import Column

PAGE, NUMBERS = "index.html", "signature.json"
"""Files of a report."""


def write_recorded_report(
    signatures: Sequence[Mapping[str, Any]],
    folder: str | Path,
    *,
    history: Sequence[Mapping[str, Any]] = (),
    title: str = "Signature of a recording",
) -> Path:
    """Write the page of recordings' signatures, ``index.html``, and what it shows, ``signature.json``.

    The page is one file, without scripts: pictures are in it.

    Parameters
    ----------
    signatures
        What :meth:`sigdb.pipeline.RecordedSignature.as_json` returns, of each recording.
    folder
        Where; made if it does not exist.
    history
        Rows of :func:`sigdb.recording.recorded_history`, where there are several recordings.
    title
        Heading of the page.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    numbers = {"signatures": list(signatures), "history": list(history), "sigdb_version": __version__}
    (folder / NUMBERS).write_text(json.dumps(numbers, allow_nan=False) + "\n", encoding="utf-8")
    footer = f"The same numbers are in {NUMBERS}. sigdb {html.escape(__version__)}."
    text = page(title, "\n".join(_body(signatures, history)), footer=footer, style=_STYLE)
    (folder / PAGE).write_text(text, encoding="utf-8")
    return folder / PAGE


def _body(signatures: Sequence[Mapping[str, Any]], history: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    if history:
        yield _table(history_columns(history), history)
        yield picture(*history_figure(history), embedded=png)
    for facts in signatures:
        yield from _signature(facts)


def _signature(facts: Mapping[str, Any]) -> Iterator[str]:
    yield f"<h2>{html.escape(facts['source'])}</h2>"
    yield _table((("", lambda row: row[0]), ("", lambda row: row[1])), fact_rows(facts))
    yield "<h3>Notes</h3>\n<ul>"
    yield from (f"<li>{html.escape(note)}</li>" for note in facts["notes"])
    yield "</ul>"
    for one in recorded_figures(facts):
        yield picture(*one, embedded=png)
    lines = [row for row in line_rows(facts) if row["found"]]
    if lines:
        yield f"<details><summary>{len(lines)} lines that stand out</summary>"
        yield _table(LINE_COLUMNS, lines)
        yield "</details>"
    yield "<h3>Indicators</h3>"
    yield _table(INDICATOR_COLUMNS, indicator_rows(facts))


def _table(columns: Sequence[Column], rows: Sequence[Any]) -> str:
    return html_table([head for head, _ in columns], [[cell(row) for _, cell in columns] for row in rows])


_STYLE = """
body { max-width: 60rem; }
h2 { margin-top: 2.2rem; overflow-wrap: anywhere; }
h3 { margin: 1.4rem 0 .4rem; }
th, td { white-space: normal; }
td:first-child { min-width: 0; }
figure img { max-width: none; }
li { color: #4a5565; font-size: .88rem; }
@media print { body { max-width: none; } table { font-size: .9rem; } figure { margin: 0; } figure img { width: 100%; } }
"""
