"""The page of a diagnosis: the answer first, then its evidence."""

from collections.abc import Iterator
from pathlib import Path
from typing import cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from sigdb.core import FloatArray, json_text, plain, publish_all
from sigdb.diagnosis import Diagnosis, Finding
from sigdb.report.diagnosis.text import DETECTOR_HEAD, detector_rows, evidence, lights, repeats, severity_rows
from sigdb.report.evaluation.style import drawing, lay_grid
from sigdb.report.page import CaptionedFigure, page
from sigdb.report.panels import DAMAGE, HEALTHY, INK, draw_spectrum, mark_passes

_SHOWN_MESH_ORDERS = 4.5
"""Highest order of the spectrum, in mesh orders."""


def write_diagnosis_report(
    diagnosis: Diagnosis, folder: str | Path, *, title: str | None = None, command: str | None = None
) -> Path:
    """Write the page of a diagnosis, ``index.html``, and its numbers, ``diagnosis.json``.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`sigdb.diagnose`.
    folder : str or path-like
        Folder of the page; it is created if it does not exist.
    title : str, optional
        Heading; by default it names the recording.
    command : str, optional
        Command that makes the page again, for the reader.

    Returns
    -------
    pathlib.Path
        The page.
    """
    folder = Path(folder)
    numbers = diagnosis.as_json() | {"signals": plain(_signals(diagnosis))}
    index = folder / "index.html"
    html = diagnosis_html(diagnosis, title=title, command=command)
    publish_all({folder / "diagnosis.json": json_text(numbers), index: html})
    return index


def diagnosis_html(diagnosis: Diagnosis, *, title: str | None = None, command: str | None = None) -> str:
    """Return the page as one text without scripts; pictures are part of it.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    title
        Heading; by default it names the recording.
    command
        Command that makes the page again.
    """
    signature = diagnosis.signature
    of = "" if signature is None else f" of {Path(signature.source).name}"
    return page(
        "diagnosis.html",
        title=title or f"Diagnosis{of}",
        alarm=diagnosis.exit_code != 0,
        answer=diagnosis.answer,
        evidence=evidence(diagnosis),
        lights=lights(diagnosis),
        severity=severity_rows(diagnosis),
        repeats=repeats(diagnosis),
        detector_head=DETECTOR_HEAD,
        detectors=detector_rows(diagnosis),
        assumed=diagnosis.assumed,
        missing=[note.text for note in diagnosis.missing],
        notes=[note.text for note in diagnosis.notes],
        pictures=list(diagnosis_figures(diagnosis)),
        reading=[note.text for note in diagnosis.reading],
        command=command,
    )


def diagnosis_figures(diagnosis: Diagnosis) -> Iterator[CaptionedFigure]:
    """Yield the pictures of a diagnosis."""
    signature, finding = diagnosis.signature, diagnosis.finding
    if signature is None:
        return
    unit = signature.unit or "unit not stated"
    if finding is not None and finding.change.bands:
        yield CaptionedFigure(
            "Where on the gear",
            "Energy of the change between mesh harmonics by tooth pass, relative to the median of the other teeth; "
            "red: teeth that stand out. A damaged tooth shows about one pass after its first contact.",
            _gear(finding, diagnosis.candidates),
        )
    if diagnosis.reference is not None:
        yield CaptionedFigure(
            "Recording and healthy reference",
            "Averages over one revolution. Numbers: tooth passes, counted from the tacho mark, or from where the "
            "average begins where there is none.",
            _averages(signature.tsa, diagnosis.reference, signature.teeth, diagnosis.candidates, unit),
        )
    yield CaptionedFigure(
        "The averaged recording",
        f"Order spectrum of {signature.channel}, peak amplitudes, over that of the healthy reference where there is "
        "one; marks at the mesh harmonics.",
        _spectrum(signature.tsa, diagnosis.reference, signature.teeth, unit),
    )


def _signals(diagnosis: Diagnosis) -> dict[str, FloatArray]:
    averages = {} if diagnosis.signature is None else {"tsa": diagnosis.signature.tsa}
    return averages if diagnosis.reference is None else averages | {"healthy": diagnosis.reference}


def _gear(finding: Finding, damaged: tuple[int, ...]) -> Figure:
    energy = finding.change.tooth_map
    Z = len(energy)
    angle = 2 * np.pi * (np.arange(Z) + 0.5) / Z
    colours = [DAMAGE if tooth in damaged else HEALTHY for tooth in range(1, Z + 1)]
    with drawing() as figure:
        axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
        axes.bar(angle, energy, width=2 * np.pi / Z * 0.9, color=colours, bottom=0.0)
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        marked = range(0, Z, max(1, -(-Z // 16)))
        axes.set_xticks([angle[tooth] for tooth in marked], [str(tooth + 1) for tooth in marked], fontsize=8)
        axes.set_rlabel_position(90 / Z)
        axes.tick_params(axis="y", labelsize=7)
        axes.grid(color="#d9d9d9", linewidth=0.6)
    return figure


def _averages(tsa: FloatArray, healthy: FloatArray, teeth: int, damaged: tuple[int, ...], unit: str) -> Figure:
    angle = np.arange(len(tsa)) * 360 / len(tsa)
    with drawing() as figure:
        axes = figure.subplots()
        lay_grid(axes)
        axes.plot(angle, healthy, color=HEALTHY, linewidth=2.0, label="healthy reference")
        axes.plot(angle, tsa, color=INK, linewidth=1.0, label="recording")
        axes.margins(y=0.12)
        mark_passes(axes, teeth, damaged)
        axes.set(xlabel="angle, deg", ylabel=unit)
        axes.legend(frameon=False, fontsize=8, loc="lower right")
    return figure


def _spectrum(tsa: FloatArray, healthy: FloatArray | None, teeth: int, unit: str) -> Figure:
    with drawing() as figure:
        axes = figure.subplots()
        draw_spectrum(axes, tsa, teeth, min(_SHOWN_MESH_ORDERS * teeth, len(tsa) / 2), healthy)
        axes.set(xlabel="order, 1/rev", ylabel=unit)
    return figure
