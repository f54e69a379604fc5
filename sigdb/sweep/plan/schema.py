"""The schema of a plan's database: the columns that this version makes, and those that every database has."""

import numpy as np
import pyarrow as pa

from sigdb.core import Section, unit_of
from sigdb.database import Column, Schema, database_schema
from sigdb.measurement import MeasurementSettings
from sigdb.signature import FEATURES
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.plan.rig_points import field_at
from sigdb.transmission import Damage, Gear, Operating, ToothDamage, Transmission

_TYPES = {int: pa.int32(), float: pa.float64(), str: pa.string()}
_LIFE = (
    Column(name="life_number", type=pa.int32(), help="Number of the life, through all grids from 1; 0 for none."),
    Column(name="life_time", type=pa.float64(), help="Time since the life began, in the unit of the recipe's rates."),
)


def plan_schema(plan: Plan) -> Schema:
    """Return the columns that this version of sigdb gives a plan's database."""
    return database_schema(
        cases=[
            Column(name="gear", type=pa.string(), help="The damaged gear, by its name in the rig."),
            Column(name="shaft", type=pa.string(), help="The shaft over whose revolution is averaged."),
            _column_of(Gear, "teeth", "Tooth count of the damaged gear."),
            _column_of(Operating, "speed_rpm"),
            _column_of(Operating, "torque"),
            _column_of(Damage, "damaged_teeth"),
            *(_column_of(ToothDamage, name) for name in plan.damage_fields),
            _column_of(Damage, "pattern"),
            *(_of_rig(plan.rig, path) for path in plan.swept),
        ],
        rows=[
            _column_of(Damage, "tooth"),
            Column(name="specimen", type=pa.int32(), help="Number of the pair of gears with its own index errors."),
            Column(name="draw", type=pa.int32(), help="Number of the noise draw."),
            *(_column_of(MeasurementSettings, name) for name in MeasurementSettings.model_fields),
            *(column for column in _LIFE if column.name in plan.measurements),
        ],
        sensors={name: plan.rig.sensors[name].unit for name in plan.sensors},
        signature=FEATURES.values(),
        nuisances=plan.nuisance.exist,
        coloured=plan.nuisance.colour_db > 0,
    )


def needed_columns(plan: Plan) -> dict[str, frozenset[str]]:
    """Return the columns of each table that the plan determines, without which rows could not be identified."""
    rows, template = plan.table_of(np.empty(0, np.int64)), plan.case_columns(plan.first_template)
    return {
        "templates": frozenset({"template", "status", "tooth", "contact_loss", "orders", *template}),
        "features": frozenset({"status", "contact_loss", *map(str, rows.columns)}),
        "signals": frozenset({"id"}),
    }


def schema_conflict(plan: Plan, schema: Schema) -> str:
    """Return why a schema is not that of a plan's database; empty if it may be.

    A database of another version of sigdb may lack columns of results, or have others. The columns that the
    plan determines must be there. A column that this version has too must have the same type and unit.
    """
    planned = plan_schema(plan)
    for table, needed in needed_columns(plan).items():
        columns = {column.name: column for column in getattr(schema, table)}
        if lacking := sorted(needed - columns.keys()):
            return f"table {table} has no column {lacking[0]}"
        for column in getattr(planned, table):
            stored = columns.get(column.name, column)
            if (stored.type, stored.unit) != (column.type, column.unit):
                return f"column {column.name} of table {table} is of another type or unit"
    return ""


def _of_rig(rig: Transmission, path: str) -> Column:
    """Return the column of a swept parameter, with the unit and the help of the rig's field."""
    field = field_at(rig, path)
    if field is None:
        return Column(name=path, type=pa.float64(), help="Swept parameter of the rig.")
    return Column(
        name=path, type=pa.float64(), unit=unit_of(field), help=f"Swept parameter of the rig. {field.description}"
    )


def _column_of(section: type[Section], name: str, help: str | None = None) -> Column:
    field = section.model_fields[name]
    return Column(
        name=name,
        type=_TYPES[field.annotation],  # type: ignore[index]
        unit=unit_of(field),
        help=help or str(field.description),
    )
