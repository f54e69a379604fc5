"""The signature of a recording as tables of text."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from sigdb.report.text_table import Column, number, table, word
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
"""Columns of :func:`line_rows`."""


def recorded_text(facts: Mapping[str, Any]) -> str:
    """Facts, indicators, lines found and notes of a recording's signature.

    Parameters
    ----------
    facts
        What :meth:`sigdb.pipeline.RecordedSignature.as_json` returns.
    """
    width = max(len(name) for name, _ in fact_rows(facts))
    head = "\n".join(f"  {name.ljust(width)}  {value}" for name, value in fact_rows(facts))
    lines = [row for row in line_rows(facts) if row["found"]]
    blocks = [
        f"{facts['source']}\n{head}",
        f"Indicators\n{table(INDICATOR_COLUMNS, indicator_rows(facts))}",
        f"Lines that stand out of the spectrum over the angle\n{table(LINE_COLUMNS, lines)}"
        if lines
        else "No line stands out",
        "Notes\n" + "\n".join(f"  - {note}" for note in facts["notes"]),
    ]
    return "\n\n".join(blocks) + "\n"


def history_text(history: Sequence[Mapping[str, Any]]) -> str:
    """The recordings of a machine, one a line, oldest first.

    Parameters
    ----------
    history
        Rows of :func:`sigdb.recording.recorded_history`.
    """
    return f"History, oldest first\n{table(history_columns(history), history)}\n"


def history_columns(history: Sequence[Mapping[str, Any]]) -> list[Column]:
    """Columns of a history."""
    shown = [(title, number(key, 5)) for key, title in _HISTORY.items() if key in history[0]]
    return [("recording", lambda row: re.split(r"[/\\]", row["source"])[-1]), *shown]


def fact_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What was averaged and how, a name and a sentence each."""
    unit, speeds = facts["unit"] or "unit not stated", facts["speed_track"]["speed_rpm"]
    gear = (
        f"{facts['gear']}, {facts['teeth']} teeth, on {facts['shaft']}" if facts["gear"] else f"{facts['teeth']} teeth"
    )
    return [
        ("channel", f"{facts['channel']} ({unit})"),
        ("gear", gear),
        ("angle", facts["angle"]),
        ("tooth numbers", "absolute: tooth 1 follows the tacho mark" if facts["absolute"] else "relative"),
        ("speed", f"{facts['speed_rpm']:.2f} rpm ({facts['speed_rpm'] / 60:.3f} Hz)"),
        ("speed range", f"{min(speeds):.2f} to {max(speeds):.2f} rpm, revolution by revolution"),
        ("averages", _averages(facts)),
        ("rms kept", f"{100 * facts['kept']:.1f} % of the record's"),
        ("scatter", "not known of one revolution" if facts["scatter"] is None else f"{facts['scatter']:.4g} ({unit})"),
        ("highest order", f"{facts['highest_order']:.1f}, {facts['highest_order'] / facts['teeth']:.1f} mesh orders"),
    ]


def _averages(facts: Mapping[str, Any]) -> str:
    M, cycle = facts["averages"], facts["cycle"]
    whole = f", {M // cycle} tooth cycles of {cycle}" if cycle and M % cycle == 0 else ""
    return f"{M} revolutions{whole}; {facts['dropped']} dropped"


INDICATOR_COLUMNS: tuple[Column, ...] = (
    ("indicator", word("name")),
    ("value", number("value")),
    ("what", word("help")),
)
"""Columns of :func:`indicator_rows`."""


def indicator_rows(facts: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Indicators with what they are."""
    return [
        {"name": name, "value": value, "help": INDICATORS[name].help} for name, value in facts["indicators"].items()
    ]


def line_rows(facts: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Lines, one a dictionary."""
    columns = facts["lines"]
    return [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
