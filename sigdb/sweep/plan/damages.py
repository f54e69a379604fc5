"""Kinds of damage as columns: a few arrays hold many thousands, and single objects are made on request."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.sweep.design.axes import AXES, DAMAGE_AXES
from sigdb.transmission import ACTING, FLAWS, OPTIONAL_FIELDS, OPTIONAL_SIZES, SIZES, Damage, ToothDamage

WHOLE_DAMAGE_AXES = tuple(name for name in DAMAGE_AXES if AXES[name].is_whole)
"""Axes of damage that are whole numbers."""

Pattern = tuple[str, tuple[ToothDamage, ...]]
"""Name of a pattern, and the damage of each of its teeth."""


def default_of(axis: str) -> float:
    """Return the value of an axis of damage that no grid names."""
    return float(AXES[axis].field.default)


def reset_unused_details(columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return columns of damage, with the default of each detail where its size is 0."""
    kept: dict[str, FloatArray] = {axis: np.asarray(column, float) + 0.0 for axis, column in columns.items()}
    for size, details in SIZES.items():
        for axis in details:
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
        (n,) values of each axis that a grid names; all others have their default.
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
        """Return the (n,) values of an axis; those of a pattern have no meaning."""
        return self.columns[axis] if axis in self.columns else np.full(len(self), default_of(axis))

    @property
    def damaged_teeth(self) -> IntArray:
        """(n,) number of damaged teeth."""
        counts = np.array([0, *(len(each) for _, each in self.patterns)])
        return np.where(self.pattern > 0, counts[self.pattern], self.column("damaged_teeth").astype(np.int64))

    @property
    def is_damage(self) -> BoolArray:
        """(n,) whether it changes anything."""
        changes = self.pattern > 0
        for size in SIZES:
            changes = changes | self._acts(size)
        return changes

    def _acts(self, size: str) -> BoolArray:
        """Return (n,) whether teeth have damage of that size, all alike."""
        acts: BoolArray = self.pattern == 0
        if size not in self.columns:
            return np.zeros_like(acts)
        for name in ACTING[size]:
            acts = acts & (self.column(name) != 0)
        return acts

    @property
    def optional_fields(self) -> tuple[str, ...]:
        """Fields of a tooth's damage that are stored only where they are used, and that some damage uses."""
        used = {size: details for size, details in OPTIONAL_SIZES.items() if self._acts(size).any()}
        return tuple(name for size, details in used.items() for name in (size, *details))

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields of a tooth's damage that have a column."""
        always = (name for name in ToothDamage.model_fields if name not in OPTIONAL_FIELDS)
        return (*always, *self.optional_fields)

    @cached_property
    def has_geometry(self) -> BoolArray:
        """(n,) whether the geometry of a tooth is damaged."""
        of_pattern = np.array([False, *(any(tooth.flaws for tooth in teeth) for _, teeth in self.patterns)])
        has = of_pattern[self.pattern]
        for size in FLAWS:
            has |= self._acts(size)
        return has

    def damage(self, number: int, gear: str, tooth: int) -> Damage:
        """Return the damage of a number on a gear, from a tooth on."""
        if self.pattern[number]:
            name, each = self.patterns[self.pattern[number] - 1]
            return Damage(gear=gear, tooth=tooth, pattern=name, each=each)
        return Damage(gear=gear, tooth=tooth, **self._values(number))

    def teeth(self, number: int) -> tuple[ToothDamage, ...]:
        """Return the distinct damages of teeth in the damage of a number."""
        if self.pattern[number]:
            return tuple(dict.fromkeys(self.patterns[self.pattern[number] - 1][1]))
        values = self._values(number)
        values.pop("damaged_teeth", None)
        return (ToothDamage(**values),)

    def _values(self, number: int) -> dict[str, Any]:
        return {
            axis: int(column[number]) if axis in WHOLE_DAMAGE_AXES else float(column[number])
            for axis, column in self.columns.items()
        }
