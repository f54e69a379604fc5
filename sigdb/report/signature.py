"""The picture of a signature: averaged signal, order spectrum, Wigner-Ville distribution, as in the paper's figures."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sigdb.core import FloatArray, InputError, publish
from sigdb.report.panels import MARGIN, colour_limit, draw_distribution, draw_signal, draw_spectrum
from sigdb.report.settings import ReportSettings
from sigdb.signature import order_spectrum, wigner_ville


def signature_figure(
    tsa: FloatArray,
    *,
    teeth: int,
    sensor: str,
    unit: str,
    title: str,
    damaged: tuple[int, ...] = (),
    settings: ReportSettings | None = None,
    others: Sequence[FloatArray] = (),
) -> Figure:
    """Draw three panels: signal against angle with the tooth passes, order spectrum, Wigner-Ville distribution.

    Parameters
    ----------
    tsa
        (n,) average of one revolution, from the tacho mark.
    teeth
        Tooth count.
    sensor, unit
        Name and unit of the signal.
    title
        Heading of the picture.
    damaged
        Damaged teeth, marked in the panels over angle.
    settings
        Highest order shown.
    others
        Averages whose pictures are to be compared with this one: axes and colours hold them all.

    Returns
    -------
    matplotlib.figure.Figure
    """
    settings = settings or ReportSettings()
    highest = min(settings.mesh_orders * teeth, len(tsa) / 2)
    with matplotlib.rc_context({"font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left"}):
        figure = Figure(figsize=(8.0, 8.6), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, fontsize=11)
        signal, spectrum, distribution = figure.subplots(3, 1, height_ratios=(1.0, 0.8, 1.3))
        draw_signal(signal, tsa, teeth, damaged)
        signal.set(title="Synchronous average", ylabel=f"{sensor}, {unit}")
        draw_spectrum(spectrum, tsa, teeth, highest)
        spectrum.set(
            title="Order spectrum (peak amplitude)", xlabel="order, 1/rev (ticks at mesh harmonics)", ylabel=unit
        )
        w = wigner_ville(tsa - tsa.mean())
        limit = colour_limit(w, highest)
        for other in others:
            _hold(signal, spectrum, other, highest)
            limit = max(limit, colour_limit(wigner_ville(other - other.mean()), highest))
        image = draw_distribution(distribution, w, teeth, highest, damaged, limit)
        distribution.set(
            title="Wigner-Ville distribution (half-window 60 deg of rotation)",
            xlabel="angle, deg (tooth passes numbered)",
            ylabel="order, 1/rev",
        )
        figure.colorbar(image, ax=distribution, extend="both", pad=0.01, label=f"({unit})$^2$ per bin")
    return figure


def _hold(signal: Axes, spectrum: Axes, other: FloatArray, highest: float) -> None:
    """Widen the axes of a signal and of its spectrum until they would hold another average."""
    low, high = signal.get_ylim()
    room = MARGIN * float(np.ptp(other))
    signal.set_ylim(min(low, float(other.min()) - room), max(high, float(other.max()) + room))
    order, c = order_spectrum(other)
    amplitude = float(np.abs(c[(order > 0) & (order <= highest)]).max())
    spectrum.set_ylim(top=max(spectrum.get_ylim()[1], 1.05 * amplitude))


def save_figure(figure: Figure, path: Path, settings: ReportSettings | None = None) -> None:
    """Write a picture; the format follows the file's suffix.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The picture.
    path : pathlib.Path
        The file; its folder is created if it does not exist.
    settings : ReportSettings, optional
        Resolution.

    Raises
    ------
    InputError
        If the suffix names no format of pictures.
    """
    check_picture(path)
    dpi, form = (settings or ReportSettings()).dots_per_inch, path.suffix.lstrip(".").lower()
    publish(path, lambda temporary: figure.savefig(temporary, format=form, dpi=dpi))


def check_picture(path: Path) -> None:
    """Refuse a file whose suffix names no format of pictures.

    Parameters
    ----------
    path : pathlib.Path
        The file.

    Raises
    ------
    InputError
        If the suffix names no format of pictures.
    """
    if path.suffix.lstrip(".").lower() not in FigureCanvasAgg.get_supported_filetypes():
        raise InputError(f"{path}: not a picture's name; end it in .png, .svg or .pdf")
