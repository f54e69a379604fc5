"""The signature of a recording as tables of text."""

from collections.abc import Iterator
from math import isnan
from pathlib import PureWindowsPath

import numpy as np
import pandas as pd

from sigdb.recording import RecordedSignature, Recording, RecordingBlocks, Repeatability
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number
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


def overview_text(recording: Recording | RecordingBlocks, *, terminal: Terminal = PLAIN) -> str:
    """Return what was read from a recording as text: a table of its channels, and what was left out.

    Parameters
    ----------
    recording : Recording or RecordingBlocks
        From :func:`sigdb.recording.read_recording` or :func:`sigdb.recording.read_in_blocks`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    overview = recording.overview()
    left_out = [text for text in overview["left_out"] if text]
    lines = [f"Read from {recording.source}", overview_table(overview).text(terminal, indent=2)]
    lines += ["Left out", *(f"  - {text}" for text in left_out)] if left_out else []
    return "\n".join(lines) + "\n"


def overview_table(overview: pd.DataFrame) -> TextTable:
    """Return the table of the channels of a recording, a row each."""
    head = (
        "channel", "unit", "rate, Hz", "rate from", "start, s", "length, s", "least", "greatest", "rms", "clipped, %",
        "spikes", "drop-outs",
    )  # fmt: skip
    rows = [
        [
            row["channel"],
            row["unit"] or "not stated",
            f"{row['sampling_rate']:.9g}",
            row["rate_from"],
            number(row["start"], 4),
            number(row["duration"], 4),
            *(number(row[key], 4) for key in ("least", "greatest", "rms")),
            number(100 * row["clipped"], 2),
            *("-" if pd.isna(row[key]) else str(row[key]) for key in ("spikes", "drop_outs")),
        ]
        for row in overview[overview["left_out"] == ""].to_dict("records")
    ]
    return TextTable(head, rows)


def recorded_text(signature: RecordedSignature, *, terminal: Terminal = PLAIN) -> str:
    """Return facts, indicators, outstanding lines and notes of a recording's signature as text.

    Parameters
    ----------
    signature : RecordedSignature
        From :func:`sigdb.recording.recorded_signature`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    facts = fact_rows(signature)
    width = max(len(name) for name, _ in facts)
    head = "\n".join(f"  {name.ljust(width)}  {value}" for name, value in facts)
    lines, envelope = line_table(signature), envelope_table(signature)
    blocks = [
        f"{signature.source}\n{head}",
        f"Indicators\n{indicator_table(signature).text(terminal, indent=2)}"
        if signature.indicators
        else f"No indicators: {signature.presence.reason}",
        *_repeats_text(signature, terminal),
        f"Lines that stand out of the spectrum over the angle\n{lines.text(terminal, indent=2)}"
        if lines.rows
        else "No line stands out",
        f"Envelope spectrum: {envelope_text(signature)}\n"
        + (envelope.text(terminal, indent=2) if envelope.rows else "  no line stands out"),
        *([f"Order map\n  {order_map_text(signature)}"] if signature.order_map and signature.presence.present else []),
        "Notes\n" + "\n".join(f"  - {note.text}" for note in signature.notes),
    ]
    return "\n\n".join(blocks) + "\n"


def history_text(history: pd.DataFrame, *, terminal: Terminal = PLAIN) -> str:
    """Return the recordings of a machine as text, a line for each, oldest first.

    Parameters
    ----------
    history : pandas.DataFrame
        From :func:`sigdb.recording.recorded_history`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    return f"History, oldest first\n{history_table(history).text(terminal, indent=2)}\n"


def history_table(history: pd.DataFrame) -> TextTable:
    """Return the table of a history, a row for each recording."""
    shown = {key: title for key, title in _HISTORY.items() if key in history}
    rows = [
        # The name of a file of Windows or of another system.
        [PureWindowsPath(row["source"]).name, *(number(row[key], 5) for key in shown)]
        for row in history.to_dict("records")
    ]
    return TextTable(["recording", *shown.values()], rows)


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
        ("rms kept", _kept(signature)),
        ("mesh", f"{'present' if signature.presence.present else 'not present'}: {signature.presence.reason}"),
        *_repeats(signature),
        ("scatter", "unknown for one revolution" if isnan(signature.scatter) else f"{signature.scatter:.4g} ({unit})"),
        ("highest order", f"{order:.1f}, {order / teeth:.1f} mesh orders"),
    ]


def _repeats(signature: RecordedSignature) -> Iterator[tuple[str, str]]:
    """Yield the fact on what repeats in each turn, with its ratio and the limit that healthy gears set."""
    repeats = signature.repeatability
    if repeats is not None:
        ratio = "" if isnan(repeats.energy_ratio) else f" (ratio {repeats.energy_ratio:.3g}, limit {repeats.limit:.3g})"
        yield "one event", f"{repeats.answer}{ratio}"


def _repeats_text(signature: RecordedSignature, terminal: Terminal) -> Iterator[str]:
    if signature.repeatability is not None and (table := repeatability_table(signature.repeatability)).rows:
        yield f"Repeats from revolution to revolution\n{table.text(terminal, indent=2)}"


def repeatability_table(repeats: Repeatability) -> TextTable:
    """Return the table of what repeats from revolution to revolution, against noise and healthy gears."""
    R = repeats.revolutions
    rows = [
        ["strongest pulse over the other teeth", number(repeats.energy_ratio, 3), "-", number(repeats.limit, 3)],
        [
            "revolutions whose strongest place is the same",
            f"{repeats.same_place} of {R}",
            number(repeats.same_place_by_chance, 3),
            number(repeats.same_place_by_pitch_errors, 3),
        ],
        [
            "correlation of odd and even revolutions",
            number(repeats.odd_even_correlation, 3),
            f"± {number(2 * repeats.odd_even_by_noise, 2)}",
            number(repeats.odd_even_by_pitch_errors, 3),
        ],
        [
            "power over that of neighbouring tooth counts",
            number(repeats.power_ratio, 3),
            number(repeats.power_ratio_by_noise, 3),
            number(repeats.power_ratio_by_pitch_errors, 3),
        ],
    ]
    head = ("what repeats", "value", "by noise", "by pitch errors, at most")
    return TextTable(head, [] if isnan(repeats.energy_ratio) else rows)


def _kept(signature: RecordedSignature) -> str:
    share, noise = 100 * signature.kept, 100 * signature.presence.kept_by_noise
    return f"{share:.1f} % of the record's" + ("" if isnan(noise) else f"; noise alone keeps {noise:.1f} %")


def _averages(signature: RecordedSignature) -> str:
    M, cycle = signature.averages, signature.cycle
    whole = f", {M // cycle} tooth cycles of {cycle}" if cycle and M % cycle == 0 else ""
    return f"{M} revolutions{whole}; {signature.dropped} dropped"


def indicator_table(signature: RecordedSignature) -> TextTable:
    """Return the table of the indicators, with their descriptions."""
    table = signature.intervals
    intervals = dict(zip(table["indicator"], zip(table["low"], table["high"], strict=True), strict=True))
    rows = [
        [name, number(value), _interval(*intervals[name]), INDICATORS[name].help]
        for name, value in signature.indicators.items()
    ]
    return TextTable(("indicator", "value", "95 % interval", "what"), rows)


def _interval(low: float, high: float) -> str:
    return "unknown, too few revolutions" if isnan(low) else f"{number(low)} to {number(high)}"


def envelope_table(signature: RecordedSignature) -> TextTable:
    """Return the table of the lines that stand out of the envelope spectrum, those of shafts and bearings by name."""
    lines = signature.envelope.lines[signature.envelope.lines["stands_out"]].sort_values("order")
    columns = (lines[name] for name in ("order", "nominal", "amplitude", "over_level", "name"))
    rows = [
        [f"{order:.3f}", f"{nominal:.3f}", number(amplitude), f"{over:.1f}", name]
        for order, nominal, amplitude, over, name in zip(*columns, strict=True)
    ]
    return TextTable(("order", "nominal", "amplitude", "over level", "what"), rows)


def envelope_text(signature: RecordedSignature) -> str:
    """Return a sentence on the band of the envelope and the orders that were searched in its spectrum."""
    envelope = signature.envelope
    low, high = envelope.band
    source = "the most impulsive band" if envelope.chosen == "kurtosis" else "the stated band"
    bearings = "shafts and bearings" if (envelope.lines["kind"] == "bearing").any() else "shafts"
    return (
        f"orders {low:.4g} to {high:.4g}, {source}, excess kurtosis {envelope.kurtosis:.3g}; orders of {bearings} are "
        "searched"
    )


def line_table(signature: RecordedSignature) -> TextTable:
    """Return the table of the lines that stand out of the spectrum over the angle."""
    lines = signature.lines[signature.lines["stands_out"]]
    columns = zip(lines["order"], lines["amplitude"], lines["over_level"], lines["name"], strict=True)
    rows = [[f"{order:.3f}", number(amplitude), f"{over:.1f}", name] for order, amplitude, over, name in columns]
    return TextTable(("order", "amplitude", "over level", "what"), rows)


def order_map_text(signature: RecordedSignature) -> str:
    """Return a sentence on the speeds of a run-up, and on the speed at which each mesh harmonic is greatest."""
    by_speed, teeth = signature.order_map, signature.teeth
    if by_speed is None:
        return ""
    peaks = []
    for h in (1, 2, 3):
        if h * teeth <= by_speed.order[-1]:
            along = by_speed.along(h * teeth)
            at = int(np.nanargmax(along))
            name = "mesh" if h == 1 else f"mesh x{h}"
            peaks.append(f"{name} is greatest at {by_speed.speed_rpm[at]:.0f} rpm ({along[at]:.4g})")
    speeds = f"{by_speed.speed_rpm[0]:.0f} to {by_speed.speed_rpm[-1]:.0f} rpm in {len(by_speed.speed_rpm)} bins"
    return "; ".join([speeds, *peaks])
