"""The plan of a sweep: a pure function of the recipe, and arithmetic from a row's id to its case.

Templates are the distinct cases, with the damage at tooth 1 where a turn is exact. A segment is one template with the
teeth, measurements, specimens and noise draws that it is stored for; rows are numbered through the segments in order.
"""

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.fields import validated
from sigdb.core.streams import NOISE_BLOCK
from sigdb.database.manifest import FORMAT
from sigdb.dynamics.period import common_period, damaged_gear
from sigdb.measurement import Measurement, tooth_cycle
from sigdb.signature.settings import Signature
from sigdb.sweep.design import Design, teeth_of
from sigdb.transmission import Damage, ToothDamage, Transmission
from sigdb.transmission.damage import FLAW_FIELDS, FLAWS, preset_teeth
from sigdb.transmission.mesh_stiffness import damaged_profile

PART_TEMPLATES = 64
_LEAST_PART, _GREATEST_PART, _PARTS_WANTED = 2048, 32768, 16


@dataclass(frozen=True, kw_only=True)
class RigPoint:
    """A rig at one combination of swept values, and the revolutions after which all its meshes repeat."""

    values: dict[str, float]
    rig: Transmission
    teeth: int
    mate_teeth: int
    revolutions: int


@dataclass(frozen=True, kw_only=True)
class TemplateCase:
    """A distinct case: a rig point and a damage, or none."""

    rig_point: int
    damage: Damage


@dataclass(frozen=True, kw_only=True)
class Segment:
    """Rows of one template: the product of teeth, measurements, specimens and draws, the last fastest."""

    template: int
    teeth: tuple[int, ...]
    measurements: tuple[Measurement, ...]
    specimens: int
    draws: int

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of teeth, measurements, specimens and draws."""
        return len(self.teeth), len(self.measurements), self.specimens, self.draws

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(np.prod(self.shape))


@dataclass(frozen=True, kw_only=True)
class Plan:
    """All that a sweep will do, before it does it; made by :func:`make_plan`."""

    design: Design
    measurement: Measurement
    signature: Signature
    rig: Transmission
    gear: str
    sensors: tuple[str, ...]
    rig_points: tuple[RigPoint, ...]
    templates: tuple[TemplateCase, ...]
    segments: tuple[Segment, ...]

    @cached_property
    def _first(self) -> np.ndarray:
        """First id of each segment, and the number of rows at the end."""
        return np.concatenate([[0], np.cumsum([segment.rows for segment in self.segments])])

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self._first[-1])

    @property
    def part_rows(self) -> int:
        """Rows in a part: fixed by the number of rows alone, whole noise blocks, some parts for every worker."""
        wanted = 1 << max(0, (self.rows // _PARTS_WANTED - 1)).bit_length()
        return min(max(wanted, _LEAST_PART), _GREATEST_PART)

    @property
    def row_parts(self) -> int:
        """Number of parts of rows."""
        return -(-self.rows // self.part_rows)

    @property
    def template_parts(self) -> int:
        """Number of parts of templates."""
        return -(-len(self.templates) // PART_TEMPLATES)

    @property
    def swept(self) -> tuple[str, ...]:
        """Dotted paths of the rig's swept parameters that have no column of their own."""
        own = {"operating.speed_rpm", "operating.torque", f"{self.gear}.teeth", f"gears.{self.gear}.teeth"}
        return tuple(dict.fromkeys(path for point in self.rig_points for path in point.values if path not in own))

    @cached_property
    def damage_fields(self) -> tuple[str, ...]:
        """Fields of a tooth's damage that have a column: those of its geometry only where a case has such damage."""
        used = {size for case in self.templates for size in case.damage.flaws}
        flaws = (name for size, beside in FLAWS.items() for name in (size, *beside) if size in used)
        return (*(name for name in ToothDamage.model_fields if name not in FLAW_FIELDS), *flaws)

    @property
    def seed(self) -> int:
        """Seed of specimens and noise."""
        return self.design.seed

    @cached_property
    def resolved(self) -> dict[str, Any]:
        """All that determines the rows, with every default filled in."""
        content: dict[str, Any] = {
            "format": FORMAT,
            "sweep": self.design.model_dump(mode="json", exclude={"rig"}),
            "measurement": self.measurement.model_dump(mode="json"),
            "signature": self.signature.model_dump(mode="json"),
            "rig": self.rig.model_dump(mode="json"),
        }
        content["sweep"]["gear"] = self.gear
        content["sweep"]["patterns"] |= self._presets
        content["signature"]["sensors"] = list(self.sensors)
        return content

    @property
    def _presets(self) -> dict[str, Any]:
        """Patterns that the grids name and the design does not define, on the rig's own tooth count."""
        teeth = self.rig.gears[self.gear].teeth
        named = dict.fromkeys(name for grid in self.design.grid for name in grid.pattern)
        return {
            name: [one.model_dump(mode="json") for one in preset_teeth(name, teeth)]
            for name in named
            if name not in self.design.patterns
        }

    @property
    def hash(self) -> str:
        """SHA-256 of :attr:`resolved`, sources of the rig's numbers and descriptions aside."""
        counted = self.resolved | {"rig": _without(self.resolved["rig"], ("sources", "title"))}
        text = json.dumps(counted, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def case_columns(self, template: int) -> dict[str, Any]:
        """Parameters that a template and its rows share."""
        case = self.templates[template]
        point = self.rig_points[case.rig_point]
        damage = case.damage
        return {
            "gear": self.gear,
            "shaft": self.rig.gears[self.gear].shaft,
            "teeth": point.teeth,
            "speed_rpm": point.rig.operating.speed_rpm,
            "torque": point.rig.operating.torque,
            "damaged_teeth": damage.damaged_teeth,
            **{name: None if damage.each else getattr(damage, name) for name in self.damage_fields},
            "pattern": damage.pattern,
            **{path: point.rig.value(path) for path in self.swept},
        }

    def table(self, start: int, stop: int) -> pd.DataFrame:
        """Rows ``start`` to ``stop - 1`` of the plan: id, template, parameters and labels."""
        frames = []
        for number in range(int(np.searchsorted(self._first, start, side="right")) - 1, len(self.segments)):
            first, segment = int(self._first[number]), self.segments[number]
            if first >= stop:
                break
            ids = np.arange(max(start, first), min(stop, first + segment.rows))
            tooth, measured, specimen, draw = np.unravel_index(ids - first, segment.shape)
            frame = pd.DataFrame({"id": ids, "template": segment.template})
            for name, value in self.case_columns(segment.template).items():
                frame[name] = np.nan if value is None else value
            frame["tooth"] = np.array(segment.teeth)[tooth]
            frame["specimen"], frame["draw"] = specimen, draw
            for name in Measurement.model_fields:
                frame[name] = np.array([getattr(one, name) for one in segment.measurements])[measured]
            frames.append(frame)
        return pd.concat(frames, ignore_index=True)


def make_plan(design: Design, measurement: Measurement, signature: Signature, rig: Transmission) -> Plan:
    """Plan a sweep.

    Raises
    ------
    InputError
        If the design does not fit the rig: the message names the key, the value and what to do.
    """
    gear = damaged_gear(rig, design.gear)
    sensors = signature.sensors or tuple(rig.sensors)
    for sensor in sensors:
        if sensor not in rig.sensors:
            raise InputError(f"signature.sensors: rig {rig.name!r} has no {sensor!r}; known: {', '.join(rig.sensors)}")

    points: dict[Transmission, RigPoint] = {}
    healthy: dict[tuple[int, Measurement], None] = {}
    rows: dict[tuple[int, Damage, int, Measurement], int] = {}
    for block, grid in enumerate(design.grid):
        measured = tuple(_with(measurement, values) for values in grid.measurements())
        for values in grid.rig_points():
            changed = rig.replace(values)
            point = points.setdefault(changed, _rig_point(changed, gear, values))
            number = list(points).index(changed)
            for one in measured:
                _whole_cycles(one, point)
                healthy[number, one] = None
            mesh = changed.meshes[changed.meshes_of(gear)[0]]
            for damage in grid.damages(design.patterns, gear, point.teeth):
                for of_tooth in damage.on_teeth(point.teeth).values():
                    damaged_profile(mesh.profile, of_tooth, point.teeth, driving=gear == mesh.driving)
                for tooth, one in itertools.product(teeth_of(grid, point.teeth, damage), measured):
                    placed = damage if rig.turns_exactly(gear) else damage.model_copy(update={"tooth": tooth})
                    # A case that grids share belongs to the first.
                    rows.setdefault((number, placed, tooth, one), block)

    wanted: dict[tuple[int, int, Damage], list[tuple[int, Measurement]]] = {}
    for (number, damage, tooth, one), block in rows.items():
        wanted.setdefault((block, number, damage), []).append((tooth, one))
    cases = dict.fromkeys((number, damage) for _, number, damage in wanted)
    templates = [(number, Damage(gear=gear)) for number in range(len(points))] + list(cases)
    order = {case: i for i, case in enumerate(sorted(templates, key=lambda case: case[0]))}
    segments = [
        Segment(
            template=order[number, Damage(gear=gear)],
            teeth=(0,),
            measurements=(one,),
            specimens=design.specimens,
            draws=design.healthy,
        )
        for number, one in healthy
        if design.healthy
    ] + [
        Segment(
            template=order[number, damage],
            teeth=teeth,
            measurements=measured,
            specimens=design.specimens,
            draws=design.draws,
        )
        for (_, number, damage), places in wanted.items()
        for teeth, measured in _rectangles(places)
    ]
    if not segments:
        raise InputError(
            "the sweep has no rows: no grid damages anything and healthy = 0; give a loss, a shift or healthy"
        )
    return Plan(
        design=design,
        measurement=measurement,
        signature=signature,
        rig=rig,
        gear=gear,
        sensors=sensors,
        rig_points=tuple(points.values()),
        templates=tuple(TemplateCase(rig_point=number, damage=damage) for number, damage in order),
        segments=tuple(segments),
    )


assert _LEAST_PART % NOISE_BLOCK == 0


def _rectangles(
    cases: Iterable[tuple[int, Measurement]],
) -> Iterator[tuple[tuple[int, ...], tuple[Measurement, ...]]]:
    """Pairs of tooth and measurement as products of teeth and measurements: one product for a plain grid."""
    by_tooth: dict[int, tuple[Measurement, ...]] = {}
    for tooth, one in cases:
        by_tooth[tooth] = (*by_tooth.get(tooth, ()), one)
    for measured, teeth in itertools.groupby(by_tooth, key=by_tooth.__getitem__):
        yield tuple(teeth), measured


def _rig_point(changed: Transmission, gear: str, values: dict[str, float]) -> RigPoint:
    return RigPoint(
        values=values,
        rig=changed,
        teeth=changed.gears[gear].teeth,
        mate_teeth=changed.gears[changed.mate(gear)].teeth,
        revolutions=common_period(changed, gear)[0],
    )


def _with(measurement: Measurement, values: dict[str, float]) -> Measurement:
    return validated(Measurement, measurement.model_dump() | values, owner="sweep.grid")


def _whole_cycles(measurement: Measurement, point: RigPoint) -> None:
    cycle = math.lcm(tooth_cycle(point.teeth, point.mate_teeth), point.revolutions)
    if measurement.averages % cycle:
        near = max(1, round(measurement.averages / cycle)) * cycle
        raise InputError(
            f"measurement.averages = {measurement.averages} is not a whole number of tooth cycles: the same teeth of "
            f"{point.teeth} and {point.mate_teeth} meet every {cycle} revolutions; use for example {near}"
        )


def _without(value: Any, keys: tuple[str, ...]) -> Any:
    if isinstance(value, dict):
        return {key: _without(item, keys) for key, item in value.items() if key not in keys}
    if isinstance(value, list):
        return [_without(item, keys) for item in value]
    return value
