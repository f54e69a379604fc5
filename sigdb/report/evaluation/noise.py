"""Pictures against noise: metrics of all estimators, and the efficiency of the model by noise band."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition import ALL, FACTORS, TARGETS, Evaluation
from sigdb.report.evaluation.style import BOUND_STYLE, Styles, by_estimator, drawing, lay_grid
from sigdb.report.page import CaptionedFigure
from sigdb.report.panels import DAMAGE, INK

_AXES = {
    "snr_db": ("signal-to-noise ratio of one revolution, dB", "against the signal-to-noise ratio"),
    "averages": ("revolutions in the average", "against the number of averages"),
}
_METRICS = {
    "accuracy": ("share of correct answers", "Accuracy, healthy rows too,"),
    "p_exact": ("P(exact tooth)", "Exact tooth of damaged rows"),
    "p_kind": ("P(correct kind)", "Kind of damaged rows"),
    "p_detected": ("share of damaged rows detected", "Damaged rows detected"),
    "false_alarm_rate": ("false-alarm rate", "False alarms"),
} | {
    f"mae_{name}": (f"MAE of the {shown.label}", f"Error of the {shown.title}")
    for name, shown in SHOWN_QUANTITIES.items()
}
_SHARES = ("accuracy", "p_exact", "p_kind", "p_detected")


def noise_figures(evaluation: Evaluation, styles: Styles) -> Iterator[CaptionedFigure]:
    """Yield pictures of metrics against noise, and against averages where these vary."""
    bound = "the dashed line is the bound" if evaluation.bound else "the bound is not computed"
    for axis, (label, against) in _AXES.items():
        table = evaluation.tables.get(axis)
        if table is None or (axis != "snr_db" and table["at"].nunique() < 2):
            continue
        for metric in TARGETS[evaluation.target].pictured_metrics:
            rows, heading = table[table["metric"] == metric], _METRICS[metric][1]
            if rows.empty:
                continue
            rows = rows.assign(**rows[["value", "low", "high"]] * FACTORS[metric])
            if rows["at"].nunique() > 1:
                caption = f"Bars: 95 % intervals over specimens; {bound}."
                figure = _lines(rows, styles, label, metric, logarithmic=axis == "averages")
                yield CaptionedFigure(f"{heading} {against}", caption, figure)
            else:
                caption = f"All rows have {rows['at'].iloc[0]:g} dB. Bars: 95 % intervals over specimens; {bound}."
                yield CaptionedFigure(f"{heading} at one signal-to-noise ratio", caption, _dots(rows, styles, metric))


def _lines(rows: pd.DataFrame, styles: Styles, label: str, metric: str, *, logarithmic: bool) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        for name, line in by_estimator(rows):
            if name == "bound":
                axes.plot(line["at"], line["value"], label=name, **BOUND_STYLE)
                continue
            ends = np.abs(line[["low", "high"]].to_numpy().T - line["value"].to_numpy())
            axes.errorbar(line["at"], line["value"], ends, fmt="o-", ms=3, capsize=2, label=name, **styles[name])
        axes.set(xlabel=label, ylabel=_METRICS[metric][0])
        if logarithmic:
            axes.set_xscale("log")
            axes.set_xticks(sorted(rows["at"].unique()))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_locator(NullLocator())
        axes.set_ylim(0, 1.01 if metric in _SHARES else None)
        axes.legend(frameon=False, fontsize=8)
        lay_grid(axes)
    return figure


def _dots(rows: pd.DataFrame, styles: Styles, metric: str) -> Figure:
    rows = rows.iloc[::-1]
    with drawing(height=1.0 + 0.32 * len(rows)) as figure:
        axes = figure.subplots()
        for place, name, value, low, high in zip(
            range(len(rows)), *(rows[key] for key in ("estimator", "value", "low", "high")), strict=True
        ):
            colour = (BOUND_STYLE if name == "bound" else styles[name])["color"]
            axes.errorbar(value, place, xerr=[[value - low], [high - value]], fmt="o", capsize=3, color=colour)
            axes.annotate(f"{value:.3f}", (value, place), (0, 5), textcoords="offset points", ha="center", fontsize=8)
        axes.set_yticks(range(len(rows)), list(rows["estimator"]))
        axes.set(xlabel=_METRICS[metric][0], ylim=(-0.5, len(rows) - 0.3))
        axes.margins(x=0.08)
        axes.set_xlim(left=min(0, axes.get_xlim()[0]))
        lay_grid(axes)
    return figure


_PANELS = (
    (
        "loss_db",
        0.0,
        "Loss against the best possible",
        "loss, dB",
        "The increase of the noise at which the best rule has as many errors as the model: 3 dB waste half of the "
        "revolutions.",
    ),
    ("a90_ratio", 1.0, "Smallest detected loss", "a90 over the bound's", "At a false-alarm rate of 1e-3."),
    ("mae_ratio", 1.0, "Error over the best possible", "MAE over the posterior median's", "1 is the best."),
)
_COLOURS = (INK, DAMAGE, "#3c8d7a")


def efficiency_figures(evaluation: Evaluation) -> Iterator[CaptionedFigure]:
    """Yield pictures of what is estimated in two noise bands or more."""
    table = evaluation.efficiency
    if table is None:
        return
    bands = table[table["band"] != ALL]
    limits = {result.criterion: result.limit for result in evaluation.criteria}
    for column, best, heading, label, caption in _PANELS:
        if column in bands and bands.loc[np.isfinite(bands[column]), "band"].nunique() > 1:
            limit = limits.get(column)
            dashed = "" if limit is None else " The dashed line is the limit of the criterion."
            text = f"{caption} Bars: 95 % intervals over specimens; wide: noise bands.{dashed}"
            yield CaptionedFigure(f"{heading}, by noise band", text, _banded(bands, column, best, limit, label))


def _banded(bands: pd.DataFrame, column: str, best: float, limit: float | None, label: str) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        groups = list(bands.groupby("quantity", sort=False)) if "quantity" in bands else [("", bands)]
        for i, (name, rows) in enumerate(groups):
            shift = (i - (len(groups) - 1) / 2) / 6
            _draw(
                axes,
                rows[np.isfinite(rows[column])],
                column,
                shift,
                str(name),
                f"C{i}" if i >= len(_COLOURS) else _COLOURS[i],
            )
        if limit is not None:
            axes.axhline(limit, color="#888888", linewidth=0.9, linestyle="--")
        axes.axhline(best, color="#111111", linewidth=0.8)
        axes.set(xlabel="signal-to-noise ratio of one revolution, dB", ylabel=label)
        if len(groups) > 1:
            axes.legend(frameon=False, fontsize=8)
        lay_grid(axes)
    return figure


def _draw(axes: Axes, rows: pd.DataFrame, column: str, shift: float, name: str, colour: str) -> None:
    """Draw values at the middle of their bands, shifted from other quantities; bars for the interval and the band."""
    width = (rows["high_db"] - rows["low_db"]).to_numpy()
    at = (rows["low_db"] + rows["high_db"]).to_numpy() / 2 + shift * width
    value = rows[column].to_numpy()
    ends = np.nan_to_num(np.abs(rows[[f"{column}_low", f"{column}_high"]].to_numpy().T - value), posinf=0.0)
    axes.errorbar(at, value, ends, fmt="o", ms=4, capsize=3, color=colour, label=name or None)
    axes.hlines(value, rows["low_db"], rows["high_db"], color=colour, linewidth=0.8, alpha=0.5)
