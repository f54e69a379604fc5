"""Measured levels behind an unknown path: mesh harmonics of healthy averages, and levels in a run-up.

A sensor on a casing sees the rig through a path that nobody has measured. Levels in dB are compared but for a smooth
part: for harmonics a polynomial in the logarithm of the frequency, for a run-up a constant. It is fitted, anew for each
rig, to what is stated less what the rig predicts.
"""

from collections.abc import Iterator, Sequence
from typing import Annotated, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from sigdb.core import FloatArray, quantity, suggestion
from sigdb.identification.measured_target import MeasuredTarget, Quantity
from sigdb.identification.rig_response import RigResponse
from sigdb.signature import order_spectrum
from sigdb.transmission import Damage, Transmission

_DB = 20 / np.log(10)
"""Decibels for each unit of the natural logarithm."""
_LEAST = 1e-300
"""Amplitude that stands for none."""

Positive = Annotated[float, Field(gt=0)]
Several = Strict(False)


def decibels(amplitude: FloatArray) -> FloatArray:
    """Return amplitudes in dB."""
    return _DB * np.log(np.maximum(amplitude, _LEAST))


class LevelTarget(MeasuredTarget):
    """Levels that a sensor measures, in any unit: only their ratios count."""

    sensor: str = Field(description="Sensor of the rig.")
    gear: str | None = Field(default=None, description="Gear that is averaged; the first one of the rig if left out.")
    relative_error: float = quantity("-", "Standard deviation of each level over the level.", gt=0)

    def check(self, rig: Transmission) -> Iterator[str]:
        """Yield what does not fit a rig."""
        if self.sensor not in rig.sensors:
            yield f"sensor = {self.sensor!r} is no sensor of rig {rig.name!r}{suggestion(self.sensor, rig.sensors)}"
        if self.gear is not None and self.gear not in rig.gears:
            yield f"gear = {self.gear!r} is no gear of rig {rig.name!r}{suggestion(self.gear, rig.gears)}"
        if not rig.meshes or not rig.operating.torque:
            yield f"rig {rig.name!r} has no mesh under torque, so nothing is excited; remove the target"

    def _quantity(self, label: str, level: float, error: float = 0.0) -> Quantity:
        value, error = float(decibels(np.array(level))), _DB * float(np.hypot(self.relative_error, error / level))
        return Quantity(label=label, unit="dB", value=value, error=error, held_out=self.held_out)


class HarmonicTarget(LevelTarget):
    """Amplitudes of mesh harmonics of a healthy average at one speed and load."""

    amplitudes: Annotated[tuple[Positive, ...], Several] = Field(
        description="Amplitudes of the harmonics 1, 2, ... of the gear's mesh, in any unit, the same for all.",
        min_length=1,
    )
    error: float = quantity(
        "-",
        "Standard deviation of each amplitude by noise, in their unit; it adds to the relative error and counts most "
        "where a harmonic is weak.",
        ge=0,
        default=0.0,
    )
    speed_rpm: float | None = quantity("rpm", "Speed; that of the rig if left out.", gt=0, default=None)
    torque: float | None = quantity("N m", "Torque; that of the rig if left out.", gt=0, default=None)

    @property
    def quantities(self) -> list[Quantity]:
        """The levels of the harmonics."""
        at = " at " + ", ".join(
            f"{value:g} {unit}" for value, unit in ((self.speed_rpm, "rpm"), (self.torque, "N m")) if value is not None
        )
        return [
            self._quantity(f"mesh harmonic {h} of {self.sensor}{at if at != ' at ' else ''}", level, self.error)
            for h, level in enumerate(self.amplitudes, 1)
        ]

    def level_and_frequency(self, response: RigResponse) -> tuple[FloatArray, FloatArray]:
        """Return the levels of a rig without a path, dB, and their frequencies, Hz."""
        here = response.at(speed_rpm=self.speed_rpm, torque=self.torque)
        teeth, signal = here.average(self.sensor, Damage(gear=self.gear))
        h = np.arange(1, len(self.amplitudes) + 1)
        if signal is None or h[-1] * teeth >= len(signal) // 2:
            return np.full(len(h), np.nan), h.astype(float)
        gear = here.gear(self.gear)
        return decibels(np.abs(order_spectrum(signal)[1][h * teeth])), h * here.rig.mesh_frequency(
            here.rig.meshes_of(gear)[0]
        )


class RunUpTarget(LevelTarget):
    """The level of a healthy average at several speeds."""

    speeds_rpm: Annotated[tuple[Positive, ...], Several] = Field(description="Speeds of the rig, rpm.", min_length=2)
    levels: Annotated[tuple[Positive, ...], Several] = Field(
        description="Root mean squares at these speeds, in any unit.", min_length=2
    )

    @model_validator(mode="after")
    def _has_a_level_for_each_speed(self) -> Self:
        if len(self.speeds_rpm) != len(self.levels):
            raise ValueError(f"{len(self.levels)} levels for {len(self.speeds_rpm)} speeds_rpm; give one for each")
        return self

    @property
    def quantities(self) -> list[Quantity]:
        """The levels at the speeds."""
        pairs = zip(self.speeds_rpm, self.levels, strict=True)
        return [self._quantity(f"level of {self.sensor} at {speed:g} rpm", level) for speed, level in pairs]

    def predicted(self, response: RigResponse) -> FloatArray:
        """Return the levels of a rig, dB, with the gain that suits what is stated."""
        levels = []
        for speed in self.speeds_rpm:
            _, signal = response.at(speed_rpm=speed).average(self.sensor, Damage(gear=self.gear))
            levels.append(np.nan if signal is None else float(np.std(signal)))
        predicted = decibels(np.array(levels))
        return predicted + np.mean(decibels(np.array(self.levels)) - predicted)


def with_paths(targets: Sequence[HarmonicTarget], response: RigResponse, degree: int) -> list[FloatArray]:
    """Return the levels of a rig for each target, dB, with the path of each sensor that suits what is stated.

    Parameters
    ----------
    targets
        The targets; those that are held out take no part in the fit of a path.
    response
        The rig.
    degree
        Degree of the path.
    """
    levels: dict[int, FloatArray] = {}
    for sensor in dict.fromkeys(target.sensor for target in targets):
        here = [i for i, target in enumerate(targets) if target.sensor == sensor]
        parts = [targets[i].level_and_frequency(response) for i in here]
        counts = [len(level) for level, _ in parts]
        level, frequency = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        stated = np.concatenate([decibels(np.array(targets[i].amplitudes)) for i in here])
        errors = [number.error for i in here for number in targets[i].quantities]
        weight = np.repeat([not targets[i].held_out for i in here], counts) / np.array(errors)
        if np.isnan(level).any():
            moved = level
        else:
            basis = np.vander(np.log(frequency / frequency[0]), degree + 1)
            path = np.linalg.lstsq(weight[:, None] * basis, weight * (stated - level), rcond=None)[0]
            moved = level + basis @ path
        levels |= dict(zip(here, np.split(moved, np.cumsum(counts)[:-1]), strict=True))
    return [levels[i] for i in range(len(targets))]
