"""The page of recordings' signatures: one file that needs no network, and the same as JSON."""

import base64
import html
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from sigdb.core.version import __version__
from sigdb.report.recorded_pictures import Picture, history_figure, recorded_figures
from sigdb.report.recorded_tables import INDICATOR_COLUMNS, fact_rows, history_columns, indicator_rows
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
        Rows of :func:`sigdb.pipeline.recorded_history`, where there are several recordings.
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
    (folder / PAGE).write_text("\n".join(_page(signatures, history, title)) + "\n", encoding="utf-8")
    return folder / PAGE


def _page(signatures: Sequence[Mapping[str, Any]], history: Sequence[Mapping[str, Any]], title: str) -> Iterator[str]:
    yield '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>"
    yield f"<h1>{html.escape(title)}</h1>"
    if history:
        yield from _table(history_columns(history), history)
        yield from _figure(history_figure(history))
    for facts in signatures:
        yield from _signature(facts)
    yield f"<footer>The same numbers are in {NUMBERS}. sigdb {html.escape(__version__)}.</footer>\n</body>\n</html>"


def _signature(facts: Mapping[str, Any]) -> Iterator[str]:
    yield f"<h2>{html.escape(facts['source'])}</h2>"
    yield from _table((("", lambda row: row[0]), ("", lambda row: row[1])), fact_rows(facts))
    yield "<h3>Notes</h3>\n<ul>"
    yield from (f"<li>{html.escape(note)}</li>" for note in facts["notes"])
    yield "</ul>"
    for picture in recorded_figures(facts):
        yield from _figure(picture)
    yield "<h3>Indicators</h3>"
    yield from _table(INDICATOR_COLUMNS, indicator_rows(facts))


def _table(columns: Sequence[Column], rows: Sequence[Any]) -> Iterator[str]:
    yield '<div class="wide"><table>'
    if any(head for head, _ in columns):
        yield "<thead><tr>" + "".join(f"<th>{html.escape(head)}</th>" for head, _ in columns) + "</tr></thead>"
    yield "<tbody>"
    for row in rows:
        yield "<tr>" + "".join(f"<td>{html.escape(cell(row))}</td>" for _, cell in columns) + "</tr>"
    yield "</tbody></table></div>"


def _figure(picture: Picture) -> Iterator[str]:
    heading, caption, figure = picture
    yield f"<figure>\n<h3>{html.escape(heading)}</h3>"
    yield f'<img alt="{html.escape(f"{heading}. {caption}")}" src="{_embedded(figure)}">'
    yield f"<figcaption>{html.escape(caption)}</figcaption>\n</figure>"


def _embedded(figure: Figure) -> str:
    """A figure as a PNG in a data address: as an SVG the spectrum's many points would be large."""
    picture = io.BytesIO()
    with matplotlib.rc_context():
        figure.savefig(picture, format="png", dpi=150, metadata={"Software": None})
    return f"data:image/png;base64,{base64.b64encode(picture.getvalue()).decode()}"


_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b2430; background: #fff; margin: 0 auto; padding: 1rem;
  max-width: 60rem; }
h1 { font-size: 1.5rem; line-height: 1.25; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin-top: 2.2rem; overflow-wrap: anywhere; }
h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid #e3e6ea; vertical-align: top; }
figure { margin: 0; break-inside: avoid; }
figure img { width: 100%; height: auto; }
figcaption, li { color: #4a5565; font-size: .88rem; }
footer { color: #667080; font-size: .85rem; margin-top: 2rem; }
@media print { body { font-size: 10pt; max-width: none; padding: 0; } .wide { overflow: visible; } }
"""
