"""The problem of an identification: from a point of what is assumed of a rig to the numbers that were measured."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri

from sigdb.core import FloatArray, InputError
from sigdb.dynamics import possible_rig
from sigdb.identification.rig_response import RigResponse
from sigdb.identification.targets import Targets
from sigdb.transmission import Choice, Choices, Transmission

_STEP = 1e-4
"""Step of finite differences, in standard deviations of the prior."""
_IMPOSSIBLE = 1e3
"""Residual of each number of a rig that cannot be, in standard deviations."""
_FARTHEST = 6.0
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
        return self.rig.assumptions.from_unit(ndtr(np.clip(z, -_FARTHEST, _FARTHEST)))

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

    def predicted(self, z: FloatArray) -> FloatArray | None:
        """Return what would be measured (m,) of the rig at a point (d,); None for a rig that cannot be."""
        try:
            return self.targets.predicted(RigResponse(self.rig_at(z)))
        except InputError:
            return None

    def misses(self, z: FloatArray, value: FloatArray) -> FloatArray:
        """Return by how many standard deviations the rig at a point (d,) misses values (m,); 0 for what is held out."""
        predicted = self.predicted(z)
        return self.is_fitted * (_IMPOSSIBLE if predicted is None else (predicted - value) / self.error)

    def slopes(self, z: FloatArray, at_z: FloatArray, value: FloatArray) -> FloatArray:
        """Return the derivatives (m, d) of :meth:`misses`, which are ``at_z`` (m,) at the point itself."""
        steps = np.where(z > 0, -_STEP, _STEP)  # towards the middle
        columns = [self.misses(z + step * unit, value) for step, unit in zip(steps, np.eye(len(z)), strict=True)]
        return np.column_stack([(moved - at_z) / step for moved, step in zip(columns, steps, strict=True)])


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
    choices = [number.path for number in rig.assumptions.free if isinstance(number.assumption, Choices)]
    if choices:
        raise InputError(
            f"rig {rig.name!r}: {choices[0]} is assumed as one of several choices, and the search is by least "
            "squares, which needs ranges; decide on one of them in a copy of the rig, and identify each copy"
        )
