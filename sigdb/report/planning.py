"""The page of a plan: the smallest damage of each measurement as a table, and as a map over speed and torque."""

from collections.abc import Iterator
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from sigdb.core import json_text, publish_all
from sigdb.planning import MeasurementPlan
from sigdb.report.evaluation.style import drawing
from sigdb.report.page import CaptionedFigure, page
from sigdb.report.panels import GRID
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number

_HEAD = ("sensor", "direction", "speed, rpm", "torque, N m", "averages", "time, s", "a90", "interval")


def write_plan_report(plan: MeasurementPlan, folder: str | PathLike[str], *, command: str | None = None) -> Path:
    """Write the page of a plan, ``index.html``, and its numbers, ``plan.json``.

    Parameters
    ----------
    plan : MeasurementPlan
        From :func:`sigdb.planning.plan_measurement`.
    folder : str or path-like
        Folder of the page; it is created if it does not exist.
    command : str, optional
        Command that makes the page again, for the reader.

    Returns
    -------
    pathlib.Path
        The page.
    """
    index = Path(folder) / "index.html"
    html = page(
        "planning.html",
        title=f"Measurements of {plan.rig}",
        sentences_of_plan=plan.sentences,
        pictures=list(plan_figures(plan)),
        head=_HEAD,
        rows=_rows(plan),
        command=command,
    )
    publish_all({Path(folder) / "plan.json": json_text(plan.as_json()), index: html})
    return index


def plan_text(plan: MeasurementPlan, *, best: int | None = None, terminal: Terminal = PLAIN) -> str:
    """Return a plan as text for a terminal.

    Parameters
    ----------
    plan : MeasurementPlan
        From :func:`sigdb.planning.plan_measurement`.
    best : int, optional
        Number of measurements, the best ones; all if left out.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    rows = _rows(plan)
    lines = [*plan.sentences, TextTable(_HEAD, rows[:best]).text(terminal)]
    if best is not None and best < len(rows):
        lines.append(f"{len(rows) - best} more measurements show less.")
    return "\n".join(lines) + "\n"


def plan_figures(plan: MeasurementPlan) -> Iterator[CaptionedFigure]:
    """Yield a map of each sensor over speed and torque, at the greatest number of averages.

    Parameters
    ----------
    plan : MeasurementPlan
        From :func:`sigdb.planning.plan_measurement`.

    Yields
    ------
    CaptionedFigure
        The best sensor first.
    """
    most = plan.table[plan.table["averages"] == plan.table["averages"].max()]
    sizes = most["a90"].dropna()
    low, high = (sizes.min(), max(sizes.max(), 1.01 * sizes.min())) if len(sizes) else (0.1, 1.0)
    for sensor in map(str, most["sensor"].unique()):
        rows = most[most["sensor"] == sensor]
        unit = "" if plan.unit == "-" else f", {plan.unit}"
        caption = (
            f"a90 of {plan.settings.kind}{unit} with {rows['averages'].iloc[0]} revolutions; darker is smaller, and so "
            "better. A cell with > shows no size that was simulated."
        )
        with drawing(height=1.2 + 0.4 * rows["torque"].nunique()) as figure:
            axes = figure.subplots()
            cells = rows.pivot(index="torque", columns="speed_rpm", values="a90")
            largest = rows.pivot(index="torque", columns="speed_rpm", values="largest")
            axes.imshow(
                np.ma.masked_invalid(cells),
                origin="lower",
                aspect="auto",
                cmap=colormaps["viridis"].with_extremes(bad=GRID),
                norm=LogNorm(low, high),
            )
            _label_cells(axes, cells, largest, middle=float(np.sqrt(low * high)))
            axes.set_xticks(range(cells.shape[1]), [f"{speed:.5g}" for speed in cells.columns])
            axes.set_yticks(range(cells.shape[0]), [f"{torque:.4g}" for torque in cells.index])
            axes.set(xlabel="speed, rpm", ylabel="torque, N m")
        yield CaptionedFigure(f"{sensor} along {rows['direction'].iloc[0]}", caption, figure)


def _label_cells(axes: Axes, cells: pd.DataFrame, largest: pd.DataFrame, *, middle: float) -> None:
    """Write the number into each cell of a map."""
    for (row, column), value in np.ndenumerate(cells.to_numpy()):
        text = f"> {float(largest.to_numpy()[row, column]):.2g}" if np.isnan(value) else f"{value:.2g}"
        dark = not np.isnan(value) and value < middle
        axes.text(column, row, text, ha="center", va="center", color="white" if dark else "black", fontsize=8)


def _rows(plan: MeasurementPlan) -> list[list[str]]:
    """Return the cells of the table."""
    return [
        [
            str(row["sensor"]),
            str(row["direction"]),
            f"{row['speed_rpm']:.5g}",
            f"{row['torque']:.4g}",
            str(row["averages"]),
            number(row["seconds"], 3),
            _size(row["a90"], row["largest"]),
            f"{_size(row['a90_low'], row['largest'])} to {_size(row['a90_high'], row['largest'])}",
        ]
        for _, row in plan.table.iterrows()
    ]


def _size(size: float, largest: float) -> str:
    """Return a size, or the largest one that it exceeds."""
    return f"> {largest:.3g}" if np.isnan(size) else f"{size:.3g}"
