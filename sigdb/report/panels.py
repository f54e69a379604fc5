"""Panels of a case: mesh stiffness, averaged signal, order spectrum, Wigner-Ville distribution."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from sigdb.core import FloatArray
from sigdb.signature import order_spectrum

INK, DAMAGE, GRID, HEALTHY = "#1f3a5f", "#c8553d", "#d9d9d9", "#a9bcd3"
MARGIN = 0.12
"""Free room above and below a signal, as a share of its range, for the numbers of the tooth passes."""
_RANGE = 0.2
"""Share of the greatest magnitude at which the colours of the distribution saturate: cross-terms stay visible."""


def draw_signal(
    axes: Axes, signal: FloatArray, teeth: int, damaged: tuple[int, ...], healthy: FloatArray | None = None
) -> None:
    """A signal, or the mesh stiffness, against angle with the tooth passes; the healthy one lightly behind it."""
    for values, colour, width in ((healthy, HEALTHY, 2.0), (signal, INK, 1.0)):
        if values is not None:
            angle = np.arange(len(values) + 1) * 360 / len(values)
            axes.plot(angle, np.append(values, values[0]), color=colour, linewidth=width)
    axes.margins(y=MARGIN)
    mark_passes(axes, teeth, damaged)
    _lay_grid(axes)


def draw_spectrum(axes: Axes, tsa: FloatArray, teeth: int, highest: float, healthy: FloatArray | None = None) -> None:
    """Peak amplitudes against order, to a highest order; the healthy ones lightly behind them."""
    for values, colour, width in ((healthy, HEALTHY, 4.0), (tsa, INK, 1.4)):
        if values is not None:
            order, c = order_spectrum(values)
            shown = (order > 0) & (order <= highest)
            axes.vlines(order[shown], 0, np.abs(c[shown]), color=colour, linewidth=width)
    axes.set(xlim=(0, highest), xticks=np.arange(0, highest + 1, teeth))
    axes.set_ylim(bottom=0)
    _lay_grid(axes)


def colour_limit(w: FloatArray, highest: float) -> float:
    """Where the colours of a distribution saturate, of what is shown to a highest order."""
    return _RANGE * float(np.abs(w[:, _orders(w) <= highest]).max()) or 1.0


def draw_distribution(
    axes: Axes, w: FloatArray, teeth: int, highest: float, damaged: tuple[int, ...], limit: float | None = None
) -> Any:
    """A distribution over angle and order, to a highest order; the image, for a colour bar."""
    order = _orders(w)
    shown = order <= highest
    limit = limit or colour_limit(w, highest)
    image = axes.imshow(
        w[:, shown].T,
        origin="lower",
        aspect="auto",
        extent=(0, 360, -order[1] / 2, float(order[shown][-1] + order[1] / 2)),
        cmap="RdBu_r",
        vmin=-limit,
        vmax=limit,
        interpolation="nearest",
    )
    axes.set(yticks=np.arange(0, highest + 1, teeth), ylim=(0, highest))
    mark_passes(axes, teeth, damaged)
    return image


def _orders(w: FloatArray) -> FloatArray:
    orders: FloatArray = np.arange(w.shape[1]) * len(w) / (2 * w.shape[1])
    return orders


def mark_passes(axes: Axes, teeth: int, damaged: tuple[int, ...]) -> None:
    """A line between tooth passes, a number in each (a few for large gears), a band over damaged ones."""
    width = 360 / teeth
    axes.set_xlim(0, 360)
    axes.set_xticks(np.arange(0, 361, 60))
    for tooth in range(1, teeth + 1):
        axes.axvline((tooth - 1) * width, color=GRID, linewidth=0.6, zorder=0.5)
    for tooth in damaged:
        axes.axvspan((tooth - 1) * width, tooth * width, color=DAMAGE, alpha=0.15, linewidth=0)
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
            color=DAMAGE if tooth in damaged else "#666666",
        )


def _lay_grid(axes: Axes) -> None:
    axes.grid(axis="y", color=GRID, linewidth=0.5)
    axes.set_axisbelow(True)
