"""Figures that evaluations of location and of severity share: against noise and averages, coverage by cell."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sigdb.recognition import ALL, LOSS_DB, RATIO, Evaluation
from sigdb.report.evaluation.style import BOUND_STYLE, Styles, by_estimator, drawing, lay_grid
from sigdb.report.panels import DAMAGE, INK

_AXES = {
    "snr_db": ("signal-to-noise ratio of one revolution, dB", "against the signal-to-noise ratio"),
    "averages": ("revolutions in the average", "against the number of averages"),
}
_FIGURES = {
    "location": (
        ("accuracy", "share of correct answers", "Accuracy, healthy rows too,"),
        ("p_exact", "P(exact tooth)", "Exact tooth of damaged rows"),
    ),
    "detection": (
        ("p_detected", "share of damaged rows found", "Damaged rows found"),
        ("false_alarm_rate", "false-alarm rate", "False alarms"),
    ),
    "severity": (
        ("mae_stiffness_loss", "MAE of the stiffness loss", "Error of the stiffness loss"),
        ("mae_phase_shift_deg", "MAE of the phase shift, deg", "Error of the phase shift"),
        ("mae_damaged_teeth", "MAE of the damaged teeth", "Error of the number of damaged teeth"),
    ),
}

_SHARES = tuple(quantity for _, quantity, _ in (*_FIGURES["location"], _FIGURES["detection"][0]))


def noise_figures(evaluation: Evaluation, styles: Styles) -> Iterator[tuple[str, str, Figure]]:
    """Headings, captions and figures against noise, and against averages where these vary."""
    bound = "the dashed line is the bound" if evaluation.bound else "the bound is not computed"
    for axis, (label, said) in _AXES.items():
        table = evaluation.tables.get(axis)
        if table is None or (axis != "snr_db" and table["at"].nunique() < 2):
            continue
        for figure, quantity, heading in _FIGURES[evaluation.target]:
            own = table[table["figure"] == figure]
            if own["at"].nunique() > 1:
                caption = f"Bars: 95 % intervals over specimens; {bound}."
                yield f"{heading} {said}", caption, _lines(own, styles, label, quantity, axis == "averages")
            else:
                caption = f"All rows have {own['at'].iloc[0]:g} dB. Bars: 95 % intervals over specimens; {bound}."
                yield f"{heading} at one signal-to-noise ratio", caption, _dots(own, styles, quantity)


def _lines(own: pd.DataFrame, styles: Styles, label: str, quantity: str, logarithmic: bool) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        for name, line in by_estimator(own):
            if name == "bound":
                axes.plot(line["at"], line["value"], label=name, **BOUND_STYLE)
                continue
            ends = np.abs(line[["low", "high"]].to_numpy().T - line["value"].to_numpy())
            axes.errorbar(line["at"], line["value"], ends, fmt="o-", ms=3, capsize=2, label=name, **styles[name])
        axes.set(xlabel=label, ylabel=quantity)
        if logarithmic:
            axes.set_xscale("log")
        axes.set_ylim(0, 1.01 if quantity in _SHARES else None)
        axes.legend(frameon=False, fontsize=8)
        lay_grid(axes)
    return figure


def _dots(own: pd.DataFrame, styles: Styles, quantity: str) -> Figure:
    own = own.iloc[::-1]
    with drawing(height=1.0 + 0.32 * len(own)) as figure:
        axes = figure.subplots()
        for place, name, value, low, high in zip(
            range(len(own)), *(own[key] for key in ("estimator", "value", "low", "high")), strict=True
        ):
            colour = (BOUND_STYLE if name == "bound" else styles[name])["color"]
            axes.errorbar(value, place, xerr=[[value - low], [high - value]], fmt="o", capsize=3, color=colour)
            axes.annotate(f"{value:.3f}", (value, place), (0, 5), textcoords="offset points", ha="center", fontsize=8)
        axes.set_yticks(range(len(own)), list(own["estimator"]))
        axes.set(xlabel=quantity, ylim=(-0.5, len(own) - 0.3))
        axes.margins(x=0.08)
        axes.set_xlim(left=min(0, axes.get_xlim()[0]))
        lay_grid(axes)
    return figure


def coverage_figures(evaluation: Evaluation) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure of coverage by cell, where cells have enough rows."""
    table = evaluation.tables.get("coverage")
    if table is None:
        return
    for target, own in table.groupby("target", sort=False):
        caption = (
            "Each cell of severity, noise and operating point with 2000 rows or more. The dashed line is what was "
            "promised. Bars: 95 % intervals over specimens."
        )
        yield f"Coverage cell by cell: {target}", caption, _cells(own.reset_index(drop=True))


def _cells(own: pd.DataFrame) -> Figure:
    varying = [name for name in own.columns if name in _CELL_WORDS and own[name].nunique(dropna=False) > 1]
    with drawing(height=1.1 + 0.2 * len(own)) as figure:
        axes = figure.subplots()
        _intervals(axes, own)
        names = [
            ", ".join(_CELL_WORDS[name].format(row[name]) for name in varying) or "all" for _, row in own.iterrows()
        ]
        axes.set_yticks(range(len(own)), names, fontsize=8)
        axes.invert_yaxis()
        axes.axvline(0.9, color="#888888", linewidth=1, linestyle="--")
        axes.set(xlabel="coverage")
        axes.set_xlim(min(0.75, float(own["low"].min()) - 0.02), 1.005)
        lay_grid(axes)
    return figure


def _intervals(axes: Axes, own: pd.DataFrame) -> None:
    wrong = (own["low"] > 0.9) | (own["high"] < 0.9)
    for off, colour in ((False, "#1f3a5f"), (True, "#c8553d")):
        some = own[wrong == off]
        ends = np.abs(some[["low", "high"]].to_numpy().T - some["coverage"].to_numpy())
        axes.errorbar(some["coverage"], some.index, xerr=ends, fmt="o", ms=4, capsize=2, color=colour)


_CELL_WORDS = {
    "stiffness_loss": "loss {:g}",
    "damaged_teeth": "damaged teeth {:g}",
    "snr_db": "{:g} dB",
    "speed_rpm": "{:g} rpm",
    "torque": "{:g} N m",
}


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


_UNITS = {
    "stiffness_loss": "stiffness loss",
    "phase_shift_deg": "phase shift, deg",
    "damaged_teeth": "number of damaged teeth",
}


def severity_figures(evaluation: Evaluation, styles: Styles) -> Iterator[tuple[str, str, Figure]]:
    """Heading, caption and figure for each quantity."""
    table = evaluation.tables["scatter"]
    for target, own in table.groupby("target", sort=False):
        caption = (
            "Dots: single rows, spread sideways so that they show. Bars: the median estimate at each true value, and "
            "the median ends of its interval. The dashed line is the truth."
        )
        yield f"Estimates of the {_UNITS[str(target)].split(',')[0]}", caption, _scatter(own, _UNITS[str(target)])


def _scatter(own: pd.DataFrame, words: str) -> Figure:
    true = own["true"].to_numpy()
    levels = np.unique(true)
    step = np.diff(levels).min() if len(levels) > 1 else 1.0
    few = len(levels) <= 15
    aside = np.random.default_rng(0).uniform(-0.28, 0.28, len(own)) * step if few else 0.0
    with drawing(height=3.8) as figure:
        axes = figure.subplots()
        axes.plot(true + aside, own["found"], "o", ms=2.5, mew=0, alpha=0.35, color=INK, rasterized=True)
        ends = (levels.min() - step / 2, levels.max() + step / 2)
        axes.plot(ends, ends, color="#888888", linewidth=1, linestyle="--")
        if few:
            _bars(axes, own)
        axes.set(xlabel=f"true {words}", ylabel=f"estimated {words}", xlim=ends)
        if few:
            axes.set_xticks(levels)
        lay_grid(axes)
    return figure


def _bars(axes: Axes, own: pd.DataFrame) -> None:
    middle = own.groupby("true").median(numeric_only=True)
    ends = None
    if "low" in middle:
        ends = np.abs(middle[["low", "high"]].to_numpy().T - middle["found"].to_numpy())
    axes.errorbar(middle.index, middle["found"], ends, fmt="D", ms=5, capsize=5, color=DAMAGE, linewidth=1.6)
