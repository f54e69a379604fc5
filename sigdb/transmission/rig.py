"""A transmission as it is described: parts by name, checked against each other."""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, Self

import numpy as np
import tomli_w
from pydantic import Field, ValidationInfo, field_validator, model_validator

from sigdb.core import InputError, quantity, validated
from sigdb.transmission.dotted_path import number_path, replaced, value_at
from sigdb.transmission.ensemble.assumption import Choice
from sigdb.transmission.ensemble.assumptions import Assumptions, assumption_problems
from sigdb.transmission.mesh.geometry import MeshGeometry, PairMember, mesh_geometry
from sigdb.transmission.mesh.geometry_profiles import GeometryProfile
from sigdb.transmission.parts.bodies import Body, Disk
from sigdb.transmission.parts.described import Described, Name
from sigdb.transmission.parts.gears import Gear, Mesh, Operating
from sigdb.transmission.parts.sensors import Sensor
from sigdb.transmission.parts.shafts import Material, Shaft
from sigdb.transmission.parts.supports import Bearing, Casing, Coupling
from sigdb.transmission.parts.usual_ranges import unusual_numbers

__all__ = ["Transmission"]


class Transmission(Described):
    """A rig: shafts, gears, bearings, couplings, meshes, casing, sensors and an operating point.

    Examples
    --------
    >>> import sigdb
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> rig.gears["pinion"].teeth, rig.mesh_frequency("main")
    (12, 2880.0)
    >>> rig.replace({"pinion.teeth": 13}).gears["pinion"].teeth
    13
    """

    name: str = Field(description="Name of the rig.", pattern=r"^[A-Za-z][A-Za-z0-9._-]*$")
    title: str = Field(default="", description="Description of the rig in a line.")
    rig_member: int = Field(
        default=0,
        description="Number of the member of an ensemble that the rig is, from 1; 0 for a rig of no ensemble.",
        ge=0,
        exclude_if=lambda member: member == 0,
    )
    damping_ratio: float = quantity(
        "-", "Fraction of critical damping of every mode of the rotors, torsion included.", ge=0, lt=1
    )
    operating: Operating = Field(description="Speed and torque, and where they enter and leave.")
    materials: dict[Name, Material] = Field(default={}, description="Materials by name.")
    shafts: dict[Name, Shaft] = Field(description="Shafts by name.", min_length=1)
    gears: dict[Name, Gear] = Field(default={}, description="Gears by name.")
    disks: dict[Name, Disk] = Field(default={}, description="Disks by name.")
    bearings: dict[Name, Bearing] = Field(default={}, description="Bearings by name.")
    couplings: dict[Name, Coupling] = Field(default={}, description="Couplings to end machines or shafts by name.")
    meshes: dict[Name, Mesh] = Field(default={}, description="Gear pairs by name.")
    casing: Casing = Field(default=Casing(), description="The casing; without modes it is rigid ground.")
    sensors: dict[Name, Sensor] = Field(default={}, description="Sensors by name.")

    @field_validator("meshes")
    @classmethod
    def _know_their_gears(cls, meshes: dict[str, Mesh], info: ValidationInfo) -> dict[str, Mesh]:
        """Meshes whose profiles follow from the geometry of their gears, where they can; else they stay as they are."""
        parts = info.data
        if {"gears", "materials"} - set(parts):
            return meshes
        fitted = {}
        for name, mesh in meshes.items():
            try:
                driving, driven = parts["gears"][mesh.driving], parts["gears"][mesh.driven]
                fitted[name] = mesh.fitted(driving, driven, parts["materials"])
            except (KeyError, ValueError):  # reported with all that is inconsistent, when the rig is complete
                fitted[name] = mesh
        return fitted

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        problems = list(self._dangling())
        if not problems:
            problems = list(self._geometry_problems())
        if not problems:
            problems = list(self._profile_problems())
        if not problems:
            problems = list(assumption_problems(self))
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def _profile_problems(self) -> Iterator[str]:
        """Profiles that do not hold for the gears of their mesh."""
        for name, mesh in self.meshes.items():
            if isinstance(mesh.profile, GeometryProfile) and any(self.geometries[name].pitch_angles_deg):
                yield (
                    f"meshes.{name}.profile.kind = {mesh.profile.kind!r} is for gears on parallel shafts; name another"
                )
                continue
            try:
                fitted = mesh.fitted(self.gears[mesh.driving], self.gears[mesh.driven], self.materials)
            except ValueError as error:
                yield f"meshes.{name}.profile: {error}"
                continue
            fewest = min((mesh.driving, mesh.driven), key=lambda gear: self.gears[gear].teeth)
            teeth, contact = self.gears[fewest].teeth, fitted.profile.contact_ratio
            if contact > teeth - 2:
                yield (
                    f"meshes.{name}: a contact of {contact:.4g} passes is more than a revolution of gear {fewest!r} "
                    f"with {teeth} teeth has room for; it must be at most {teeth - 2}"
                )

    def _dangling(self) -> Iterator[str]:
        """References to parts and nodes that do not exist."""
        operating = self.operating
        machines = [name for name, coupling in self.couplings.items() if coupling.to_shaft is None]
        yield from _missing("operating.shaft", operating.shaft, self.shafts)
        yield from _missing("operating.drive", operating.drive, machines)
        yield from _missing("operating.load", operating.load, machines)
        for name, shaft in self.shafts.items():
            yield from _missing(f"shafts.{name}.material", shaft.material, self.materials)
            for i, segment in enumerate(shaft.segments):
                yield from _missing(f"shafts.{name}.segments.{i}.material", segment.material, self.materials)
                if segment.material is None and shaft.material is None:
                    yield f"shafts.{name}.segments.{i}.material is missing; give it there or for the whole shaft"
        for table in ("gears", "disks", "bearings", "couplings"):
            for name, part in getattr(self, table).items():
                yield from self._missing_node(f"{table}.{name}", "shaft", "node", part)
        for name, coupling in self.couplings.items():
            if coupling.to_shaft is not None:
                yield from self._missing_node(f"couplings.{name}", "to_shaft", "to_node", coupling)
        for table in ("gears", "disks"):
            for name, part in getattr(self, table).items():
                yield from _missing(f"{table}.{name}.material", part.material, self.materials)
        for name, bearing in self.bearings.items():
            yield from _missing(f"bearings.{name}.seat", bearing.seat, self.casing.points)
        for name, mesh in self.meshes.items():
            yield from _missing(f"meshes.{name}.driving", mesh.driving, self.gears)
            yield from _missing(f"meshes.{name}.driven", mesh.driven, self.gears)
            if mesh.driving == mesh.driven:
                yield f"meshes.{name}.driven = {mesh.driven!r} is also its driving gear; name two gears"
        for name, sensor in self.sensors.items():
            yield from _missing(f"sensors.{name}.gear", sensor.gear, self.gears)
            yield from _missing(f"sensors.{name}.point", sensor.point, self.casing.points)

    def _missing_node(self, key: str, shaft_field: str, node_field: str, part: Any) -> Iterator[str]:
        shaft, node = getattr(part, shaft_field), getattr(part, node_field)
        yield from _missing(f"{key}.{shaft_field}", shaft, self.shafts)
        if shaft in self.shafts and node >= self.shafts[shaft].nodes:
            yield (
                f"{key}.{node_field} = {node} does not exist: shaft {shaft!r} has the nodes 0 to "
                f"{self.shafts[shaft].nodes - 1}; choose one of them or give the shaft more elements"
            )

    def _geometry_problems(self) -> Iterator[str]:
        drive, load = self.operating.drive, self.operating.load
        if drive is not None and load is not None and self.couplings[drive].shaft == self.couplings[load].shaft:
            yield (
                f"operating.load = {load!r} is on the same shaft as operating.drive = {drive!r}, so no torque goes "
                "through a mesh; name a coupling of a shaft that the mesh drives"
            )
            return
        try:
            geometries = self.geometries
        except InputError as error:
            yield str(error)
            return
        if load is not None and self._solved[1].get(self.couplings[load].shaft, 0.0) == 0:
            yield (
                f"operating.load = {load!r} is on shaft {self.couplings[load].shaft!r}, which no mesh drives; "
                "name a coupling of a driven shaft"
            )
        for name, mesh in self.meshes.items():
            for gear_name, radius in zip((mesh.driving, mesh.driven), geometries[name].radii, strict=True):
                bore = self.gears[gear_name].bore
                if bore >= 2 * radius:
                    yield (
                        f"gears.{gear_name}.bore = {bore} must be less than the mean pitch diameter {2 * radius:.4g}; "
                        "reduce the bore, or raise the module or the tooth count"
                    )
        for name in set(self.gears) - {gear for mesh in self.meshes.values() for gear in (mesh.driving, mesh.driven)}:
            if self.gears[name].mass is None:
                yield f"gears.{name} takes part in no mesh, so it has no pitch radius; give its mass and polar_inertia"

    @cached_property
    def _solved(self) -> tuple[dict[str, MeshGeometry], dict[str, float]]:
        """Mesh geometries, and the speed of every shaft about its own z axis as a multiple of the drive's."""
        ratios = {self.drive_shaft: float(self.operating.rotation)}
        self._couple(ratios)
        geometries: dict[str, MeshGeometry] = {}
        while len(geometries) < len(self.meshes):
            ready = [
                name
                for name, mesh in self.meshes.items()
                if name not in geometries and self.gears[mesh.driving].shaft in ratios
            ]
            if not ready:
                left = sorted(set(self.meshes) - set(geometries))
                raise InputError(
                    f"meshes.{left[0]}: its driving gear's shaft is not driven; power must flow from "
                    f"shaft {self.drive_shaft!r} through the meshes, driving gear to driven gear"
                )
            for name in ready:
                mesh = self.meshes[name]
                driving, driven = self.gears[mesh.driving], self.gears[mesh.driven]
                ratio = ratios[driving.shaft]
                try:
                    geometry = mesh_geometry(mesh, self._member(driving), self._member(driven), int(np.sign(ratio)))
                except InputError as error:
                    raise InputError(f"meshes.{name}: {error}") from None
                speed = geometry.driven_rotation * abs(ratio) * driving.teeth / driven.teeth
                if not np.isclose(ratios.setdefault(driven.shaft, speed), speed, rtol=1e-9):
                    raise InputError(
                        f"meshes.{name} turns shaft {driven.shaft!r} at another speed than another mesh does; "
                        "a train cannot have two speeds on one shaft"
                    )
                geometries[name] = geometry
                self._couple(ratios)
        return geometries, ratios

    def _couple(self, ratios: dict[str, float]) -> None:
        """Give shafts that are coupled to turning ones the same speed."""
        links = [
            (coupling.shaft, coupling.to_shaft) for coupling in self.couplings.values() if coupling.to_shaft is not None
        ]
        for a, b in [*links, *((b, a) for a, b in links)] * len(links):
            if a in ratios and b not in ratios:
                sense = np.sign(self.shafts[a].rotation[:, 2] @ self.shafts[b].rotation[:, 2])
                ratios[b] = ratios[a] * float(sense)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Transmission) and self.model_dump() == other.model_dump()

    def __hash__(self) -> int:
        return hash(self.model_dump_json())

    def _member(self, gear: Gear) -> PairMember:
        return PairMember(teeth=gear.teeth, axis=self.shafts[gear.shaft].rotation[:, 2], apex=gear.apex)

    @property
    def drive_shaft(self) -> str:
        """Name of the shaft to which the operating point refers."""
        operating = self.operating
        return operating.shaft or self.couplings[operating.drive or ""].shaft

    @property
    def geometries(self) -> dict[str, MeshGeometry]:
        """Geometry of each mesh."""
        return self._solved[0]

    def ratio(self, shaft: str) -> float:
        """Signed speed of a shaft about its own z axis per speed of the drive's; 0 for one that no mesh drives."""
        return self._solved[1].get(shaft, 0.0)

    def speed(self, shaft: str) -> float:
        """Signed speed of a shaft about its own z axis, rad/s; 0 for one that no mesh drives."""
        return self.ratio(shaft) * self.operating.speed_rpm * 2 * np.pi / 60

    def mesh_frequency(self, mesh: str) -> float:
        """Mesh frequency, Hz."""
        gear = self.gears[self.meshes[mesh].driving]
        ratio = abs(self._solved[1][gear.shaft])
        return ratio * self.operating.speed_rpm * gear.teeth / 60

    @property
    def unbalanced(self) -> tuple[str, ...]:
        """Shafts with a gear or disk that has an unbalance."""
        bodies = (*self.gears.values(), *self.disks.values())
        return tuple(name for name in self.shafts if any(body.shaft == name and body.unbalance for body in bodies))

    def gear_body(self, name: str) -> Body:
        """Inertia of a gear."""
        gear = self.gears[name]
        if gear.body is not None:
            return gear.body
        mesh = self.meshes_of(name)[0]
        radius = self.geometries[mesh].radii[0 if self.meshes[mesh].driving == name else 1]
        return gear.inertia(self.materials[gear.material or ""].density, radius)

    def disk_body(self, name: str) -> Body:
        """Inertia of a disk."""
        disk = self.disks[name]
        return disk.inertia(self.materials[disk.material].density if disk.material else 0.0)

    def meshes_of(self, gear: str) -> list[str]:
        """Return the names of the meshes in which a gear takes part.

        Raises
        ------
        InputError
            If the rig has no such gear.
        """
        for sentence in _missing("gear", gear, self.gears):
            raise InputError(f"rig {self.name!r}: {sentence}")
        return [name for name, mesh in self.meshes.items() if gear in (mesh.driving, mesh.driven)]

    def mate(self, gear: str) -> str:
        """Name of the gear that meshes with a gear, in its first mesh."""
        mesh = self.meshes[self.meshes_of(gear)[0]]
        return mesh.driven if mesh.driving == gear else mesh.driving

    def turns_exactly(self, gear: str) -> bool:
        """Whether moving the damage by a tooth only turns the response: one mesh in the rig, on that gear."""
        return len(self.meshes) == 1 and len(self.meshes_of(gear)) == 1

    def path(self, dotted: str) -> tuple[str, ...]:
        """The full path of a parameter: ``pinion.teeth`` is ``gears.pinion.teeth``.

        The first word is a section of the rig or the name of a part; gears come before other parts of the same name.

        Raises
        ------
        InputError
            If it names no numeric field.
        """
        return number_path(self, dotted)

    def value(self, dotted: str) -> float:
        """Value of a numeric parameter by its dotted path."""
        return float(value_at(self, self.path(dotted), dotted))

    def replace(self, values: Mapping[str, float]) -> "Transmission":
        """The rig with other values at dotted paths, checked again; what is assumed of them stays.

        Raises
        ------
        InputError
            If a path names no numeric field, or a value breaks a rule.
        """
        if not values:
            return self
        return transmission_of(replaced(self, values), owner=f"rig {self.name!r} with {dict(values)}")

    @cached_property
    def assumptions(self) -> Assumptions:
        """Ranges, choices and ties of the rig's numbers, by full dotted path, in order of dependence.

        Examples
        --------
        >>> import sigdb
        >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
        >>> str(rig.assumptions["meshes.main.stiffness"])
        '1.3e+08 to 4.5e+08, log'
        """
        return Assumptions.of(self)

    def with_assumed(self, values: Mapping[str, Choice]) -> "Transmission":
        """The rig with other values inside what is assumed of them, checked again; ties follow.

        Parameters
        ----------
        values
            By dotted path: a number in its range (a multiple of the other number, where the range is of one), or one of
            the choices, a table by its ``kind``. Numbers that it does not name stay, or keep their multiple.

        Raises
        ------
        InputError
            If nothing is assumed of a number, it is tied, or the value is outside its range or breaks a rule.
        """
        data = self.assumptions.applied(self, values)
        return transmission_of(data, owner=f"rig {self.name!r} with other assumed numbers")

    def to_toml(self) -> str:
        """Return the text of a rig file, which :func:`load_transmission` reads as this rig."""
        return tomli_w.dumps(_stated(self.model_dump()), multiline_strings=True)


def _stated(value: Any) -> Any:
    """Return a value without the fields that are None and the tables and lists that are empty."""
    if isinstance(value, dict):
        stated = {name: _stated(item) for name, item in value.items()}
        return {name: item for name, item in stated.items() if item is not None and item != {} and item != []}
    return [_stated(item) for item in value] if isinstance(value, tuple | list) else value


def transmission_of(data: Mapping[str, Any], *, owner: str) -> Transmission:
    """Return the rig of the fields of a rig file.

    Raises
    ------
    InputError
        If they break a rule; numbers outside their usual range are named too, each once.
    """
    try:
        return validated(Transmission, data, owner=owner)
    except InputError as error:
        further = [text for text in unusual_numbers(data) if text.split(" = ")[0] not in str(error)]
        raise InputError("\n".join([str(error), *(f"{owner}: {text}" for text in further)])) from None


def _missing(key: str, name: str | None, names: Any) -> Iterator[str]:
    if name is not None and name not in names:
        yield f"{key} = {name!r} does not exist; {_listed(names)}"


def _listed(names: Any) -> str:
    return f"known: {', '.join(names)}" if names else "the rig has none"
