"""The schema of a database of recordings: the columns of simulated rows, and those of a measurement."""

from dataclasses import replace

import pyarrow as pa

from sigdb.core import unit_of
from sigdb.database import MEASURED_SENSOR, NOISE_BY_ORDER, Column, Schema, database_schema
from sigdb.ingest.facts.recording_facts import RecordingFacts
from sigdb.measurement import MeasurementSettings
from sigdb.signature import FEATURES
from sigdb.transmission import Damage, Gear, Operating, ToothDamage

_LIST = pa.list_(pa.field("element", pa.float32()))
_TYPES = {int: pa.int32(), float: pa.float64(), str: pa.string()}


def measured_schema() -> Schema:
    """Return the columns of a database of recordings."""
    plain = database_schema(
        cases=[
            Column(name="gear", type=pa.string(), help="The averaged gear, by its name in the rig; empty without one."),
            Column(name="shaft", type=pa.string(), help="The shaft over whose revolution is averaged."),
            _column_of(Gear, "teeth", "Tooth count of the averaged gear."),
            _column_of(Operating, "speed_rpm", "Speed of the rig's drive shaft; of the averaged shaft without a rig."),
            _column_of(Operating, "torque"),
            _column_of(Damage, "damaged_teeth"),
            _column_of(ToothDamage, "phase_shift_deg"),
            _column_of(ToothDamage, "stiffness_loss"),
            _column_of(Damage, "pattern"),
        ],
        rows=[
            _column_of(Damage, "tooth", "First damaged tooth; 0 = undamaged, null = unknown."),
            Column(name="specimen", type=pa.int32(), help="Number of the pair of gears; null = unknown."),
            Column(name="draw", type=pa.int32(), help="Number of the average in its recording."),
            *(_column_of(MeasurementSettings, name) for name in MeasurementSettings.model_fields),
            *MEASURED,
        ],
        sensors={MEASURED_SENSOR: "signal"},
        signature=FEATURES.values(),
    )
    return Schema(
        templates=plain.templates,
        features=tuple(
            _CHANGED.get(column.name, lambda each: each)(_of_any_sensor(column)) for column in plain.features
        ),
        signals=(*map(_of_any_sensor, plain.signals), *_SIGNALS),
    )


def _column_of(section: type, name: str, help: str = "") -> Column:
    field = section.model_fields[name]  # type: ignore[attr-defined]
    return Column(name=name, type=_TYPES[field.annotation], unit=unit_of(field), help=help or str(field.description))


def _of_any_sensor(column: Column) -> Column:
    """Return a column whose help names no sensor."""
    return replace(column, help=column.help.removesuffix(f" Sensor {MEASURED_SENSOR}."))


_CHANGED = {
    "id": lambda column: replace(column, help="Number of the row."),
    "template": lambda column: replace(column, help="Null: a measured row has no template."),
    "snr_db": lambda column: replace(
        column, help="10 log10(variance of the average without its noise / variance of one revolution's noise)."
    ),
    "scatter": lambda column: replace(column, help="Standard deviation between revolutions, as an rms over the angle."),
    "status_code": lambda column: replace(
        column,
        help="Short form of the status, to group by: 'ok'; 'unreadable' (the file cannot be read); 'no_gear' (the gear "
        "is not to be seen); 'doubtful' (the reading doubts something that the average depends on); 'no_average' "
        "(angle or length do not suffice).",
    ),
}
"""Columns of simulated rows that mean something else, or can be estimated only."""


def _text(name: str, help: str = "") -> Column:
    return Column(name=name, type=pa.string(), help=help or str(RecordingFacts.model_fields[name].description))


MEASURED = (
    _text("source", "'measured', or 'simulated elsewhere' for averages of another program."),
    _text("recording", "Name of the file, below the folder that was ingested."),
    _text("sha256", "SHA-256 of the file as it was read; null where it could not be read."),
    _text("set"),
    _text("machine"),
    _text("specimen_name", "Name of the pair of gears; empty where it is unknown."),
    _text("sensor"),
    _text("channel", "Channel of the file."),
    _text("unit", "Unit of the average: in SI where the file's unit is known; empty where none is stated."),
    _text("date"),
    Column(name="begin", type=pa.float64(), unit="s", help="Begin of the average on the recording's time axis."),
    Column(name="load", type=pa.float64(), help="Load in any one unit, such as per cent."),
    Column(name="shaft_rpm", type=pa.float64(), unit="rev/min", help="Mean speed of the averaged shaft."),
    _text("rig", "The rig; empty without one."),
    _text("state"),
    _text("health", "'healthy', 'damaged' or 'unknown', by the labels."),
    _text("kind"),
    _text("severity"),
    _text("label_trust"),
    _text("angle", "Source of the shaft's angle."),
    Column(
        name="absolute",
        type=pa.bool_(),
        help="Whether tooth 1 is the first after the tacho's mark; else it is relative.",
    ),
    Column(name="kept", type=pa.float64(), help="Standard deviation of the average over that of the record."),
    Column(name="highest_order", type=pa.float64(), unit="1/rev", help="The record's Nyquist frequency in orders."),
    Column(name="presence_p", type=pa.float64(), help="Probability that noise alone looks as much like the gear."),
    _text("notes", "Notes of the reading, a JSON list of objects with code, text and values."),
)
"""Columns that only measured rows have."""

_SIGNALS = (
    NOISE_BY_ORDER,
    Column(
        name="groups",
        type=_LIST,
        unit="signal",
        help="Averages of up to 24 groups of consecutive revolutions, (groups, n) row-major.",
    ),
)
