"""Notes of a diagnosis: missing information, the reading of the recordings, and other facts about the answer."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from sigdb.core import Note
from sigdb.diagnosis.change.detectors import Detector
from sigdb.diagnosis.change.finding import Finding
from sigdb.recording import SPEED_DOUBT, RecordedSignature

OTHER_SHAFT = "other-shaft"
"""Code of the note that something turns with another shaft."""

_UNLIKE = 0.5
"""Correlation of the errors of the teeth below which the gears may be others."""

_RARE = 1e-4
"""Probability below which the envelope repeats with another shaft; several shafts are tried."""

_FAR_SPEED = 1.8
"""Quotient of a recorded and a rig's speed above which a note asks for the sampling rate; mistakes are twofold."""


def missing_notes(signature: RecordedSignature, healthy: Sequence[RecordedSignature], *, mark: bool) -> Iterator[Note]:
    """Yield the notes on missing information that would improve the answer, a tacho mark among it."""
    if not healthy:
        yield Note(
            code="no-healthy-recording",
            text="A healthy recording of the same machine by the same channel. Without it only an event that repeats "
            "in nearly every revolution can be seen, and errors of these gears cannot be separated from small damage.",
        )
    if not mark:
        text = "A tacho mark: without it teeth are counted from where the average begins."
        yield Note(code="no-tacho-mark", text=text)
    for where, recording in (("", signature), *((" in the healthy recording", each) for each in healthy)):
        for note in recording.notes:
            if note.code == SPEED_DOUBT:
                yield replace(note, text=f"A reliable speed{where}: {note.text}.")


def reading_notes(signature: RecordedSignature, healthy: Sequence[RecordedSignature]) -> Iterator[Note]:
    """Yield the notes on reading and averaging; of the healthy recording those that differ in more than numbers."""
    yield from (note for note in signature.notes if note.code != SPEED_DOUBT)
    subjects = [_subject(note) for note in signature.notes]
    for each in healthy:
        for note in each.notes:
            if note.code != SPEED_DOUBT and _subject(note) not in subjects:
                subjects.append(_subject(note))
                values = {**note.values, "recording": "healthy"}
                yield replace(note, text=f"healthy recording: {note.text}", values=values)


def _subject(note: Note) -> tuple[str, dict[str, str]]:
    """Return the code of a note with those of its values that are no numbers."""
    return note.code, {name: value for name, value in note.values.items() if isinstance(value, str)}


def rig_speed_notes(rated_rpm: float, speed_rpm: float) -> Iterator[Note]:
    """Yield the note on a recorded speed that is far from the operating speed of the rig."""
    ratio = speed_rpm / rated_rpm
    if not 1 / _FAR_SPEED < ratio < _FAR_SPEED:
        yield Note(
            code="far-from-rig-speed",
            text=f"The recording's speed is {speed_rpm:.5g} rpm, {ratio:.3g} times the rig's operating speed of "
            f"{rated_rpm:.5g} rpm. If the rig did not run at this speed, check the sampling rate and the tacho.",
            values={"recording": speed_rpm, "rig": rated_rpm},
        )


def turn_notes(finding: Finding, *, absolute: bool) -> Iterator[Note]:
    """Yield the notes on the turn between the averages, and on how alike their teeth are."""
    change = finding.change
    Z = change.teeth
    if not absolute:
        text = (
            f"Without a common tacho mark the healthy average was turned by {change.turn * Z:.3f} teeth, where it fits "
            "best."
        )
        yield Note(code="turned", text=text, values={"teeth": change.turn * Z})
    alike = f"{change.likeness:.2f}"
    if change.likeness < _UNLIKE and not finding.stands_out:
        yield Note(
            code="teeth-unlike",
            text=f"The errors of the teeth in the two recordings have a correlation of {alike}: too little to know "
            "that these are the same gears in the same position.",
            values={"likeness": change.likeness},
        )
    if finding.wider:
        text = (
            "The recordings differ more than parts of one healthy recording do, by load, speed, sensor or all teeth "
            "alike; the limits were raised, and rest on other machines. Five healthy recordings or more would replace "
            "them."
        )
        yield Note(code="wider-than-healthy", text=text, values={"middle": change.middle})


def method_notes(detectors: Sequence[Detector]) -> Iterator[Note]:
    """Yield the notes where the simulation, the healthy recordings alone, and FM4 and NA4 disagree."""
    pulse = any(each.alarm for each in detectors if each.decides and not each.simulated)
    shape = any(each.alarm for each in detectors if each.simulated)
    if pulse != shape and any(each.simulated for each in detectors):
        both = ("the healthy recordings alone", "the templates of the rig")
        which, rest = both if pulse else both[::-1]
        text = f"By {which} a tooth stands out, by {rest} none does: the answer is that of the former."
        yield Note(code="methods-disagree", text=text, values={"pulse": pulse, "template": shape})
    for each in detectors:
        if not each.decides and each.alarm != (pulse or shape):
            side = "above" if each.alarm else "within"
            text = (
                f"{each.name} of the difference, {each.value:.3g}, is {side} its limit of {each.limit:.3g}, where "
                f"{'a' if pulse or shape else 'no'} tooth stands out; it takes no part in the answer."
            )
            yield Note(
                code=f"{each.name.lower()}-disagrees", text=text, values={"value": each.value, "limit": each.limit}
            )


def fm4_notes(signature: RecordedSignature) -> Iterator[Note]:
    """Yield a note on FM4 of the average, for which there is no limit without a healthy recording."""
    fm4 = signature.indicators.get("fm4")
    if fm4 is not None:
        text = f"FM4 is {fm4:.3g}; one damaged tooth that stands out raises it well above 3."
        yield Note(code="fm4", text=text, values={"recording": fm4})


def shaft_notes(signature: RecordedSignature, healthy: Sequence[RecordedSignature]) -> Iterator[Note]:
    """Yield a note for each other shaft with which the envelope repeats, unless a healthy recording does so too."""
    ordinary = {row["shaft"] for each in healthy for row in _repeating(each)}
    for row in _repeating(signature):
        if row["shaft"] in ordinary:
            continue
        doubt = "" if healthy else " Errors of its gear do so too."
        text = (
            f"Something turns with {row['shaft']} (order {row['order']:.4g}, p = {row['p_value']:.1g})"
            f", which the average of this gear does not hold: look at the gear on that shaft too.{doubt}"
        )
        yield Note(code=OTHER_SHAFT, text=text, values={name: row[name] for name in ("shaft", "order", "p_value")})


def _repeating(signature: RecordedSignature) -> list[dict[str, Any]]:
    rows = signature.shafts.to_dict("records") if len(signature.shafts) else []
    return [{str(name): value for name, value in row.items()} for row in rows if row["p_value"] <= _RARE]
