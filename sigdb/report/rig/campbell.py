"""The Campbell diagram: natural frequencies against speed, with the orders that excite them."""

import textwrap
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

from sigdb.core import FloatArray, InputError
from sigdb.transmission import Transmission, coupled_modes

_SPEEDS = 25
_LOWEST, _HIGHEST = 0.02, 1.25
"""Range of speeds, as fractions of the operating one."""
_MESH_ORDERS = (1, 2, 3)
_SHAFT_ROOM, _MESH_ROOM = 3.0 * _HIGHEST, 1.1 * _MESH_ORDERS[-1]
"""Highest frequency shown, as a multiple of the fastest shaft's or mesh's at the operating speed."""
_DAMPING = LogNorm(0.003, 0.3, clip=True)
_ORDER, _OPERATING = "#8a8a8a", "#c8553d"

Order = tuple[str, float]
"""A label, and a frequency at the operating speed, Hz."""


def campbell_figure(rig: Transmission, *, max_hz: float | None = None) -> Figure:
    """Draw the natural frequencies of the coupled rig at 25 speeds, from near rest to 1.25 times the operating speed.

    Each mark is a mode at a speed, coloured by its damping ratio. Lines are the speeds of the shafts and, in a panel of
    its own with a wider range of frequencies, the first three harmonics of the meshes, each to beyond the operating
    speed.

    Parameters
    ----------
    rig : Transmission
        The rig.
    max_hz : float, optional
        Highest frequency shown, Hz; by default three times the fastest shaft's at the highest speed, and 1.1 times the
        third harmonic of the fastest mesh at the operating speed.

    Returns
    -------
    matplotlib.figure.Figure
        The diagram.

    Raises
    ------
    InputError
        If the rig stands still, or a part of it can move freely.
    """
    operating = rig.operating.speed_rpm
    if not operating:
        raise InputError(f"rig {rig.name!r} stands still; a Campbell diagram needs operating.speed_rpm above 0")
    speeds = np.linspace(_LOWEST, _HIGHEST, _SPEEDS) * operating
    with threadpool_limits(1):  # many small eigenproblems: threads would only wait for each other
        modes = [coupled_modes(rig.replace({"operating.speed_rpm": float(speed)})) for speed in speeds]
    x = np.concatenate([np.full(len(each.frequency_hz), speed) for each, speed in zip(modes, speeds, strict=True)])
    y = np.concatenate([each.frequency_hz for each in modes])
    damping = np.concatenate([each.damping_ratio for each in modes])

    turning = [(f"{name} 1x", float(abs(rig.speed(name)) / (2 * np.pi))) for name in rig.shafts]
    meshing = [(f"{name} {n}x", n * rig.mesh_frequency(name)) for name in rig.meshes for n in _MESH_ORDERS]
    fastest = max((rig.mesh_frequency(name) for name in rig.meshes), default=0.0)
    panels = [("Shaft orders", turning, _SHAFT_ROOM * max(hertz for _, hertz in turning))]
    if meshing:
        panels.append(("Mesh orders", meshing, _MESH_ROOM * fastest))
    with matplotlib.rc_context({"font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left"}):
        figure = Figure(figsize=(1.6 + 4.7 * len(panels), 5.2), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(textwrap.fill(f"Campbell diagram: {rig.title or rig.name}", 60 * len(panels)), fontsize=11)
        axes = figure.subplots(1, len(panels), squeeze=False)[0]
        for panel, (title, orders, highest) in zip(axes, panels, strict=True):
            panel.set_title(title)
            panel.set_xlabel(f"speed of {rig.drive_shaft}, rpm")
            _draw(panel, (x, y, damping), orders, operating, max_hz or highest)
        figure.colorbar(
            ScalarMappable(_DAMPING, "viridis"), ax=list(axes), label="damping ratio", extend="both", pad=0.01
        )
    return figure


def _draw(
    axes: Axes,
    modes: tuple[FloatArray, FloatArray, FloatArray],
    orders: Sequence[Order],
    operating: float,
    highest: float,
) -> None:
    top = _HIGHEST * operating
    for _, hertz in orders:
        axes.plot([0, top], [0, hertz * _HIGHEST], color=_ORDER, linewidth=0.8, linestyle=(0, (4, 2)))
    _label(axes, orders, top, highest)
    axes.axvline(operating, color=_OPERATING, linewidth=1.0)
    axes.annotate(
        "operating",
        (operating, 1),
        xycoords=("data", "axes fraction"),
        xytext=(-3, -4),
        textcoords="offset points",
        ha="right",
        va="top",
        rotation=90,
        fontsize=7,
        color=_OPERATING,
    )
    x, y, damping = modes
    shown = (y > 0) & (y <= highest)
    axes.scatter(
        x[shown], y[shown], c=damping[shown], norm=_DAMPING, cmap="viridis", marker="_", s=120, linewidths=1.6, zorder=2
    )
    axes.set(ylabel="frequency, Hz", xlim=(0, top), ylim=(0, highest))
    axes.grid(color="#e6e6e6", linewidth=0.5)
    axes.set_axisbelow(True)


def _label(axes: Axes, orders: Sequence[Order], top: float, highest: float) -> None:
    """Write the names of the lines where they leave the panel, apart from each other."""
    used: list[tuple[float, float]] = []
    for label, hertz in sorted(orders, key=lambda order: order[1]):
        out = hertz * _HIGHEST / highest  # above 1 the line leaves at the top
        x, y = (min(1.0, 1 / out), min(out, 1.0)) if out else (1.0, 0.0)
        y += 0.02 if out <= 0.97 else -0.025
        while any(abs(x - a) < 0.2 and abs(y - b) < 0.04 for a, b in used):
            y += 0.01 if out <= 0.97 else -0.01
        used.append((x, y))
        axes.annotate(
            label,
            (x, y),
            xycoords="axes fraction",
            xytext=(-3, 0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=7,
            color="#555555",
            bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7},
            zorder=3,
        )
