"""The page of a monitor: the answer for each gear, its history as lines, and a heat map of teeth over time."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sigdb.core import json_text, publish_all
from sigdb.monitoring import GearHistory
from sigdb.report.evaluation.style import drawing, lay_grid
from sigdb.report.page import CaptionedFigure, page
from sigdb.report.panels import DAMAGE, HEALTHY, INK
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number

_HEAD = ("recording", "health", "tooth", "at tooth", "level, dB", "NA4*", "NB4*", "alarm or doubt")
_SHOWN = 12
"""Newest looks in a table."""

_WHOLE = 10
"""Most histories that a terminal shows whole."""


def write_monitor_report(histories: Sequence[GearHistory], folder: str | Path, *, command: str | None = None) -> Path:
    """Write the page of histories, ``index.html``, and their numbers, ``monitor.json``.

    Parameters
    ----------
    histories : sequence of GearHistory
        From :func:`sigdb.monitoring.monitor`.
    folder : str or path-like
        Folder of the page; it is created if it does not exist.
    command : str, optional
        Command that makes the page again, for the reader.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    index = folder / "index.html"
    gears = [
        {
            "title": _title(history),
            "answer": history.answer.sentence,
            "alarm": history.answer.exit_code != 0,
            "evidence": _evidence(history),
            "notes": [note.text for note in history.notes],
            "pictures": list(monitor_figures(history)),
            "rows": _rows(history),
        }
        for history in histories
    ]
    html = page("monitoring.html", title="Monitored gears", gears=gears, head=_HEAD, command=command)
    numbers = json_text([history.as_json() for history in histories])
    publish_all({folder / "monitor.json": numbers, index: html})
    return index


def monitor_text(histories: Sequence[GearHistory], *, terminal: Terminal = PLAIN) -> str:
    """Return the answers and the newest looks as text for a terminal.

    Where there are more than ten histories, those without an alarm are shown by their answer alone.

    Parameters
    ----------
    histories : sequence of GearHistory
        From :func:`sigdb.monitoring.monitor`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    blocks, short = [], 0
    for history in histories:
        lines = [_title(history), f"  {history.answer.sentence}"]
        if len(histories) > _WHOLE and not history.answer.exit_code:
            short += 1
        else:
            lines += [f"  {sentence}" for sentence in _evidence(history)]
            if rows := _rows(history):
                lines += [TextTable(_HEAD, rows).text(terminal, indent=2)]
        lines += [f"  {note.text}" for note in history.notes]
        blocks.append("\n".join(lines))
    if short:
        blocks.append(f"The looks of {short} gears without an alarm are not shown; --out and --format json have them.")
    return "\n\n".join(blocks) + "\n"


def monitor_figures(history: GearHistory) -> Iterator[CaptionedFigure]:
    """Yield the pictures of a history: indicators over time, and teeth over time."""
    if history.looks.empty:
        return
    yield CaptionedFigure(
        "Indicators over time",
        "Difference from the healthy recordings, of the strongest tooth, and level, in healthy deviations; dashed: the "
        "limit of the first two. Grey: healthy looks.",
        _lines(history),
    )
    yield CaptionedFigure(
        "Teeth over time",
        "Energy of the difference from the healthy recordings by tooth pass, dB relative to noise. A damaged tooth "
        "shows about one pass after its first contact.",
        _heat_map(history),
    )


def _title(history: GearHistory) -> str:
    place = history.place
    names = [place.get("machine", ""), place.get("gear", ""), place.get("sensor", "")]
    teeth = f"{place['teeth']} teeth" if "teeth" in place else ""
    return ", ".join(each for each in (*names, teeth) if each) or "gear"


def _evidence(history: GearHistory) -> list[str]:
    """Return sentences on the limit, the change and the trend."""
    if history.looks.empty:
        return []
    table = history.looks
    sentences = [
        f"Limit: {history.limit:.3g} healthy deviations, for {history.false_alarms_a_year:g} false alarms a year at "
        f"{history.looks_a_year:.3g} looks a year, from {history.healthy_looks} healthy looks."
    ]
    if history.change is not None:
        low, best, high = (table["recording"].iloc[each] for each in (
            history.change.low, history.change.look, history.change.high))  # fmt: skip
        sentences.append(f"The indicator has changed at {best} (95 %: {low} to {high}).")
    if history.trend is not None:
        trend = history.trend
        sentences.append(
            f"Trend: {trend.slope:.2g} healthy deviations a {trend.per} (95 %: {trend.low:.2g} to {trend.high:.2g})."
        )
    sentences += _growth_sentences(history)
    zone = table["zone"].iloc[-1]
    if zone:
        sentences.append(f"Zone {zone} of the stated ends.")
    return sentences


def _growth_sentences(history: GearHistory) -> list[str]:
    """Return sentences on the growth of a tooth's difference, where there is damage, and on its life."""
    growth = history.growth
    if growth is None or not growth.stands_out:
        return []
    sentences = [
        f"Growth: the difference is {growth.severity_db:.3g} dB over that of the other teeth (90 %: "
        f"{growth.low_db:.3g} to {growth.high_db:.3g}), at tooth {growth.tooth} with a probability of "
        f"{growth.tooth_probability:.3g}. The statistic is {growth.statistic[-1]:.3g}, the limit "
        f"{history.growth_limit:.3g}."
    ]
    if growth.life is not None:
        life = growth.life
        sentences.append(
            f"No remaining life is given: {life.reason}."
            if life.reason
            else f"Remaining life: {life.median:.3g} {growth.per}s (90 %: {life.low:.3g} to {life.high:.3g})."
        )
    return sentences


def _rows(history: GearHistory) -> list[list[str]]:
    return [
        [
            str(row["recording"]),
            number(row["health_indicator"], 3),
            number(row["tooth_indicator"], 3),
            f"{row['tooth']}",
            f"{row['level_db']:+.1f}",
            number(row["na4_star"], 3),
            number(row["nb4_star"], 3),
            "alarm" if row["alarm"] else row["doubt"] or "-",
        ]
        for row in history.looks.tail(_SHOWN).to_dict("records")
    ]


def _lines(history: GearHistory) -> Figure:
    table = history.looks
    x = np.arange(1, len(table) + 1)
    with drawing(width=8.0) as figure:
        axes = figure.subplots()
        lay_grid(axes)
        for name, label, colour in (
            ("level", "level", HEALTHY),
            ("health_indicator", "health indicator", INK),
            ("tooth_indicator", "strongest tooth", DAMAGE),
        ):
            axes.plot(x, table[name], color=colour, linewidth=1.2, label=label)
        for look in x[table["healthy"].to_numpy()]:
            axes.axvspan(look - 0.5, look + 0.5, color="#efefef", zorder=0, linewidth=0)
        axes.axhline(history.limit, color=INK, linestyle="--", linewidth=0.8)
        axes.set(xlabel="look, oldest first", ylabel="healthy deviations", yscale="symlog")
        axes.legend(frameon=False, fontsize=8)
    return figure


def _heat_map(history: GearHistory) -> Figure:
    energy = 10 * np.log10(np.maximum(history.tooth_map.T, 1e-3))
    with drawing(width=8.0) as figure:
        axes = figure.subplots()
        extent = (0.5, energy.shape[1] + 0.5, 0.5, energy.shape[0] + 0.5)
        image = axes.imshow(energy, aspect="auto", origin="lower", extent=extent, cmap="magma", interpolation="nearest")
        axes.set(xlabel="look, oldest first", ylabel="tooth pass")
        figure.colorbar(image, ax=axes, pad=0.01, label="dB over noise")
    return figure
