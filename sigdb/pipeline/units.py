"""Units that recordings are written in."""

from dataclasses import replace

from sigdb.core.errors import InputError
from sigdb.pipeline.recorded_result import RecordedSignature

_KNOWN = {
    "m/s^2": ("m/s^2", 1.0),
    "m/s2": ("m/s^2", 1.0),
    "m/s²": ("m/s^2", 1.0),
    "g": ("m/s^2", 9.80665),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "in/s": ("m/s", 0.0254),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
}
"""SI unit and factor of units; standard gravity and inch as defined."""


def in_unit(signature: RecordedSignature, wanted: str) -> RecordedSignature:
    """The signature in the unit of a simulated sensor; a note where the recording's is not stated.

    Raises
    ------
    InputError
        If it is another quantity or not a known unit.
    """
    if not signature.unit:
        note = f"The unit of {signature.channel} is not stated; it was taken to be {wanted}."
        return replace(signature, unit=wanted, notes=(*signature.notes, note))
    unit, factor = _KNOWN.get(signature.unit, ("", 0.0))
    if unit != wanted:
        raise InputError(
            f"{signature.source}: {signature.channel} is in {signature.unit!r}, the simulated sensor in {wanted!r}; "
            "give a healthy recording, which tells the path, or a sensor of that quantity, or the right unit"
        )
    return replace(
        signature,
        unit=wanted,
        tsa=signature.tsa * factor,
        scatter=signature.scatter * factor,
        noise=signature.noise * factor,
    )
