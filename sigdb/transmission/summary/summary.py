"""Summary of a rig in numbers: its parts, its forces, its frequencies, and where its numbers come from."""

from collections.abc import Iterator
from typing import Any, cast

from pydantic import BaseModel

from sigdb.transmission.ensemble.assumed_values import value_in
from sigdb.transmission.parts.described import NOTES, ORIGINS, Described
from sigdb.transmission.parts.usual_ranges import unusual_numbers
from sigdb.transmission.rig import Transmission
from sigdb.transmission.summary.facts import (
    AssumedFacts,
    CasingModeFacts,
    CouplingFacts,
    ExcitationFacts,
    OperatingFacts,
    RigFacts,
    SensorFacts,
)
from sigdb.transmission.summary.parts import (
    bearing_facts,
    disk_facts,
    gear_facts,
    mesh_facts,
    mesh_remarks,
    mode_facts,
    resonances,
    shaft_facts,
)

_MOST_NAMED = 6
"""Numbers without a range that a remark names."""


def describe_rig(rig: Transmission) -> RigFacts:
    """Return the numbers of a rig at its operating point, as lists and dictionaries that JSON can hold.

    Parameters
    ----------
    rig : Transmission
        Any rig, with or without meshes, torque or casing.

    Returns
    -------
    RigFacts
        A dictionary in SI units, but for keys that end in _deg, _rpm or _hz. It has:

        - ``name``, ``title``, ``damping_ratio`` and ``operating``;
        - lists of dictionaries: ``shafts``, ``gears``, ``disks``, ``meshes``, ``tooth_forces``, ``bearings``,
          ``couplings``, ``casing``, ``sensors``, ``excitations``, ``modes`` and ``resonances``;
        - ``overdamped``, the number of modes that do not vibrate;
        - ``origins``, counts of fields by origin;
        - ``assumed``, a list of dictionaries: the range, choices or tie of each assumed number;
        - ``remarks``, a sentence on each number outside the usual range of its kind, on each mesh that the torque does
          not press together as it should, and on the numbers that are assumed without a range.

        Modes go to three times the highest mesh frequency, or to ten times the highest shaft speed of a rig without
        meshes, and are the lowest six at least. Resonances are modes with a damping ratio below 0.7 within 5 % of a
        shaft's speed or of one of the first three harmonics of a mesh.

    Raises
    ------
    InputError
        If a part of the rig can move freely.

    Examples
    --------
    >>> import sigdb
    >>> facts = describe_rig(sigdb.load_transmission("nasa-spiral-bevel"))
    >>> facts["meshes"][0]["mesh_frequency_hz"], facts["meshes"][0]["tooth_cycle_hz"]
    (2880.0, 80.0)
    """
    operating = cast(OperatingFacts, _dumped(rig.operating) | {"drive_shaft": rig.drive_shaft})
    meshes, forces = mesh_facts(rig)
    modes, overdamped = mode_facts(rig)
    return {
        "name": rig.name,
        "title": rig.title,
        "damping_ratio": rig.damping_ratio,
        "operating": operating,
        "shafts": [shaft_facts(rig, name) for name in rig.shafts],
        "gears": [gear_facts(rig, name) for name in rig.gears],
        "disks": [disk_facts(rig, name) for name in rig.disks],
        "meshes": meshes,
        "tooth_forces": forces,
        "bearings": [bearing_facts(rig, name) for name in rig.bearings],
        "couplings": [
            cast(CouplingFacts, {"name": name} | _dumped(coupling)) for name, coupling in rig.couplings.items()
        ],
        "casing": [cast(CasingModeFacts, _dumped(mode)) for mode in rig.casing.modes],
        "sensors": [
            cast(SensorFacts, {"name": name, "unit": sensor.unit} | _dumped(sensor))
            for name, sensor in rig.sensors.items()
        ],
        "excitations": list(_excitations(rig)),
        "modes": modes,
        "overdamped": overdamped,
        "resonances": list(resonances(rig, modes)),
        "origins": origins(rig),
        "assumed": assumed_facts(rig),
        "remarks": [*unusual_numbers(rig.model_dump()), *mesh_remarks(rig, meshes), *_unranged_remark(rig)],
    }


def _dumped(part: Described) -> dict[str, object]:
    return part.model_dump(exclude={"sources", "assumed"})


def _excitations(rig: Transmission) -> Iterator[ExcitationFacts]:
    """The excitations of a rig other than torque and mesh stiffness."""
    for name, body in (*rig.gears.items(), *rig.disks.items()):
        if body.unbalance:
            yield {"what": f"unbalance of {name}", "size": body.unbalance, "unit": "kg m", "shaft": body.shaft}
    for name, gear in rig.gears.items():
        if gear.runout:
            yield {"what": f"run-out of {name}", "size": gear.runout, "unit": "m", "shaft": gear.shaft}
    for name, mesh in rig.meshes.items():
        if mesh.profile_error is not None:
            shaft, size = rig.gears[mesh.driving].shaft, mesh.profile_error.amplitude
            yield {"what": f"profile error of {name}, every tooth pass", "size": size, "unit": "m", "shaft": shaft}
    if rig.operating.load is not None and rig.operating.load_fluctuation:
        shaft = rig.couplings[rig.operating.load].shaft
        what = f"fluctuation of the load, order {rig.operating.load_order}"
        yield {"what": what, "size": rig.operating.load_fluctuation, "unit": "of the mean", "shaft": shaft}


def assumed_facts(rig: Transmission) -> list[AssumedFacts]:
    """Return the present value of each assumed number of a rig, and its range, choices or tie in words."""
    data = rig.model_dump()
    free = {number.path for number in rig.assumptions.free}
    return [
        {"path": path, "value": _shown(value_in(data, path)), "assumed": str(assumption), "is_free": path in free}
        for path, assumption in rig.assumptions.items()
    ]


def _shown(value: Any) -> float | int | str | list[float]:
    if isinstance(value, dict):
        return str(value.get("kind", "trapezoid"))
    return list(value) if isinstance(value, tuple) else cast(float, value)


def origins(rig: Transmission) -> dict[str, int]:
    """Return counts of fields by the origin that ``sources`` gives them; ``unstated`` are quantities without one."""
    counts = dict.fromkeys((*ORIGINS, "unstated"), 0)
    for _, part in _parts(rig):
        for text in part.sources.values():
            counts[text.split(":")[0]] += 1
        counts["unstated"] += sum(name not in part.sources for name in _stated_numbers(part))
    return counts


def unranged_numbers(rig: Transmission) -> list[str]:
    """Return the dotted paths of numbers that no source gives and of which nothing is assumed in range.

    Those are numbers without a source, and all with one that begins with ``assumed:``, such as a mode shape, without a
    range, choices or tie of their own or of a component.
    """
    return [
        ".".join((*path, name))
        for path, part in _parts(rig)
        for name in dict.fromkeys([*_stated_numbers(part), *part.sources])
        if part.sources.get(name, "assumed:").startswith("assumed:")
        and not any(key.split(".")[0] == name for key in part.assumed)
    ]


def _unranged_remark(rig: Transmission) -> Iterator[str]:
    paths = unranged_numbers(rig)
    if paths:
        more = f" and {len(paths) - _MOST_NAMED} more" if len(paths) > _MOST_NAMED else ""
        count = "1 number is" if len(paths) == 1 else f"{len(paths)} numbers are"
        yield (
            f"{count} assumed without a range: {', '.join(paths[:_MOST_NAMED])}{more}; give each assumed.KEY, or "
            "another source"
        )


def _stated_numbers(part: Described) -> Iterator[str]:
    """Yield the names of the quantities of a part that are not their defaults."""
    for name, field in type(part).model_fields.items():
        is_quantity = isinstance(field.json_schema_extra, dict)
        if is_quantity and _is_number(getattr(part, name)) and getattr(part, name) != field.default:
            yield name


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) or (isinstance(value, tuple) and all(map(_is_number, value)))


def _parts(here: object, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Described]]:
    """Yield the parts of a rig, each with its path."""
    if isinstance(here, Described):
        yield path, here
    if isinstance(here, BaseModel):
        items = [(name, getattr(here, name)) for name in type(here).model_fields if name not in NOTES]
    elif isinstance(here, dict):
        items = list(here.items())
    else:
        items = [(str(i), item) for i, item in enumerate(here)] if isinstance(here, tuple) else []
    for name, item in items:
        yield from _parts(item, (*path, name))
