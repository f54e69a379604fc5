"""Notes of a diagnosis: missing information, the reading of the recordings, and other facts about the answer."""

from collections.abc import Iterator
from dataclasses import replace

from sigdb.core import Note
from sigdb.diagnosis.healthy_reference import HealthyReference
from sigdb.recognition import PointTemplates
from sigdb.recording import SPEED_DOUBT, RecordedSignature

_CHANGED_DB = 3.0
"""Change of a mesh harmonic, dB, above which the two recordings are not of the same state of the rig."""

_FAR_SPEED = 1.8
"""Quotient of a recorded and a rig's speed above which a note asks for the sampling rate; mistakes are twofold."""

_FAR = 0.02
"""Relative distance from the templates' operating point above which a note reports it."""


def missing_notes(signature: RecordedSignature, healthy: RecordedSignature | None, *, mark: bool) -> Iterator[Note]:
    """Yield the notes on missing information that would improve the answer, a tacho mark among it."""
    if healthy is None:
        yield Note(
            code="no-healthy-recording",
            text="A healthy recording of the same rig by the same channel. Without it the diagnosis assumes the "
            "simulated rig's path from the mesh to the sensor, and cannot separate errors of these gears from damage.",
        )
    if not mark:
        text = "A tacho mark: without it teeth are counted from where the average begins."
        yield Note(code="no-tacho-mark", text=text)
    for where, recording in (("", signature), (" in the healthy recording", healthy)):
        for note in () if recording is None else recording.notes:
            if note.code == SPEED_DOUBT:
                yield replace(note, text=f"A reliable speed{where}: {note.text}.")


def reading_notes(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[Note]:
    """Yield the notes on reading and averaging; of the healthy recording those that differ in more than numbers."""
    yield from (note for note in signature.notes if note.code != SPEED_DOUBT)
    subjects = [_subject(note) for note in signature.notes]
    for note in () if healthy is None else healthy.notes:
        if note.code != SPEED_DOUBT and _subject(note) not in subjects:
            values = {**note.values, "recording": "healthy"}
            yield replace(note, text=f"healthy recording: {note.text}", values=values)


def _subject(note: Note) -> tuple[str, dict[str, str]]:
    """Return the code of a note with those of its values that are no numbers."""
    return note.code, {name: value for name, value in note.values.items() if isinstance(value, str)}


def operating_point_notes(point: PointTemplates, speed_rpm: float, torque: float) -> Iterator[Note]:
    """Yield the notes on a speed or torque that differs from that of the templates."""
    quantities = (("speed", speed_rpm, "rpm", point.speed_rpm), ("torque", torque, "N m", point.torque))
    for name, value, unit, simulated in quantities:
        if abs(value - simulated) > _FAR * abs(simulated):
            yield Note(
                code=f"other-{name}",
                text=f"The templates have a {name} of {simulated:g} {unit}, the recording {value:g} {unit}.",
                values={"templates": simulated, "recording": value},
            )


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


def path_notes(reference: HealthyReference | None) -> Iterator[Note]:
    """Yield the notes on the transfer path and its change since the healthy recording."""
    if reference is None:
        return
    used = reference.path.harmonics
    harmonics = f"mesh harmonic{'s' if len(used) > 1 else ''} {', '.join(map(str, used))}"
    text = f"The path from the mesh to the sensor is that of {harmonics} of the healthy recording."
    yield Note(code="path", text=text, values={"harmonics": len(used)})
    least, most = float(reference.change_db.min()), float(reference.change_db.max())
    if reference.changed or max(-least, most) > _CHANGED_DB:
        yield Note(
            code="changed-path",
            text=f"Since the healthy recording the mesh harmonics have changed by {least:+.1f} to {most:+.1f} dB: "
            "load, mounting or sensor may not be the same, and other changes need not be damage.",
            values={"least_db": least, "most_db": most},
        )


def fm4_notes(signature: RecordedSignature, healthy: RecordedSignature | None) -> Iterator[Note]:
    """Yield a note on FM4, which needs no template."""
    recordings = {"recording": signature} | ({} if healthy is None else {"healthy": healthy})
    fm4 = {name: recording.indicators["fm4"] for name, recording in recordings.items() if "fm4" in recording.indicators}
    if "recording" in fm4:
        healthy_value = f" ({fm4['healthy']:.3g} in the healthy recording)" if "healthy" in fm4 else ""
        yield Note(
            code="fm4",
            text=f"FM4 is {fm4['recording']:.3g}{healthy_value}; one damaged tooth that stands out raises it well "
            "above 3.",
            values=fm4,
        )
