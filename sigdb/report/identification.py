"""The page of an identification: the fit, the posterior with the prior, and predictions with bands."""

from os import PathLike
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.core import publish_all
from sigdb.identification import Identification, identification_sentences
from sigdb.report.page import CaptionedFigure, page
from sigdb.report.panels import DAMAGE, GRID, HEALTHY, INK
from sigdb.report.text_table import TextTable

_PAGE = "index.html"
_LINE = 0.28
"""Height of a line of a picture, inches."""


def write_identification_report(result: Identification, folder: str | PathLike[str]) -> Path:
    """Write the page of an identification, ``index.html``.

    The page is one file without scripts; pictures are part of it.

    Parameters
    ----------
    result : Identification
        From :func:`sigdb.identification.identify`.
    folder : str or path-like
        Folder of the page; it is created if it does not exist.

    Returns
    -------
    pathlib.Path
        The page.
    """
    frames = {
        "Numbers": result.posterior(),
        "Measured numbers": result.predictions(),
        "Observations": result.observations(),
        "Members": result.table(),
    }
    tables = {name: TextTable.of_frame(frame.reset_index()) for name, frame in frames.items() if len(frame)}
    text = page(
        "identification.html",
        title=f"Identification of {result.problem.rig.name}",
        subtitle=result.problem.targets.title,
        sentences_of_fit=identification_sentences(result),
        pictures=identification_figures(result),
        tables=tables,
    )
    publish_all({Path(folder) / _PAGE: text})
    return Path(folder) / _PAGE


def identification_figures(result: Identification) -> tuple[CaptionedFigure, ...]:
    """Draw the posterior of each number in its range, and the predictions in standard deviations of their errors.

    Parameters
    ----------
    result : Identification
        From :func:`sigdb.identification.identify`.

    Returns
    -------
    tuple of CaptionedFigure
        Without the second where nothing is measured.
    """
    percent = f"{100 * result.level:.0f} %"
    figures = [
        CaptionedFigure(
            "Posterior and prior",
            f"Light: the range of each number, equally likely. Dark: the interval of {percent}; ticks are members. "
            "Red: the targets do not identify the number.",
            _posterior_figure(result),
        )
    ]
    predictions = result.predictions()
    if len(predictions):
        figures.append(
            CaptionedFigure(
                "Predictions",
                f"Difference from the stated value in its standard deviations: intervals of {percent} of the members, "
                "without errors of measurement. Shaded: two standard deviations. Red: held out.",
                _prediction_figure(predictions),
            )
        )
    return tuple(figures)


def _figure(lines: int) -> tuple[Figure, Axes]:
    with matplotlib.rc_context({"font.size": 9}):
        figure = Figure(figsize=(8.5, 0.9 + _LINE * lines), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
    axes.set_ylim(lines - 0.5, -0.5)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(left=False)
    return figure, axes


def _posterior_figure(result: Identification) -> Figure:
    posterior, coordinates = result.posterior(), result.coordinates()
    figure, axes = _figure(len(posterior))
    for line, (path, row) in enumerate(posterior.iterrows()):
        u = coordinates[str(path)].to_numpy()
        low, median, high = np.quantile(u, [(1 - result.level) / 2, 0.5, (1 + result.level) / 2], method="weibull")
        colour = INK if row["is_identified"] else DAMAGE
        axes.barh(line, 1.0, height=0.6, color=GRID)
        axes.barh(line, high - low, left=low, height=0.6, color=colour, alpha=0.55)
        axes.plot(u, np.full(len(u), line), "|", color=colour, markersize=7)
        axes.plot(median, line, "o", color=colour, markersize=4)
    axes.set_yticks(range(len(posterior)), [str(path) for path in posterior.index])
    axes.set(xlim=(0, 1), xlabel="place in the range, along its scale")
    return figure


def _prediction_figure(predictions: pd.DataFrame) -> Figure:
    figure, axes = _figure(len(predictions))
    axes.axvspan(-2, 2, color=HEALTHY, alpha=0.35, linewidth=0)
    axes.axvline(0, color=INK, linewidth=0.8)
    for line, (_, row) in enumerate(predictions.iterrows()):
        low, median, high = (
            (row[name] - row["stated"]) / row["error"] for name in ("predicted_low", "median", "predicted_high")
        )
        colour = DAMAGE if row["held_out"] else INK
        axes.plot([low, high], [line, line], color=colour, linewidth=3, solid_capstyle="butt")
        axes.plot(median, line, "o", color=colour, markersize=4)
    axes.set_yticks(range(len(predictions)), [str(name) for name in predictions.index])
    axes.set(xlabel="predicted less stated, in standard deviations")
    return figure
