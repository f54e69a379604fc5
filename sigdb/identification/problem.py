"""The problem of an identification: from a point of what is assumed of a rig to the numbers that were measured."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri

from sigdb.core import BoolArray, FloatArray, InputError
from sigdb.dynamics import possible_rig
from sigdb.identification.rig_response import RigResponse
from sigdb.identification.targets import Targets
from sigdb.transmission import Choice, Choices, Transmission

_STEP = 1e-4
"""Step of finite differences, in standard deviations of the prior."""
_IMPOSSIBLE = 1e3
"""Residual of each number of a rig that cannot be, in standard deviations."""
FARTHEST = 6.0
"""Greatest coordinate, in standard deviations of the prior: the ends of a range, to a part in 10^9."""


@dataclass(frozen=True)
class Problem:
    """A rig with ranges, and what is known of it.

    Coordinates z are those of the unit cube through the normal distribution, so that the prior, equally likely over
    each range, is a standard normal one without ends.

    Attributes
    ----------
    rig
        The rig.
    targets
        Targets that fit it.
    """

    rig: Transmission
    targets: Targets
    _last: dict[bytes, RigResponse] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Full dotted paths of the free numbers, in the order of the coordinates."""
        return tuple(number.path for number in self.rig.assumptions.free)

    @cached_property
    def value(self) -> FloatArray:
        """(m,) stated values."""
        return np.array([number.value for number in self.targets.quantities])

    @cached_property
    def error(self) -> FloatArray:
        """(m,) their standard deviations."""
        return np.array([number.error for number in self.targets.quantities])

    @cached_property
    def is_fitted(self) -> FloatArray:
        """(m,) 1 for a number that is fitted, 0 for one that is held out."""
        return np.array([0.0 if number.held_out else 1.0 for number in self.targets.quantities])

    @property
    def start(self) -> FloatArray:
        """The coordinates (d,) of the rig as it is."""
        return np.clip(ndtri(self.rig.assumptions.to_unit(self.rig)), -2.0, 2.0)

    def values_at(self, z: FloatArray) -> dict[str, Choice]:
        """Return the values of the free numbers at a point (d,)."""
        return self.rig.assumptions.from_unit(ndtr(np.clip(z, -FARTHEST, FARTHEST)))

    def rig_at(self, z: FloatArray) -> Transmission:
        """Return the rig at a point (d,).

        Raises
        ------
        InputError
            If the numbers do not go together.
        """
        return self.rig.with_assumed(self.values_at(z))

    def why_impossible(self, z: FloatArray) -> str | None:
        """Return why there cannot be a rig at a point (d,); None for one that can be."""
        member = possible_rig(self.rig, self.values_at(z))
        return member if isinstance(member, str) else None

    def response(self, z: FloatArray) -> RigResponse:
        """Return the response of the rig at a point (d,); that of the point before is kept.

        Raises
        ------
        InputError
            If the numbers do not go together.
        """
        key = z.tobytes()
        if key not in self._last:
            response = RigResponse(self.rig_at(z))
            self._last.clear()
            self._last[key] = response
        return self._last[key]

    def predicted(self, z: FloatArray) -> FloatArray | None:
        """Return what would be measured (m,) of the rig at a point (d,); None for a rig that cannot be."""
        try:
            predicted = self.targets.predicted(self.response(z))
        except InputError:
            return None
        return predicted if np.isfinite(predicted).all() else None

    def _searched(self, z: FloatArray, rig: Transmission | None = None) -> FloatArray | None:
        """Return what a search compares (m,) of the rig at a point (d,), or of one nearby; None if it cannot be."""
        targets, compared = self._targets_searched
        predicted = self.value.copy()
        try:
            here = self.response(z)
            predicted[compared] = targets.predicted(here if rig is None else here.nearby(rig))
        except InputError:
            return None
        return predicted if np.isfinite(predicted).all() else None

    @cached_property
    def _targets_searched(self) -> tuple[Targets, BoolArray]:
        """The targets without those held out, and their numbers (m,); all modes, which are matched together."""
        fitted = {
            kind: tuple(target for target in getattr(self.targets, kind) if not target.held_out)
            for kind in ("deflections", "harmonics", "run_ups")
        }
        compared = self.is_fitted > 0
        compared[: sum(len(target.quantities) for target in self.targets.modes)] = True
        return self.targets.model_copy(update=fitted), compared

    def observed(self, z: FloatArray) -> FloatArray:
        """Return the observed numbers (k,) of the rig at a point (d,); nan where there is none."""
        try:
            return self.targets.observed(self.response(z))
        except InputError:
            return np.full(len(self.targets.observations), np.nan)

    def misfit(self, z: FloatArray, value: FloatArray, prior: FloatArray) -> float:
        """Return the sum of squares that a search without derivatives makes small at a point (d,).

        It is that of the misses of values (m,), of the distance from a point of the prior, where values are measured,
        and of the misses of observations.
        """
        observations = self.targets.observations
        missed = sum(
            observation.miss(number) ** 2
            for observation, number in zip(observations, self.observed(z) if observations else (), strict=True)
            if not observation.held_out
        )
        if self.is_fitted.any() and np.isfinite(missed):
            missed += float((self.misses(z, value) ** 2).sum() + ((z - prior) ** 2).sum())
        return float(missed)

    @property
    def is_smooth(self) -> bool:
        """Whether least squares apply: no observation is searched for, and no choice is free."""
        searched = [observation for observation in self.targets.observations if not observation.held_out]
        return not searched and not any(isinstance(free.assumption, Choices) for free in self.rig.assumptions.free)

    def misses(self, z: FloatArray, value: FloatArray) -> FloatArray:
        """Return by how many standard deviations the rig at a point (d,) misses values (m,); 0 for what is held out."""
        predicted = self._searched(z)
        return self.is_fitted * (_IMPOSSIBLE if predicted is None else (predicted - value) / self.error)

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives (m, d) of :meth:`misses` at a point (d,); 0 where no rig can be."""
        return np.column_stack([self.slope(z, number) for number in range(len(z))])

    def slope(self, z: FloatArray, number: int) -> FloatArray:
        """Return the derivative (m,) of :meth:`misses` by a coordinate; 0 where no rig can be.

        The rig's matrices and mesh stiffness are differenced; modes and averages follow them in closed form.
        """
        moved, step = z.copy(), -_STEP if z[number] > 0 else _STEP  # towards the middle
        moved[number] += step
        before = self._searched(z)
        try:
            after = None if before is None else self._searched(z, self.rig_at(moved))
        except InputError:
            after = None
        if before is None or after is None:
            return np.zeros(len(self.value))
        return self.is_fitted * (after - before) / (step * self.error)


def check_free(rig: Transmission) -> None:
    """Refuse a rig that has nothing to search for.

    Raises
    ------
    InputError
        If no number of the rig is free.
    """
    if not rig.assumptions.free:
        raise InputError(
            f"rig {rig.name!r} has no assumed number with a range to search in; give it some, for example "
            "assumed.damping_ratio = { low = 0.02, high = 0.05 }"
        )
