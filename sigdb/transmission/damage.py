"""Tooth damage: what it does to the stiffness and to the flank of the tooth pair, for one tooth and for several."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, Strict, model_serializer, model_validator

from sigdb.core import InputError, Section, quantity, suggestion, validated, without_defaults

MOST_DEVIATION = 0.01
"""Greatest deviation of a flank, m: more than any tooth of the rigs in use has to lose."""


@dataclass(frozen=True, kw_only=True)
class Size:
    """Mark of a field of :class:`ToothDamage` that is the size of a kind of damage: the tooth has none where it is 0.

    Attributes
    ----------
    kind
        Name of the kind; that of the field if left out.
    geometric
        Whether the damage changes the tooth's geometry.
    always_stored
        Whether every stored case has the size and its details. Other sizes are stored only where they are used, so that
        a field can be added without a change to older recipes, databases and hashes.
    """

    kind: str = ""
    geometric: bool = False
    always_stored: bool = False


@dataclass(frozen=True, kw_only=True)
class Detail:
    """Mark of a field of :class:`ToothDamage` that means something only where a size is not 0.

    Attributes
    ----------
    of
        Name of the size.
    extent
        Whether the field is an extent: where it is 0, the size changes nothing.
    """

    of: str
    extent: bool = False


class ToothDamage(Section):
    """Damage of one tooth: of its stiffness and flank, or of its geometry where the profile is by the energy method."""

    phase_shift_deg: Annotated[float, Size(kind="shift", always_stored=True)] = quantity(
        "deg",
        "Delay of the tooth's mesh stiffness, in degrees of rotation of the damaged gear; positive is later.",
        default=0.0,
    )
    stiffness_loss: Annotated[float, Size(kind="loss", always_stored=True)] = quantity(
        "-", "Fraction of the tooth's mesh stiffness that is lost.", ge=0, le=1, default=0.0
    )
    loss_extent: Annotated[float, Detail(of="stiffness_loss", extent=True)] = quantity(
        "-", "Fraction of the tooth's contact over which the loss acts, from first contact.", ge=0, le=1, default=1.0
    )
    friction: Annotated[float, Size(kind="friction", always_stored=True)] = quantity(
        "-", "Coulomb friction coefficient of the tooth.", ge=0, le=1, default=0.0
    )
    flank_deviation: Annotated[float, Size(kind="deviation")] = quantity(
        "m",
        "Material missing from the flank across the face width, along the mesh normal, such as the depth of a spall; "
        "negative where there is too much.",
        ge=-MOST_DEVIATION, le=MOST_DEVIATION, default=0.0,
    )  # fmt: skip
    deviation_extent: Annotated[float, Detail(of="flank_deviation", extent=True)] = quantity(
        "-", "Fraction of the tooth's contact over which the flank deviates.", ge=0, le=1, default=1.0
    )
    deviation_place: Annotated[float, Detail(of="flank_deviation")] = quantity(
        "-", "Middle of the deviation, as a fraction of the contact from first contact.", ge=0, le=1, default=0.5
    )
    crack_depth: Annotated[float, Size(kind="crack", geometric=True)] = quantity(
        "m", "Length of a crack from the loaded side of the root, through the whole face width.", ge=0, default=0.0
    )
    crack_angle_deg: Annotated[float, Detail(of="crack_depth")] = quantity(
        "deg", "Angle of the crack from the tooth's centre line.", gt=0, le=90, default=70.0
    )
    pit_diameter: Annotated[float, Size(kind="pit", geometric=True)] = quantity(
        "m", "Diameter of round pits in a row across the loaded flank.", ge=0, default=0.0
    )
    pit_depth: Annotated[float, Detail(of="pit_diameter")] = quantity(
        "m", "Depth of the pits; 0 takes only width of contact.", ge=0, default=0.0
    )
    pits: Annotated[int, Detail(of="pit_diameter")] = quantity("-", "Number of pits.", ge=1, default=1)
    pit_place: Annotated[float, Detail(of="pit_diameter")] = quantity(
        "-",
        "Place of the pits' centres, as a fraction of the contact from first contact; off it below 0 and above 1.",
        default=0.5,
    )
    wear_depth: Annotated[float, Size(kind="wear", geometric=True)] = quantity(
        "m", "Depth worn evenly off the flank, along its normal.", ge=0, default=0.0
    )
    chip_height: Annotated[float, Size(kind="chip", geometric=True)] = quantity(
        "m", "Height that is broken off the tooth, from its tip; all of the tooth is missing at its height.",
        ge=0, default=0.0,
    )  # fmt: skip
    chip_extent: Annotated[float, Detail(of="chip_height", extent=True)] = quantity(
        "-", "Fraction of the face width that is broken off.", ge=0, le=1, default=1.0
    )

    @model_serializer(mode="wrap")
    def _as_used(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return without_defaults(self, handler(self), OPTIONAL_FIELDS)

    def shift_in_passes(self, teeth: int) -> float:
        """The phase shift in tooth passes of a gear.

        Raises
        ------
        InputError
            If it is more than half a tooth pass.
        """
        shift = self.phase_shift_deg * teeth / 360
        if abs(shift) > 0.5:
            raise InputError(
                f"phase_shift_deg = {self.phase_shift_deg} is more than half a tooth pass of a gear of {teeth} teeth; "
                f"give at most {180 / teeth:g} deg"
            )
        return shift

    def __repr_args__(self) -> list[tuple[str | None, object]]:
        return [(name, getattr(self, name)) for name in type(self).model_fields if name in self.model_fields_set]

    @property
    def is_damage(self) -> bool:
        """Whether it changes anything."""
        return any(map(self._acts, SIZES))

    @property
    def flaws(self) -> tuple[str, ...]:
        """Sizes of geometric damage that change the tooth."""
        return tuple(filter(self._acts, FLAWS))

    def _acts(self, size: str) -> bool:
        return all(getattr(self, name) != 0 for name in ACTING[size])

    @property
    def geometry(self) -> "ToothDamage":
        """The part that changes the tooth's geometry, without fields that mean nothing with it."""
        return ToothDamage(**{name: getattr(self, name) for size in self.flaws for name in (size, *FLAWS[size])})


def sizes_with_details(damage: type[ToothDamage]) -> dict[str, tuple[str, ...]]:
    """Return the fields of a tooth's damage that are sizes, each with the fields that are details of it."""
    fields = damage.model_fields
    details = {name: mark.of for name, field in fields.items() for mark in field.metadata if isinstance(mark, Detail)}
    return {
        size: tuple(name for name, of in details.items() if of == size)
        for size, field in fields.items()
        if any(isinstance(mark, Size) for mark in field.metadata)
    }


def _mark_of(size: str) -> Size:
    return next(mark for mark in ToothDamage.model_fields[size].metadata if isinstance(mark, Size))


def _is_extent(name: str) -> bool:
    marks = ToothDamage.model_fields[name].metadata
    return any(isinstance(mark, Detail) and mark.extent for mark in marks)


SIZES = sizes_with_details(ToothDamage)
"""Sizes of a tooth's damage, each with the fields that mean something only where it is not 0."""
ACTING = {size: (size, *filter(_is_extent, details)) for size, details in SIZES.items()}
"""Sizes of a tooth's damage, each with the fields that are all different from 0 where it changes the tooth."""
FLAWS = {size: details for size, details in SIZES.items() if _mark_of(size).geometric}
"""Sizes of geometric damage, each with its details."""
KINDS = {size: _mark_of(size).kind or size for size in SIZES}
"""Sizes of a tooth's damage, each with the name of its kind."""
OPTIONAL_SIZES = {size: details for size, details in SIZES.items() if not _mark_of(size).always_stored}
"""Sizes that are stored only where they are used, each with its details."""
OPTIONAL_FIELDS = tuple(name for size, details in OPTIONAL_SIZES.items() for name in (size, *details))

_WEAR_PASSES = 0.05
"""Delay of a worn tooth in passes: 1.5 deg on 12 teeth, the least shift that the paper simulates."""
PRESETS: dict[str, str] = {
    "pitted": "50 % of the stiffness over the first 20 % of the contact",
    "broken": "50 % of the stiffness over all of the contact",
    "worn": "every tooth of the gear 0.05 of a tooth pass late, with 10 % less stiffness",
}
"""Kinds of damage that have a name: what each is. The sizes of worn teeth are assumed, the others are the paper's."""


def preset_teeth(name: str, teeth: int) -> tuple[ToothDamage, ...]:
    """Damage of consecutive teeth by the name of a preset, on a gear of that many teeth.

    Raises
    ------
    InputError
        If there is no such preset.
    """
    if name == "pitted":
        return (ToothDamage(stiffness_loss=0.5, loss_extent=0.2),)
    if name == "broken":
        return (ToothDamage(stiffness_loss=0.5),)
    if name == "worn":
        return (ToothDamage(phase_shift_deg=_WEAR_PASSES * 360 / teeth, stiffness_loss=0.1),) * teeth
    raise InputError(f"no preset {name!r}{suggestion(name, PRESETS)}")


def as_damage(damage: "Damage | Mapping[str, Any] | None") -> "Damage":
    """Return damage as it is, of its fields by name, or none.

    Raises
    ------
    TypeError
        If it is of another type.
    """
    if isinstance(damage, Damage):
        return damage
    if damage is None or isinstance(damage, Mapping):
        return validated(Damage, dict(damage or {}), owner="damage")
    raise TypeError(
        f"damage is of type {type(damage).__name__}; give sigdb.Damage(tooth=3, stiffness_loss=0.3), or such fields as "
        "a dictionary"
    )


class Damage(ToothDamage):
    """Damage of consecutive teeth of one gear: all alike, or a pattern of teeth that differ.

    Examples
    --------
    >>> import sigdb
    >>> sigdb.Damage(tooth=12, damaged_teeth=2, stiffness_loss=0.5).on_teeth(12)
    {12: ToothDamage(stiffness_loss=0.5), 1: ToothDamage(stiffness_loss=0.5)}
    """

    gear: str | None = Field(
        default=None, description="Name of the damaged gear; the first mesh's driving gear if left out."
    )
    tooth: int = quantity(
        "-", "First damaged tooth, from 1 in the order of mesh after the tacho mark; 0 = undamaged.", ge=0, default=0
    )
    damaged_teeth: int = quantity("-", "Number of consecutive damaged teeth; 0 = undamaged.", ge=0, default=1)
    pattern: str = Field(
        default="", description="Name of the list of damaged teeth that differ; empty where all are alike."
    )
    each: Annotated[tuple[ToothDamage, ...], Strict(False)] = Field(
        default=(), description="Damage of each tooth of a pattern, in the order of mesh."
    )

    @model_validator(mode="before")
    @classmethod
    def _counts(cls, data: object) -> object:
        """An undamaged gear has no damaged teeth, a pattern says how many it has, and NumPy's numbers are numbers."""
        if isinstance(data, dict):
            data = {name: value.item() if isinstance(value, np.generic) else value for name, value in data.items()}
            if not data.get("tooth", 0):
                return {"damaged_teeth": 0} | data
            if data.get("each"):
                return {"damaged_teeth": len(data["each"])} | data
        return data

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.tooth == 0) != (self.damaged_teeth == 0):
            raise ValueError(
                f"tooth = {self.tooth} and damaged_teeth = {self.damaged_teeth} contradict each other; "
                "both are 0 for an undamaged gear, and neither is for a damaged one"
            )
        if self.tooth == 0 and (super().is_damage or self.each):
            raise ValueError("damage is given without a tooth; say with tooth which tooth is the first damaged one")
        stated = set(ToothDamage.model_fields) & self.model_fields_set
        if self.each and (stated or self.damaged_teeth != len(self.each)):
            raise ValueError(
                f"pattern {self.pattern!r} gives the damage of {len(self.each)} teeth one by one; leave out "
                f"{', '.join(ToothDamage.model_fields)} and damaged_teeth"
            )
        return self

    @classmethod
    def preset(cls, name: str, *, teeth: int, tooth: int = 1, gear: str | None = None) -> Self:
        """A kind of damage by its name, which becomes the name of the pattern.

        ``pitted`` takes 50 % of the tooth's stiffness over the first 20 % of its contact, ``broken`` 50 % over all of
        it. ``worn`` delays every tooth of the gear by 0.05 of a tooth pass and takes 10 % of its stiffness.

        Parameters
        ----------
        name
            ``pitted``, ``broken`` or ``worn``.
        teeth
            Teeth of the damaged gear.
        tooth
            The damaged tooth; where every tooth is damaged alike it does not matter.
        gear
            The damaged gear; the first mesh's driving gear if left out.

        Raises
        ------
        InputError
            If there is no such preset.

        Examples
        --------
        >>> import sigdb
        >>> sigdb.Damage.preset("pitted", teeth=12, tooth=6).on_teeth(12)
        {6: ToothDamage(stiffness_loss=0.5, loss_extent=0.2)}
        """
        return cls(gear=gear, tooth=tooth, pattern=name, each=preset_teeth(name, teeth))

    @property
    def is_damage(self) -> bool:
        """Whether any tooth is changed."""
        return self.tooth > 0 and (any(tooth.is_damage for tooth in self.each) if self.each else super().is_damage)

    def on_teeth(self, teeth: int) -> dict[int, ToothDamage]:
        """Damage by tooth number on a gear of that many teeth; damaged teeth wrap (12, 1, 2).

        Raises
        ------
        InputError
            If the gear has fewer teeth than the damage names, or a shift is more than half a tooth pass.
        """
        if self.tooth > teeth:
            raise InputError(
                f"tooth {self.tooth} does not exist: the gear has {teeth} teeth; name one from 1 to {teeth}"
            )
        if self.damaged_teeth > teeth:
            raise InputError(
                f"damaged_teeth = {self.damaged_teeth}, but the gear has {teeth} teeth; give {teeth} or fewer"
            )
        alike = ToothDamage(**self.model_dump(include=set(ToothDamage.model_fields), exclude_unset=True))
        each = self.each or (alike,) * self.damaged_teeth
        for tooth in each:
            tooth.shift_in_passes(teeth)
        return {(self.tooth - 1 + i) % teeth + 1: tooth for i, tooth in enumerate(each)}
