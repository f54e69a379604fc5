"""The page of the signatures of recordings: one file that needs no network, and its numbers as JSON."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from sigdb.core import __version__, json_text, plain, publish_all
from sigdb.recording import RecordedSignature
from sigdb.report.page import page
from sigdb.report.recording.pictures import history_figure, recorded_figures
from sigdb.report.recording.tables import (
    envelope_table,
    fact_rows,
    history_table,
    indicator_table,
    line_table,
    repeatability_table,
)

PAGE, NUMBERS = "index.html", "signature.json"
"""Files of a report."""


def write_recorded_report(
    signatures: Sequence[RecordedSignature],
    folder: str | Path,
    *,
    history: pd.DataFrame | None = None,
    title: str = "Signature of a recording",
) -> Path:
    """Write the page of the signatures of recordings, ``index.html``, and its numbers, ``signature.json``.

    The page is one file without scripts; pictures are part of it.

    Parameters
    ----------
    signatures : sequence of RecordedSignature
        Signatures from :func:`sigdb.recording.recorded_signature`.
    folder : str or path-like
        Folder of the page; it is created if it does not exist.
    history : pandas.DataFrame, optional
        From :func:`sigdb.recording.recorded_history`, where there are several recordings.
    title : str
        Heading of the page.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    numbers = {
        "signatures": [signature.as_json() for signature in signatures],
        "history": [] if history is None else plain(history.to_dict("records")),
        "sigdb_version": __version__,
    }
    text = page(
        "recording.html",
        title=title,
        history=None if history is None else _history(history),
        signatures=[_signature(signature) for signature in signatures],
        numbers=NUMBERS,
    )
    publish_all({folder / NUMBERS: json_text(numbers, indent=None), folder / PAGE: text})
    return folder / PAGE


def _history(history: pd.DataFrame) -> dict[str, object]:
    return {"table": history_table(history), "picture": history_figure(history)}


def _signature(signature: RecordedSignature) -> dict[str, object]:
    return {
        "source": signature.source,
        "facts": fact_rows(signature),
        "absent": "" if signature.presence.present else signature.presence.reason,
        "notes": signature.notes,
        "pictures": list(recorded_figures(signature)),
        "lines": line_table(signature),
        "indicators": indicator_table(signature),
        "repeats": None if signature.repeatability is None else repeatability_table(signature.repeatability),
        "envelope": envelope_table(signature),
    }
