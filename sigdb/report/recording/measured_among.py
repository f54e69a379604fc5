"""The picture of where measured rows lie among simulated ones: the two directions in which simulated spectra vary."""

from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.core import BoolArray, FloatArray

_MESH_ORDERS = 4
_INSIDE = 0.95
"""Share of the simulated rows that lie within the ellipse."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AmongSimulated:
    """Simulated and measured rows in the plane of the two main directions of the simulated ones.

    Attributes
    ----------
    simulated, measured
        (rows, 2) coordinates.
    damaged
        Whether each simulated row is damaged.
    inside
        Share of the measured rows within the ellipse that holds 95 % of the simulated rows.
    """

    simulated: FloatArray
    measured: FloatArray
    damaged: BoolArray
    inside: float


def among_simulated(
    simulated: FloatArray, measured: FloatArray, damaged: BoolArray, *, teeth: int, path_removed: bool
) -> AmongSimulated:
    """Return where measured rows lie among simulated ones.

    The logarithms of the amplitudes at orders 1 to 4.5 mesh orders are projected on the two main directions in which
    those of the simulated rows vary.

    Parameters
    ----------
    simulated, measured
        (rows, n / 2 + 1) order spectra.
    damaged
        Whether each simulated row is damaged.
    teeth
        Tooth count.
    path_removed
        Whether the mean logarithm in each mesh order is removed from each row: a gain, and a path that is flat there.
    """
    logs = [_logarithms(each, teeth, path_removed) for each in (simulated, measured)]
    centre = logs[0].mean(axis=0)
    directions = np.linalg.svd(logs[0] - centre, full_matrices=False)[2][:2]
    flat, other = ((each - centre) @ directions.T for each in logs)
    inverse = np.linalg.pinv(np.cov(flat.T))
    distance, away = (np.einsum("ij,jk,ik->i", each, inverse, each) for each in (flat, other))
    inside = float(np.mean(away <= np.quantile(distance, _INSIDE))) if len(away) else np.nan
    return AmongSimulated(simulated=flat, measured=other, damaged=damaged, inside=inside)


def _logarithms(spectra: FloatArray, teeth: int, path_removed: bool) -> FloatArray:
    """Return the logarithms (rows, orders) of the amplitudes."""
    top = min(int((_MESH_ORDERS + 0.5) * teeth), spectra.shape[1] - 1)
    floor = 1e-6 * spectra.max(axis=1, keepdims=True, initial=np.finfo(float).tiny)
    logs = np.log10(np.maximum(np.asarray(spectra[:, 1 : top + 1], float), floor))
    if path_removed:
        band = (np.arange(1, top + 1) + teeth // 2) // teeth
        for number in np.unique(band):
            logs[:, band == number] -= logs[:, band == number].mean(axis=1, keepdims=True)
    return logs


def among_figure(as_they_are: AmongSimulated, path_removed: AmongSimulated, *, title: str) -> Figure:
    """Draw simulated and measured rows, as they are and with gain and path removed."""
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=11)
    panels = (("as they are", as_they_are), ("gain and path removed", path_removed))
    for axes, (name, each) in zip(figure.subplots(1, 2), panels, strict=True):
        for damaged, colour, label in (
            (True, "#e8b27d", "simulated, damaged"),
            (False, "#8a8a8a", "simulated, healthy"),
        ):
            axes.scatter(*each.simulated[each.damaged == damaged].T, s=6, color=colour, label=label, rasterized=True)
        axes.scatter(*each.measured.T, s=16, color="#1f5fa8", marker="x", label="measured, healthy")
        axes.set(
            title=f"{name}: {each.inside:.0%} of the measured within",
            xlabel="first direction of log amplitude",
            ylabel="second direction",
        )
        axes.title.set_fontsize(9)
    figure.axes[0].legend(fontsize=8)
    return figure
