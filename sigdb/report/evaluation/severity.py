"""Pictures of severity: estimates against the truth; and of coverage, cell by cell."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition import Evaluation
from sigdb.report.evaluation.style import drawing, lay_grid
from sigdb.report.page import CaptionedFigure
from sigdb.report.panels import DAMAGE, INK


def severity_figures(evaluation: Evaluation) -> Iterator[CaptionedFigure]:
    """Yield a picture of the estimates of each quantity, where the evaluation holds them."""
    table = evaluation.tables.get("scatter")
    if table is None:
        return
    for quantity, rows in table.groupby("quantity", sort=False):
        caption = (
            "Dots: single rows, spread sideways so that they show. Bars: the median estimate at each true value, and "
            "the median ends of its interval. The dashed line is the truth."
        )
        shown = SHOWN_QUANTITIES[str(quantity)]
        numbers = [name for name in ("true", "estimate", "low", "high") if name in rows]
        scaled = rows.assign(**rows[numbers] * shown.factor)
        yield CaptionedFigure(f"Estimates of the {shown.title}", caption, _scatter(scaled, shown.label))


def _scatter(rows: pd.DataFrame, label: str) -> Figure:
    true = rows["true"].to_numpy()
    levels = np.unique(true)
    step = np.diff(levels).min() if len(levels) > 1 else 1.0
    few = len(levels) <= 15
    aside = np.random.default_rng(0).uniform(-0.28, 0.28, len(rows)) * step if few else 0.0
    with drawing(height=3.8) as figure:
        axes = figure.subplots()
        axes.plot(true + aside, rows["estimate"], "o", ms=2.5, mew=0, alpha=0.35, color=INK, rasterized=True)
        ends = (levels.min() - step / 2, levels.max() + step / 2)
        axes.plot(ends, ends, color="#888888", linewidth=1, linestyle="--")
        if few:
            _bars(axes, rows)
        axes.set(xlabel=f"true {label}", ylabel=f"estimated {label}", xlim=ends)
        if few:
            axes.set_xticks(levels)
        lay_grid(axes)
    return figure


def _bars(axes: Axes, rows: pd.DataFrame) -> None:
    middle = rows.groupby("true").median(numeric_only=True)
    ends = None
    if "low" in middle:
        ends = np.abs(middle[["low", "high"]].to_numpy().T - middle["estimate"].to_numpy())
    axes.errorbar(middle.index, middle["estimate"], ends, fmt="D", ms=5, capsize=5, color=DAMAGE, linewidth=1.6)


def coverage_figures(evaluation: Evaluation) -> Iterator[CaptionedFigure]:
    """Yield pictures of coverage by cell, where cells have enough rows."""
    table = evaluation.tables.get("coverage")
    if table is None:
        return
    for target, cells in table.groupby("target", sort=False):
        caption = (
            "Each cell of severity, noise and operating point with 2000 rows or more. The dashed line is the nominal "
            "coverage. Bars: 95 % intervals over specimens."
        )
        yield CaptionedFigure(f"Coverage cell by cell: {target}", caption, _cells(cells.reset_index(drop=True)))


_CELL_TEXT = {
    "stiffness_loss": "loss {:g}",
    "damaged_teeth": "damaged teeth {:g}",
    "snr_db": "{:g} dB",
    "speed_rpm": "{:g} rpm",
    "torque": "{:g} N m",
}


def _cells(cells: pd.DataFrame) -> Figure:
    shown = [name for name in cells.columns if name in _CELL_TEXT or name in SHOWN_QUANTITIES]
    varying = [name for name in shown if cells[name].nunique() > 1]
    with drawing(height=1.1 + 0.2 * len(cells)) as figure:
        axes = figure.subplots()
        _intervals(axes, cells)
        names = [", ".join(_cell_text(name, row[name]) for name in varying) or "all" for _, row in cells.iterrows()]
        axes.set_yticks(range(len(cells)), names, fontsize=8)
        axes.invert_yaxis()
        axes.axvline(0.9, color="#888888", linewidth=1, linestyle="--")
        axes.set(xlabel="coverage")
        axes.set_xlim(min(0.75, float(cells["low"].min()) - 0.02), 1.005)
        lay_grid(axes)
    return figure


def _cell_text(name: str, value: float) -> str:
    if name in _CELL_TEXT:
        return _CELL_TEXT[name].format(value)
    return f"{SHOWN_QUANTITIES[name].title} {SHOWN_QUANTITIES[name].text(value)}"


def _intervals(axes: Axes, cells: pd.DataFrame) -> None:
    wrong = (cells["low"] > 0.9) | (cells["high"] < 0.9)
    for off, colour in ((False, INK), (True, DAMAGE)):
        some = cells[wrong == off]
        ends = np.abs(some[["low", "high"]].to_numpy().T - some["coverage"].to_numpy())
        axes.errorbar(some["coverage"], some.index, xerr=ends, fmt="o", ms=4, capsize=2, color=colour)
