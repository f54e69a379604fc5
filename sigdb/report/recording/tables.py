"""The signature of a recording as tables of text."""

import re
from math import isnan

import pandas as pd

from sigdb.recording import RecordedSignature
from sigdb.report.text_table import Column, number, rows_of, table, word
from sigdb.signature import INDICATORS

_HISTORY: dict[str, str] = {
    "speed_rpm": "speed, rpm",
    "averages": "averages",
    "kept": "share kept",
    "rms": "rms",
    "fm4": "fm4",
    "energy_ratio": "energy ratio",
    "na4": "NA4",
    "nb4": "NB4",
    "na4_star": "NA4*",
    "nb4_star": "NB4*",
}
LINE_COLUMNS: tuple[Column, ...] = (
    ("order", lambda row: f"{row['order']:.3f}"),
    ("amplitude", number("amplitude")),
    ("over level", lambda row: f"{row['over_level']:.1f}"),
    ("what", word("name")),
)
"""Columns of the table of :func:`outstanding_lines`."""


def recorded_text(signature: RecordedSignature) -> str:
    """Return facts, indicators, outstanding lines and notes of a recording's signature as text.

    Parameters
    ----------
    signature : RecordedSignature
        From :func:`sigdb.recording.recorded_signature`.

    Returns
    -------
    str
        Several lines.
    """
    facts = fact_rows(signature)
    width = max(len(name) for name, _ in facts)
    head = "\n".join(f"  {name.ljust(width)}  {value}" for name, value in facts)
    lines = outstanding_lines(signature)
    blocks = [
        f"{signature.source}\n{head}",
        f"Indicators\n{table(INDICATOR_COLUMNS, indicator_rows(signature))}",
        f"Lines that stand out of the spectrum over the angle\n{table(LINE_COLUMNS, lines)}"
        if lines
        else "No line stands out",
        "Notes\n" + "\n".join(f"  - {note.text}" for note in signature.notes),
    ]
    return "\n\n".join(blocks) + "\n"


def history_text(history: pd.DataFrame) -> str:
    """Return the recordings of a machine as text, a line for each, oldest first.

    Parameters
    ----------
    history : pandas.DataFrame
        From :func:`sigdb.recording.recorded_history`.

    Returns
    -------
    str
        Several lines.
    """
    return f"History, oldest first\n{table(history_columns(history), rows_of(history))}\n"


def history_columns(history: pd.DataFrame) -> list[Column]:
    """Return the columns of the table of a history."""
    shown = [(title, number(key, 5)) for key, title in _HISTORY.items() if key in history]
    return [("recording", lambda row: re.split(r"[/\\]", row["source"])[-1]), *shown]


def fact_rows(signature: RecordedSignature) -> list[tuple[str, str]]:
    """Return facts about the average, a name and a text each."""
    unit, speeds, teeth = signature.unit or "unit not stated", signature.speed_track["speed_rpm"], signature.teeth
    order = signature.highest_order
    return [
        ("channel", f"{signature.channel} ({unit})"),
        ("gear", f"{signature.gear}, {teeth} teeth, on {signature.shaft}" if signature.gear else f"{teeth} teeth"),
        ("angle", signature.angle),
        ("tooth numbers", "absolute: tooth 1 follows the tacho mark" if signature.absolute else "relative"),
        ("speed", f"{signature.speed_rpm:.2f} rpm ({signature.speed_rpm / 60:.3f} Hz)"),
        ("speed range", f"{min(speeds):.2f} to {max(speeds):.2f} rpm, revolution by revolution"),
        ("averages", _averages(signature)),
        ("rms kept", f"{100 * signature.kept:.1f} % of the record's"),
        ("scatter", "unknown for one revolution" if isnan(signature.scatter) else f"{signature.scatter:.4g} ({unit})"),
        ("highest order", f"{order:.1f}, {order / teeth:.1f} mesh orders"),
    ]


def _averages(signature: RecordedSignature) -> str:
    M, cycle = signature.averages, signature.cycle
    whole = f", {M // cycle} tooth cycles of {cycle}" if cycle and M % cycle == 0 else ""
    return f"{M} revolutions{whole}; {signature.dropped} dropped"


INDICATOR_COLUMNS: tuple[Column, ...] = (
    ("indicator", word("name")),
    ("value", number("value")),
    ("what", word("help")),
)
"""Columns of :func:`indicator_rows`."""


def indicator_rows(signature: RecordedSignature) -> list[dict[str, str | float | None]]:
    """Return the indicators with their descriptions."""
    return [
        {"name": name, "value": None if isnan(value) else value, "help": INDICATORS[name].help}
        for name, value in signature.indicators.items()
    ]


def outstanding_lines(signature: RecordedSignature) -> list[dict[str, str | float]]:
    """Return the lines that stand out of the spectrum over the angle."""
    lines = signature.lines[signature.lines["stands_out"]]
    return [{str(name): value for name, value in row.items()} for row in lines.to_dict("records")]
