"""The page of a diagnosis: the answer first, then what it rests on."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sigdb.core import FloatArray
from sigdb.report.evaluation.style import drawing, lay_grid
from sigdb.report.page import CaptionedFigure, page
from sigdb.report.panels import DAMAGE, HEALTHY, INK, draw_spectrum, mark_passes
from sigdb.report.text_table import number, table, word

TITLES = {
    "stiffness_loss": "stiffness loss",
    "phase_shift_deg": "phase shift, deg",
    "damaged_teeth": "damaged teeth",
    "tooth": "tooth",
    "probability": "probability",
    "misfit": "misfit",
}


def write_diagnosis_report(
    facts: Mapping[str, Any], signals: Mapping[str, FloatArray], folder: str | Path, *, title: str
) -> Path:
    """Write the page of a diagnosis, ``index.html``, and its facts, ``diagnosis.json``; arguments as below.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    numbers = dict(facts) | {"signals": {name: one.tolist() for name, one in signals.items()}}
    (folder / "diagnosis.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    (folder / "index.html").write_text(diagnosis_html(facts, signals, title=title), encoding="utf-8")
    return folder / "index.html"


def diagnosis_html(facts: Mapping[str, Any], signals: Mapping[str, FloatArray], *, title: str) -> str:
    """The page as one string, without scripts: pictures are in it.

    Parameters
    ----------
    facts
        The diagnosis as plain data, of ``Diagnosis.as_json``.
    signals
        (n,) ``tsa``, the average of the recording; ``compared``, what the templates were compared with; ``template``,
        the nearest one; ``healthy``, that of a healthy gear.
    title
        Heading.
    """
    names = [name for name in TITLES if name in facts["nearest"][0]]
    return page(
        "diagnosis.html",
        title=title,
        alarm=facts["kind"] != "none",
        answer=facts["answer"],
        evidence=_beside(facts),
        severity_heading=f"How severe{', if damaged' if facts['teeth'][0]['candidate'] else ''}",
        severity=[[TITLES[one["target"]], f"{one['estimate']:.3g}", _interval(one)] for one in facts["severity"] or ()],
        missing=facts["missing"],
        notes=facts["notes"],
        nearest_head=[TITLES[name] for name in names],
        nearest=[[_cell(one, name) for name in names] for one in facts["nearest"]],
        pictures=list(diagnosis_figures(facts, signals)),
        reading=facts["reading"],
    )


def diagnosis_text(facts: Mapping[str, Any]) -> str:
    """The answer and what it rests on, for a terminal; ``facts`` as of :func:`diagnosis_html`."""
    lines = [facts["answer"], _beside(facts)]
    if facts["severity"]:
        columns = [("severity", word("target")), ("estimate", number("estimate", 3))]
        ends = [("low", number("low", 3)), ("high", number("high", 3))]
        lines += ["", table([*columns, *ends], facts["severity"])]
    names = [name for name in TITLES if name in facts["nearest"][0]]
    lines += ["", "nearest templates", table([(name, number(name, 3)) for name in names], facts["nearest"])]
    for heading in ("missing", "notes", "reading"):
        sentences = facts[heading]
        if sentences:
            lines += ["", heading, *(f"  {one}" for one in sentences)]
    return "\n".join(lines) + "\n"


def diagnosis_figures(facts: Mapping[str, Any], signals: Mapping[str, FloatArray]) -> Iterator[CaptionedFigure]:
    """Yield the pictures of a diagnosis."""
    teeth, unit = len(facts["teeth"]) - 1, facts["unit"] or "unit not stated"
    yield CaptionedFigure(
        "What is not as on a healthy gear",
        "Recording and nearest template, each less the healthy template, against the angle of rotation. Numbers: tooth "
        "passes, counted from the tacho mark, or from where the average begins where there is none.",
        _difference(signals, teeth, unit, facts["nearest"][0]),
    )
    if facts["kind"] != "outside":
        yield CaptionedFigure(
            "Which tooth",
            "Probability of no damage and of each first damaged tooth, if one of the templates is true. Red: in the "
            "set that holds the truth with a probability of 0.9.",
            _teeth(facts["teeth"]),
        )
    yield CaptionedFigure(
        "The averaged recording",
        f"Order spectrum of {facts['channel']}, peak amplitudes; marks at the mesh harmonics.",
        _spectrum(signals["tsa"], teeth, unit),
    )


def _cell(row: Mapping[str, Any], name: str) -> str:
    return "none" if name == "tooth" and row[name] == 0 else f"{row[name]:.3g}"


def _interval(one: Mapping[str, Any]) -> str:
    return f"{one['low']:.3g}" if one["low"] == one["high"] else f"{one['low']:.3g} to {one['high']:.3g}"


def _beside(facts: Mapping[str, Any]) -> str:
    """How far the recording is from what was simulated, and what that means for the probability."""
    misfit = f"The nearest template leaves {facts['misfit']:.2g} times the noise; up to {facts['limit']:.2g} it fits."
    if facts["kind"] == "outside":
        return f"{misfit} Probabilities and templates below are those of the least bad fit, and no evidence."
    return f"Probability of damage {facts['p_damage']:.3g}, at even odds before the recording. {misfit}"


def _difference(signals: Mapping[str, FloatArray], teeth: int, unit: str, nearest: Mapping[str, Any]) -> Figure:
    first, count = int(nearest["tooth"]), int(nearest["damaged_teeth"])
    damaged = tuple((first - 1 + i) % teeth + 1 for i in range(count)) if first else ()
    angle = np.arange(len(signals["compared"])) * 360 / len(signals["compared"])
    with drawing() as figure:
        axes = figure.subplots()
        lay_grid(axes)
        axes.plot(angle, signals["compared"] - signals["healthy"], color=HEALTHY, linewidth=1.2, label="recording")
        axes.plot(angle, signals["template"] - signals["healthy"], color=INK, linewidth=1.2, label="nearest template")
        axes.margins(y=0.12)
        mark_passes(axes, teeth, damaged)
        axes.set(xlabel="angle, deg", ylabel=unit)
        axes.legend(frameon=False, fontsize=8, loc="lower right")
    return figure


def _teeth(rows: list[Mapping[str, Any]]) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        lay_grid(axes)
        colours = [DAMAGE if one["candidate"] else HEALTHY for one in rows]
        axes.bar([one["tooth"] for one in rows], [one["probability"] for one in rows], color=colours)
        step = -(-len(rows) // 14)
        marked = [one["tooth"] for one in rows if one["tooth"] % step == 0]
        axes.set_xticks(marked, ["none" if one == 0 else str(one) for one in marked])
        axes.set(ylim=(0, 1), xlabel="first damaged tooth", ylabel="probability")
    return figure


def _spectrum(tsa: FloatArray, teeth: int, unit: str) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        draw_spectrum(axes, tsa, teeth, min(4.5 * teeth, len(tsa) / 2))
        axes.set(xlabel="order, 1/rev", ylabel=unit)
    return figure
