"""Figures of a model against the best possible answer: loss, and errors over the bound's, by noise band."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sigdb.recognition import Evaluation
from sigdb.recognition.aims import LOSS_DB, RATIO
from sigdb.recognition.noise_bands import ALL
from sigdb.report.evaluation_style import drawing, lay_grid
from sigdb.report.panels import DAMAGE, INK

_PANELS = (
    (
        "loss_db",
        LOSS_DB,
        "Loss against the best possible",
        "loss, dB",
        "By how much the noise may grow until the best rule has as many errors as the model: 3 dB waste half of the "
        "revolutions.",
    ),
    ("a90_ratio", RATIO, "Smallest loss that is found", "a90 over the bound's", "At a false-alarm rate of 1e-3."),
    ("mae_ratio", RATIO, "Error over the best possible", "MAE over the posterior median's", "1 is the best."),
)
_COLOURS = (INK, DAMAGE, "#3c8d7a")


def efficiency_figures(evaluation: Evaluation) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure of what is known in two noise bands or more."""
    table = evaluation.efficiency
    if table is None:
        return
    bands = table[table["band"] != ALL]
    for column, aim, heading, label, caption in _PANELS:
        if column in bands and bands.loc[np.isfinite(bands[column]), "band"].nunique() > 1:
            said = f"{caption} Bars: 95 % intervals over specimens; wide: noise bands. The dashed line is the aim."
            yield f"{heading}, by noise band", said, _banded(bands, column, aim, label)


def _banded(bands: pd.DataFrame, column: str, aim: float, label: str) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        groups = list(bands.groupby("target", sort=False)) if "target" in bands else [("", bands)]
        for i, (name, own) in enumerate(groups):
            _draw(axes, own[np.isfinite(own[column])], column, (i - (len(groups) - 1) / 2) / 6, str(name), _COLOURS[i])
        axes.axhline(aim, color="#888888", linewidth=0.9, linestyle="--")
        axes.axhline(1 if aim == RATIO else 0, color="#111111", linewidth=0.8)
        axes.set(xlabel="signal-to-noise ratio of one revolution, dB", ylabel=label)
        if len(groups) > 1:
            axes.legend(frameon=False, fontsize=8)
        lay_grid(axes)
    return figure


def _draw(axes: Axes, own: pd.DataFrame, column: str, aside: float, name: str, colour: str) -> None:
    """Values at the middle of their bands, beside those of other targets; bars for the interval and the band."""
    width = (own["high_db"] - own["low_db"]).to_numpy()
    at = (own["low_db"] + own["high_db"]).to_numpy() / 2 + aside * width
    value = own[column].to_numpy()
    ends = np.nan_to_num(np.abs(own[[f"{column}_low", f"{column}_high"]].to_numpy().T - value), posinf=0.0)
    axes.errorbar(at, value, ends, fmt="o", ms=4, capsize=3, color=colour, label=name or None)
    axes.hlines(value, own["low_db"], own["high_db"], color=colour, linewidth=0.8, alpha=0.5)
