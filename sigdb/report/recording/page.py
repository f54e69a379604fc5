"""The page of recordings' signatures: one file that needs no network, and the same as JSON."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sigdb.core import __version__
from sigdb.report.page import page
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
    text = page(
        "recording.html",
        title=title,
        history=_history(history) if history else None,
        signatures=[_signature(facts) for facts in signatures],
        numbers=NUMBERS,
    )
    (folder / PAGE).write_text(text, encoding="utf-8")
    return folder / PAGE


def _history(history: Sequence[Mapping[str, Any]]) -> dict[str, object]:
    return _table(history_columns(history), history) | {"picture": history_figure(history)}


def _signature(facts: Mapping[str, Any]) -> dict[str, object]:
    return {
        "source": facts["source"],
        "facts": fact_rows(facts),
        "notes": facts["notes"],
        "pictures": list(recorded_figures(facts)),
        "lines": _table(LINE_COLUMNS, [row for row in line_rows(facts) if row["found"]]),
        "indicators": _table(INDICATOR_COLUMNS, indicator_rows(facts)),
    }


def _table(columns: Sequence[Column], rows: Sequence[Any]) -> dict[str, object]:
    return {"head": [head for head, _ in columns], "rows": [[cell(row) for _, cell in columns] for row in rows]}
