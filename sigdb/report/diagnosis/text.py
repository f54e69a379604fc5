"""The text of a diagnosis: the answer first, then its evidence."""

from sigdb.diagnosis import Diagnosis
from sigdb.report.recording.tables import repeatability_table
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number

TITLES = {"stiffness_loss": "stiffness loss", "phase_shift_deg": "phase shift, deg", "damaged_teeth": "damaged teeth"}
"""Titles of quantities of a severity."""

DETECTOR_HEAD = ("detector", "by", "value", "limit", "alarm", "healthy pieces", "false alarms")
"""Heading of the table of detectors."""

_DETECTORS: dict[str, str] = {
    "pulse": "pulse",
    "FM4": "FM4 of the difference",
    "NA4": "NA4 of the difference",
    "template": "templates, free amplitudes",
    "likelihood": "templates behind the path",
}
"""Titles of detectors."""


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
    lines = [diagnosis.answer, evidence(diagnosis), ""]
    lines += [f"  {name:<7}{state:<12}{text}".rstrip() for name, state, text in lights(diagnosis)]
    if diagnosis.severity is not None:
        head = ("severity", "estimate", "90 % interval")
        lines += ["", TextTable(head, severity_rows(diagnosis)).text(terminal, indent=2)]
    if (repeating := repeats(diagnosis)) is not None:
        lines += ["", repeating.text(terminal, indent=2)]
    if rows := detector_rows(diagnosis):
        lines += ["", TextTable(DETECTOR_HEAD, rows).text(terminal, indent=2)]
    sections = (
        ("assumed", diagnosis.assumed),
        ("missing", [note.text for note in diagnosis.missing]),
        ("notes", [note.text for note in diagnosis.notes]),
        ("reading", [note.text for note in diagnosis.reading]),
    )
    for heading, sentences in sections:
        if sentences:
            lines += ["", heading, *(f"  {sentence}" for sentence in sentences)]
    return "\n".join(lines) + "\n"


def lights(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Return the three lights: ``level``, ``sensor`` and ``tooth``, each with its state and a sentence.

    The state is ``unchanged``, ``changed`` or ``unknown``.
    """
    level, finding = diagnosis.level, diagnosis.finding
    if level is None or finding is None:
        return [(name, "unknown", "") for name in ("level", "sensor", "tooth")]
    sensor = level.cause in ("sensor gain", "polarity", "load or mounting")
    text = f"mesh harmonics {level.mesh_db.min():+.1f} to {level.mesh_db.max():+.1f} dB" if len(level.mesh_db) else ""
    teeth = ", ".join(str(each.tooth) for each in diagnosis.locations)
    return [
        ("level", "changed" if level.changed else "unchanged", text),
        ("sensor", "changed" if sensor else "unchanged", f"likelier cause: {level.cause}" if level.changed else ""),
        ("tooth", "changed" if diagnosis.locations else "unchanged", f"tooth {teeth}" if teeth else ""),
    ]


def severity_rows(diagnosis: Diagnosis) -> list[list[str]]:
    """Return the rows of the table of the severity; none without one."""
    rows = [] if diagnosis.severity is None else diagnosis.severity.to_dict("records")
    return [[TITLES[row["target"]], f"{row['estimate']:.3g}", _interval(row["low"], row["high"])] for row in rows]


def _interval(low: float, high: float) -> str:
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def detector_rows(diagnosis: Diagnosis) -> list[list[str]]:
    """Return the rows of the table of detectors, those of healthy recordings alone first."""
    return [
        [
            _DETECTORS[each.name],
            "templates" if each.simulated else "healthy recordings alone",
            number(each.value, 3),
            number(each.limit, 3),
            "alarm" if each.alarm else "-",
            f"{each.pieces}",
            f"{each.false_alarm_rate:.2g}",
        ]
        for each in diagnosis.detectors
    ]


def repeats(diagnosis: Diagnosis) -> TextTable | None:
    """Return the table of what repeats, where there is no healthy recording and something was computed."""
    signature = diagnosis.signature
    if diagnosis.healthy or signature is None or signature.repeatability is None:
        return None
    table = repeatability_table(signature.repeatability)
    return table if table.rows else None


def evidence(diagnosis: Diagnosis) -> str:
    """Return the rate of false alarms, and how it was counted."""
    law = diagnosis.law
    if law is None:
        return "Nothing was compared."
    return (
        f"False alarms: at most one in {1 / law.false_alarms:.0f} healthy recordings, since none of {law.pieces} "
        "independent healthy pieces reaches the limit. Statistics are relative to what noise alone exceeds once in "
        "1000."
    )
