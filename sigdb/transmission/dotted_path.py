"""Parameters of a rig by dotted path: where they are, their values, and rigs with others."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from sigdb.core import InputError, suggestion
from sigdb.transmission.parts.described import item

if TYPE_CHECKING:
    from sigdb.transmission.rig import Transmission

TABLES = ("gears", "disks", "shafts", "bearings", "couplings", "meshes", "sensors", "materials")
"""Tables of parts by name; a name that two of them hold is that of the first."""

Path = tuple[str, ...]
"""Names and numbers that lead to a value of a rig."""


def full_path(rig: "Transmission", dotted: str) -> Path:
    """Return the full path of a parameter: ``pinion.teeth`` is ``gears.pinion.teeth``.

    Raises
    ------
    InputError
        If the rig has nothing of the name of its first word.
    """
    parts = tuple(dotted.split("."))
    if parts[0] in type(rig).model_fields:
        return parts
    tables = [table for table in TABLES if parts[0] in getattr(rig, table)]
    if not tables:
        names = [*type(rig).model_fields, *(name for table in TABLES for name in getattr(rig, table))]
        raise InputError(f"rig {rig.name!r} has no part {parts[0]!r} (in {dotted!r}){suggestion(parts[0], names)}")
    return tables[0], *parts


def number_path(rig: "Transmission", dotted: str) -> Path:
    """Return the full path of a numeric parameter.

    Raises
    ------
    InputError
        If it names no numeric field.
    """
    path = full_path(rig, dotted)
    value = value_at(rig, path, dotted)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{dotted!r} of rig {rig.name!r} is not a number; name a numeric field of the rig")
    return path


def value_at(rig: "Transmission", path: Path, dotted: str) -> Any:
    """Return the value at a full path.

    Raises
    ------
    InputError
        If there is none.
    """
    here: Any = rig
    for part in path:
        names = list(type(here).model_fields) if isinstance(here, BaseModel) else here if isinstance(here, dict) else ()
        here = item(here, part)
        if here is None:
            raise InputError(f"rig {rig.name!r} has no parameter {dotted!r}{suggestion(part, names)}")
    return here


def replaced(rig: "Transmission", values: Mapping[str, float]) -> dict[str, Any]:
    """Return the fields of a rig with other values at dotted paths.

    Raises
    ------
    InputError
        If a path names no numeric field, or a value is no number.
    """
    data = rig.model_dump()
    for dotted, value in values.items():
        path = number_path(rig, dotted)
        check_teeth_free(rig, path, dotted)
        if isinstance(value, bool | str):
            raise InputError(f"rig {rig.name!r}: {dotted} = {value!r} must be a number")
        if path[-1].isdigit():
            raise InputError(f"{dotted!r} is one component of a vector and cannot be set alone; set it in the rig file")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InputError(f"rig {rig.name!r}: {dotted} = {value!r} must be a number") from None
        whole = isinstance(value_at(rig, path, dotted), int) and number.is_integer()
        data = with_value(data, path, int(value) if whole else number)
    return data


def check_teeth_free(rig: "Transmission", path: Path, dotted: str) -> None:
    """Refuse the tooth count of a gear whose mass would not follow it.

    Raises
    ------
    InputError
        If it would not.
    """
    if path[0] == "gears" and path[-1] == "teeth" and rig.gears[path[1]].mass is not None:
        raise InputError(
            f"{dotted!r} cannot be changed: the body of gear {path[1]!r} is given by its mass and would not "
            "follow; give body_length and material instead"
        )


def with_value(data: Any, path: Path, value: object) -> Any:
    """Return fields of a rig with another value at a full path; tables are changed in place, lists are copied."""
    if not path:
        return value
    if isinstance(data, dict):
        data[path[0]] = with_value(data[path[0]] if path[1:] else None, path[1:], value)
        return data
    items: Sequence[Any] = data
    i = int(path[0])
    return [*items[:i], with_value(items[i], path[1:], value), *items[i + 1 :]]
