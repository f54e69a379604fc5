"""Table of the channels of a recording and of what was left out of it, and notes on faults of the samples."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, Note
from sigdb.recording.overview.sample_faults import SampleRuns, clipped_runs, drop_out_runs, spike_runs

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

FAULTS: dict[str, tuple[Callable[[FloatArray], SampleRuns], str]] = {
    "clipped": (clipped_runs, "stand at its extremes, as those of a clipped signal do; indicators of peaks are wrong"),
    "spikes": (spike_runs, "are single and far outside, as spikes are; indicators of peaks are wrong"),
    "drop-outs": (drop_out_runs, "have one value in a signal that moves, as drop-outs do"),
}
"""Runs of faulty samples, and the end of a sentence on them, by the code of their note."""


def fault_notes(channels: Sequence["Channel"], *, tacho: str | None) -> list[Note]:
    """Return notes on constant channels, clipping, spikes and drop-outs; the tacho is a wave of its kind."""
    notes: list[Note] = []
    for channel in channels:
        if is_constant(channel):
            values: dict[str, str | float] = {"channel": channel.name, "count": 1, "share": 1.0}
            text = f"{channel.name} is constant"
            notes.append(Note(code="constant-channel", text=text, values=values | {"first_s": channel.start}))
        elif channel.name != tacho:
            notes += [note for code in FAULTS if (note := _note(channel, code)) is not None]
    return notes


def is_constant(channel: "Channel") -> bool:
    """Return whether all samples of a channel are equal."""
    return bool(channel.samples.min() == channel.samples.max())


def _note(channel: "Channel", code: str) -> Note | None:
    find, sentence = FAULTS[code]
    runs = find(channel.samples)
    if not runs.samples:
        return None
    share = runs.samples / channel.samples.size
    first = channel.start + float(runs.starts[0]) / channel.sampling_rate
    text = (
        f"{channel.name}: {runs.samples} samples in {runs.starts.size} places ({100 * share:.2g} %), first at "
        f"{first:.4g} s, {sentence}"
    )
    values: dict[str, str | float] = {"channel": channel.name, "count": runs.starts.size, "samples": runs.samples}
    return Note(code=code, text=text, values=values | {"share": share, "first_s": first})


LEFT_OUT = {"not-read", "not-over-time", "short-arrays", "neither-series-nor-matrix"}
"""Codes of notes on parts of a file that are no channels, besides those that end in ``-left-out``."""

NOT_SHOWN = {"lines-left-out"}
"""Codes of notes on parts that hold no numbers."""

COLUMNS = (
    "channel", "unit", "sampling_rate", "rate_from", "start", "duration", "samples", "least", "greatest", "rms",
    "clipped", "spikes", "drop_outs", "left_out",
)  # fmt: skip
"""Columns of the table."""

COUNTS = ("samples", "spikes", "drop_outs")
"""Columns of whole numbers, which may be missing."""


def overview_table(recording: "Recording") -> pd.DataFrame:
    """Return a row for each channel, then one for each part that was left out."""
    rows = [_row(channel, is_tacho=channel.name == recording.tacho) for channel in recording.channels]
    for note in recording.notes:
        if note.code in LEFT_OUT or (note.code.endswith("-left-out") and note.code not in NOT_SHOWN):
            name = next((note.values[key] for key in ("column", "channel", "name") if key in note.values), "")
            rows.append({"channel": str(name), "unit": "", "rate_from": "", "left_out": note.text})
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    return table.astype(dict.fromkeys(COUNTS, "Int64"))


def _row(channel: "Channel", *, is_tacho: bool) -> dict[str, object]:
    from sigdb.recording.recording import UnreadChannel

    x = channel.samples
    row: dict[str, object] = {
        "channel": channel.name,
        "unit": channel.unit,
        "sampling_rate": channel.sampling_rate,
        "rate_from": channel.rate_from,
        "start": channel.start,
        "duration": channel.duration,
        "samples": x.size,
        "least": channel.least if isinstance(channel, UnreadChannel) else float(x.min()),
        "greatest": channel.greatest if isinstance(channel, UnreadChannel) else float(x.max()),
        "rms": channel.rms if isinstance(channel, UnreadChannel) else _rms(x),
        "left_out": "",
    }
    if is_tacho or isinstance(channel, UnreadChannel):
        return row
    runs = {code: find(x) for code, (find, _) in FAULTS.items()} if not is_constant(channel) else {}
    clipped = runs["clipped"].samples / x.size if runs else 0.0
    spikes, drop_outs = (runs[code].starts.size if runs else 0 for code in ("spikes", "drop-outs"))
    return row | {"clipped": clipped, "spikes": spikes, "drop_outs": drop_outs}


def _rms(x: FloatArray) -> float:
    peak = float(np.abs(x).max())
    return peak * float(np.sqrt(np.mean((x / peak) ** 2))) if peak > 0 else 0.0
