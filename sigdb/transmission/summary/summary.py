"""Summary of a rig in numbers: its parts, its forces, its frequencies, and where its numbers come from."""

from collections.abc import Iterator
from typing import cast

from pydantic import BaseModel

from sigdb.transmission.parts.described import ORIGINS, Described
from sigdb.transmission.parts.usual_ranges import unusual_numbers
from sigdb.transmission.rig import Transmission
from sigdb.transmission.summary.facts import (
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
        - ``remarks``, a sentence on each number outside the usual range of its kind, and on each mesh that the torque
          does not press together as it should.

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
        "remarks": [*unusual_numbers(rig.model_dump()), *mesh_remarks(rig, meshes)],
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


def origins(rig: Transmission) -> dict[str, int]:
    """Return counts of fields by the origin that ``sources`` gives them; ``unstated`` are quantities without one."""
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


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) or (isinstance(value, tuple) and all(map(_is_number, value)))


def _parts(here: object) -> Iterator[Described]:
    if isinstance(here, Described):
        yield here
    if isinstance(here, BaseModel):
        values: list[object] = [getattr(here, name) for name in type(here).model_fields]
    elif isinstance(here, dict | tuple):
        values = list(here.values() if isinstance(here, dict) else here)
    else:
        values = []
    for value in values:
        yield from _parts(value)
