"""The templates of one operating point and sensor, as a database holds them."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from sigdb.core import FloatArray, InputError, validated
from sigdb.database.database import Database
from sigdb.database.store.schema import suffixed
from sigdb.measurement import index_error_covariance
from sigdb.transmission import Transmission

_ARRAYS = ("tsa", "specimen_response", "harmonic_response")
_ROWS_AT_ONCE = 64

_Row = Mapping[str, pa.Scalar]


@dataclass(frozen=True, kw_only=True, eq=False)
class StoredTemplate:
    """A template of one sensor, with a result and without loss of contact.

    Attributes
    ----------
    case
        Its columns without lists.
    signal
        (n,) y_D.
    response
        (n, teeth) Y_D, per m of index error.
    harmonic, orders
        (n, 2 orders) cosine and sine under harmonic excitations, and their (orders,).
    reference_variance
        Variance of the healthy clean average.
    covariance
        (teeth, teeth) covariance of the index errors that an average sees, for an ``index_error`` of 1.
    """

    case: Mapping[str, Any]
    signal: FloatArray
    response: FloatArray
    harmonic: FloatArray
    orders: FloatArray
    reference_variance: float
    covariance: FloatArray


def stored_templates(
    database: Database,
    *,
    speed_rpm: float,
    torque: float,
    teeth: int,
    sensor: str | None = None,
    where: str | None = None,
) -> list[StoredTemplate]:
    """Templates of one operating point and tooth count; see :meth:`Hypotheses.of`."""
    rig, gear = _rig(database)
    if not rig.turns_exactly(gear):
        raise InputError(
            f"{database.store}: the rig {rig.name} has {len(rig.meshes)} meshes, so that damage at another tooth is "
            "not a turn of the damage at the first; the law of an average is known for rigs with one mesh"
        )
    stored = database.stored_sensor(sensor)
    names = {key: suffixed(key, database.sensors, stored) for key in (*_ARRAYS, "reference_variance")}
    chosen = f"speed_rpm = {speed_rpm!r} and torque = {torque!r} and teeth = {teeth} and status = 'ok'"
    chosen += " and not contact_loss" + (f" and ({where})" if where else "")
    schema = database.dataset("templates").schema
    scalars = [field.name for field in schema if not pa.types.is_list(field.type)]
    columns = list(dict.fromkeys([*scalars, "orders", *names.values()]))
    rows = [
        row
        for batch in database.batches(chosen, table="templates", columns=columns, rows=_ROWS_AT_ONCE)
        for row in _rows(batch)
    ]
    if not rows:
        raise InputError(
            f"{database.store} has no template at speed_rpm = {speed_rpm:g}, torque = {torque:g}, teeth = {teeth} that "
            "has a result and keeps contact; take an operating point of its templates"
        )
    mate_teeth = _mate_teeth(rig, gear, scalars)
    return [
        StoredTemplate(
            case={name: row[name].as_py() for name in scalars},
            covariance=index_error_covariance(teeth, mate_teeth(row)),
            reference_variance=row[names["reference_variance"]].as_py(),
            signal=_array(row[names["tsa"]]),
            response=_array(row[names["specimen_response"]]).reshape(-1, teeth),
            harmonic=_array(row[names["harmonic_response"]]).reshape(len(_array(row[names["tsa"]])), -1),
            orders=_array(row["orders"]),
        )
        for row in rows
    ]


def _rig(database: Database) -> tuple[Transmission, str]:
    """The rig that a database was made of, and its damaged gear."""
    resolved = database.manifest.resolved
    rig = validated(Transmission, resolved["rig"], owner=str(database.store))
    return rig, resolved["sweep"]["gear"]


def _mate_teeth(rig: Transmission, gear: str, columns: Iterable[str]) -> Callable[[_Row], int]:
    """Tooth count of the damaged gear's mate in a template; a sweep may have changed it."""
    mate = rig.mate(gear)
    swept = [name for name in columns if "." in name and rig.path(name) == ("gears", mate, "teeth")]
    if swept:
        return lambda row: int(row[swept[0]].as_py())
    return lambda row: rig.gears[mate].teeth


def _rows(batch: pa.RecordBatch) -> Iterator[_Row]:
    for i in range(batch.num_rows):
        yield {name: batch[name][i] for name in batch.schema.names}


def _array(stored: pa.ListScalar) -> FloatArray:
    return np.asarray(stored.values.to_numpy(zero_copy_only=False), float)
