"""What a rig is, in numbers: its parts, its forces, its frequencies, and where its numbers come from."""

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from sigdb.transmission.parts.described import ORIGINS, Described
from sigdb.transmission.rig import Transmission
from sigdb.transmission.summary.parts import (
    bearing_numbers,
    gear_numbers,
    mesh_numbers,
    mode_numbers,
    resonances,
    shaft_numbers,
)


def describe_rig(rig: Transmission) -> dict[str, Any]:
    """Numbers of a rig at its operating point, as plain lists and dictionaries.

    Parameters
    ----------
    rig
        Any rig, with or without meshes, torque or casing.

    Returns
    -------
    dict
        ``name``, ``title``, ``damping_ratio``, ``operating``; lists of dictionaries ``shafts``, ``gears``, ``disks``,
        ``meshes``, ``tooth_forces``, ``bearings``, ``couplings``, ``casing``, ``sensors``, ``excitations``, ``modes``
        (to three times the highest mesh frequency, or ten times the highest shaft speed of a rig without meshes, and
        the lowest six at least), ``resonances`` (modes with a damping ratio below 0.7 within 5 % of a shaft's speed or
        of one of the first three harmonics of a mesh); ``overdamped``, a count of modes that do not vibrate; and
        ``origins``, counts of fields by origin. SI units, but for keys that end in _deg, _rpm or _hz.

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
    operating = rig.operating.model_dump(exclude={"sources"}) | {"drive_shaft": rig.drive_shaft}
    meshes, forces = mesh_numbers(rig)
    modes, overdamped = mode_numbers(rig)
    return {
        "name": rig.name,
        "title": rig.title,
        "damping_ratio": rig.damping_ratio,
        "operating": operating,
        "shafts": [shaft_numbers(rig, name) for name in rig.shafts],
        "gears": [gear_numbers(rig, name) for name in rig.gears],
        "disks": [
            {"name": name, "shaft": disk.shaft, "node": disk.node} | rig.disk_body(name).model_dump()
            for name, disk in rig.disks.items()
        ],
        "meshes": meshes,
        "tooth_forces": forces,
        "bearings": [bearing_numbers(rig, name) for name in rig.bearings],
        "couplings": [
            {"name": name} | coupling.model_dump(exclude={"sources"}) for name, coupling in rig.couplings.items()
        ],
        "casing": [mode.model_dump(exclude={"sources"}) for mode in rig.casing.modes],
        "sensors": [
            {"name": name, "unit": sensor.unit} | sensor.model_dump(exclude={"sources"})
            for name, sensor in rig.sensors.items()
        ],
        "excitations": list(_excitations(rig)),
        "modes": modes,
        "overdamped": overdamped,
        "resonances": list(resonances(rig, modes)),
        "origins": origins(rig),
    }


def _excitations(rig: Transmission) -> Iterator[dict[str, Any]]:
    """What excites the rig besides torque and mesh stiffness."""
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


def origins(rig: Transmission) -> dict[str, int]:
    """Counts of fields by the origin that ``sources`` gives them; ``unstated`` are quantities without one."""
    counts = dict.fromkeys((*ORIGINS, "unstated"), 0)
    for part in _parts(rig):
        for text in part.sources.values():
            counts[text.split(":")[0]] += 1
        counts["unstated"] += sum(
            isinstance(field.json_schema_extra, dict)
            and _is_number(getattr(part, name))
            and getattr(part, name) != field.default
            and name not in part.sources
            for name, field in type(part).model_fields.items()
        )
    return counts


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (isinstance(value, tuple) and all(_is_number(one) for one in value))


def _parts(here: Any) -> Iterator[Described]:
    if isinstance(here, Described):
        yield here
    if isinstance(here, BaseModel):
        values = [getattr(here, name) for name in type(here).model_fields]
    elif isinstance(here, dict | tuple):
        values = list(here.values() if isinstance(here, dict) else here)
    else:
        values = []
    for value in values:
        yield from _parts(value)
