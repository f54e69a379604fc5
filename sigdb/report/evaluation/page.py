"""The report of an evaluation: one page that needs no network, and its numbers as JSON."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from sigdb.core import __version__, json_text, plain, publish_all
from sigdb.recognition import (
    ENOUGH,
    FACTORS,
    TARGETS,
    TITLES,
    Estimate,
    EstimateTable,
    Evaluation,
    bound_text,
    criteria_table,
    efficiency_cells,
    limitation_texts,
    metric_among,
    metric_table,
    robustness_cells,
    robustness_text,
)
from sigdb.report.evaluation.location import location_figures
from sigdb.report.evaluation.noise import efficiency_figures, noise_figures
from sigdb.report.evaluation.severity import coverage_figures, severity_figures
from sigdb.report.evaluation.style import estimator_styles
from sigdb.report.page import CaptionedFigure, Cell, page

PAGE, NUMBERS = "index.html", "evaluation.json"
"""Files of a report."""


def write_evaluation_report(evaluation: Evaluation, folder: str | Path, *, title: str) -> Path:
    """Write the page of an evaluation, ``index.html``, and its numbers, ``evaluation.json``.

    The page is one file without scripts: pictures are in it. The numbers are all metrics with their intervals (null
    where a value is not known) and, under ``tables``, the columns behind the pictures.

    Parameters
    ----------
    evaluation
        Result of :func:`sigdb.recognition.evaluate`.
    folder
        Folder of the report; created if it does not exist.
    title
        Heading of the page, for example names of model and database.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    numbers = evaluation.as_json() | {
        "tables": {name: plain(table.to_dict("list")) for name, table in evaluation.tables.items()},
        "sigdb_version": __version__,
    }
    html = evaluation_html(evaluation, title=title)
    publish_all({folder / NUMBERS: json_text(numbers), folder / PAGE: html})
    return folder / PAGE


def evaluation_html(evaluation: Evaluation, *, title: str) -> str:
    """Return the page of an evaluation as one text without scripts.

    Parameters
    ----------
    evaluation : Evaluation
        From :func:`sigdb.recognition.evaluate`.
    title : str
        Heading of the page.

    Returns
    -------
    str
        The page in HTML.
    """
    split = f"{evaluation.split}, {evaluation.split_text}"
    return page(
        "evaluation.html",
        title=title,
        summary=f"{split}. {evaluation.rows} rows of {evaluation.specimens} specimens.",
        above=[TITLES[name] for name in evaluation.above],
        metrics=_table(metric_table(evaluation)),
        model_column=1 + list(evaluation.metrics).index(evaluation.learner),
        bound=bound_text(evaluation),
        differences=_differences(evaluation),
        efficiency=_table(efficiency_cells(evaluation)),
        efficiency_caption=TARGETS[evaluation.target].text.efficiency,
        limitations=limitation_texts(evaluation),
        criteria=_table(criteria_table(evaluation)),
        robustness=_table(robustness_cells(evaluation)),
        robustness_caption=robustness_text(evaluation),
        pictures=list(evaluation_figures(evaluation)),
        no_cells="" if "coverage" in evaluation.tables else _why_no_cells(evaluation),
        numbers=NUMBERS,
        split_hash=evaluation.split_hash[:12],
    )


def evaluation_figures(evaluation: Evaluation) -> Iterator[CaptionedFigure]:
    """Yield the pictures of all that an evaluation holds, each with heading and caption.

    Parameters
    ----------
    evaluation : Evaluation
        From :func:`sigdb.recognition.evaluate`.

    Yields
    ------
    CaptionedFigure
        Heading, caption and picture.
    """
    styles = estimator_styles(evaluation.metrics, evaluation.learner)
    yield from efficiency_figures(evaluation)
    yield from severity_figures(evaluation)
    yield from location_figures(evaluation, styles)
    yield from noise_figures(evaluation, styles)
    yield from coverage_figures(evaluation)


def _why_no_cells(evaluation: Evaluation) -> str:
    if not any("coverage" in name for name in evaluation.metrics[evaluation.learner]):
        return "the model gives neither sets nor intervals"
    return f"no cell of severity, noise and operating point has {ENOUGH} rows"


def _table(table: EstimateTable) -> dict[str, Sequence[object]] | None:
    """Return head and rows for the template; None for a table without rows."""
    return {"head": table.head, "rows": [list(map(_cell, row)) for row in table.rows]} if table else None


def _cell(cell: Estimate | str) -> Cell:
    if isinstance(cell, str):
        return Cell(cell)
    if np.isnan(cell.value):
        return Cell("-")
    return Cell(f"{cell.value:.3f}", "" if np.isnan(cell.low) else f"[{cell.low:.3f}, {cell.high:.3f}]")


def _differences(evaluation: Evaluation) -> str:
    """Return the model's lead over its baselines in one metric, as a sentence; nothing without baselines."""
    target = TARGETS[evaluation.target]
    metric = metric_among(target, target.paired_metric, evaluation.metrics[evaluation.learner])
    leads = [
        f"{other} {lead.value:+.3f} [{lead.low:+.3f}, {lead.high:+.3f}]"
        for other, metrics in evaluation.differences.items()
        if metric in metrics
        for lead in [metrics[metric].times(FACTORS[metric])]
    ]
    if not leads:
        return ""
    return f"{TITLES[metric]} of {evaluation.learner} minus that of others, on the same rows: {'; '.join(leads)}."
