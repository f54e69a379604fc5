"""Picture of cases side by side: a column for each case, a row for each kind of panel."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.core import FloatArray
from sigdb.report.panels import colour_limit, draw_distribution, draw_signal, draw_spectrum
from sigdb.report.settings import Panel, ReportSettings
from sigdb.signature import wigner_ville

_WIDTH, _MARGIN = 4.1, 1.1
_HEIGHTS: dict[Panel, float] = {"stiffness": 2.1, "signal": 2.4, "spectrum": 2.2, "distribution": 3.2}


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of a comparison.

    Attributes
    ----------
    title
        Title of its column.
    teeth
        Tooth count of the damaged gear.
    tsa
        (n,) average of one revolution, from the tacho mark.
    damaged
        Damaged teeth, marked in the panels over angle.
    healthy
        (n,) the average without damage, drawn lightly behind the other; None to leave it out.
    stiffness, healthy_stiffness
        (n,) mesh stiffness, N/m, with and without damage; needed only where it is shown.
    """

    title: str
    teeth: int
    tsa: FloatArray
    damaged: tuple[int, ...] = ()
    healthy: FloatArray | None = None
    stiffness: FloatArray | None = None
    healthy_stiffness: FloatArray | None = None


def comparison_figure(
    cases: Sequence[Case],
    *,
    sensor: str,
    unit: str,
    panels: Sequence[Panel] = ("signal", "spectrum", "distribution"),
    title: str = "",
    caption: str = "",
    settings: ReportSettings | None = None,
) -> Figure:
    """Draw cases side by side, on the same scales.

    Parameters
    ----------
    cases
        The cases, from left to right.
    sensor, unit
        Name and unit of the signal.
    panels
        Panels of each case, from top to bottom: ``stiffness``, ``signal``, ``spectrum``, ``distribution``.
    title, caption
        Text above and below.
    settings
        Highest order shown.

    Returns
    -------
    matplotlib.figure.Figure
    """
    settings = settings or ReportSettings()
    heights = [_HEIGHTS[panel] for panel in panels]
    width = _MARGIN + _WIDTH * max(len(cases), 2)
    lines = textwrap.wrap(caption, int(15 * width))
    with matplotlib.rc_context({"font.size": 9, "axes.titlesize": 9.5}):
        figure = Figure(figsize=(width, sum(heights) + 0.8 + 0.17 * len(lines)), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, fontsize=11)
        if lines:
            figure.supxlabel("\n".join(lines), fontsize=8.5, x=0.01, ha="left")
        grid = figure.subplots(len(panels), len(cases), squeeze=False, height_ratios=heights)
        for panel, row in zip(panels, grid, strict=True):
            for axes in row[1:] if panel != "distribution" else ():
                axes.sharey(row[0])
                axes.tick_params(labelleft=False)
            _DRAWN[panel](list(row), cases, settings, unit)
            row[0].set_ylabel(_LABELS[panel].format(sensor=sensor, unit=unit))
        for axes, case in zip(grid[0], cases, strict=True):
            axes.set_title(case.title)
    return figure


_LABELS: dict[Panel, str] = {
    "stiffness": "mesh stiffness, N/m",
    "signal": "{sensor}, {unit}",
    "spectrum": "peak amplitude, {unit}",
    "distribution": "Wigner-Ville: order, 1/rev",
}
_ANGLE = "angle, deg (tooth passes numbered)"


def _highest(case: Case, settings: ReportSettings) -> float:
    return min(settings.mesh_orders * case.teeth, len(case.tsa) / 2)


def _stiffnesses(row: list[Axes], cases: Sequence[Case], settings: ReportSettings, unit: str) -> None:
    for axes, case in zip(row, cases, strict=True):
        assert case.stiffness is not None
        draw_signal(axes, case.stiffness, case.teeth, case.damaged, case.healthy_stiffness)
        axes.set(xlabel=_ANGLE)
        axes.set_ylim(0, 1.2 * max(float(np.max(case.stiffness)) for case in cases if case.stiffness is not None))


def _signals(row: list[Axes], cases: Sequence[Case], settings: ReportSettings, unit: str) -> None:
    for axes, case in zip(row, cases, strict=True):
        draw_signal(axes, case.tsa, case.teeth, case.damaged, case.healthy)
        axes.set(xlabel=_ANGLE)


def _spectra(row: list[Axes], cases: Sequence[Case], settings: ReportSettings, unit: str) -> None:
    for axes, case in zip(row, cases, strict=True):
        draw_spectrum(axes, case.tsa, case.teeth, _highest(case, settings), case.healthy)
        axes.set(xlabel="order, 1/rev (ticks at mesh harmonics)")


def _distributions(row: list[Axes], cases: Sequence[Case], settings: ReportSettings, unit: str) -> None:
    """Draw distributions on one scale of colours, with one bar for it."""
    distributions = [wigner_ville(case.tsa - np.mean(case.tsa)) for case in cases]
    limit = max(colour_limit(w, _highest(case, settings)) for w, case in zip(distributions, cases, strict=True))
    image: Any = None
    for axes, case, w in zip(row, cases, distributions, strict=True):
        image = draw_distribution(axes, w, case.teeth, _highest(case, settings), case.damaged, limit)
        axes.set(xlabel=_ANGLE)
    figure: Any = row[0].figure
    figure.colorbar(image, ax=row, extend="both", pad=0.01, label=f"({unit})$^2$ per bin")


_DRAWN = {"stiffness": _stiffnesses, "signal": _signals, "spectrum": _spectra, "distribution": _distributions}
