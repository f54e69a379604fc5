"""Kinds of damage as columns: a hundred thousand of them are a few arrays, and an object only when one is asked for."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.transmission import FLAW_FIELDS, FLAWS, Damage, ToothDamage

WHOLE = ("damaged_teeth", "pits")
"""Axes of damage that are counts."""
SIZES = {"stiffness_loss": ("loss_extent",), **FLAWS}
"""Sizes of damage, each with the axes that mean nothing where it is zero."""

Pattern = tuple[str, tuple[ToothDamage, ...]]
"""Name of a pattern, and the damage of each of its teeth."""


def default_of(axis: str) -> float:
    """Value of an axis of damage that no grid names."""
    return float((Damage if axis == "damaged_teeth" else ToothDamage).model_fields[axis].default)


def meaningful(columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Columns of damage with the defaults in place of values that mean nothing beside a size of zero."""
    kept: dict[str, FloatArray] = {axis: np.asarray(column, float) + 0.0 for axis, column in columns.items()}
    for size, beside in SIZES.items():
        for axis in beside:
            if axis in kept:
                there = kept[size] != 0 if size in kept else False
                kept[axis] = np.where(there, kept[axis], default_of(axis))
    return kept


@dataclass(frozen=True, kw_only=True)
class Damages:
    """Kinds of damage by number.

    Attributes
    ----------
    columns
        (n,) values of each axis that some grid names; all others have their default.
    pattern
        (n,) number of the pattern, from 1; 0 where all damaged teeth are alike.
    patterns
        The patterns: number 1 is the first.
    """

    columns: dict[str, FloatArray]
    pattern: IntArray
    patterns: tuple[Pattern, ...]

    def __len__(self) -> int:
        return len(self.pattern)

    def column(self, axis: str) -> FloatArray:
        """(n,) values of an axis; those of a pattern mean nothing."""
        return self.columns[axis] if axis in self.columns else np.full(len(self), default_of(axis))

    @property
    def damaged_teeth(self) -> IntArray:
        """(n,) number of damaged teeth."""
        counts = np.array([0, *(len(each) for _, each in self.patterns)])
        return np.where(self.pattern > 0, counts[self.pattern], self.column("damaged_teeth").astype(np.int64))

    @property
    def is_damage(self) -> BoolArray:
        """(n,) whether it changes anything."""
        stiffness = (self.column("phase_shift_deg") != 0) | (
            (self.column("stiffness_loss") > 0) & (self.column("loss_extent") > 0)
        )
        alike = stiffness | (self.column("friction") > 0)
        for size in FLAWS:
            alike |= self._flaw(size)
        return (self.pattern > 0) | alike

    def _flaw(self, size: str) -> BoolArray:
        """(n,) whether teeth have that geometric damage, all alike."""
        if size not in self.columns:
            return np.zeros(len(self), bool)
        found = (self.columns[size] != 0) & (self.pattern == 0)
        return found & (self.column("chip_extent") != 0) if size == "chip_height" else found

    @property
    def flaws(self) -> tuple[str, ...]:
        """Fields of geometric damage that some damage has."""
        return tuple(name for size, beside in FLAWS.items() if self._flaw(size).any() for name in (size, *beside))

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields of a tooth's damage that have a column: those of its geometry only where it is damaged."""
        return (*(name for name in ToothDamage.model_fields if name not in FLAW_FIELDS), *self.flaws)

    @cached_property
    def has_geometry(self) -> BoolArray:
        """(n,) whether the geometry of a tooth is damaged."""
        of_pattern = np.array([False, *(any(one.flaws for one in each) for _, each in self.patterns)])
        found = of_pattern[self.pattern]
        for size in FLAWS:
            found |= self._flaw(size)
        return found

    def damage(self, number: int, gear: str, tooth: int) -> Damage:
        """One of them on a gear, from a tooth on."""
        if self.pattern[number]:
            name, each = self.patterns[self.pattern[number] - 1]
            return Damage(gear=gear, tooth=tooth, pattern=name, each=each)
        return Damage(gear=gear, tooth=tooth, **self._values(number))

    def teeth(self, number: int) -> tuple[ToothDamage, ...]:
        """The different damages of teeth in one of them."""
        if self.pattern[number]:
            return tuple(dict.fromkeys(self.patterns[self.pattern[number] - 1][1]))
        values = self._values(number)
        values.pop("damaged_teeth", None)
        return (ToothDamage(**values),)

    def _values(self, number: int) -> dict[str, Any]:
        return {
            axis: int(column[number]) if axis in WHOLE else float(column[number])
            for axis, column in self.columns.items()
        }
