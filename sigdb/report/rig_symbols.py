"""Symbols of a rig's drawing; places in inches."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

INK, SENSOR = "#1f3a5f", "#c8553d"


def draw_box(
    axes: Axes, x: float, y: float, width: float, half: float, colour: str, *, style: str = "-", zorder: float = 1.5
) -> None:
    """A rectangle from x to x + width, half above and half below y."""
    axes.add_patch(
        Rectangle((x, y - half), width, 2 * half, facecolor=colour, edgecolor=INK, linewidth=0.8, linestyle=style,
                  zorder=zorder)
    )  # fmt: skip


def draw_zigzag(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    """A spring."""
    a, b = np.array(start), np.array(end)
    along = np.array([0, 0.2, 0.27, 0.4, 0.53, 0.66, 0.8, 1.0])
    across = 0.05 * np.array([0, 0, 1, -1, 1, -1, 0, 0])
    normal = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a)
    points = a + along[:, None] * (b - a) + across[:, None] * normal
    axes.plot(points[:, 0], points[:, 1], color=INK, linewidth=0.9, zorder=3)


def draw_arrow(axes: Axes, x: float, y: float, right: float, up: float) -> None:
    """A sensor's direction as it is seen in the side view."""
    if np.hypot(right, up) < 0.1:
        axes.plot([x], [y], marker="o", markersize=8, fillstyle="none", color=SENSOR, zorder=5)
        axes.plot([x], [y], marker=".", markersize=4, color=SENSOR, zorder=5)
        return
    axes.annotate(
        "", (x + 0.4 * right, y + 0.4 * up), (x, y), zorder=5,
        arrowprops={"arrowstyle": "-|>", "color": SENSOR, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip


def draw_text(axes: Axes, x: float, y: float, text: str, colour: str, *, size: float = 8.0) -> None:
    """A word that hides the lines behind it."""
    box = {"boxstyle": "square,pad=0.08", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    axes.text(x, y, text, fontsize=size, color=colour, ha="center", va="center", bbox=box, zorder=5)
