"""Pictures of location, kind and detection: confusion of teeth and of kinds, detection, calibration."""

from collections.abc import Callable, Iterator
from typing import cast

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from sigdb.database import kind_classes
from sigdb.recognition import Evaluation
from sigdb.report.evaluation.style import BOUND_STYLE, Styles, by_estimator, drawing, lay_grid
from sigdb.report.page import CaptionedFigure
from sigdb.report.panels import DAMAGE, GRID, INK

_LEAST = 10
"""Fewest rows of a bin of probabilities that is drawn."""


def confusion_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Draw true against predicted teeth, 'none' first; colours are shares of a row, so scaled that rare errors show."""
    table = evaluation.tables["confusion"]
    teeth = int(table["teeth"].mode()[0])
    counts = table[table["teeth"] == teeth]
    share = np.zeros((teeth + 1, teeth + 1))
    predicted = counts["predicted"].to_numpy(int).clip(max=teeth)
    np.add.at(share, (counts["tooth"].to_numpy(int), predicted), counts["rows"].to_numpy())
    share /= np.maximum(share.sum(axis=1, keepdims=True), 1)
    with drawing(width=4.8, height=4.6) as figure:
        axes = figure.subplots()
        image = axes.imshow(np.where(share > 0, np.sqrt(share), np.nan), cmap="Blues", vmin=0, vmax=1)
        step = -(-(teeth + 1) // 20)
        ticks = np.unique(np.append(0, np.arange(1, teeth + 1, step)))
        names = ["none", *map(str, ticks[1:])]
        axes.set_xticks(ticks, names)
        axes.set_yticks(ticks, names)
        axes.set(xlabel="predicted tooth", ylabel="true tooth", title=f"{evaluation.learner}, {teeth} teeth")
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


def kinds_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Draw true against predicted kinds of damage, 'none' first, with the share of the rows of each true kind."""
    table = evaluation.tables["kinds"]
    kinds = kind_classes([*table["kind"], *table["predicted"]])
    counts = table.pivot(index="kind", columns="predicted", values="rows").reindex(index=kinds, columns=kinds).fillna(0)
    share = counts.to_numpy(float) / np.maximum(counts.sum(axis=1).to_numpy()[:, None], 1)
    with drawing(width=4.8, height=1.6 + 0.4 * len(kinds)) as figure:
        axes = figure.subplots()
        axes.imshow(np.where(share > 0, np.sqrt(share), np.nan), cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axes.set_xticks(range(len(kinds)), kinds, rotation=30, ha="right")
        axes.set_yticks(range(len(kinds)), kinds)
        axes.set(xlabel="predicted kind", ylabel="true kind", title=evaluation.learner)
        _write_shares(axes, share)
    return figure


def around_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Draw the distance from the true to the predicted tooth around the gear, of damaged rows with a tooth."""
    table = evaluation.tables["confusion"]
    teeth = int(table["teeth"].mode()[0])
    damaged = table[(table["teeth"] == teeth) & (table["tooth"] > 0)]
    called, total = damaged[damaged["predicted"] > 0], damaged["rows"].sum()
    share = np.bincount((called["predicted"] - called["tooth"]) % teeth, called["rows"], teeth) / total
    missed = 1 - share.sum()
    least = 1 / total
    with drawing(width=4.8, height=4.6) as figure:
        axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        angle = 2 * np.pi * np.arange(teeth) / teeth
        floor = np.floor(np.log10(least))
        height = np.log10(np.maximum(share, 10**floor)) - floor
        axes.bar(angle, height, width=0.8 * 2 * np.pi / teeth, color=[INK, *[DAMAGE] * (teeth - 1)])
        decades = np.arange(1, -int(floor) + 1)
        axes.set_yticks(decades, [f"{10.0 ** (decade + floor):g}" for decade in decades], fontsize=7)
        axes.set_ylim(0, -floor)
        axes.set_rlabel_position((teeth // 2 + 0.5) * 360 / teeth)
        step = -(-teeth // 24)
        distance = (np.arange(teeth) + teeth // 2) % teeth - teeth // 2
        axes.set_xticks(angle[::step], [f"{teeth_off:+d}" if teeth_off else "0" for teeth_off in distance[::step]])
        axes.set_title(f"{evaluation.learner}, {teeth} teeth; missed: {missed:.3f}")
        axes.grid(color=GRID, linewidth=0.5)
    return figure


def roc_figure(evaluation: Evaluation, styles: Styles) -> Figure:
    """Draw the probability of detection against the false-alarm rate, down to the least that healthy rows resolve."""
    table = evaluation.tables["roc"]
    with drawing() as figure:
        axes = figure.subplots()
        for name, curve in by_estimator(table):
            if name == "bound":
                axes.plot(curve["false_alarm_rate"], curve["detected"], label=name, **BOUND_STYLE)
                continue
            axes.fill_between(
                curve["false_alarm_rate"], curve["low"], curve["high"], color=styles[name]["color"], alpha=0.15, lw=0
            )
            axes.plot(curve["false_alarm_rate"], curve["detected"], label=name, **styles[name])
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
    """Draw the share of damaged rows detected against stiffness loss, with fitted curves and their lower bounds."""
    table = evaluation.tables["pod"]
    with drawing() as figure:
        axes = figure.subplots()
        for name, levels in by_estimator(table):
            colour = styles[name]["color"]
            ends = np.abs(levels[["low", "high"]].to_numpy().T - levels["detected"].to_numpy())
            axes.errorbar(
                levels["stiffness_loss"], levels["detected"], ends, fmt="o", color=colour, ms=4, capsize=2, label=name
            )
        for name, curve in by_estimator(evaluation.tables.get("pod_curve", table[:0])):
            axes.plot(curve["stiffness_loss"], curve["fitted"], color=styles[name]["color"])
            axes.plot(curve["stiffness_loss"], curve["bound"], color=styles[name]["color"], linestyle=":", linewidth=1)
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
    """Draw the share of correct answers against their probability, and below the number of rows of each bin."""
    table = evaluation.tables["reliability"]
    with drawing(height=4.2) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        above.plot([0, 1], [0, 1], color="#888888", linewidth=0.8, linestyle="--")
        for name, bins in by_estimator(table[table["rows"] >= _LEAST]):
            ends = np.abs(bins[["low", "high"]].to_numpy().T - bins["right"].to_numpy())
            above.errorbar(
                bins["probability"], bins["right"], ends, fmt="o-", ms=3, capsize=2, label=name, **styles[name]
            )
            below.plot(bins["probability"], bins["rows"], "o-", ms=3, **styles[name])
        above.set(xlim=(0, 1), ylim=(0, 1.02), ylabel="share of correct answers")
        above.legend(loc="upper left", frameon=False)
        below.set(xlabel="probability of the answer", ylabel="rows", yscale="log")
        lay_grid(above)
        lay_grid(below)
    return figure


def _room(low: pd.Series) -> tuple[float, float]:
    """Return limits of shares: from a little below the least to 1."""
    least = float(low.min())
    return (max(0.0, np.floor(10 * least) / 10), 1.01) if np.isfinite(least) else (0.0, 1.01)


def location_figures(evaluation: Evaluation, styles: Styles) -> Iterator[CaptionedFigure]:
    """Yield the pictures whose table the evaluation holds."""
    for table, heading, caption, draw in _FIGURES:
        if table in evaluation.tables:
            yield CaptionedFigure(heading, caption, draw(evaluation, styles))


_FIGURES: tuple[tuple[str, str, str, Callable[[Evaluation, Styles], Figure]], ...] = (
    (
        "confusion",
        "Confusion of teeth",
        "Each row of the picture is a true tooth, its cells the shares of the answers; the scale is the square root, "
        "so that rare answers show. Teeth 1 and the last one are neighbours.",
        confusion_figure,
    ),
    (
        "confusion",
        "Distance around the gear",
        "Damaged rows by the distance from the true to the predicted tooth, the true one at the top; the scale is "
        "logarithmic, its lowest ring less than one row.",
        around_figure,
    ),
    (
        "kinds",
        "Confusion of kinds",
        "Each row of the picture is a true kind of damage, its cells the shares of the answers.",
        kinds_figure,
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
        "Share of the rows detected at each loss, of damage by loss alone where there is such. Line: logistic curve; "
        "dotted: its lower 95 % bound; a90 is where the curve passes 0.9.",
        pod_figure,
    ),
    (
        "reliability",
        "Reliability of probabilities",
        "On the dashed line, answers with probability p are correct in a share p of the rows. Bins of "
        f"{_LEAST} rows or more.",
        reliability_figure,
    ),
)
