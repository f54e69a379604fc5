"""What is to be known of an average of a recording, one sentence each."""

from typing import TYPE_CHECKING

from sigdb.recording.orders import AveragedGear

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording


def channel_notes(recording: "Recording", signal: "Channel") -> list[str]:
    """Which channel it is, and whether its unit is known."""
    names = [one.name for one in recording.signals]
    said = [f"channel {signal.name} of {', '.join(names)}"] if len(names) > 1 else []
    return said + ([] if signal.unit else [f"the unit of channel {signal.name} is not stated"])


def average_notes(known: AveragedGear, M: int, available: int) -> list[str]:
    """Revolutions used and dropped, and whether they are tooth cycles."""
    used = f"{M} of {available} whole revolutions averaged"
    if known.cycle is None:
        return [f"{used}: whole revolutions, not tooth cycles, since the mate's tooth count is not known"]
    if M % known.cycle:
        return [f"{used}: no whole number of tooth cycles of {known.cycle} revolutions, so traces of other orders stay"]
    return [f"{used}: {M // known.cycle} tooth cycles of {known.cycle} revolutions"]


def range_notes(teeth: int, highest: float, samples_per_tooth: int) -> list[str]:
    """How far up a recording reaches, where that is less than what a simulated average holds."""
    if 2 * highest >= samples_per_tooth * teeth:
        return []
    return [
        f"the recording reaches to order {highest:.1f}, {highest / teeth:.1f} mesh orders: above it the average holds"
        f" nothing, where simulated ones of {samples_per_tooth} samples a tooth reach to {samples_per_tooth / 2:g}"
    ]
