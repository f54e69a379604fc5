"""The columns that a plan's database has, taken from the fields that declare them."""

import pyarrow as pa

from sigdb.core.fields import Section, unit_of
from sigdb.database.schema import Column, Schema, database_schema
from sigdb.measurement import Measurement
from sigdb.signature import INDICATORS
from sigdb.sweep.plan import Plan
from sigdb.sweep.rig_points import declared
from sigdb.transmission import Damage, ToothDamage, Transmission
from sigdb.transmission.gears import Gear, Operating

_TYPES = {int: pa.int32(), float: pa.float64(), str: pa.string()}


def plan_schema(plan: Plan) -> Schema:
    """The schema of the database that a plan makes."""
    return database_schema(
        cases=[
            Column(name="gear", type=pa.string(), help="The damaged gear, by its name in the rig."),
            Column(name="shaft", type=pa.string(), help="The shaft over whose revolution is averaged."),
            _declared(Gear, "teeth", "Tooth count of the damaged gear."),
            _declared(Operating, "speed_rpm"),
            _declared(Operating, "torque"),
            _declared(Damage, "damaged_teeth"),
            *(_declared(ToothDamage, name) for name in plan.damage_fields),
            _declared(Damage, "pattern"),
            *(_of_rig(plan.rig, path) for path in plan.swept),
        ],
        rows=[
            _declared(Damage, "tooth"),
            Column(name="specimen", type=pa.int32(), help="Number of the pair of gears with its own index errors."),
            Column(name="draw", type=pa.int32(), help="Number of the noise draw."),
            *(_declared(Measurement, name) for name in Measurement.model_fields),
        ],
        sensors={name: plan.rig.sensors[name].unit for name in plan.sensors},
        indicators=INDICATORS.values(),
    )


def _of_rig(rig: Transmission, path: str) -> Column:
    """The column of a swept parameter, with the unit and the help of the rig's field."""
    field = declared(rig, path)
    if field is None:
        return Column(name=path, type=pa.float64(), help="Swept parameter of the rig.")
    return Column(
        name=path, type=pa.float64(), unit=unit_of(field), help=f"Swept parameter of the rig. {field.description}"
    )


def _declared(section: type[Section], name: str, help: str | None = None) -> Column:
    field = section.model_fields[name]
    return Column(
        name=name,
        type=_TYPES[field.annotation],  # type: ignore[index]
        unit=unit_of(field),
        help=help or str(field.description),
    )
