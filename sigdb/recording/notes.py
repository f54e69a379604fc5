"""Notes on the average of a recording."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sigdb.core import Note
from sigdb.recording.evidence.presence import MeshPresence
from sigdb.recording.orders import AveragedGear
from sigdb.recording.overview.overview_table import FAULTS, fault_notes

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

_LITTLE_KEPT, _ABOVE_NOISE = 0.2, 2.0
"""Share of the record's rms, and ratio to what noise alone keeps, below which an average keeps little."""
_OF_PEAKS = ("peak_to_peak", "crest_factor", "kurtosis", "energy_operator", "fm0", "fm4", "m6a", "m8a")
"""Indicators that a few great samples, or missing ones, decide."""

DOUBTS = frozenset(
    {
        *("speed-doubt", "speed-to-confirm", "speed-unlike-rig", "ratio-unlike-rig", "rounded-ratio", "tacho-coarse"),
        *("mesh-phase-slips", "rate-of-another-array", "time-assumed", "cut-short", "spoilt-indicators"),
    }
)
"""Codes of notes on something that an average depends on and the reading is not sure of."""

MESH_PRESENT, NO_MESH = "mesh-present", "no-mesh"
"""Codes of the notes on whether the gear is to be seen in the recording."""


def channel_notes(recording: "Recording", signal: "Channel") -> list[Note]:
    """Return notes on the choice of the channel and on a missing unit."""
    names = [channel.name for channel in recording.signals]
    notes = []
    if len(names) > 1:
        text = f"channel {signal.name} of {', '.join(names)}"
        notes.append(Note(code="channel", text=text, values={"channel": signal.name}))
    if not signal.unit:
        text = f"the unit of channel {signal.name} is not stated"
        notes.append(Note(code="unit-not-stated", text=text, values={"channel": signal.name}))
    return notes


def average_note(gear: AveragedGear, revolutions: int, available: int) -> Note:
    """Return the note on the averaged and available revolutions, and on whether they are whole tooth cycles."""
    average = f"{revolutions} of {available} whole revolutions averaged"
    values = {"revolutions": revolutions, "available": available}
    if gear.cycle is None:
        text = f"{average}: whole revolutions, not tooth cycles, since the mate's tooth count is not known"
        return Note(code="whole-revolutions", text=text, values=values)
    values = values | {"cycle": gear.cycle}
    if revolutions % gear.cycle:
        text = f"{average}: no whole number of tooth cycles of {gear.cycle} revolutions, so traces of other orders stay"
        return Note(code="broken-tooth-cycles", text=text, values=values)
    text = f"{average}: {revolutions // gear.cycle} tooth cycles of {gear.cycle} revolutions"
    return Note(code="whole-tooth-cycles", text=text, values=values)


def range_notes(teeth: int, highest: float, samples_per_tooth: int) -> list[Note]:
    """Return a note on the highest order of a recording where a simulated average reaches further."""
    if 2 * highest >= samples_per_tooth * teeth:
        return []
    text = (
        f"the recording reaches to order {highest:.1f}, {highest / teeth:.1f} mesh orders: above it the average holds"
        f" nothing, where simulated ones of {samples_per_tooth} samples a tooth reach to {samples_per_tooth / 2:g}"
    )
    return [Note(code="highest-order", text=text, values={"order": highest, "samples_per_tooth": samples_per_tooth})]


def presence_note(presence: MeshPresence, kept: float) -> Note:
    """Return the note on whether the gear is to be seen, with what the average keeps and what noise would keep."""
    values: dict[str, float | int | str] = {
        "p_value": presence.p_value,
        "kept": kept,
        "kept_by_noise": presence.kept_by_noise,
    }
    share = f"the average keeps {kept:.1%} of the record's rms, noise alone would keep {presence.kept_by_noise:.1%}"
    if presence.present:
        return Note(code=MESH_PRESENT, text=f"{presence.reason}; {share}", values=values)
    text = f"{presence.reason}; {share}; indicators of the average are refused"
    return Note(code=NO_MESH, text=text, values=values)


def kept_notes(presence: MeshPresence, kept: float) -> Iterator[Note]:
    """Yield a note where the average keeps little of the record, though the gear is to be seen."""
    least = max(_LITTLE_KEPT, _ABOVE_NOISE * presence.kept_by_noise)
    if presence.present and kept < least:
        text = (
            f"the average keeps {kept:.1%} of the record's rms, less than {least:.0%}: most of the record does not"
            " repeat once a revolution; check speed, ratio and pulses a revolution, or other sources are louder"
        )
        yield Note(code="little-kept", text=text, values={"kept": kept, "least": least})


def spoilt_notes(recording: "Recording", signal: "Channel", *, in_blocks: bool) -> Iterator[Note]:
    """Yield a note on the indicators that clipped samples, spikes and drop-outs of a channel spoil.

    In blocks the channel has no samples here; the reading of the blocks has noted their faults.
    """
    listed = [note for note in recording.notes if note.code in FAULTS]
    for note in listed or (() if in_blocks else fault_notes([signal], tacho=None)):
        if note.code in FAULTS and note.values.get("channel") == signal.name:
            values = {"fault": note.code, "channel": signal.name, "indicators": ", ".join(_OF_PEAKS)}
            text = f"{', '.join(_OF_PEAKS)} are not to be trusted: {note.text.partition(',')[0]} ({note.code})"
            yield Note(code="spoilt-indicators", text=text, values=values)
