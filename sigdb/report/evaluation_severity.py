"""Figures of an evaluation of severity: estimates against truth, with their intervals."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sigdb.recognition import Evaluation
from sigdb.report.evaluation_style import Styles, drawing, lay_grid
from sigdb.report.panels import DAMAGE, INK

_UNITS = {
    "stiffness_loss": "stiffness loss",
    "phase_shift_deg": "phase shift, deg",
    "damaged_teeth": "number of damaged teeth",
}


def severity_figures(evaluation: Evaluation, styles: Styles) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure for each quantity."""
    table = evaluation.tables["scatter"]
    for target, own in table.groupby("target", sort=False):
        caption = (
            "Dots: single rows, spread sideways so that they show. Bars: the median estimate at each true value, and "
            "the median ends of its interval. The dashed line is the truth."
        )
        yield f"Estimates of the {_UNITS[str(target)].split(',')[0]}", caption, _scatter(own, _UNITS[str(target)])


def _scatter(own: pd.DataFrame, words: str) -> Figure:
    true = own["true"].to_numpy()
    levels = np.unique(true)
    step = np.diff(levels).min() if len(levels) > 1 else 1.0
    few = len(levels) <= 15
    aside = np.random.default_rng(0).uniform(-0.28, 0.28, len(own)) * step if few else 0.0
    with drawing(height=3.8) as figure:
        axes = figure.subplots()
        axes.plot(true + aside, own["found"], "o", ms=2.5, mew=0, alpha=0.35, color=INK, rasterized=True)
        ends = (levels.min() - step / 2, levels.max() + step / 2)
        axes.plot(ends, ends, color="#888888", linewidth=1, linestyle="--")
        if few:
            _bars(axes, own)
        axes.set(xlabel=f"true {words}", ylabel=f"estimated {words}", xlim=ends)
        if few:
            axes.set_xticks(levels)
        lay_grid(axes)
    return figure


def _bars(axes: Axes, own: pd.DataFrame) -> None:
    middle = own.groupby("true").median(numeric_only=True)
    ends = None
    if "low" in middle:
        ends = np.abs(middle[["low", "high"]].to_numpy().T - middle["found"].to_numpy())
    axes.errorbar(middle.index, middle["found"], ends, fmt="D", ms=5, capsize=5, color=DAMAGE, linewidth=1.6)
