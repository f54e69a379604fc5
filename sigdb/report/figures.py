"""The picture of a signature: averaged signal, order spectrum, Wigner-Ville distribution, as in the paper's figures."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.report.settings import Report
from sigdb.signature import order_spectrum, wigner_ville

_INK, _DAMAGE, _GRID = "#1f3a5f", "#c8553d", "#d9d9d9"
_RANGE = 0.2
"""Share of the greatest magnitude at which the colours of the distribution saturate: cross-terms stay visible."""


def signature_figure(
    tsa: FloatArray,
    *,
    teeth: int,
    sensor: str,
    unit: str,
    title: str,
    damaged: tuple[int, ...] = (),
    settings: Report | None = None,
) -> Figure:
    """Three panels: signal against angle with the tooth passes, order spectrum, Wigner-Ville distribution.

    Parameters
    ----------
    tsa
        (n,) average of one revolution, from the tacho mark.
    teeth
        Tooth count.
    sensor, unit
        Name and unit of the signal.
    title
        What is shown.
    damaged
        Damaged teeth, marked in the panels over angle.
    settings
        Highest order shown.

    Returns
    -------
    matplotlib.figure.Figure
    """
    settings = settings or Report()
    highest = min(settings.mesh_orders * teeth, len(tsa) / 2)
    with matplotlib.rc_context({"font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left"}):
        figure = Figure(figsize=(8.0, 8.6), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, fontsize=11)
        signal, spectrum, distribution = figure.subplots(3, 1, height_ratios=(1.0, 0.8, 1.3))
        _draw_signal(signal, tsa, teeth, f"{sensor}, {unit}", damaged)
        _draw_spectrum(spectrum, tsa, teeth, unit, highest)
        _draw_distribution(distribution, tsa, teeth, highest, damaged)
    return figure


def save_figure(figure: Figure, path: Path, settings: Report | None = None) -> None:
    """Write a figure; the format follows the file's suffix.

    Raises
    ------
    InputError
        If the suffix names no format of pictures.
    """
    formats = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in formats:
        raise InputError(f"{path}: not a picture's name; end it in .png, .svg or .pdf")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=(settings or Report()).dots_per_inch)


def _draw_signal(axes: Axes, tsa: FloatArray, teeth: int, label: str, damaged: tuple[int, ...]) -> None:
    angle = np.arange(len(tsa) + 1) * 360 / len(tsa)
    axes.plot(angle, np.append(tsa, tsa[0]), color=_INK, linewidth=1.0)
    axes.set(title="Synchronous average", ylabel=label)
    axes.margins(y=0.12)  # room for the numbers of the tooth passes
    _mark_passes(axes, teeth, damaged)
    axes.grid(axis="y", color=_GRID, linewidth=0.5)
    axes.set_axisbelow(True)


def _draw_spectrum(axes: Axes, tsa: FloatArray, teeth: int, unit: str, highest: float) -> None:
    order, c = order_spectrum(tsa)
    shown = (order > 0) & (order <= highest)
    axes.vlines(order[shown], 0, np.abs(c[shown]), color=_INK, linewidth=1.4)
    axes.set(
        title="Order spectrum (peak amplitude)",
        xlabel="order, 1/rev (ticks at mesh harmonics)",
        ylabel=unit,
        xlim=(0, highest),
        xticks=np.arange(0, highest + 1, teeth),
    )
    axes.set_ylim(bottom=0)
    axes.grid(axis="y", color=_GRID, linewidth=0.5)
    axes.set_axisbelow(True)


def _draw_distribution(axes: Axes, tsa: FloatArray, teeth: int, highest: float, damaged: tuple[int, ...]) -> None:
    w = wigner_ville(tsa - tsa.mean())
    order = np.arange(w.shape[1]) * len(tsa) / (2 * w.shape[1])
    shown = w[:, order <= highest].T
    limit = _RANGE * float(np.abs(shown).max()) or 1.0
    image: Any = axes.imshow(
        shown,
        origin="lower",
        aspect="auto",
        extent=(0, 360, -order[1] / 2, float(order[order <= highest][-1] + order[1] / 2)),
        cmap="RdBu_r",
        vmin=-limit,
        vmax=limit,
        interpolation="nearest",
    )
    axes.set(
        title="Wigner-Ville distribution (half-window 60 deg of rotation)",
        xlabel="angle, deg (tooth passes numbered)",
        ylabel="order, 1/rev",
        yticks=np.arange(0, highest + 1, teeth),
        ylim=(0, highest),
    )
    _mark_passes(axes, teeth, damaged)
    axes.figure.colorbar(image, ax=axes, extend="both", pad=0.01, format="%.1e", label="unit$^2$ per bin")


def _mark_passes(axes: Axes, teeth: int, damaged: tuple[int, ...]) -> None:
    """A line between tooth passes, a number in each (a few for large gears), a band over damaged ones."""
    width = 360 / teeth
    axes.set_xlim(0, 360)
    axes.set_xticks(np.arange(0, 361, 60))
    for tooth in range(1, teeth + 1):
        axes.axvline((tooth - 1) * width, color=_GRID, linewidth=0.6, zorder=0.5)
    for tooth in damaged:
        axes.axvspan((tooth - 1) * width, tooth * width, color=_DAMAGE, alpha=0.15, linewidth=0)
    step = -(-teeth // 20)
    for tooth in range(1, teeth + 1, step):
        axes.annotate(
            str(tooth),
            ((tooth - 0.5) * width, 1),
            xycoords=("data", "axes fraction"),
            xytext=(0, -3),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=7,
            color=_DAMAGE if tooth in damaged else "#666666",
        )
