"""Pictures of a recording's signature: speed, average, spectrum over the angle, Wigner-Ville distribution, history."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from sigdb.core import FloatArray
from sigdb.recording import OrderMap, RecordedSignature
from sigdb.report.evaluation.style import drawing, lay_grid
from sigdb.report.page import CaptionedFigure
from sigdb.report.panels import DAMAGE, HEALTHY, INK, draw_distribution, draw_signal
from sigdb.signature import wigner_ville

_KINDS = {"mesh": DAMAGE, "sideband": "#3c8d7a", "shaft": "#8a6bbd", "bearing": "#b5651d", "unnamed": "#8c8c8c"}
_HIGHEST = 4
"""Highest order of the distribution, in mesh orders."""
_ABOUT = 2.6
"""Orders to either side of a mesh harmonic in the enlarged spectra."""


def recorded_figures(signature: RecordedSignature) -> Iterator[CaptionedFigure]:
    """Yield the pictures of a recording's signature.

    Parameters
    ----------
    signature : RecordedSignature
        From :func:`sigdb.recording.recorded_signature`.

    Yields
    ------
    CaptionedFigure
        Heading, caption and figure.
    """
    yield _speed(signature)
    yield _average(signature)
    yield _spectrum(signature)
    yield _sidebands(signature)
    yield _envelope(signature)
    if signature.order_map is not None:
        yield _order_map(signature, signature.order_map)
    yield _distribution(signature)


def history_figure(history: pd.DataFrame) -> CaptionedFigure:
    """Return the picture of the indicators over the recordings of a machine.

    Parameters
    ----------
    history : pandas.DataFrame
        From :func:`sigdb.recording.recorded_history`.

    Returns
    -------
    CaptionedFigure
        Heading, caption and figure.
    """
    shown = [name for name in ("na4", "nb4", "na4_star", "nb4_star") if name in history]
    with drawing(width=8.0) as figure:
        axes = figure.subplots()
        for name, colour in zip(shown, (INK, DAMAGE, "#3c8d7a", "#8a6bbd"), strict=False):
            label = name.upper().replace("_STAR", "*")
            axes.plot(np.arange(1, len(history) + 1), history[name], "o-", color=colour, label=label)
        axes.set(xlabel="recording", ylabel="quotient", yscale="log", xticks=np.arange(1, len(history) + 1))
        axes.legend(frameon=False)
        lay_grid(axes)
    caption = "NA4 and NB4 against the mean of the recordings up to each; with a star against the first, healthy ones."
    return CaptionedFigure("History", f"{caption} A change of load or speed changes them as damage does.", figure)


def _speed(signature: RecordedSignature) -> CaptionedFigure:
    track = signature.speed_track
    with drawing(width=8.0, height=2.4) as figure:
        axes = figure.subplots()
        axes.plot(track["time"], track["speed_rpm"], color=INK, linewidth=1)
        axes.set(xlabel="time, s", ylabel="speed, rpm")
        axes.ticklabel_format(axis="y", useOffset=False)
        lay_grid(axes)
    return CaptionedFigure("Speed", f"Speed of each revolution, from the {signature.angle}.", figure)


def _average(signature: RecordedSignature) -> CaptionedFigure:
    with drawing(width=8.0, height=3.0) as figure:
        axes = figure.subplots()
        draw_signal(axes, signature.tsa, signature.teeth, ())
        axes.set(xlabel="angle, deg (tooth passes numbered)", ylabel=_with_unit(signature))
    counted = (
        "tooth 1 is the first after the tacho mark"
        if signature.absolute
        else "numbers are relative: tooth 1 is arbitrary"
    )
    return CaptionedFigure("Synchronous average", f"{signature.averages} revolutions; {counted}.", figure)


def _spectrum(signature: RecordedSignature) -> CaptionedFigure:
    spectrum = signature.record_spectrum
    with drawing(width=8.0, height=3.4) as figure:
        axes = figure.subplots()
        _draw_spectrum(axes, spectrum[spectrum["order"] > 0])
        _mark(axes, signature.lines, ("shaft", "mesh", "sideband", "unnamed"), names=False)
        axes.set(
            xlim=(0, spectrum["order"].iloc[-1]), xlabel="order, 1/rev", ylabel=f"peak amplitude, {_unit(signature)}"
        )
        axes.legend(frameon=False, ncols=5, fontsize=8, loc="upper left", bbox_to_anchor=(0, 1.12))
    return CaptionedFigure(
        "Order spectrum over the angle",
        "Spectrum of the record in equal steps of angle, not averaged, so that orders of other shafts show. Dots are "
        "lines that stand out of the level around them.",
        figure,
    )


def _sidebands(signature: RecordedSignature) -> CaptionedFigure:
    spectrum, teeth = signature.record_spectrum, signature.teeth
    order = spectrum["order"].to_numpy()
    centres = [h * teeth for h in (1, 2, 3) if h * teeth + _ABOUT <= order[-1]] or [teeth]
    with drawing(width=8.0, height=1.0 + 2.1 * len(centres)) as figure:
        for axes, centre in zip(figure.subplots(len(centres), 1, squeeze=False)[:, 0], centres, strict=True):
            _draw_spectrum(axes, spectrum[np.abs(order - centre) <= _ABOUT])
            axes.set(xlim=(centre - _ABOUT, centre + _ABOUT), ylabel=_unit(signature))
            axes.set_ylim(top=axes.get_ylim()[1] * 12)  # room for the names
            _mark(axes, signature.lines, ("mesh", "sideband", "unnamed"), names=True)
        axes.set_xlabel("order, 1/rev")
    return CaptionedFigure(
        "Mesh harmonics and sidebands", "The same spectrum about the first mesh harmonics, lines named.", figure
    )


def _envelope(signature: RecordedSignature) -> CaptionedFigure:
    spectrum, envelope = signature.envelope.spectrum, signature.envelope
    with drawing(width=8.0, height=3.2) as figure:
        axes = figure.subplots()
        _draw_spectrum(axes, spectrum[spectrum["order"] > 0])
        axes.set_ylim(top=axes.get_ylim()[1] * 12)  # room for the names
        axes.set(xlim=(0, spectrum["order"].iloc[-1]), xlabel="order, 1/rev", ylabel=f"peak, {_unit(signature)}")
        _mark(axes, envelope.lines, ("shaft", "bearing", "unnamed"), names=True)
    low, high = envelope.band
    band = f"The record without its average, in the band of orders {low:.4g} to {high:.4g}"
    return CaptionedFigure(
        "Envelope spectrum",
        f"{band}, excess kurtosis {envelope.kurtosis:.3g}. Dots are lines that stand out.",
        figure,
    )


def _order_map(signature: RecordedSignature, by_speed: OrderMap) -> CaptionedFigure:
    with drawing(width=8.0, height=4.2) as figure:
        axes = figure.subplots()
        decibels = 20 * np.log10(np.maximum(by_speed.amplitude, 1e-5 * np.nanmax(by_speed.amplitude)))
        image = axes.pcolormesh(
            by_speed.order, by_speed.speed_rpm, decibels, shading="nearest", cmap="magma", rasterized=True
        )
        image.set_clim(np.nanmax(decibels) - 60, np.nanmax(decibels))
        axes.set(xlabel="order, 1/rev", ylabel="speed, rpm")
        figure.colorbar(image, ax=axes, pad=0.01, label=f"peak amplitude, dB re 1 {_unit(signature)}")
    return CaptionedFigure(
        "Order map",
        "Amplitude by order and speed, from frames of eight revolutions; white where no frame lies.",
        figure,
    )


def _distribution(signature: RecordedSignature) -> CaptionedFigure:
    teeth = signature.teeth
    x = _below(signature.tsa, 2 * _HIGHEST * teeth)
    with drawing(width=8.0, height=4.2) as figure:
        axes = figure.subplots()
        image = draw_distribution(axes, wigner_ville(x - x.mean()), teeth, _HIGHEST * teeth, ())
        axes.set(xlabel="angle, deg (tooth passes numbered)", ylabel="order, 1/rev")
        figure.colorbar(image, ax=axes, extend="both", pad=0.01, label=_per_bin(signature))
    caption = f"Orders of the average up to {2 * _HIGHEST} mesh orders; half-window 60 deg of rotation."
    return CaptionedFigure("Wigner-Ville distribution", caption, figure)


def _below(tsa: FloatArray, highest: int) -> FloatArray:
    """The average without its orders from a highest one on, in as few samples as it needs."""
    if len(tsa) <= 2 * highest:
        return tsa
    X = np.fft.rfft(tsa)[: highest + 1]
    X[-1] = 0
    return np.fft.irfft(X, 2 * highest) * (2 * highest / len(tsa))


def _draw_spectrum(axes: Axes, spectrum: pd.DataFrame) -> None:
    order, amplitude, level = (spectrum[name].to_numpy() for name in ("order", "amplitude", "level"))
    least = max(float(level.min()), 1e-6 * float(amplitude.max()), np.finfo(float).tiny) / 10
    axes.plot(order, np.maximum(amplitude, least), color=HEALTHY, linewidth=0.7)
    axes.plot(order, np.maximum(level, least), color=INK, linewidth=1, label="level")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(bottom=least)
    lay_grid(axes)


def _mark(axes: Axes, lines: pd.DataFrame, kinds: Sequence[str], *, names: bool) -> None:
    """Draw dots at the lines that stand out, with their names."""
    low, high = axes.get_xlim() if names else (0, np.inf)
    shown = lines[lines["stands_out"] & lines["order"].between(low, high)]
    for kind in kinds:
        dots = shown[shown["kind"] == kind]
        axes.plot(dots["order"], dots["amplitude"], "o", color=_KINDS[kind], markersize=3.5, label=kind)
        for line in dots.itertuples() if names else ():
            axes.annotate(
                _last_words(str(line.name)),
                (line.order, line.amplitude),
                xytext=(0, 7),
                textcoords="offset points",
                rotation=90,
                ha="center",
                va="bottom",
                fontsize=6.5,
                color=_KINDS[kind],
            )


def _last_words(name: str) -> str:
    """Return the part of a sideband's name behind its mesh harmonic."""
    return name[max(name.rfind(sign) for sign in (" + ", " - ", " +", " -")) + 1 :]


def _unit(signature: RecordedSignature) -> str:
    return signature.unit or "unit not stated"


def _per_bin(signature: RecordedSignature) -> str:
    return f"({signature.unit})$^2$ per bin" if signature.unit else "square per bin, unit not stated"


def _with_unit(signature: RecordedSignature) -> str:
    return f"{signature.channel}, {_unit(signature)}"
