"""The tables of a rig file whose numbers follow from what is known of a machine, each with its source and range."""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

from sigdb.transmission.known.known_numbers import KnownNumbers
from sigdb.transmission.known.shaft_layout import ShaftLayout, shaft_layout
from sigdb.transmission.known.stage_size import (
    PRESSURE_ANGLE_DEG,
    StageSize,
    bearing_stiffness,
    disk_mass,
    machine_inertia,
    rounded,
    size_stage,
)
from sigdb.transmission.mesh.geometry_profiles import EnergyMethod, Iso6336
from sigdb.transmission.parts.gears import Gear, Mesh, Operating, ProfileError
from sigdb.transmission.parts.sensors import Sensor
from sigdb.transmission.parts.shafts import Material, Segment, Shaft
from sigdb.transmission.parts.supports import Bearing, CasingMode, Coupling
from sigdb.transmission.rig import Transmission
from sigdb.transmission.summary.rig_text import Table

_STATED = "derived: as stated to new-rig"
_STEEL = "published: EN 1993-1-1 and EN 1991-1-1, steel"
_PLACE = "derived: its place on the shaft"
_AXIS = [0.0, 0.0, 1.0]
_GRAVITY = 9.81
_MOST_PER_BORE = 5
"""Pitch diameters per diameter of the shaft, beyond which a gear has a hub."""


def spread(value: float, low: float, high: float, *, scale: str = "log") -> dict[str, Any]:
    """Return a range from one part of a value to another."""
    return {"low": rounded(low * value), "high": rounded(high * value), "scale": scale}


class RigTables:
    """The tables of a rig with known tooth counts, speed and torque, and perhaps known modules.

    Parameters
    ----------
    numbers
        The known numbers.
    name
        Name of the rig.
    energy_method
        Whether the mesh stiffness follows from the shape of the teeth by the energy method.
    """

    def __init__(self, numbers: KnownNumbers, name: str, *, energy_method: bool) -> None:
        self.numbers, self.name, self.energy_method = numbers, name, energy_method
        self.single = len(numbers.teeth) == 1

    @cached_property
    def stages(self) -> list[StageSize]:
        """Sizes of the stages."""
        sizes, torque = [], self.numbers.torque
        for i, teeth in enumerate(self.numbers.teeth):
            label = "new-rig" if self.single else f"new-rig: stage {i + 1}"
            sizes.append(size_stage(teeth, torque, self.numbers.helix_angle_deg, self.numbers.module_of(i), label))
            torque *= teeth[1] / teeth[0]
        return sizes

    @cached_property
    def gears(self) -> list[tuple[str, str]]:
        """Names of the driving and the driven gear of each stage."""
        names = [("pinion", "wheel") if z1 <= z2 else ("wheel", "pinion") for z1, z2 in self.numbers.teeth]
        return names if self.single else [(f"{a}-{i}", f"{b}-{i}") for i, (a, b) in enumerate(names, 1)]

    @cached_property
    def meshes(self) -> list[str]:
        """Names of the meshes."""
        return ["main"] if self.single else [f"stage-{i}" for i in range(1, len(self.stages) + 1)]

    @cached_property
    def shafts(self) -> list[ShaftLayout]:
        """Layouts of the shafts, that of the drive first."""
        names = [f"{name}-shaft" for name in self.gears[0]] if self.single else []
        names = names or [f"shaft-{i}" for i in range(1, len(self.stages) + 2)]
        return [shaft_layout(name, i, self.stages) for i, name in enumerate(names)]

    def tables(self) -> Iterator[Table]:
        """Yield the tables, that of the top first."""
        yield self._top()
        yield self._operating()
        yield self._steel()
        for shaft in self.shafts:
            yield from self._shaft(shaft)
        for i in range(len(self.stages)):
            yield from self._gears(i)
        for i in range(len(self.stages)):
            yield from self._mesh(i)
        yield from self._machines()
        for shaft in self.shafts:
            yield from self._bearings(shaft)
        yield from self._casing()
        yield from self._sensors()

    def _top(self) -> Table:
        ratios = ", ".join(f"{z1}/{z2}" for z1, z2 in self.numbers.teeth)
        kind = "helical" if self.numbers.helix_angle_deg else "spur"
        count = {1: "A", 2: "Two stages of", 3: "Three stages of"}[len(self.stages)]
        title = f"{count} {kind} {'pair' if self.single else 'pairs'}, {ratios} teeth"
        return Table(
            name="",
            section=Transmission,
            values={"name": self.name, "title": title, "damping_ratio": 0.04},
            sources={"damping_ratio": "assumed: 3 to 6 % is usual for geared rotors on rolling bearings in oil"},
            assumed={"damping_ratio": {"low": 0.03, "high": 0.06, "scale": "log"}},
        )

    def _operating(self) -> Table:
        values = {"drive": "motor", "load": "brake", "speed_rpm": self.numbers.speed_rpm, "torque": self.numbers.torque}
        return Table(
            name="operating", section=Operating, values=values, sources={"speed_rpm": _STATED, "torque": _STATED}
        )

    def _steel(self) -> Table:
        values = {"density": 7850.0, "young_modulus": 2.1e11, "shear_modulus": 8.1e10}
        return Table(name="materials.steel", section=Material, values=values, sources=dict.fromkeys(values, _STEEL))

    def _shaft(self, shaft: ShaftLayout) -> Iterator[Table]:
        yield Table(
            name=f"shafts.{shaft.name}",
            section=Shaft,
            values={"axis": _AXIS, "material": "steel"},
            sources={"axis": "derived: all shafts are parallel"},
        )
        for i, (length, reason) in enumerate(shaft.segments):
            first = f"shafts.{shaft.name}.segments.0.outer_diameter"
            yield Table(
                name=f"[shafts.{shaft.name}.segments]",
                section=Segment,
                values={"length": length, "outer_diameter": shaft.diameter, "elements": 2},
                sources={
                    "length": f"assumed: rule {reason}",
                    "outer_diameter": shaft.reason if i == 0 else "assumed: the same along the shaft",
                    "elements": "derived: two elements a segment are no longer than twice the diameter",
                },
                assumed={
                    "length": spread(length, 0.7, 1.5),
                    "outer_diameter": self._diameter_range(shaft) if i == 0 else {"as": first},
                },
            )

    def _diameter_range(self, shaft: ShaftLayout) -> dict[str, Any]:
        within = spread(shaft.diameter, 0.75, min(1.4, shaft.room / shaft.diameter))
        return self._multiple(within, shaft.narrowest)

    def _multiple(self, within: dict[str, Any], stage: int) -> dict[str, Any]:
        """Return a range of a length as one of multiples of a stage's module, where that has a range itself."""
        if self.numbers.module is not None:
            return within
        module = self.stages[stage].transverse_module
        ends = {end: rounded(within[end] / module) for end in ("low", "high")}
        return within | ends | {"of": f"meshes.{self.meshes[stage]}.module"}

    def _gears(self, stage: int) -> Iterator[Table]:
        for member, name in enumerate(self.gears[stage]):
            shaft = self.shafts[stage + member]
            width = f"meshes.{self.meshes[stage]}.face_width"
            bore, held, reason = self._bore(stage, member, shaft)
            yield Table(
                name=f"gears.{name}",
                section=Gear,
                values={
                    "shaft": shaft.name,
                    "node": shaft.gear_nodes[stage],
                    "teeth": self.numbers.teeth[stage][member],
                    "body_length": self.stages[stage].face_width,
                    "bore": bore,
                    "material": "steel",
                },
                sources={
                    "node": _PLACE,
                    "teeth": _STATED,
                    "body_length": "assumed: a solid body as wide as the teeth",
                    "bore": reason,
                },
                assumed={
                    "body_length": {"as": width},
                    "bore": held,
                },
            )

    def _bore(self, stage: int, member: int, shaft: ShaftLayout) -> tuple[float, dict[str, Any], str]:
        """Return the bore of a gear, its range, and its source."""
        diameter = self.stages[stage].diameters[member]
        if self.energy_method and diameter > _MOST_PER_BORE * shaft.diameter:  # the method holds to 7 of the root's
            hub = rounded(0.2 * diameter)
            return hub, self._multiple(spread(hub, 0.75, 1.4), stage), "assumed: rule of a hub of 0.2 pitch diameters"
        tied = {"as": f"shafts.{shaft.name}.segments.0.outer_diameter"}
        return shaft.diameter, tied, "assumed: the diameter of the shaft"

    def _mesh(self, stage: int) -> Iterator[Table]:
        size, name = self.stages[stage], self.meshes[stage]
        helix, backlash = self.numbers.helix_angle_deg, rounded(0.05 * size.module)
        values: dict[str, Any] = {
            "driving": self.gears[stage][0],
            "driven": self.gears[stage][1],
            "module": size.transverse_module,
            "face_width": size.face_width,
            "pressure_angle_deg": PRESSURE_ANGLE_DEG,
            "line_of_centres": [1.0, 0.0, 0.0],
            "backlash": backlash,
            "damping": size.damping,
        }
        sources = {
            "module": self._module_source(size),
            "stiffness": "derived: that of the profile",
            "face_width": "assumed: rule of 10 to 25 modules, by 250 MPa of bending at the root"
            + (", and a contact ratio below 2.7" if helix else ""),
            "pressure_angle_deg": "published: ISO 53, the standard basic rack",
            "line_of_centres": "derived: the shafts stand side by side",
            "backlash": "assumed: rule of 0.05 modules",
            "damping": "assumed: a tenth of the critical one of the gears as solid disks; 0.03 to 0.17 is usual, after "
            "Kasuba and Evans (1981)",
        }
        width = {"low": size.least_width, "high": size.most_width, "scale": "log"}
        assumed: dict[str, Mapping[str, Any]] = {
            "face_width": self._multiple(width, stage),
            "backlash": spread(backlash, 0.4, 2.0),
            "damping": spread(size.damping, 0.3, 1.7),
        }
        if self.numbers.module is None:
            assumed = {"module": spread(size.transverse_module, 0.7, 1.6)} | assumed
        if helix:
            # Next to each other on a shaft, the axial forces of a wheel and the next pinion are opposite.
            values |= {"helix_angle_deg": helix, "hand": ("right", "left")[stage % 2]}
            sources |= {"helix_angle_deg": _STATED, "hand": "assumed: either hand"}
            tied = {"as": f"meshes.{self.meshes[0]}.hand"} if stage else {}
            assumed["hand"] = {"choices": ["right", "left"] if stage % 2 == 0 else ["left", "right"]} | tied
            if stage:
                sources["hand"] = "assumed: so that the axial forces on a shaft are opposite"
        yield Table(name=f"meshes.{name}", section=Mesh, values=values, sources=sources, assumed=assumed)
        yield self._profile(name)
        yield Table(
            name=f"meshes.{name}.profile_error",
            section=ProfileError,
            values={"amplitude": size.relief},
            sources={
                "amplitude": "assumed: rule of tip relief by the deflection of one pair of teeth, after ISO/TR 15144-1"
            },
            assumed={"amplitude": spread(size.relief, 0.5, 2.0)},
        )

    def _module_source(self, size: StageSize) -> str:
        if self.numbers.module is None:
            return (
                f"assumed: rule of modules after ISO 54, series I, {size.bending / 1e6:.0f} MPa of bending at the root"
            )
        if self.numbers.helix_angle_deg:
            return f"derived: {size.module * 1e3:g} mm, as stated to new-rig, over the cosine of the helix angle"
        return _STATED

    def _profile(self, mesh: str) -> Table:
        if self.energy_method:
            return Table(
                name=f"meshes.{mesh}.profile",
                section=EnergyMethod,
                values={"kind": "energy-method", "flank": 0.15},
                sources={"flank": "assumed: teeth take their load within a small part of a pass"},
                assumed={"flank": {"low": 0.05, "high": 0.2, "scale": "log"}},
            )
        return Table(
            name=f"meshes.{mesh}.profile",
            section=Iso6336,
            values={"kind": "iso-6336", "flank": 0.15, "blank_factor": 0.95},
            sources={
                "flank": "assumed: teeth take their load within a small part of a pass",
                "blank_factor": "assumed: ISO 6336-1, 1 for solid disks and less for thin webs",
            },
            assumed={
                "flank": {"low": 0.05, "high": 0.2, "scale": "log"},
                "blank_factor": {"low": 0.75, "high": 1.0, "scale": "log"},
            },
        )

    def _machines(self) -> Iterator[Table]:
        last = self.stages[-1]
        ends = (
            ("motor", self.shafts[0], self.numbers.torque),
            ("brake", self.shafts[-1], last.torque * last.teeth[1] / last.teeth[0]),
        )
        for name, shaft, torque in ends:
            stiffness, inertia = rounded(100 * torque), rounded(machine_inertia(torque))
            yield Table(
                name=f"couplings.{name}",
                section=Coupling,
                values={"shaft": shaft.name, "node": shaft.end_node, "stiffness": stiffness, "inertia": inertia},
                sources={
                    "node": _PLACE,
                    "stiffness": "assumed: rule of 50 times the rated torque a radian, rated for twice the torque",
                    "inertia": "assumed: that of a four-pole induction motor of this torque",
                },
                assumed={"stiffness": spread(stiffness, 0.2, 6.0), "inertia": spread(inertia, 0.3, 3.0)},
            )

    def _bearings(self, shaft: ShaftLayout) -> Iterator[Table]:
        weight = _GRAVITY * sum(
            disk_mass(self.stages[stage].diameters[member], self.stages[stage].face_width)
            for stage, member in shaft.members
        )
        load = (weight + sum(self.stages[stage].normal_force for stage, _ in shaft.members)) / 2
        radial = rounded(bearing_stiffness(shaft.diameter, load))
        left = f"{shaft.name.removesuffix('-shaft')}-left"
        for name, node in ((left, 0), (left.replace("-left", "-right"), shaft.right_node)):
            tied = {"as": f"bearings.{left}.stiffness"}
            yield Table(
                name=f"bearings.{name}",
                section=Bearing,
                values={
                    "shaft": shaft.name,
                    "node": node,
                    "seat": name,
                    "stiffness": [radial, radial, rounded(0.4 * radial)],
                },
                sources={
                    "node": _PLACE,
                    "stiffness": f"assumed: after Kraemer (1993), nine balls of 0.3 bores under {load:.3g} N"
                    if name == left
                    else "assumed: as the other bearing of the shaft",
                },
                assumed={"stiffness": spread(radial, 0.4, 2.5) if name == left else tied},
            )

    def _casing(self) -> Iterator[Table]:
        bodies = [disk_mass(diameter, size.face_width) for size in self.stages for diameter in size.diameters] + [
            disk_mass(shaft.diameter, sum(length for length, _ in shaft.segments)) for shaft in self.shafts
        ]
        mass = rounded(1.5 * sum(bodies))
        breadth = sum(sum(size.diameters) for size in self.stages)
        frequency = rounded(min(200 / breadth, 1e4))
        seats = [f"{shaft.name.removesuffix('-shaft')}-{side}" for shaft in self.shafts for side in ("left", "right")]
        for i, direction in enumerate(([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])):
            ranges = {
                "frequency_hz": spread(frequency, 0.5, 2.0),
                "damping_ratio": {"low": 0.01, "high": 0.05, "scale": "log"},
                "modal_mass": spread(mass, 0.5, 2.0),
            }
            yield Table(
                name="[casing.modes]",
                section=CasingMode,
                values={
                    "frequency_hz": frequency,
                    "damping_ratio": 0.02,
                    "modal_mass": mass,
                    "shape": dict.fromkeys(seats, direction),
                },
                sources={
                    "frequency_hz": "assumed: rule of 200 m/s over the breadth of the gears",
                    "damping_ratio": "assumed: bolted castings have 1 to 5 %",
                    "modal_mass": "assumed: rule of 1.5 times the mass of shafts and gears",
                    "shape": f"derived: a rigid casing moves as a whole, {'across' if i == 0 else 'vertically'}",
                },
                assumed=ranges if i == 0 else {name: {"as": f"casing.modes.0.{name}"} for name in ranges},
            )

    def _sensors(self) -> Iterator[Table]:
        gear, shaft = self.gears[0][0], self.shafts[0].name
        places = ((f"{gear}-vertical", {"gear": gear}),
                  ("housing-vertical", {"point": f"{shaft.removesuffix('-shaft')}-left"}))  # fmt: skip
        for name, place in places:
            yield Table(
                name=f"sensors.{name}",
                section=Sensor,
                values=place | {"direction": [0.0, 1.0, 0.0], "quantity": "acceleration"},
                sources={"direction": "derived: across the line of centres"},
            )
