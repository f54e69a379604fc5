"""Figures of an evaluation of location: confusion around the gear, detection, calibration."""

from collections.abc import Callable, Iterator
from typing import cast

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from sigdb.recognition import Evaluation
from sigdb.report.evaluation.style import BOUND_STYLE, Styles, by_estimator, drawing, lay_grid
from sigdb.report.panels import DAMAGE, GRID, INK

_LEAST = 10
"""Rows of a bin of probabilities that is drawn."""


def confusion_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """True against found teeth, 'none' first; colours tell the share of a row, on a scale that shows rare errors."""
    table = evaluation.tables["confusion"]
    teeth = int(table["teeth"].mode()[0])
    own = table[table["teeth"] == teeth]
    share = np.zeros((teeth + 1, teeth + 1))
    np.add.at(share, (own["tooth"].to_numpy(int), own["found"].to_numpy(int).clip(max=teeth)), own["rows"].to_numpy())
    share /= np.maximum(share.sum(axis=1, keepdims=True), 1)
    with drawing(width=4.8, height=4.6) as figure:
        axes = figure.subplots()
        image = axes.imshow(np.where(share > 0, np.sqrt(share), np.nan), cmap="Blues", vmin=0, vmax=1)
        step = -(-(teeth + 1) // 20)
        ticks = np.unique(np.append(0, np.arange(1, teeth + 1, step)))
        names = ["none", *map(str, ticks[1:])]
        axes.set_xticks(ticks, names)
        axes.set_yticks(ticks, names)
        axes.set(xlabel="tooth found", ylabel="true tooth", title=f"{evaluation.learner}, {teeth} teeth")
        axes.tick_params(axis="x", labelrotation=90 if teeth > 12 else 0)
        axes.axhline(0.5, color=INK, linewidth=0.6)
        axes.axvline(0.5, color=INK, linewidth=0.6)
        if teeth <= 15:
            _write_shares(axes, share)
        bar = figure.colorbar(image, ax=axes, shrink=0.85, pad=0.02, label="share of the rows of a true tooth")
        marks = np.array([0, 0.01, 0.1, 0.3, 0.6, 1])
        bar.set_ticks(np.sqrt(marks).tolist(), labels=[f"{mark:g}" for mark in marks])
    return figure


def _write_shares(axes: Axes, share: np.ndarray) -> None:
    for (row, column), value in np.ndenumerate(share):
        if value >= 0.005:
            colour = "white" if value > 0.3 else INK
            text = "1" if value > 0.995 else f"{value:.2f}"[1:]
            axes.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)


def around_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Distance from the true to the found tooth around the gear, of damaged rows that are given a tooth."""
    table = evaluation.tables["confusion"]
    teeth = int(table["teeth"].mode()[0])
    own = table[(table["teeth"] == teeth) & (table["tooth"] > 0)]
    called = own[own["found"] > 0]
    share = np.bincount((called["found"] - called["tooth"]) % teeth, called["rows"], teeth) / own["rows"].sum()
    missed = 1 - share.sum()
    least = 1 / own["rows"].sum()
    with drawing(width=4.8, height=4.6) as figure:
        axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        angle = 2 * np.pi * np.arange(teeth) / teeth
        floor = np.floor(np.log10(least))
        height = np.log10(np.maximum(share, 10**floor)) - floor
        axes.bar(angle, height, width=0.8 * 2 * np.pi / teeth, color=[INK, *[DAMAGE] * (teeth - 1)])
        decades = np.arange(1, -int(floor) + 1)
        axes.set_yticks(decades, [f"{10.0 ** (one + floor):g}" for one in decades], fontsize=7)
        axes.set_ylim(0, -floor)
        axes.set_rlabel_position((teeth // 2 + 0.5) * 360 / teeth)
        step = -(-teeth // 24)
        distance = (np.arange(teeth) + teeth // 2) % teeth - teeth // 2
        axes.set_xticks(angle[::step], [f"{one:+d}" if one else "0" for one in distance[::step]])
        axes.set_title(f"{evaluation.learner}, {teeth} teeth; missed: {missed:.3f}")
        axes.grid(color=GRID, linewidth=0.5)
    return figure


def roc_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Probability of detection against false-alarm rate, down to what the healthy rows resolve."""
    table = evaluation.tables["roc"]
    with drawing() as figure:
        axes = figure.subplots()
        for name, own in by_estimator(table):
            if name == "bound":
                axes.plot(own["false_alarm_rate"], own["detected"], label=name, **BOUND_STYLE)
                continue
            axes.fill_between(
                own["false_alarm_rate"], own["low"], own["high"], color=styles[name]["color"], alpha=0.15, lw=0
            )
            axes.plot(own["false_alarm_rate"], own["detected"], label=name, **styles[name])
        least = float(table["false_alarm_rate"].min())
        chance = np.geomspace(least, 1, 50)
        axes.plot(chance, chance, color="#888888", linewidth=0.8, linestyle=":", label="chance")
        axes.set_xscale("log")
        axes.set(
            xlim=(least, 1), ylim=_room(table["low"]), xlabel="false-alarm rate", ylabel="probability of detection"
        )
        axes.legend(loc="lower right", frameon=False)
        lay_grid(axes)
    return figure


def pod_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Share of damaged rows found against stiffness loss, with the fitted curves and their lower bounds."""
    table = evaluation.tables["pod"]
    with drawing() as figure:
        axes = figure.subplots()
        for name, own in by_estimator(table):
            colour = styles[name]["color"]
            ends = np.abs(own[["low", "high"]].to_numpy().T - own["found"].to_numpy())
            axes.errorbar(own["stiffness_loss"], own["found"], ends, fmt="o", color=colour, ms=4, capsize=2, label=name)
        for name, own in by_estimator(evaluation.tables.get("pod_curve", table[:0])):
            axes.plot(own["stiffness_loss"], own["fitted"], color=styles[name]["color"])
            axes.plot(own["stiffness_loss"], own["bound"], color=styles[name]["color"], linestyle=":", linewidth=1)
        axes.axhline(0.9, color="#888888", linewidth=0.8, linestyle="--")
        rate = float(table["false_alarm_rate"].iloc[0])
        axes.set(
            xlabel="stiffness loss",
            ylabel="probability of detection",
            title=f"at a false-alarm rate of {rate:g}",
            ylim=(0, 1.03),
        )
        axes.set_xlim(left=0)
        axes.legend(loc="lower right", frameon=False)
        lay_grid(axes)
    return figure


def reliability_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Share of answers that are right against their probability; below, how many there are of each."""
    table = evaluation.tables["reliability"]
    with drawing(height=4.2) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        above.plot([0, 1], [0, 1], color="#888888", linewidth=0.8, linestyle="--")
        for name, own in by_estimator(table[table["rows"] >= _LEAST]):
            ends = np.abs(own[["low", "high"]].to_numpy().T - own["right"].to_numpy())
            above.errorbar(
                own["probability"], own["right"], ends, fmt="o-", ms=3, capsize=2, label=name, **styles[name]
            )
            below.plot(own["probability"], own["rows"], "o-", ms=3, **styles[name])
        above.set(xlim=(0, 1), ylim=(0, 1.02), ylabel="share that is right")
        above.legend(loc="upper left", frameon=False)
        below.set(xlabel="probability of the answer", ylabel="rows", yscale="log")
        lay_grid(above)
        lay_grid(below)
    return figure


def _room(low: pd.Series) -> tuple[float, float]:
    """Limits of shares: from a little below the least to 1."""
    least = float(low.min())
    return (max(0.0, np.floor(10 * least) / 10), 1.01) if np.isfinite(least) else (0.0, 1.01)


def location_figures(evaluation: Evaluation, styles: Styles) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure of all that the evaluation holds."""
    for table, heading, caption, draw in _FIGURES:
        if table in evaluation.tables:
            yield heading, caption, draw(evaluation, styles)


_FIGURES: tuple[tuple[str, str, str, Callable[[Evaluation, Styles], Figure]], ...] = (
    (
        "confusion",
        "Which tooth for which",
        "Each row of the picture is a true tooth, its cells the shares of the answers; the scale is the square root, "
        "so that rare answers show. Teeth 1 and the last one are neighbours.",
        confusion_figure,
    ),
    (
        "confusion",
        "How far off, around the gear",
        "Damaged rows by the distance from the true to the named tooth, the true one at the top; the scale is "
        "logarithmic, its lowest ring less than one row.",
        around_figure,
    ),
    (
        "roc",
        "Detection at low false-alarm rates",
        "Damaged rows whose score of damage is above a threshold, against healthy ones above it. The curve ends where "
        "three healthy rows are left. Bands: 95 % intervals.",
        roc_figure,
    ),
    (
        "pod",
        "Detection against stiffness loss",
        "Share of the rows found at each loss, of damage by loss alone where there is such. Line: logistic curve; "
        "dotted: its lower 95 % bound; a90 is where the curve passes 0.9.",
        pod_figure,
    ),
    (
        "reliability",
        "Probabilities against what came true",
        f"On the dashed line what is said with probability p comes true in p of the cases. Bins of {_LEAST} rows or "
        "more.",
        reliability_figure,
    ),
)
