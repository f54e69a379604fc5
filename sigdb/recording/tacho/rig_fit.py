"""Agreement of an angle with the rig and the signal: speed, ratio, and how finely the pulses fix the teeth."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.orders import AveragedGear
from sigdb.recording.shaft_angle import ShaftAngle
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

SPEED_UNLIKE_RIG = "speed-unlike-rig"
"""Code of the note that the tacho's speed is not near the rig's or the stated one."""

_UNLIKE = 0.2
"""Relative difference of two speeds from which on they do not agree."""
_FITS = 0.05
"""Relative difference up to which a number of pulses or a ratio explains a speed."""
_MOST_PULSES = 10_000
_NEAR_RATIO = 0.01
"""Relative difference from an exact ratio below which a ratio is that one, rounded."""
_SLIP = 0.1
"""Tooth passes by which a rounded ratio may slip over the record."""
_LARGEST_WHEEL = 150
"""Largest denominator of a decimal ratio that is not taken for a rounded one."""
_COARSE = 0.5
"""Error of the mesh phase from which on the pulses are too coarse for the teeth, rad."""
_LEAST_RATE = 100.0
"""Lowest sampling rate of a gear's vibration, Hz."""


def fit_to_rig(
    angle: ShaftAngle,
    recording: "Recording",
    gear: AveragedGear,
    *,
    rig: Transmission | None,
    stated_rpm: float | None = None,
) -> ShaftAngle:
    """Return the angle of a tacho with notes on what does not fit the rig or the stated speed.

    Parameters
    ----------
    angle
        The angle.
    recording
        Its recording.
    gear
        The averaged gear.
    rig
        The rig; its exact ratios are known.
    stated_rpm
        Speed of the averaged shaft from the settings; the recording's or the rig's if left out.

    Raises
    ------
    InputError
        If the ratio is a rounded one, so that the average slips.
    """
    track = angle.speed_track()["speed_rpm"]
    speed = float(track.median())
    ratios = {} if rig is None or gear.shaft is None else _ratios(rig, gear.shaft)
    _refuse_rounded(angle, recording, gear.teeth, ratios)
    expected = stated_rpm or recording.speed_rpm or gear.speed_rpm
    notes = [*_ratio_notes(angle, ratios), *_coarse_notes(angle, gear.teeth)]
    if expected is not None and abs(speed / expected - 1) > _UNLIKE:
        notes.append(_unlike(angle, speed, expected, ratios, rated=not (stated_rpm or recording.speed_rpm)))
    return replace(angle, notes=(*angle.notes, *notes))


def check_mesh_in_range(signal: "Channel", source: str, *, teeth: int, speed_rpm: float) -> None:
    """Refuse a signal that cannot hold the mesh.

    Raises
    ------
    InputError
        If its rate is below 100 Hz, or the mesh is not below half of it.
    """
    fs, mesh = signal.sampling_rate, teeth * speed_rpm / 60
    if fs < _LEAST_RATE:
        raise InputError(
            f"{source}: {signal.name} has a sampling rate of {fs:g} Hz (from {signal.rate_from}); a gear's vibration"
            f" has at least {_LEAST_RATE:g} Hz, check the rate"
        )
    if mesh >= fs / 2:
        raise InputError(
            f"{source}: the mesh of {teeth} teeth at {speed_rpm:.4g} rpm is at {mesh:.4g} Hz, not below half the"
            f" sampling rate of {signal.name}, {fs / 2:g} Hz; check teeth, pulses_per_rev, ratio and the rate"
        )


def _ratios(rig: Transmission, shaft: str) -> dict[str, Fraction]:
    """Return the revolutions of a shaft in one of each turning shaft."""
    turns = {name: abs(rig.ratio(name)) for name in rig.shafts if rig.ratio(name)}
    return {name: Fraction(turns[shaft] / other).limit_denominator(10**6) for name, other in turns.items()}


def _refuse_rounded(angle: ShaftAngle, recording: "Recording", teeth: int, ratios: dict[str, Fraction]) -> None:
    """Refuse a ratio that is near an exact one of the rig, and not near enough for the record's length."""
    for shaft, exact in ratios.items():
        off = abs(angle.ratio / float(exact) - 1)
        turns = (len(angle.pulses) - 1) / angle.pulses_per_rev * angle.ratio
        if off < _NEAR_RATIO and off * turns * teeth > _SLIP:
            raise InputError(
                f"{recording.source}: ratio = {angle.ratio:.8g} is near {exact} = {float(exact):.8g} of the rig's shaft"
                f" {shaft!r}, and not equal: the average slips by {off * turns * teeth:.2g} teeth over the record;"
                f" give ratio '{exact}'"
            )


def _ratio_notes(angle: ShaftAngle, ratios: dict[str, Fraction]) -> Iterator[Note]:
    if ratios:
        if not any(abs(angle.ratio / float(exact) - 1) < _NEAR_RATIO for exact in ratios.values()):
            listed = ", ".join(f"{exact} of {shaft}" for shaft, exact in ratios.items())
            text = f"the ratio {angle.ratio:.6g} is that of no shaft of the rig ({listed}); check where the tacho is"
            yield Note(code="ratio-unlike-rig", text=text, values={"ratio": angle.ratio})
        return
    decimal = Fraction(repr(angle.ratio)).limit_denominator(10**9)
    short = len(repr(angle.ratio).replace(".", "").strip("0")) <= 6
    if short and decimal.denominator > _LARGEST_WHEEL and decimal.numerator > 1:
        digits = len(repr(angle.ratio).partition(".")[2])
        turns = (len(angle.pulses) - 1) / angle.pulses_per_rev
        slip = turns * 0.5 * 10**-digits
        text = (
            f"the ratio {angle.ratio:g} looks rounded; then the average slips by up to {slip:.2g} revolutions over the"
            " record, so give it as a fraction of tooth counts such as 19/48"
        )
        yield Note(code="rounded-ratio", text=text, values={"ratio": angle.ratio, "slip_rev": slip})


def _coarse_notes(angle: ShaftAngle, teeth: int) -> Iterator[Note]:
    # A pulse lies about twice as far from the cubic through its neighbours as the spline through all is off.
    error = angle.misfit * angle.ratio * teeth / 2
    if 2 * np.pi * error > _COARSE:
        yield Note(
            code="tacho-coarse",
            text=f"the tacho is coarse for {teeth} teeth: between its pulses the angle is uncertain by about"
            f" {error:.2g} tooth passes, which smears the mesh harmonics; take more pulses a revolution, a higher rate"
            " of the tacho, or the phase of the mesh",
            values={"tooth_passes": error, "teeth": teeth},
        )


def _unlike(angle: ShaftAngle, speed: float, expected: float, ratios: dict[str, Fraction], *, rated: bool) -> Note:
    fits = []
    pulses = angle.pulses_per_rev * speed / expected
    whole = round(pulses)
    if 1 <= whole <= _MOST_PULSES and abs(pulses / whole - 1) < _FITS and whole != angle.pulses_per_rev:
        fits.append(f"pulses_per_rev = {whole}")
    values: dict[str, str | int | float] = {"speed_rpm": speed, "expected_rpm": expected}
    for shaft, exact in ratios.items():
        off = abs(speed * float(exact) / angle.ratio / expected - 1)
        if off < _FITS and abs(angle.ratio / float(exact) - 1) > _NEAR_RATIO:
            fits.append(f"ratio = {exact}, the tacho on {shaft}")
    values["fits"] = "; ".join(fits)
    hint = (
        f"{' or '.join(fits)} would fit, or the sampling rate is wrong"
        if fits
        else "check the sampling rate, pulses_per_rev, ratio and the tacho"
    )
    whose = "the rig's operating point" if rated else "the stated speed"
    return Note(
        code=SPEED_UNLIKE_RIG,
        text=f"the tacho gives {speed:.1f} rpm, {whose} is {expected:.1f} rpm: {hint}",
        values=values,
    )
