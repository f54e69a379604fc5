"""The report of an evaluation: one page that needs no network, and its numbers as JSON."""

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
from sigdb.report.page import CaptionedFigure, Cell, page

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
    """Return the page as one string."""
    efficiency, aims = efficiency_rows(evaluation), aim_rows(evaluation)
    return page(
        "evaluation.html",
        title=title,
        summary=f"{evaluation.split}. {evaluation.rows} rows of {evaluation.specimens} specimens.",
        above=[TITLES.get(name, name) for name in evaluation.above],
        metrics=_table(figure_rows(evaluation)) | {"ours": 1 + list(evaluation.figures).index(evaluation.learner)},
        bound=bound_said(evaluation),
        differences=_differences(evaluation),
        efficiency=_table(efficiency) | {"caption": EFFICIENCY_SAID[evaluation.target]} if efficiency else None,
        aims=_table(aims) if aims else None,
        pictures=[CaptionedFigure(*one) for one in evaluation_figures(evaluation)],
        no_cells="" if "coverage" in evaluation.tables else _why_no_cells(evaluation),
        numbers=NUMBERS,
        split_hash=evaluation.split_hash[:12],
    )


def evaluation_figures(evaluation: Evaluation) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure of all that an evaluation holds."""
    styles = estimator_styles(evaluation.figures, evaluation.learner)
    yield from efficiency_figures(evaluation)
    yield from (severity_figures if evaluation.target == "severity" else location_figures)(evaluation, styles)
    yield from noise_figures(evaluation, styles)
    yield from coverage_figures(evaluation)


def _why_no_cells(evaluation: Evaluation) -> str:
    figures = evaluation.figures[evaluation.learner]
    if not any("coverage" in name for name in figures):
        return "the model gives neither sets nor intervals"
    return f"no cell of severity, noise and operating point has {ENOUGH} rows"


def _table(table: list[list[str]]) -> dict[str, object]:
    """Return the head and the rows of a table, values apart from their intervals."""
    head, *rows = table
    return {"head": head, "rows": [[_cell(text) for text in row] for row in rows]}


def _cell(text: str) -> Cell:
    value, bracket, ends = text.partition(" [")
    return Cell(value, f"[{ends}" if bracket else "")


def _differences(evaluation: Evaluation) -> str:
    """Return the model's lead over the others in the metric that says most; nothing without others."""
    key = {"location": "accuracy", "detection": "p_detected"}.get(evaluation.target, "mae_stiffness_loss")
    leads = [
        f"{other} {figures[key].value:+.3f} [{figures[key].low:+.3f}, {figures[key].high:+.3f}]"
        for other, figures in evaluation.differences.items()
        if key in figures
    ]
    if not leads:
        return ""
    return f"{TITLES[key]} of {evaluation.learner} minus that of others, on the same rows: {'; '.join(leads)}."


def _columns(table: pd.DataFrame) -> dict[str, list[object]]:
    return {
        str(name): [None if isinstance(one, float) and not np.isfinite(one) else one for one in table[name].tolist()]
        for name in table
    }
