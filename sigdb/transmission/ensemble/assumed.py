"""Numbers of a rig with ranges, choices or ties: where they are, what they refer to, and their order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import TYPE_CHECKING

from pydantic import BaseModel, TypeAdapter, ValidationError

from sigdb.core import InputError
from sigdb.transmission.dotted_path import Path, full_path, value_at
from sigdb.transmission.ensemble.assumption import Assumption, Choice, Choices, Range, Tie
from sigdb.transmission.parts.described import NOTES, Described, is_ranged, item, shown
from sigdb.transmission.parts.gears import AnyProfile

if TYPE_CHECKING:
    from sigdb.transmission.rig import Transmission

_PROFILE: TypeAdapter[Described] = TypeAdapter(AnyProfile)


@dataclass(frozen=True, kw_only=True)
class Assumed:
    """A number of a rig and what is assumed of it.

    Attributes
    ----------
    path
        Full dotted path.
    assumption
        Its range, choices or tie.
    within
        Path and choice of the table that the number is in, where there are other choices; it exists with that choice.
    target
        Full dotted path of the other number that it refers to.
    """

    path: str
    assumption: Assumption
    within: tuple[str, Choice] | None = None
    target: str | None = None

    @property
    def is_free(self) -> bool:
        """Whether it has a value of its own: a tie, and choices that go with others, have none."""
        return isinstance(self.assumption, Range) or (isinstance(self.assumption, Choices) and self.target is None)

    @property
    def domain(self) -> Range | Choices:
        """The range or choices of a free number."""
        assert not isinstance(self.assumption, Tie), self.path
        return self.assumption

    def exists(self, chosen: Mapping[str, object]) -> bool:
        """Return whether the number exists, by the choices of tables."""
        return self.within is None or chosen[self.within[0]] == self.within[1]


def assumed_in(here: object, path: Path = (), within: tuple[str, Choice] | None = None) -> Iterator[Assumed]:
    """Yield what is assumed in a part of a rig, and in the parts of it."""
    choices: Mapping[str, Assumption] = {}
    if isinstance(here, Described):
        choices = here.assumed
        for key, assumption in here.assumed.items():
            yield Assumed(path=".".join((*path, key)), assumption=assumption, within=within)
    if isinstance(here, BaseModel):
        parts = [(name, getattr(here, name)) for name in type(here).model_fields if name not in NOTES]
    elif isinstance(here, dict):
        parts = list(here.items())
    else:
        parts = [(str(i), part) for i, part in enumerate(here)] if isinstance(here, tuple) else []
    for name, part in parts:
        of_part = choices.get(name)
        if isinstance(of_part, Choices) and isinstance(of_part.choices[0], dict):
            yield from _alternatives(part, of_part, (*path, name))
        elif not isinstance(of_part, Tie):
            yield from assumed_in(part, (*path, name), within)


def _alternatives(present: Described, choices: Choices, path: Path) -> Iterator[Assumed]:
    """Yield what is assumed within each table that may stand at a path; the present one is named by its kind alone."""
    dotted = ".".join(path)
    for choice, label in zip(choices.choices, choices.labels, strict=True):
        assert isinstance(choice, dict)
        if label == item(present, "kind"):
            if len(choice) > 1:
                raise InputError(f"assumed.{dotted}: kind = {label!r} stands in {dotted} itself; give here kind alone")
            yield from assumed_in(present, path, (dotted, label))
        else:
            try:
                other = _PROFILE.validate_python(choice)
            except ValidationError as error:
                where = ".".join(map(str, error.errors()[0]["loc"][1:]))
                raise InputError(
                    f"assumed.{dotted}: the choice of kind = {label!r}: {where} {error.errors()[0]['msg']}"
                ) from None
            yield from assumed_in(other, path, (dotted, label))


def with_target(rig: "Transmission", number: Assumed) -> Assumed:
    """Return an assumption with the full path of the number that it refers to, which must exist and fit."""
    assumption = number.assumption
    dotted = assumption.of if isinstance(assumption, Range) else assumption.target
    if dotted is None:
        return number
    target = full_path(rig, dotted)
    value = value_at(rig, target, dotted)
    if isinstance(assumption, Range) and not is_ranged(value):
        raise InputError(f"of = {dotted!r} is {shown(value)}, which has no multiple; name a number")
    if isinstance(assumption, Tie):
        now: object = rig
        for name in number.path.split("."):
            now = item(now, name)
        if now is not None and not _tie_fits(now, value, assumption.factor):
            raise InputError(f"as = {dotted!r} is {shown(value)}, and it is {shown(now)}: they do not go together")
    if isinstance(assumption, Choices):
        other = value_at(rig, target[:-1], dotted) if target[:-1] else rig
        theirs = other.assumed.get(target[-1]) if isinstance(other, Described) else None
        if not isinstance(theirs, Choices) or len(theirs.choices) != len(assumption.choices):
            raise InputError(
                f"as = {dotted!r} has no {len(assumption.choices)} choices; name a number with as many choices"
            )
    return Assumed(path=number.path, assumption=assumption, within=number.within, target=".".join(target))


def _tie_fits(now: object, other: object, factor: float) -> bool:
    if isinstance(now, tuple) or isinstance(other, tuple):
        return isinstance(now, tuple) and isinstance(other, tuple) and len(now) == len(other)
    if isinstance(now, float):
        return isinstance(other, int | float)
    if isinstance(now, BaseModel):
        return isinstance(other, BaseModel) and factor == 1
    return type(now) is type(other) and (factor == 1 or isinstance(now, int))


def in_order(numbers: Sequence[Assumed]) -> list[Assumed]:
    """Return numbers so that each comes after all that it depends on: what it refers to, and what it is a part of.

    Raises
    ------
    CycleError
        If they depend on each other in a circle.
    """
    paths = list(dict.fromkeys(number.path for number in numbers))
    refers: dict[str, list[str]] = {path: [] for path in paths}  # lists: the order must not depend on hashes
    for number in numbers:
        target = number.target
        refers[number.path] += [
            path for path in paths
            if (path != number.path and number.path.startswith(f"{path}."))
            or (target is not None and (f"{path}.".startswith(f"{target}.") or target.startswith(f"{path}.")))
        ]  # fmt: skip
    sorter = TopologicalSorter(refers)
    place = {path: i for i, path in enumerate(sorter.static_order())}
    return sorted(numbers, key=lambda number: place[number.path])
