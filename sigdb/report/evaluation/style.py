"""Style of the pictures of an evaluation: colours of estimators, sizes for a phone, grids."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.report.panels import DAMAGE, GRID, INK

Styles = Mapping[str, Mapping[str, Any]]
"""Colour and line of each estimator."""

BOUND_STYLE: Mapping[str, Any] = {"color": "#111111", "linestyle": "--", "linewidth": 1.4, "zorder": 4}
"""Style of the bound, which is drawn over the lines that come near it."""

_OTHERS = ("#3c8d7a", "#8a6bbd", "#c79a2b", "#5b8fd6", "#8c8c8c", "#b3697f", "#6f8f3f")


def estimator_styles(estimators: Iterable[str], learner: str) -> Styles:
    """Return the strongest colour and line for the model, others for its baselines."""
    others = [name for name in estimators if name != learner]
    styles = {learner: {"color": INK, "linewidth": 2.0}}
    for i, name in enumerate(others):
        colour = DAMAGE if i == 0 else _OTHERS[(i - 1) % len(_OTHERS)]
        styles[name] = {"color": colour, "linewidth": 1.3}
    return styles


@contextmanager
def drawing(*, width: float = 4.8, height: float = 3.4) -> Iterator[Figure]:
    """Yield a picture narrow enough to be read on a phone."""
    with matplotlib.rc_context({"font.size": 9, "axes.titlesize": 9, "axes.titlelocation": "left"}):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure


def by_estimator(table: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the rows of each estimator, in the order of the table."""
    for name in table["estimator"].unique():
        yield str(name), table[table["estimator"] == name]


def lay_grid(axes: Axes) -> None:
    """Draw a light grid behind, and no frame above and to the right."""
    axes.grid(color=GRID, linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
