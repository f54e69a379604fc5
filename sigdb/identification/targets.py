"""Stated targets of an identification, as a TOML file has them: what is known of a rig from measurements."""

from collections.abc import Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, Strict, model_validator
from scipy.optimize import linear_sum_assignment

from sigdb.core import FloatArray, InputError, Section, quantity, read_toml, suggestion, validated
from sigdb.identification.level_targets import HarmonicTarget, RunUpTarget, with_paths
from sigdb.identification.measured_target import MeasuredTarget, Quantity, check_one_error, error_of
from sigdb.identification.observation import Observation
from sigdb.identification.rig_response import RigResponse
from sigdb.transmission import CoupledModes, Transmission

_LEAST_SHARE = 0.2
"""Least share of a mode's energy in a motion, for the mode to be one in which that body moves."""
_WRONG_MOTION = 100.0
"""Cost of a mode in which another body moves, far above that of any frequency."""


class ModeTarget(MeasuredTarget):
    """A measured natural frequency, its damping ratio, or both."""

    moves: str | None = Field(
        default=None, description="Motion with the mode, such as 'pinion-shaft bending', as `sigdb modes` names it."
    )
    frequency_hz: float = quantity("Hz", "Damped natural frequency.", gt=0)
    error_hz: float | None = quantity("Hz", "Standard deviation of the frequency.", gt=0, default=None)
    relative_error: float | None = quantity("-", "Standard deviation over the frequency.", gt=0, default=None)
    damping_ratio: float | None = quantity("-", "Fraction of critical damping.", gt=0, lt=1, default=None)
    damping_error: float | None = quantity("-", "Standard deviation of the damping ratio.", gt=0, default=None)
    speed_rpm: float | None = quantity(
        "rpm", "Speed of the rig; as the rig file has it if left out.", ge=0, default=None
    )

    @model_validator(mode="after")
    def _has_errors(self) -> Self:
        check_one_error(self, f"frequency_hz = {self.frequency_hz:g}", "error_hz")
        if (self.damping_ratio is None) != (self.damping_error is None):
            raise ValueError("damping_ratio and damping_error go together; give both, or none")
        return self

    @property
    def quantities(self) -> list[Quantity]:
        """The frequency, and the damping ratio where it is stated."""
        of = f"mode at {self.frequency_hz:g} Hz" + (f" ({self.moves})" if self.moves else "")
        error = error_of(self.frequency_hz, self.error_hz, self.relative_error)
        numbers = [Quantity(label=of, unit="Hz", value=self.frequency_hz, error=error, held_out=self.held_out)]
        if self.damping_ratio is not None and self.damping_error is not None:
            label = f"damping of the {of}"
            ratio, error = self.damping_ratio, self.damping_error
            numbers.append(Quantity(label=label, unit="-", value=ratio, error=error, held_out=self.held_out))
        return numbers

    def check(self, rig: Transmission) -> Iterator[str]:
        """Yield what does not fit a rig."""
        if self.moves is not None:
            motions = RigResponse(rig).motions
            if self.moves not in motions:
                yield f"moves = {self.moves!r} is no motion of rig {rig.name!r}{suggestion(self.moves, motions)}"


class DeflectionTarget(MeasuredTarget):
    """A measured static deflection that a sensor of the rig sees, under a force along a sensor or under the torque."""

    sensor: str = Field(description="Sensor of the rig, by its place and direction.")
    force_at: str | None = Field(
        default=None, description="Sensor along whose direction the force acts; the rig's torque acts if left out."
    )
    force: float | None = quantity("N", "Force along that direction.", default=None)
    deflection: float = quantity("m", "Static displacement along the sensor's direction.")
    error: float | None = quantity("m", "Standard deviation of the deflection.", gt=0, default=None)
    relative_error: float | None = quantity("-", "Standard deviation over the deflection.", gt=0, default=None)

    @model_validator(mode="after")
    def _has_error(self) -> Self:
        check_one_error(self, f"deflection = {self.deflection:g}", "error")
        if not self.deflection:
            raise ValueError("deflection = 0 says nothing of stiffness; state one that is not 0")
        if (self.force_at is None) != (self.force is None):
            raise ValueError("force and force_at go together; give both, or none for the torque of the rig")
        if self.force == 0:
            raise ValueError("force = 0 deflects nothing; state the force of the measurement")
        return self

    @property
    def quantities(self) -> list[Quantity]:
        """The deflection."""
        load = "the torque" if self.force is None else f"{self.force:g} N at {self.force_at}"
        error = error_of(self.deflection, self.error, self.relative_error)
        label = f"deflection of {self.sensor} under {load}"
        return [Quantity(label=label, unit="m", value=self.deflection, error=error, held_out=self.held_out)]

    def check(self, rig: Transmission) -> Iterator[str]:
        """Yield what does not fit a rig."""
        for field, name in (("sensor", self.sensor), ("force_at", self.force_at)):
            if name is not None and name not in rig.sensors:
                yield f"{field} = {name!r} is no sensor of rig {rig.name!r}{suggestion(name, rig.sensors)}"
        if self.force is None and not rig.operating.torque:
            yield f"force is missing, and rig {rig.name!r} has no torque; give force and force_at"

    def predicted(self, response: RigResponse) -> FloatArray:
        """Return the deflection (1,) of a rig."""
        return np.array([response.deflection(self.sensor, self.force_at, self.force)])


Several = Strict(False)


class Targets(Section):
    """Measurements of a rig, each with its error: the content of a targets file.

    Examples
    --------
    >>> targets = Targets(modes=[{"frequency_hz": 11.64, "relative_error": 0.01, "moves": "shaft bending"}])
    >>> targets.quantities[0].label
    'mode at 11.64 Hz (shaft bending)'
    """

    title: str = Field(default="", description="Description in a line.")
    modes: Annotated[tuple[ModeTarget, ...], Several] = Field(
        default=(), description="Natural frequencies and damping ratios."
    )
    deflections: Annotated[tuple[DeflectionTarget, ...], Several] = Field(default=(), description="Static deflections.")
    harmonics: Annotated[tuple[HarmonicTarget, ...], Several] = Field(
        default=(), description="Amplitudes of mesh harmonics of healthy averages, behind an unknown smooth path."
    )
    run_ups: Annotated[tuple[RunUpTarget, ...], Several] = Field(
        default=(), description="Levels against speed, behind an unknown gain."
    )
    path_degree: int = quantity(
        "-", "Degree of the path in dB, a polynomial in the logarithm of the frequency.", ge=0, le=6, default=2
    )
    observations: Annotated[tuple[Observation, ...], Several] = Field(
        default=(), description="Statements on averages of damaged gears, without errors."
    )

    @model_validator(mode="after")
    def _has_some(self) -> Self:
        held_out = [target.held_out for target in self.measured] + [seen.held_out for seen in self.observations]
        if not held_out:
            raise ValueError("no target; give tables such as [[modes]] or [[deflections]]")
        if all(held_out):
            raise ValueError("all targets are held out, so nothing is fitted; take held_out from some")
        return self

    @model_validator(mode="after")
    def _has_levels_beyond_the_paths(self) -> Self:
        for sensor in dict.fromkeys(target.sensor for target in self.harmonics):
            fitted = [target for target in self.harmonics if target.sensor == sensor and not target.held_out]
            count = sum(len(target.amplitudes) for target in fitted)
            if count < self.path_degree + 2:
                raise ValueError(
                    f"harmonics of {sensor}: {count} fitted amplitudes are all taken up by a path of degree "
                    f"{self.path_degree}; give {self.path_degree + 2} or more, or lower path_degree"
                )
        return self

    @property
    def measured(self) -> tuple[MeasuredTarget, ...]:
        """Targets with errors, in the order of :meth:`predicted`."""
        return (*self.modes, *self.deflections, *self.harmonics, *self.run_ups)

    @property
    def quantities(self) -> list[Quantity]:
        """All measured numbers, in the order of :meth:`predicted`."""
        return [number for target in self.measured for number in target.quantities]

    def check(self, rig: Transmission) -> None:
        """Refuse targets that do not fit a rig.

        Raises
        ------
        InputError
            Names each target, what is wrong with it, and what the rig has.
        """
        problems = [
            f"{kind}.{number}: {problem}"
            for kind in type(self).model_fields
            if kind not in ("title", "path_degree")
            for number, target in enumerate(getattr(self, kind), 1)
            for problem in target.check(rig)
        ]
        if problems:
            raise InputError("\n".join(problems))

    def predicted(self, response: RigResponse) -> FloatArray:
        """Return the numbers of a rig that were measured, in the order of :attr:`quantities`.

        Raises
        ------
        InputError
            If the rig has fewer modes than targets, or a force turns it freely.
        """
        deflections = [target.predicted(response) for target in self.deflections]
        run_ups = [target.predicted(response) for target in self.run_ups]
        harmonics = with_paths(self.harmonics, response, self.path_degree)
        return np.concatenate([self._modes(response), *deflections, *harmonics, *run_ups])

    def observed(self, response: RigResponse) -> FloatArray:
        """Return the observed numbers of a rig, in the order of :attr:`observations`; nan where there is none.

        Raises
        ------
        InputError
            If the rig has no steady state.
        """
        return np.array([observation.value(response) for observation in self.observations], float)

    def _modes(self, response: RigResponse) -> FloatArray:
        numbers: dict[int, list[float]] = {}
        for speed in dict.fromkeys(target.speed_rpm for target in self.modes):
            here = [i for i, target in enumerate(self.modes) if target.speed_rpm == speed]
            modes = response.at(speed_rpm=speed).modes
            for i, mode in zip(here, matched_modes(modes, [self.modes[i] for i in here]), strict=True):
                numbers[i] = [float(modes.frequency_hz[mode])]
                if self.modes[i].damping_ratio is not None:
                    numbers[i].append(float(modes.damping_ratio[mode]))
        return np.array([number for i in range(len(self.modes)) for number in numbers[i]])


def matched_modes(modes: CoupledModes, targets: Iterable[ModeTarget]) -> list[int]:
    """Return a mode for each target, no mode twice: the nearest frequencies where the right body moves.

    Raises
    ------
    InputError
        If there are fewer modes than targets.
    """
    targets = list(targets)
    turning = np.flatnonzero(modes.frequency_hz > 0)
    if len(turning) < len(targets):
        raise InputError(f"the rig has {len(turning)} modes that oscillate, fewer than the {len(targets)} targets")
    stated = np.array([target.frequency_hz for target in targets])
    cost = np.abs(np.log(modes.frequency_hz[turning] / stated[:, None]))
    for row, target in zip(cost, targets, strict=True):
        if target.moves is not None:
            shares = np.array([modes.moves[i].get(target.moves, 0.0) for i in turning])
            row[shares < _LEAST_SHARE] += _WRONG_MOTION
    return [int(turning[i]) for i in linear_sum_assignment(cost)[1]]


def load_targets(path: str | PathLike[str]) -> Targets:
    """Read the targets of an identification.

    Parameters
    ----------
    path : str or path
        A TOML file.

    Returns
    -------
    Targets

    Raises
    ------
    InputError
        If the file is missing or breaks a rule; the message names the key, the value and the remedy.
    """
    path = Path(path)
    return validated(Targets, read_toml(path), owner=str(path), first=1)
