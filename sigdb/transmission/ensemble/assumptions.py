"""All that is assumed of a rig's numbers, by dotted path, and the unit cube of what is free in it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from graphlib import CycleError
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, suggestion
from sigdb.transmission.dotted_path import check_teeth_free, full_path, value_at
from sigdb.transmission.ensemble.assumed import Assumed, assumed_in, in_order, with_target
from sigdb.transmission.ensemble.assumed_values import agree, following, value_in, value_of, with_number
from sigdb.transmission.ensemble.assumption import Assumption, Choice, Choices, Range
from sigdb.transmission.parts.described import item, shown

if TYPE_CHECKING:
    from sigdb.transmission.rig import Transmission


@dataclass(frozen=True, kw_only=True)
class Assumptions(Mapping[str, Assumption]):
    """Ranges, choices and ties of the numbers that a rig has, by full dotted path, in order of dependence.

    Attributes
    ----------
    everything
        Numbers in order, those of tables that can be chosen too.
    chosen
        The present choice of each table that has some.
    """

    everything: tuple[Assumed, ...]
    chosen: Mapping[str, Choice]

    @classmethod
    def of(cls, rig: "Transmission") -> "Assumptions":
        """Return what is assumed of a rig's numbers.

        Raises
        ------
        InputError
            If a tie leads to nothing or in a circle, or a number is assumed twice.
        """
        problems = list(assumption_problems(rig))
        if problems:
            raise InputError("\n".join(f"rig {rig.name!r}: {problem}" for problem in problems))
        numbers = [with_target(rig, number) for number in assumed_in(rig)]
        chosen = {
            number.path: item(value_at(rig, tuple(number.path.split(".")), number.path), "kind")
            for number in numbers
            if isinstance(number.assumption, Choices) and isinstance(number.assumption.choices[0], dict)
        }
        return cls(everything=tuple(in_order(numbers)), chosen=chosen)

    def __getitem__(self, path: str) -> Assumption:
        return self._present[path].assumption

    def __iter__(self) -> Iterator[str]:
        return iter(self._present)

    def __len__(self) -> int:
        return len(self._present)

    @cached_property
    def _present(self) -> dict[str, Assumed]:
        return {number.path: number for number in self.everything if number.exists(self.chosen)}

    @cached_property
    def free(self) -> tuple[Assumed, ...]:
        """Numbers that have values of their own: the coordinates of the unit cube, in order."""
        return tuple(number for number in self.everything if number.is_free)

    def from_unit(self, u: ArrayLike) -> dict[str, Choice]:
        """Return values by full dotted path, for :meth:`Transmission.with_assumed`, at a point of the unit cube.

        Parameters
        ----------
        u : array_like, (free,)
            Coordinates from 0 to 1. Those of numbers that a choice leaves out have no effect.

        Raises
        ------
        InputError
            If it is of another length, or a coordinate is outside 0 to 1.
        """
        point = np.asarray(u, float)
        if point.shape != (len(self.free),):
            raise InputError(
                f"u has the shape {point.shape}; the rig has {len(self.free)} free numbers, give a coordinate of each"
            )
        if not ((point >= 0) & (point <= 1)).all():
            raise InputError(f"u = {point.tolist()} must be from 0 to 1")
        values: dict[str, Choice] = {}
        chosen = dict(self.chosen)
        for number, x in zip(self.free, point.tolist(), strict=True):
            if number.exists(chosen):
                values[number.path] = number.domain.at(x)
                if number.path in chosen:
                    chosen[number.path] = values[number.path]
        return values

    def to_unit(self, rig: "Transmission") -> FloatArray:
        """Return the point of the unit cube (free,) of a rig of these assumptions; 0.5 where it has no such number.

        Raises
        ------
        InputError
            If a number of the rig is outside its range or not one of the choices.
        """
        values, chosen = self.values_of(rig), rig.assumptions.chosen
        point = np.full(len(self.free), 0.5)
        for i, number in enumerate(self.free):
            if number.path in values and number.exists(chosen):
                _check(rig, number, values[number.path])
                point[i] = number.domain.unit(values[number.path])
        return point

    def values_of(self, rig: "Transmission") -> dict[str, Choice]:
        """Return the present values of the free numbers that a rig has, by full dotted path."""
        data, theirs = rig.model_dump(), rig.assumptions
        return {number.path: value_of(data, number) for number in theirs.free if number.exists(theirs.chosen)}

    def applied(self, rig: "Transmission", values: Mapping[str, Choice]) -> dict[str, Any]:
        """Return the fields of the rig with other values; see :meth:`Transmission.with_assumed`.

        Raises
        ------
        InputError
            If a value has no place.
        """
        data = rig.model_dump()
        left = {".".join(full_path(rig, dotted)): value for dotted, value in values.items()}
        chosen = dict(self.chosen)
        multiples = {
            number.path: value_of(data, number)
            for number in self.free
            if isinstance(number.assumption, Range) and number.target and number.exists(chosen)
        }
        for number in self.everything:
            if not number.exists(chosen):
                continue
            if number.is_free and number.path in left:
                value = left.pop(number.path)
                _check(rig, number, value)
                check_teeth_free(rig, tuple(number.path.split(".")), number.path)
            elif number.path in multiples:
                value = multiples[number.path]
            elif number.is_free:
                continue
            else:
                value = 0
            data = with_number(data, number, value)
            if number.path in chosen:
                chosen[number.path] = value
        for path in left:
            names = [number.path for number in self.everything if number.is_free and number.exists(chosen)]
            if path in self._present:
                raise InputError(f"rig {rig.name!r}: {path} follows {self._present[path].target}; set that")
            raise InputError(f"rig {rig.name!r}: nothing is assumed of {path}{suggestion(path, names)}")
        return data


def assumption_problems(rig: "Transmission") -> Iterator[str]:
    """Yield sentences on assumptions that contradict each other, or refer to nothing."""
    try:
        numbers = list(assumed_in(rig))
    except InputError as error:
        yield str(error)
        return
    seen: set[object] = set()
    sound = []
    for number in numbers:
        if (number.path, number.within) in seen:
            yield f"{number.path} is assumed twice; say once what is assumed of it"
        seen.add((number.path, number.within))
        try:
            sound.append(with_target(rig, number))
        except InputError as error:
            yield f"assumed.{number.path}: {error}"
    try:
        in_order(sound)
    except CycleError as circle:
        yield f"assumed: {' follows '.join(reversed(circle.args[1]))}: a circle; tie one of these to nothing"


def value_problems(rig: "Transmission") -> Iterator[str]:
    """Yield sentences on numbers of a rig that are not as is assumed of them."""
    data = rig.model_dump()
    for path, number in rig.assumptions._present.items():
        if number.is_free:
            try:
                _check(rig, number, value_of(data, number))
            except InputError as error:
                yield str(error).removeprefix(f"rig {rig.name!r}: ")
            continue
        assert number.target is not None
        now, expected = value_in(data, path), following(data, number)
        if not agree(now, expected):
            yield (
                f"{path} = {shown(now)} is assumed {number.assumption}, so it must be {shown(expected)}; "
                "correct it, or the assumption"
            )


def _check(rig: "Transmission", number: Assumed, value: object) -> None:
    """Refuse a value that is outside what is assumed.

    Raises
    ------
    InputError
        If it is.
    """
    if not number.domain.holds(value):
        text = f"{value:g}" if isinstance(value, float) else repr(value)
        what = f"{number.path} = {text}" + (f" times {number.target}" if number.target else "")
        raise InputError(
            f"rig {rig.name!r}: {what} is outside what is assumed of it, {number.assumption}; "
            "change the value, or the range or choices"
        )
