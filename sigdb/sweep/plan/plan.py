"""The plan of a sweep: a pure function of the recipe, and arithmetic from a row's id to its case.

Templates are the distinct cases. Their damage is at tooth 1 where a turn is exact. A run of rows is a template with its
teeth, measurements, specimens and noise draws. Rows are numbered through the runs in order. Ids and template numbers
are those of the database: the parts of an extension follow those of the database.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sigdb.core import NOISE_BLOCK, FloatArray, IntArray
from sigdb.database import CaseValue
from sigdb.dynamics import Solver, solver_named
from sigdb.measurement import MeasurementSettings, NuisanceSettings
from sigdb.signature import SignatureSettings
from sigdb.sweep.design.settings import SweepSettings
from sigdb.sweep.plan.damages import WHOLE_DAMAGE_AXES, Damages
from sigdb.sweep.plan.layout import RowRuns, TemplateTable
from sigdb.sweep.plan.resolved import hash_of, resolved_content
from sigdb.sweep.plan.rig_points import RigPoint, RigPoints
from sigdb.transmission import Damage, Transmission

__all__ = ["PART_TEMPLATES", "Plan", "RigPoint", "TemplateCase", "rows_of_a_part"]

CaseArray = FloatArray | IntArray | NDArray[np.object_]
"""Values of a column of cases."""

PART_TEMPLATES = 64
_LEAST_PART, _GREATEST_PART, _PARTS_WANTED = 2048, 32768, 16
assert _LEAST_PART % NOISE_BLOCK == 0


def rows_of_a_part(rows: int) -> int:
    """Return the number of rows in a part: whole noise blocks, fixed by the number of rows alone."""
    wanted = 1 << max(0, (rows // _PARTS_WANTED - 1)).bit_length()
    return min(max(wanted, _LEAST_PART), _GREATEST_PART)


@dataclass(frozen=True, kw_only=True)
class TemplateCase:
    """A distinct case: a rig point and a damage, or none."""

    rig_point: int
    damage: Damage


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Plan of a sweep, made by :func:`make_plan`: every template and row, before any is computed.

    Attributes
    ----------
    design : SweepSettings
        Section ``[sweep]`` of the recipe.
    measurement : MeasurementSettings
        Section ``[measurement]``.
    signature : SignatureSettings
        Section ``[signature]``.
    rig : Transmission
        The rig of the recipe.
    gear : str
        Name of the damaged gear.
    sensors : tuple of str
        Names of the stored sensors.
    rig_points : RigPoints
        The rigs of the sweep.
    templates : TemplateTable
        The distinct cases.
    damages : Damages
        The kinds of damage of the cases.
    row_runs : RowRuns
        The rows.
    measurements : dict of ndarray
        The values of the measurements of the rows.
    part_rows : int
        Number of rows in a part.
    first_row_part, first_template_part : int
        Number of the first part of rows and of templates; 0 except for an extension of a database.
    base_fields : tuple of str
        Fields of damage that the database of an extension has columns for.
    nuisance : NuisanceSettings
        Section ``[nuisance]`` of the recipe.
    """

    design: SweepSettings
    measurement: MeasurementSettings
    signature: SignatureSettings
    rig: Transmission
    gear: str
    sensors: tuple[str, ...]
    rig_points: RigPoints
    templates: TemplateTable
    damages: Damages
    row_runs: RowRuns
    measurements: dict[str, FloatArray]
    part_rows: int
    first_row_part: int = 0
    first_template_part: int = 0
    base_fields: tuple[str, ...] = ()
    nuisance: NuisanceSettings = field(default_factory=NuisanceSettings)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.row_runs.rows

    @property
    def n_templates(self) -> int:
        """Number of templates."""
        return len(self.templates)

    @property
    def row_parts(self) -> int:
        """Number of parts of rows."""
        return -(-self.rows // self.part_rows)

    @property
    def template_parts(self) -> int:
        """Number of parts of templates."""
        return -(-self.n_templates // PART_TEMPLATES)

    @property
    def row_part_numbers(self) -> range:
        """Numbers of the parts of rows in the database."""
        return range(self.first_row_part, self.first_row_part + self.row_parts)

    @property
    def template_part_numbers(self) -> range:
        """Numbers of the parts of templates in the database."""
        return range(self.first_template_part, self.first_template_part + self.template_parts)

    @property
    def parts_settings(self) -> dict[str, int | list[str]]:
        """Numbers and columns of its parts that do not follow from its rows, as in an extension."""
        if self.first_row_part == self.first_template_part == 0 and self.part_rows == rows_of_a_part(self.rows):
            return {}
        return {
            "first_row_part": self.first_row_part,
            "first_template_part": self.first_template_part,
            "part_rows": self.part_rows,
            "base_fields": list(self.base_fields),
        }

    @property
    def first_row(self) -> int:
        """The first id."""
        return self.first_row_part * self.part_rows

    @property
    def first_template(self) -> int:
        """The first template's number."""
        return self.first_template_part * PART_TEMPLATES

    def row_range(self, part: int) -> tuple[int, int]:
        """Return the first id of a part, and the id after its last."""
        start = part * self.part_rows
        return start, min(start + self.part_rows, self.first_row + self.rows)

    def template_range(self, part: int) -> range:
        """Return the numbers of the templates of a part."""
        start = part * PART_TEMPLATES
        return range(start, min(start + PART_TEMPLATES, self.first_template + self.n_templates))

    @property
    def template_numbers(self) -> range:
        """Numbers of all templates."""
        return range(self.first_template, self.first_template + self.n_templates)

    def templates_at(self, rig_point: int) -> range:
        """Return the numbers of the templates of a rig point; the undamaged template is the first."""
        start, stop = np.searchsorted(self.templates.rig, [rig_point, rig_point + 1])
        return range(self.first_template + int(start), self.first_template + int(stop))

    def case(self, number: int) -> TemplateCase:
        """Return the case of a template, by its number."""
        at = number - self.first_template
        damage, tooth = int(self.templates.damage[at]), int(self.templates.tooth[at])
        return TemplateCase(
            rig_point=int(self.templates.rig[at]),
            damage=self.damages.damage(damage, self.gear, tooth) if tooth else Damage(gear=self.gear),
        )

    def cases(self) -> Iterator[TemplateCase]:
        """Yield the cases of all templates, in order."""
        return map(self.case, self.template_numbers)

    @property
    def swept(self) -> tuple[str, ...]:
        """Dotted paths of the rig's swept parameters that have no column of their own."""
        with_column = {("operating", "speed_rpm"), ("operating", "torque"), ("gears", self.gear, "teeth")}
        return tuple(path for path in self.rig_points.swept if self.rig.path(path) not in with_column)

    @cached_property
    def damage_fields(self) -> tuple[str, ...]:
        """Fields of a tooth's damage that have a column: those of its geometry only where a case has such damage."""
        return tuple(dict.fromkeys((*self.base_fields, *self.damages.fields)))

    @property
    def solver(self) -> Solver:
        """The solver that the design names, for the samples of a tooth pass that are stored."""
        return solver_named(self.design.solver, self.signature.samples_per_tooth)

    @property
    def seed(self) -> int:
        """Seed of samples, specimens and noise."""
        return self.design.seed

    @cached_property
    def resolved(self) -> dict[str, Any]:
        """Everything that determines the rows, with every default filled in."""
        return resolved_content(self)

    @cached_property
    def hash(self) -> str:
        """SHA-256 of :attr:`resolved`, sources of the rig's numbers and descriptions aside."""
        return hash_of(self.resolved)

    def case_columns(self, number: int) -> dict[str, CaseValue]:
        """Return the parameters that a template and its rows share, by column."""
        columns = self._case_columns(np.array([number - self.first_template]))
        case = {
            name: values.tolist()[0] if isinstance(values, np.ndarray) else values for name, values in columns.items()
        }
        if case["pattern"]:
            return case | dict.fromkeys(self.damage_fields)
        return case | {name: int(case[name]) for name in WHOLE_DAMAGE_AXES if name in case}

    def _case_columns(self, at: IntArray) -> dict[str, str | CaseArray]:
        """Return columns of templates, counted from this plan's first; a single value where it is the same for all."""
        rig, damage = self.templates.rig[at], self.templates.damage[at]
        of_damage = self._damage_table
        return {
            "gear": self.gear,
            "shaft": self.rig.gears[self.gear].shaft,
            "teeth": self.rig_points.teeth[rig],
            **{name: values[rig] for name, values in self._rig_table.items() if name in ("speed_rpm", "torque")},
            **{name: of_damage[name][damage] for name in ("damaged_teeth", *self.damage_fields, "pattern")},
            **{name: self._rig_table[name][rig] for name in self.swept},
        }

    @cached_property
    def _rig_table(self) -> dict[str, FloatArray]:
        """Columns of the rig points."""
        operating = {name: self.rig_points.parameter(f"operating.{name}") for name in ("speed_rpm", "torque")}
        return operating | {path: self.rig_points.parameter(path) for path in self.swept}

    @cached_property
    def _damage_table(self) -> dict[str, CaseArray]:
        """Columns of the kinds of damage; the last row, which -1 names too, is that of no damage."""
        none = Damage(gear=self.gear)
        patterned = self.damages.pattern > 0
        names = np.array(["", *(name for name, _ in self.damages.patterns)], dtype=object)
        table: dict[str, CaseArray] = {
            "damaged_teeth": np.append(self.damages.damaged_teeth, 0),
            "pattern": np.append(names[self.damages.pattern], ""),
        }
        for name in self.damage_fields:
            column = np.append(self.damages.column(name), float(getattr(none, name)))
            column[:-1][patterned] = np.nan
            table[name] = column.astype(np.int64) if name in WHOLE_DAMAGE_AXES and not patterned.any() else column
        return table

    def table(self, start: int, stop: int) -> pd.DataFrame:
        """Return rows ``start`` to ``stop - 1`` of the plan: id, template, parameters and labels."""
        return self.table_of(np.arange(start, stop))

    def table_of(self, ids: IntArray) -> pd.DataFrame:
        """Return rows of the plan by their ids, with the columns of :meth:`table`."""
        place = self.row_runs.locate(ids - self.first_row)
        columns: dict[str, str | CaseArray | pd.Series] = {
            "id": ids,
            "template": place["template"] + self.first_template,
        }
        for name, values in self._case_columns(place["template"]).items():
            columns[name] = pd.Series(values, dtype="str") if name == "pattern" else values
        columns |= {name: place[name] for name in ("tooth", "specimen", "draw")}
        return pd.DataFrame(columns | {name: values[place["measured"]] for name, values in self.measurements.items()})

    def sample_ids(self, rows: int, damaged: int) -> IntArray:
        """Return the first ids, and those of the first damaged rows."""
        template = self.row_runs.template
        run = np.flatnonzero(self.templates.tooth[template] > 0)[:1]
        first = self.row_runs.first[run]
        ids = [np.arange(min(rows, self.rows)), *(np.arange(at, min(at + damaged, self.rows)) for at in first)]
        return np.unique(np.concatenate(ids)) + self.first_row
