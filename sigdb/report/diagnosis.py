"""The page of a diagnosis: the answer first, then its evidence."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from sigdb.core import FloatArray, json_text, plain, publish_all
from sigdb.diagnosis import Comparison, Diagnosis
from sigdb.report.evaluation.style import drawing, lay_grid
from sigdb.report.page import CaptionedFigure, page
from sigdb.report.panels import DAMAGE, HEALTHY, INK, draw_spectrum, mark_passes
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number

TITLES = {
    "stiffness_loss": "stiffness loss",
    "phase_shift_deg": "phase shift, deg",
    "damaged_teeth": "damaged teeth",
    "tooth": "tooth",
    "probability": "probability",
    "reduced_chi2": "reduced chi-square",
}
"""Titles of quantities of a diagnosis."""


def write_diagnosis_report(diagnosis: Diagnosis, folder: str | Path, *, title: str | None = None) -> Path:
    """Write the page of a diagnosis, ``index.html``, and its numbers, ``diagnosis.json``.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`sigdb.diagnose`.
    folder : str or path-like
        Folder of the page; it is created if it does not exist.
    title : str, optional
        Heading; by default it names the recording.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    numbers = diagnosis.as_json() | {"signals": plain(_signals(diagnosis))}
    index = folder / "index.html"
    publish_all({folder / "diagnosis.json": json_text(numbers), index: diagnosis_html(diagnosis, title=title)})
    return index


def diagnosis_html(diagnosis: Diagnosis, *, title: str | None = None) -> str:
    """Return the page as one text without scripts; pictures are part of it.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    title
        Heading; by default it names the recording.
    """
    nearest, severity = _nearest(diagnosis), diagnosis.severity
    names = [name for name in TITLES if name in nearest]
    comparison, signature = diagnosis.comparison, diagnosis.signature
    of = "" if signature is None else f" of {Path(signature.source).name}"
    undamaged = comparison is not None and 0 in comparison.candidates
    return page(
        "diagnosis.html",
        title=title or f"Diagnosis{of}",
        alarm=diagnosis.kind != "none",
        answer=diagnosis.answer,
        evidence=_evidence(diagnosis),
        severity_heading=f"How severe{', if damaged' if undamaged else ''}",
        severity=[] if severity is None else _severity_rows(severity),
        missing=diagnosis.missing,
        notes=diagnosis.notes,
        nearest_head=[TITLES[name] for name in names],
        nearest=[[_cell(name, value) for name, value in row.items()] for row in nearest[names].to_dict("records")],
        pictures=list(diagnosis_figures(diagnosis)),
        reading=diagnosis.reading,
    )


def diagnosis_text(diagnosis: Diagnosis, *, terminal: Terminal = PLAIN) -> str:
    """Return the answer and its evidence as text for a terminal.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`sigdb.diagnose`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    lines = [diagnosis.answer, _evidence(diagnosis)]
    if diagnosis.severity is not None:
        ends = ("estimate", "low", "high")
        rows = [
            [row["target"], *(number(row[name], 3) for name in ends)] for row in diagnosis.severity.to_dict("records")
        ]
        lines += ["", TextTable(("severity", *ends), rows).text(terminal, indent=2)]
    nearest = _nearest(diagnosis)
    names = [name for name in TITLES if name in nearest]
    rows = [[number(row[name], 3) for name in names] for row in nearest.to_dict("records")]
    if rows:
        lines += ["", "nearest templates", TextTable(names, rows).text(terminal, indent=2)]
    sections = (("missing", diagnosis.missing), ("notes", diagnosis.notes), ("reading", diagnosis.reading))
    for heading, notes in sections:
        if notes:
            lines += ["", heading, *(f"  {note.text}" for note in notes)]
    return "\n".join(lines) + "\n"


def diagnosis_figures(diagnosis: Diagnosis) -> Iterator[CaptionedFigure]:
    """Yield the pictures of a diagnosis."""
    signature, comparison = diagnosis.signature, diagnosis.comparison
    if signature is None:
        return
    unit = signature.unit or "unit not stated"
    if comparison is not None:
        yield from _comparison_figures(diagnosis, comparison, unit)
    yield CaptionedFigure(
        "The averaged recording",
        f"Order spectrum of {signature.channel}, peak amplitudes; marks at the mesh harmonics.",
        _spectrum(signature.tsa, signature.teeth, unit),
    )


def _comparison_figures(diagnosis: Diagnosis, comparison: Comparison, unit: str) -> Iterator[CaptionedFigure]:
    yield CaptionedFigure(
        "Difference from a healthy gear",
        "Recording and nearest template, each less the healthy template, against the angle of rotation. Numbers: tooth "
        "passes, counted from the tacho mark, or from where the average begins where there is none.",
        _difference(comparison, len(comparison.probability) - 1, unit),
    )
    if diagnosis.kind != "outside":
        yield CaptionedFigure(
            "Which tooth",
            "Probability of no damage and of each first damaged tooth, if one of the templates is true. Red: in the "
            "set that holds the truth with a probability of 0.9.",
            _teeth(diagnosis.teeth),
        )


def _nearest(diagnosis: Diagnosis) -> pd.DataFrame:
    """Return the nearest templates; none where nothing was compared."""
    return pd.DataFrame() if diagnosis.comparison is None else diagnosis.comparison.nearest


def _signals(diagnosis: Diagnosis) -> dict[str, FloatArray]:
    comparison, signature = diagnosis.comparison, diagnosis.signature
    averages = {} if signature is None else {"tsa": signature.tsa}
    if comparison is None:
        return averages
    return averages | {
        "compared": comparison.x,
        "template": comparison.template,
        "healthy": comparison.healthy,
    }


def _severity_rows(severity: pd.DataFrame) -> list[list[str]]:
    return [
        [TITLES[row["target"]], f"{row['estimate']:.3g}", _interval(row["low"], row["high"])]
        for row in severity.to_dict("records")
    ]


def _cell(name: object, value: float) -> str:
    return "none" if name == "tooth" and value == 0 else f"{value:.3g}"


def _interval(low: float, high: float) -> str:
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def _evidence(diagnosis: Diagnosis) -> str:
    """Return the fit of the nearest template, and the probability of damage where a template fits."""
    comparison = diagnosis.comparison
    if comparison is None:
        return "Nothing was compared: without the mesh a recording says nothing on the gear's teeth, damaged or not."
    fit = (
        f"The squared residual of the nearest template is {comparison.reduced_chi2:.2g} times that of the noise; up to "
        f"{comparison.limit:.2g} a template fits."
    )
    if diagnosis.kind == "outside":
        return f"{fit} Probabilities and templates below are those of the least bad fit, and no evidence."
    return f"Probability of damage {diagnosis.p_damage:.3g}, at even odds before the recording. {fit}"


def _difference(comparison: Comparison, teeth: int, unit: str) -> Figure:
    first, count = (int(comparison.nearest[name].iloc[0]) for name in ("tooth", "damaged_teeth"))
    damaged = tuple((first - 1 + i) % teeth + 1 for i in range(count)) if first else ()
    angle = np.arange(len(comparison.x)) * 360 / len(comparison.x)
    curves = (("recording", comparison.x, HEALTHY), ("nearest template", comparison.template, INK))
    with drawing() as figure:
        axes = figure.subplots()
        lay_grid(axes)
        for label, signal, colour in curves:
            axes.plot(angle, signal - comparison.healthy, color=colour, linewidth=1.2, label=label)
        axes.margins(y=0.12)
        mark_passes(axes, teeth, damaged)
        axes.set(xlabel="angle, deg", ylabel=unit)
        axes.legend(frameon=False, fontsize=8, loc="lower right")
    return figure


def _teeth(teeth: pd.DataFrame) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        lay_grid(axes)
        colours = [DAMAGE if candidate else HEALTHY for candidate in teeth["candidate"]]
        axes.bar(teeth["tooth"], teeth["probability"], color=colours)
        marked = range(0, len(teeth), -(-len(teeth) // 14))
        axes.set_xticks(marked, ["none" if tooth == 0 else str(tooth) for tooth in marked])
        axes.set(ylim=(0, 1), xlabel="first damaged tooth", ylabel="probability")
    return figure


def _spectrum(tsa: FloatArray, teeth: int, unit: str) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        draw_spectrum(axes, tsa, teeth, min(4.5 * teeth, len(tsa) / 2))
        axes.set(xlabel="order, 1/rev", ylabel=unit)
    return figure
