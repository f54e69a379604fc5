"""The text and the pages of a joint diagnosis: the answer first, then the evidence of each average."""

from pathlib import Path

import numpy as np

from sigdb.core import json_text, publish_all
from sigdb.diagnosis import JointDiagnosis
from sigdb.report.diagnosis.report import write_diagnosis_report
from sigdb.report.page import page
from sigdb.report.text_table import PLAIN, Terminal, TextTable

PARTS_HEAD = ("channel", "speed, rpm", "recordings", "alone", "log10 odds alone")
"""Heading of the table of the averages."""

_SHOWN, _LEAST = 5, 0.005
"""Greatest number of teeth that are shown, and their least probability."""


def joint_diagnosis_text(joint: JointDiagnosis, *, terminal: Terminal = PLAIN) -> str:
    """Return the joint answer and the evidence of each average, as text for a terminal.

    Parameters
    ----------
    joint : JointDiagnosis
        From :func:`sigdb.diagnosis.diagnose_jointly`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    lines = [joint.answer, *probabilities(joint), "", TextTable(PARTS_HEAD, part_rows(joint)).text(terminal, indent=2)]
    if joint.notes:
        lines += ["", "notes", *(f"  {note.text}" for note in joint.notes)]
    return "\n".join(lines) + "\n"


def write_joint_report(joint: JointDiagnosis, folder: str | Path, *, command: str | None = None) -> Path:
    """Write the page of a joint diagnosis, ``index.html``, its numbers, and the page of each average in a folder.

    Parameters
    ----------
    joint : JointDiagnosis
        From :func:`sigdb.diagnosis.diagnose_jointly`.
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
    names = [f"average-{number}" for number in range(1, len(joint.parts) + 1)]
    for name, part in zip(names, joint.parts, strict=True):
        write_diagnosis_report(part.diagnosis, folder / name, command=command)
    html = page(
        "joint_diagnosis.html",
        title="Joint diagnosis",
        alarm=joint.exit_code != 0,
        answer=joint.answer,
        probabilities=probabilities(joint),
        parts_head=PARTS_HEAD,
        parts=part_rows(joint),
        pages=[f"{name}/index.html" for name in names],
        notes=[note.text for note in joint.notes],
        command=command,
    )
    index = folder / "index.html"
    publish_all({folder / "diagnosis.json": json_text(joint.as_json()), index: html})
    return index


def probabilities(joint: JointDiagnosis) -> list[str]:
    """Return a sentence on the probabilities of damage and of the teeth; none without a posterior."""
    posterior = joint.posterior
    if posterior is None:
        return []
    order = np.argsort(-posterior.teeth, kind="stable")[:_SHOWN]
    teeth = ", ".join(
        f"{tooth + 1}: {posterior.teeth[tooth]:.3g}" for tooth in order if posterior.teeth[tooth] >= _LEAST
    )
    gear = f" of {joint.gear}" if joint.gear else ""
    by_tooth = f"; of damage at tooth{gear} {teeth}" if teeth else ""
    return [f"Probability of no damage {posterior.none:.3g}{by_tooth}. Damage and none are equally likely before."]


def part_rows(joint: JointDiagnosis) -> list[list[str]]:
    """Return the rows of the table of the averages; odds are those of damage at the most probable tooth."""
    tooth = 0 if joint.posterior is None else int(joint.posterior.teeth.argmax())
    return [
        [
            part.channel or "the first",
            "" if np.isnan(part.speed_rpm) else f"{part.speed_rpm:.5g}",
            ", ".join(str(number + 1) for number in part.recordings),
            part.diagnosis.kind,
            "" if part.contribution is None else f"{part.contribution[tooth] / np.log(10):+.1f}",
        ]
        for part in joint.parts
    ]
