"""The report of an evaluation: one page that needs no network, and its numbers as JSON."""

import html
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from sigdb.core import __version__
from sigdb.recognition import (
    EFFICIENCY_SAID,
    ENOUGH,
    TITLES,
    Evaluation,
    aim_rows,
    bound_said,
    efficiency_rows,
    figure_rows,
)
from sigdb.report.evaluation.location import location_figures
from sigdb.report.evaluation.shared import coverage_figures, efficiency_figures, noise_figures, severity_figures
from sigdb.report.evaluation.style import estimator_styles
from sigdb.report.page import page, picture

PAGE, NUMBERS = "index.html", "evaluation.json"
"""Files of a report."""


def write_evaluation_report(evaluation: Evaluation, folder: str | Path, *, title: str) -> Path:
    """Write the page of an evaluation, ``index.html``, and its numbers, ``evaluation.json``.

    The page is one file, without scripts: pictures are in it. The numbers are all figures with their intervals (null
    where one is not known) and, under ``tables``, what the pictures show, as columns.

    Parameters
    ----------
    evaluation
        What :func:`sigdb.recognition.evaluate` gives.
    folder
        Where; made if it does not exist.
    title
        Heading of the page, for example names of model and database.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    numbers = evaluation.as_json() | {
        "tables": {name: _columns(table) for name, table in evaluation.tables.items()},
        "sigdb_version": __version__,
    }
    (folder / NUMBERS).write_text(json.dumps(numbers, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (folder / PAGE).write_text(evaluation_html(evaluation, title=title), encoding="utf-8")
    return folder / PAGE


def evaluation_html(evaluation: Evaluation, *, title: str) -> str:
    """The page as one string."""
    footer = f"The same numbers are in {NUMBERS}. Table of cases and folds: {evaluation.split_hash[:12]}. "
    return page(title, "\n".join(_body(evaluation)), footer=f"{footer}sigdb {html.escape(__version__)}.", style=_STYLE)


def evaluation_figures(evaluation: Evaluation) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure of all that an evaluation holds."""
    styles = estimator_styles(evaluation.figures, evaluation.learner)
    yield from efficiency_figures(evaluation)
    yield from (severity_figures if evaluation.target == "severity" else location_figures)(evaluation, styles)
    yield from noise_figures(evaluation, styles)
    yield from coverage_figures(evaluation)


def _body(evaluation: Evaluation) -> Iterator[str]:
    yield f"<p>{html.escape(evaluation.split)}. {evaluation.rows} rows of {evaluation.specimens} specimens.</p>"
    if evaluation.above:
        named = ", ".join(TITLES.get(name, name) for name in evaluation.above)
        yield (
            f'<p class="alarm">The model is better than the best possible answer ({html.escape(named)}): its training '
            "has seen what it was asked about, or the rows do not follow the law that the bound assumes.</p>"
        )
    yield "<h2>Figures</h2>"
    yield from _table(evaluation)
    yield (
        "<p>In brackets: 95 % interval of a bootstrap over specimens, rough for few of them. "
        f"{html.escape(bound_said(evaluation))}</p>"
    )
    yield from _differences(evaluation)
    yield from _against_bound(evaluation)
    yield '<div class="pictures">'
    for heading, caption, figure in evaluation_figures(evaluation):
        yield picture(heading, caption, figure)
    yield "</div>"
    if "coverage" not in evaluation.tables:
        yield f"<p>Coverage cell by cell is not given: {_why_no_cells(evaluation)}.</p>"


def _why_no_cells(evaluation: Evaluation) -> str:
    figures = evaluation.figures[evaluation.learner]
    if not any("coverage" in name for name in figures):
        return "the model gives neither sets nor intervals"
    return f"no cell of severity, noise and operating point has {ENOUGH} rows"


def _against_bound(evaluation: Evaluation) -> Iterator[str]:
    """The model against the best possible answer, and its aims."""
    efficiency, aims = efficiency_rows(evaluation), aim_rows(evaluation)
    if efficiency or aims:
        yield "<h2>Against the best possible</h2>"
    if efficiency:
        yield f"<p>{html.escape(EFFICIENCY_SAID[evaluation.target])}</p>"
        yield from _cells_of(efficiency)
    if aims:
        yield "<h3>Aims</h3>\n<p>Each where the noise band is worst.</p>"
        yield '<table class="aims">\n<thead>' + _cells("th", aims[0], 0) + "</thead>\n<tbody>"
        yield from (_cells("td", row, 0) for row in aims[1:])
        yield "</tbody></table>"


def _table(evaluation: Evaluation) -> Iterator[str]:
    yield from _cells_of(figure_rows(evaluation), ours=1 + list(evaluation.figures).index(evaluation.learner))


def _cells_of(table: list[list[str]], *, ours: int = -1) -> Iterator[str]:
    """A table, one column of which stands out."""
    head, *rows = table
    yield '<div class="wide"><table>\n<thead>' + _cells("th", head, ours) + "</thead>\n<tbody>"
    yield from (_cells("td", row, ours) for row in rows)
    yield "</tbody></table></div>"


def _cells(tag: str, row: list[str], ours: int) -> str:
    cells = []
    for i, text in enumerate(row):
        value, _, ends = html.escape(text, quote=False).partition(" [")
        mark = ' class="ours"' if i == ours else ""
        small = f' <span class="ends">[{ends}</span>' if ends else ""
        cells.append(f"<{tag}{mark}>{value}{small}</{tag}>")
    return "<tr>" + "".join(cells) + "</tr>"


def _differences(evaluation: Evaluation) -> Iterator[str]:
    """The model against the others, on the figure that says most."""
    key = {"location": "accuracy", "detection": "p_detected"}.get(evaluation.target, "mae_stiffness_loss")
    said = [
        f"{other} {figures[key].value:+.3f} [{figures[key].low:+.3f}, {figures[key].high:+.3f}]"
        for other, figures in evaluation.differences.items()
        if key in figures
    ]
    if said:
        yield (
            f"<p>{html.escape(TITLES[key])} of {html.escape(evaluation.learner)} minus that of others, on the same "
            f"rows: {html.escape('; '.join(said))}.</p>"
        )


def _columns(table: pd.DataFrame) -> dict[str, list[object]]:
    return {
        str(name): [None if isinstance(one, float) and not np.isfinite(one) else one for one in table[name].tolist()]
        for name in table
    }


_STYLE = """
.wide + h3 { margin-top: 1.4rem; }
.aims td { white-space: normal; min-width: 5rem; }
"""
