"""Plans from designs: the grids of a design, checked against the rig, become templates and runs of rows."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from sigdb.core import BoolArray, DatabaseError, FloatArray, InputError, IntArray, Problems, validated
from sigdb.dynamics import check_in_one_mesh, damaged_gear, solver_named
from sigdb.measurement import MeasurementSettings, NuisanceSettings, check_revolutions
from sigdb.signature import SignatureSettings
from sigdb.sweep.design.axes import LIFE_AXES, MEASUREMENT_AXES
from sigdb.sweep.design.settings import WIDEST, SweepLimits, SweepSettings
from sigdb.sweep.plan.crossing import AxisArray, Crossing, combinations, grid_name, joint_points
from sigdb.sweep.plan.damages import Damages, Pattern, default_of
from sigdb.sweep.plan.layout import Blocks, consecutive, distinct, lay_out
from sigdb.sweep.plan.members import members_of, with_members
from sigdb.sweep.plan.plan import Plan, rows_of_a_part
from sigdb.sweep.plan.resolved import same_content, without_sources
from sigdb.sweep.plan.rig_points import RigPoints, check_whole_cycles, rig_points
from sigdb.transmission import PRESETS, AnyProfile, ToothDamage, Transmission, damaged_profile, preset_teeth


def make_plan(
    design: SweepSettings,
    measurement: MeasurementSettings,
    signature: SignatureSettings,
    rig: Transmission,
    *,
    limits: SweepLimits = WIDEST,
    first_row_part: int = 0,
    first_template_part: int = 0,
    part_rows: int | None = None,
    base_fields: Sequence[str] = (),
    nuisance: NuisanceSettings | None = None,
) -> Plan:
    """Return the plan of a sweep.

    Parameters
    ----------
    design : SweepSettings
        Section ``[sweep]`` of a recipe.
    measurement : MeasurementSettings
        Section ``[measurement]``.
    signature : SignatureSettings
        Section ``[signature]``.
    rig : Transmission
        The rig that the design is for.
    limits : SweepLimits, optional
        Section ``[limits]``; the widest that a recipe may have if left out.
    first_row_part, first_template_part : int
        Numbers of the first parts, for an extension of a database.
    part_rows : int, optional
        Rows in a part of the database, for an extension.
    base_fields : sequence of str
        Fields of damage that the database has columns for, for an extension.
    nuisance : NuisanceSettings, optional
        Section ``[nuisance]``; no nuisances if left out.

    Returns
    -------
    Plan
        All templates and rows, by arithmetic: a plan of millions of rows takes little memory.

    Raises
    ------
    InputError
        If the design does not fit the rig or exceeds a limit: the message has a line for each problem, with the key,
        the value and what to do. Grids count from 1.
    """
    for name in ("specimens", "draws", "healthy"):
        limits.check("rows", getattr(design, name), owner="the sweep", what=f"rows by {name}")
    design, gear = with_members(design, rig), damaged_gear(rig, design.gear)
    check_in_one_mesh(rig, gear)
    sensors = signature.sensors or tuple(rig.sensors)
    problems = Problems()
    for sensor in sensors:
        if sensor not in rig.sensors:
            problems.add(f"signature.sensors: rig {rig.name!r} has no {sensor!r}; known: {', '.join(rig.sensors)}")
    crossings = []
    for number in range(len(design.grid)):
        with problems.collect():
            crossings.append(_crossing(design, number, rig, limits))
    if len(crossings) < len(design.grid):
        problems.raise_any()
    with problems.collect(needed=True):
        points, numbers = rig_points(
            rig,
            gear,
            [(crossing.owner, crossing.rig_values, crossing.places) for crossing in crossings],
            members=members_of(design, rig),
            most_builds=partial(limits.check, "rigs", owner="the sweep", what="rigs to build"),
        )
        samples = int(points.teeth.max()) * signature.samples_per_tooth
        limits.check("samples", samples, owner=f"an average of {points.teeth.max()} teeth", what="samples")
    gathered = _GridCases(design, measurement, points, gear)
    for crossing, rigs in zip(crossings, numbers, strict=True):
        with problems.collect():
            gathered.add(crossing, rigs)
    if len(gathered.pieces) < len(crossings):
        problems.raise_any()
    blocks, damages, teeth = gathered.blocks()
    _check_damages(damages, blocks, points, gear, problems)
    measurements, measured, of_no_life = gathered.measurements()
    with problems.collect():
        _check_specimens(design, signature, measurements["index_error"])
    rig_measured = _rig_measured(gathered, of_no_life)
    with problems.collect():
        check_whole_cycles(measurements["averages"].astype(np.int64), rig_measured, points)
        check_revolutions(nuisance or NuisanceSettings(), measurements["averages"])
    problems.raise_any()
    damaged = float(np.sum(blocks.tooth_count.astype(float) * blocks.measured_count)) * design.draws
    rows = (damaged + float(len(rig_measured[0])) * design.healthy) * design.specimens
    limits.check("rows", rows, owner="the sweep", what="rows")
    layout = lay_out(
        blocks,
        teeth,
        measured,
        healthy=rig_measured,
        rigs=len(points),
        turns=rig.turns_exactly(gear),
        specimens=design.specimens,
        draws=design.draws,
        healthy_draws=design.healthy,
    )
    if not layout.row_runs.rows:
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
        rig_points=points,
        templates=layout.templates,
        damages=damages,
        row_runs=layout.row_runs,
        measurements=measurements,
        part_rows=part_rows or rows_of_a_part(layout.row_runs.rows),
        first_row_part=first_row_part,
        first_template_part=first_template_part,
        base_fields=tuple(base_fields),
        nuisance=nuisance or NuisanceSettings(),
    )


def _check_specimens(design: SweepSettings, signature: SignatureSettings, index_errors: FloatArray) -> None:
    """Refuse index errors where a template would hold for one specimen only."""
    if index_errors.any() and not solver_named(design.solver, signature.samples_per_tooth).serves_all_specimens:
        raise InputError(
            f"sweep.solver = {design.solver!r} marches each case for gears without index errors; set index_error = 0 "
            "in [measurement] and in the grids, or leave out the solver"
        )


def _crossing(design: SweepSettings, number: int, rig: Transmission, limits: SweepLimits) -> Crossing:
    owner, grid = grid_name(number), design.grid[number]
    for what, count in (
        ("joint points", grid.joint_points),
        ("combinations of values of the rig", grid.joint_points * combinations(grid.rig.values())),
        ("measurements", combinations(getattr(grid, axis) for axis in MEASUREMENT_AXES)),
    ):
        limits.check("points", count, owner=owner, what=what)
    joint = joint_points(grid, rig, owner=owner, number=number, seed=design.seed)
    crossing = Crossing(owner=owner, grid=grid, joint=joint)
    limits.check("templates", crossing.cases, owner=owner, what="cases of damage")
    return crossing


def _own_patterns(design: SweepSettings, teeth: int) -> dict[str, tuple[ToothDamage, ...]]:
    """Return the patterns of the design, but those equal to the preset of their name, which follows the tooth count."""
    return {
        name: each for name, each in design.patterns.items() if name not in PRESETS or each != preset_teeth(name, teeth)
    }


class _GridCases:
    """The cases of all grids, grid after grid."""

    def __init__(self, design: SweepSettings, measurement: MeasurementSettings, points: RigPoints, gear: str) -> None:
        self.measurement, self.points = measurement, points
        self.defined = _own_patterns(design, points.base.gears[gear].teeth)
        self.patterns: dict[Pattern, int] = {}
        self.pieces: list[dict[str, Any]] = []
        # Each tooth stands at its own number, then come the grids' lists.
        self.teeth: list[IntArray] = [np.arange(points.teeth.max() + 1)]
        self.measured: list[dict[str, FloatArray]] = []
        self.lives = 0
        self.places: list[tuple[IntArray, IntArray, IntArray]] = []

    def add(self, crossing: Crossing, rigs: IntArray) -> None:
        """Add a grid whose places have those rigs."""
        of_gear, cycles = self.points.teeth[rigs], self.points.cycles[rigs]
        measured, start, count = crossing.measurements(self.measurement, cycles)
        start = start + sum(len(columns["averages"]) for columns in self.measured)
        if "life_number" in measured:
            measured["life_number"] += self.lives * (measured["life_number"] > 0)
            self.lives = max(self.lives, int(measured["life_number"].max()))
        self.measured.append(measured)
        self.places.append((rigs, start, count))
        columns, names, n = crossing.damages()
        tooth_start, tooth_count, listed = crossing.teeth(of_gear)
        tooth_start = tooth_start + (sum(map(len, self.teeth)) if len(listed) else 0)
        place = np.repeat(np.arange(len(rigs)), n)
        pattern, alike = self._numbered(names, of_gear[place])
        piece = {
            "grid": np.full(len(place), len(self.pieces)),
            "rig": rigs[place],
            "tooth_start": tooth_start[place],
            # Damage of all teeth alike is one case wherever it begins.
            "tooth_count": np.where(alike, 1, tooth_count[place]),
            "measured_start": start[place],
            "measured_count": count[place],
        }
        self.teeth.append(listed)
        kept = Damages(columns=columns, pattern=pattern, patterns=tuple(self.patterns)).is_damage
        self.pieces.append(
            {
                "blocks": {name: values[kept] for name, values in piece.items()},
                "columns": {axis: values[kept] for axis, values in columns.items()},
                "pattern": pattern[kept],
            }
        )

    def _numbered(self, names: AxisArray | None, teeth: IntArray) -> tuple[IntArray, BoolArray]:
        """Return the number of each case's pattern, 0 for none, and whether it damages all teeth of the gear alike."""
        if names is None:
            return np.zeros(len(teeth), np.int64), np.zeros(len(teeth), bool)
        pairs, first = distinct(names, teeth)
        each = [self._pattern(str(names[at]), int(teeth[at])) for at in first]
        numbers = [self.patterns.setdefault(pattern, len(self.patterns) + 1) for pattern in each]
        alike = [
            len(damages) == teeth[at] and len(set(damages)) == 1 for (_, damages), at in zip(each, first, strict=True)
        ]
        return np.array(numbers)[pairs], np.array(alike)[pairs]

    def _pattern(self, name: str, teeth: int) -> Pattern:
        """Return a pattern on a gear of that many teeth; patterns of the design go before presets."""
        each = self.defined.get(name)
        return name, each if each is not None else preset_teeth(name, teeth)

    def blocks(self) -> tuple[Blocks, Damages, IntArray]:
        """Return all cases, the kinds of damage that they have, and the list of teeth."""
        axes = dict.fromkeys(axis for piece in self.pieces for axis in piece["columns"])
        pattern = np.concatenate([piece["pattern"] for piece in self.pieces])
        columns = {
            axis: np.concatenate(
                [piece["columns"].get(axis, np.full(len(piece["pattern"]), default_of(axis))) for piece in self.pieces]
            )
            for axis in axes
        }
        damage, first = distinct(pattern, *columns.values())
        damages = Damages(
            columns={axis: column[first] for axis, column in columns.items()},
            pattern=pattern[first],
            patterns=tuple(self.patterns),
        )
        whole = {
            name: np.concatenate([piece["blocks"][name] for piece in self.pieces]) for name in self.pieces[0]["blocks"]
        }
        return Blocks(damage=damage, **whole), damages, np.concatenate(self.teeth)

    def measurements(self) -> tuple[dict[str, FloatArray], IntArray, IntArray]:
        """Return the distinct measurements as columns, the number of each in the list, and that of it in no life."""
        columns = {
            name: np.concatenate([columns.get(name, np.zeros(len(columns["averages"]))) for columns in self.measured])
            for name in (
                *MeasurementSettings.model_fields,
                *(LIFE_AXES if any("life_number" in columns for columns in self.measured) else ()),
            )
        }
        n = len(columns["averages"])
        of_no_life = {name: 0 * column if name in LIFE_AXES else column for name, column in columns.items()}
        both = {name: np.concatenate([column, of_no_life[name]]) for name, column in columns.items()}
        codes, first = distinct(*both.values())
        unique = {name: column[first] for name, column in both.items()}
        return unique | {"averages": unique["averages"].astype(np.int64)}, codes[:n], codes[n:]


def _rig_measured(gathered: _GridCases, measured: IntArray) -> tuple[IntArray, IntArray]:
    """Return the numbers of each rig and each measurement that a grid has for it, each combination once."""
    rigs, start, count = (np.concatenate(column) for column in zip(*gathered.places, strict=True))
    _, once = distinct(rigs, start, count)
    rig = np.repeat(rigs[once], count[once])
    measurement = measured[consecutive(start[once], count[once])]
    _, first = distinct(rig, measurement)
    return rig[first], measurement[first]


def _check_damages(damages: Damages, blocks: Blocks, points: RigPoints, gear: str, problems: Problems) -> None:
    """Collect the first damage of each grid that does not fit its gear.

    Each kind of damage is checked once for each tooth count.
    """
    wrong: set[int] = set()
    teeth = points.teeth[blocks.rig]
    _, first = distinct(blocks.damage, teeth)
    damage, count = blocks.damage[first], teeth[first]
    shift = np.abs(damages.column("phase_shift_deg")) * (damages.pattern == 0)
    # A shift at the limit is checked too.
    wide = shift[damage] * count > 180 * (1 - 1e-9)
    for at in np.flatnonzero((damages.damaged_teeth[damage] > count) | wide | (damages.pattern[damage] > 0)):
        with _naming_grid(int(blocks.grid[first[at]]), wrong, problems):
            damages.damage(int(damage[at]), gear, 1).on_teeth(int(count[at]))
    if damages.has_geometry.any():
        _check_geometry(damages, blocks.at(damages.has_geometry[blocks.damage]), points, gear, wrong, problems)


def _check_geometry(
    damages: Damages, blocks: Blocks, points: RigPoints, gear: str, wrong: set[int], problems: Problems
) -> None:
    build = points.builds[blocks.rig]
    _, first = distinct(blocks.damage, build)
    profiles: dict[int, tuple[AnyProfile, bool]] = {}
    for at in first:
        point = points[int(blocks.rig[at])]
        if build[at] not in profiles:
            mesh = point.rig.meshes[point.rig.meshes_of(gear)[0]]
            profiles[build[at]] = mesh.profile, gear == mesh.driving
        profile, driving = profiles[build[at]]
        with _naming_grid(int(blocks.grid[at]), wrong, problems):
            for of_tooth in damages.teeth(int(blocks.damage[at])):
                damaged_profile(profile, of_tooth, point.teeth, driving=driving)


@contextmanager
def _naming_grid(number: int, wrong: set[int], problems: Problems) -> Iterator[None]:
    """Collect a problem with the damage of a grid, named, if it is the grid's first."""
    try:
        yield
    except InputError as error:
        if number not in wrong:
            problems.add(f"{grid_name(number)}: {error}")
        wrong.add(number)


_OTHER_VERSION = "it was made by another version of sigdb; use that version, or make the database again"


def plan_from(resolved: dict[str, Any]) -> Plan:
    """Return the plan of a database from its resolved recipe, as ``sigdb.toml`` holds it.

    Parameters
    ----------
    resolved : dict
        The content of :attr:`Plan.resolved`; keys that hold None may be left out.

    Returns
    -------
    Plan
        The plan that the database was made by.

    Raises
    ------
    DatabaseError
        If the plan would be another: another version of sigdb resolved the recipe.

    Examples
    --------
    >>> import sigdb
    >>> from sigdb.measurement import MeasurementSettings
    >>> from sigdb.signature.settings import SignatureSettings
    >>> from sigdb.sweep import SweepSettings, make_plan, plan_from
    >>> design = SweepSettings(rig="nasa-spiral-bevel", grid=[{"stiffness_loss": [0.2, 0.4]}])
    >>> plan = make_plan(design, MeasurementSettings(), SignatureSettings(), sigdb.load_transmission(design.rig))
    >>> plan_from(plan.resolved).hash == plan.hash
    True
    """
    try:
        plan = _rebuild(resolved)
    except (InputError, KeyError, TypeError) as error:
        raise DatabaseError(
            f"the plan cannot be made again from the resolved recipe ({error}); {_OTHER_VERSION}"
        ) from None
    if not same_content(without_sources(plan.resolved), without_sources(resolved)):
        raise DatabaseError(f"the plan made again from the resolved recipe is another one; {_OTHER_VERSION}")
    return plan


def _rebuild(resolved: dict[str, Any]) -> Plan:
    owner = "resolved recipe"
    rig = validated(Transmission, resolved["rig"], owner=owner)
    sweep = resolved["sweep"] | {"rig": rig.name} | {key: resolved[key] for key in ("solver",) if key in resolved}
    return make_plan(
        validated(SweepSettings, sweep, owner=owner),
        validated(MeasurementSettings, resolved["measurement"], owner=owner),
        validated(SignatureSettings, resolved["signature"], owner=owner),
        rig,
        **resolved.get("parts", {}),
        nuisance=validated(NuisanceSettings, resolved.get("nuisance", {}), owner=owner),
    )
