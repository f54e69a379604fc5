"""The grid coverage of a database as text, and as a picture of how well the cases between its own match."""

from collections.abc import Mapping

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.core import FloatArray, unit_of
from sigdb.report.panels import DAMAGE, GRID, INK
from sigdb.report.text_table import PLAIN, Terminal, TextTable
from sigdb.sweep import Coverage
from sigdb.transmission import Damage, Gear, Operating, ToothDamage

_WANTED = 0.97
_BINS = 30
_COLUMNS = 3
_APART = 0.2
"""Least distance between labelled values of an axis, as a fraction of its length."""


def coverage_text(coverage: Coverage, *, name: str, terminal: Terminal = PLAIN) -> str:
    """Return a study of the grid coverage as text.

    Parameters
    ----------
    coverage : Coverage
        From :func:`sigdb.sweep.coverage`.
    name : str
        Name or place of the database.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    record, match = coverage.record, coverage.cases["match"]
    details = record.details
    lines = [
        f"{name}: {details['cases']} random cases between its own, sensor {record.sensor}",
        f"match with the nearest template: least {match.min():.3f}, 5 % below {match.quantile(0.05):.3f}, "
        f"median {match.median():.3f}; {details['share_above_0.97']:.1%} of the cases at 0.97 or above",
        f"separation from it, in deviations of an average's noise: median {details['separation_median']:.1f}, "
        f"greatest {details['separation_greatest']:.1f}",
        f"threshold of 'outside the database': a residual distance of {record.threshold:.3g} (exceeded by 1 % of "
        f"{details['rows']} measured rows, or fewer); stored",
    ]
    if coverage.failed:
        lines.append(f"{coverage.failed} more cases have no result")
    if len(coverage.coarse):
        lines += ["", TextTable.of_frame(coverage.coarse).text(terminal)]
    return "\n".join(lines) + "\n"


def coverage_figure(cases: pd.DataFrame, *, grid: Mapping[str, FloatArray], title: str) -> Figure:
    """Draw the distribution of the match, and the match against each axis.

    A line is at a match of 0.97. The ticks of an axis are the grid's values.

    Parameters
    ----------
    cases
        One row a case off the grid: its ``match``, and a column for each axis.
    grid
        Values of each axis between which the cases lie, ascending.
    title
        Heading of the picture.

    Returns
    -------
    matplotlib.figure.Figure
    """
    panels = 1 + len(grid)
    columns = min(_COLUMNS, panels)
    rows = -(-panels // columns)
    with matplotlib.rc_context({"font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left"}):
        figure = Figure(figsize=(0.8 + 3.4 * columns, 0.7 + 2.9 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, fontsize=11)
        first, *others = figure.subplots(rows, columns, squeeze=False).flat
        _draw_distribution(first, cases["match"].to_numpy())
        for axes, (name, values) in zip(others, grid.items(), strict=False):
            _draw_axis(axes, cases[name].to_numpy(float), cases["match"].to_numpy(), values)
            axes.set(xlabel=_label(name), ylabel="match")
        for axes in others[len(grid) :]:
            axes.remove()
    return figure


def _draw_distribution(axes: Axes, match: FloatArray) -> None:
    """Draw a histogram, cases below the line in the colour of damage."""
    width = (1 - min(0.95, float(match.min()))) / _BINS
    # The line is an edge between bars.
    below, above = (int(np.ceil(share / width)) for share in (_WANTED - float(match.min()), 1 - _WANTED))
    left = _WANTED + np.arange(-max(below, 1), above) * width
    bar = np.clip(np.floor((match - left[0]) / width), 0, len(left) - 1).astype(int)
    colours = np.where(np.arange(len(left)) < max(below, 1), DAMAGE, INK).tolist()
    axes.bar(left, np.bincount(bar, minlength=len(left)), width, align="edge", color=colours)
    axes.axvline(_WANTED, color=DAMAGE, linewidth=1)
    axes.set(
        title=f"{(match >= _WANTED).mean():.1%} of the cases at {_WANTED} or above", xlabel="match", ylabel="cases"
    )
    axes.set_xlim(left[0], 1)


def _draw_axis(axes: Axes, x: FloatArray, match: FloatArray, values: FloatArray) -> None:
    for value in values:
        axes.axvline(value, color=GRID, linewidth=0.6, zorder=0.5)
    axes.scatter(x, match, s=9, c=np.where(match < _WANTED, DAMAGE, INK), alpha=0.6, linewidths=0)
    axes.axhline(_WANTED, color=DAMAGE, linewidth=1)
    shown = _labelled(values)
    axes.set_xticks(shown, [f"{value:.5g}" for value in shown])
    axes.set_xticks(values, minor=True)
    top = 1 + 0.04 * (1 - min(0.95, float(match.min())))
    axes.set_ylim(top=top)
    axes.set_axisbelow(True)


def _labelled(values: FloatArray) -> FloatArray:
    """Return values that are far enough apart for a label each, the first and the last included."""
    least = _APART * (values[-1] - values[0])
    shown = [values[0]]
    for value in values[1:-1]:
        if value - shown[-1] >= least and values[-1] - value >= least:
            shown.append(value)
    return np.array([*shown, values[-1]])


def _label(axis: str) -> str:
    """Return the name of an axis with its unit, which some names end in, once."""
    for section in (ToothDamage, Damage, Operating, Gear):
        if axis in section.model_fields:
            unit = unit_of(section.model_fields[axis])
            name = axis.removesuffix(f"_{ {'rev/min': 'rpm'}.get(unit, unit.lower()) }")
            return axis if unit == "-" else f"{name}, {unit}"
    return axis
