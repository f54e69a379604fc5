"""Templates: the distinct cases of a database, each simulated once; their only writer and their only reader."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isnan, nan
from typing import Self, TypeAlias

import numpy as np
import pyarrow as pa

from sigdb.core import FloatArray, InputError, IntArray, NotApplicableError, validated
from sigdb.database.store.schema import StatusCode, suffixed
from sigdb.database.stored_tables import StoredTables
from sigdb.transmission import Transmission

CaseValue: TypeAlias = str | float | int | bool | None
"""A value of a column without lists."""

_RESULTS = (
    "floquet_multiplier",
    "static_compression",
    "min_compression",
    "least_elsewhere",
    "static_force",
    "min_mesh_force",
    "least_force_elsewhere",
    "error",
)
_ROWS_AT_ONCE = 64
"""Templates that are read together: the arrays of each are large."""


def _none() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Template:
    """A distinct case of a database with its simulated response, for some or all of the stored sensors.

    A template without a result has a ``status`` other than ``ok`` and no arrays. A template that loses contact holds
    for gears without index errors: its responses to index errors and to harmonic excitations are zeros and are not
    stored. Arrays are float64 in the unit of their column; the database holds them as float32.

    Attributes
    ----------
    case
        ``template`` (its number), ``tooth`` (first damaged tooth, 0 for none), ``teeth``, and the parameters that the
        template shares with its rows, by column name.
    status
        ``ok``, or why there is no result and what to change.
    status_code
        Short form of the status; None in databases of earlier versions.
    contact_loss
        Whether the mesh loses contact; None where it was not computed.
    floquet_multiplier
        Largest Floquet multiplier over a revolution; nan where it was not computed.
    static_compression
        Compression under the mean mesh stiffness, m; nan where it was not computed.
    min_compression, least_elsewhere
        Least compression of the damaged gear's mesh and of the other meshes, as fractions of the static ones; nan where
        they were not computed.
    static_force
        Mesh force under the mean torque, N; nan where it was not computed, as in databases of earlier versions.
    min_mesh_force, least_force_elsewhere
        Least force of the damaged gear's mesh and of the other meshes, as fractions of the static ones; nan where they
        were not computed. A mesh is closed while its force is positive.
    error
        Estimated error of the clean averages, as a fraction of their peak-to-peak; nan where it was not computed.
    compression, mesh_force
        (N,) in m and N, over the common period of all meshes.
    compression_response
        (N, teeth) compression per index error.
    compression_harmonic
        (N, orders, 2) compression under harmonic excitations, m.
    mesh_force_response, mesh_force_harmonic
        The same of the mesh force.
    orders
        (orders,) orders of the harmonic excitations, cycles per revolution.
    reference_variance
        (sensors,) variance of the healthy clean average.
    signals
        (sensors, n) clean averages y_D, in the sensors' units.
    specimen_response
        (sensors, n, teeth) Y_D, change of the averages per metre of index error.
    harmonic_response
        (sensors, n, orders, 2) averages under harmonic excitations.
    nuisance_modes
        (sensors, n, modes) changes of the averages per standard deviation of the nuisances; without modes where none
        are stated, or where contact is lost.
    nuisance_counts
        (nuisances,) number of modes of each nuisance.
    """

    case: Mapping[str, CaseValue]
    status: str = "ok"
    status_code: str | None = StatusCode.OK
    contact_loss: bool | None = None
    floquet_multiplier: float = nan
    static_compression: float = nan
    min_compression: float = nan
    least_elsewhere: float = nan
    static_force: float = nan
    min_mesh_force: float = nan
    least_force_elsewhere: float = nan
    error: float = nan
    compression: FloatArray = field(default_factory=_none)
    mesh_force: FloatArray = field(default_factory=_none)
    compression_response: FloatArray = field(default_factory=_none)
    compression_harmonic: FloatArray = field(default_factory=_none)
    mesh_force_response: FloatArray = field(default_factory=_none)
    mesh_force_harmonic: FloatArray = field(default_factory=_none)
    orders: FloatArray = field(default_factory=_none)
    reference_variance: FloatArray = field(default_factory=_none)
    signals: FloatArray = field(default_factory=_none)
    specimen_response: FloatArray = field(default_factory=_none)
    harmonic_response: FloatArray = field(default_factory=_none)
    nuisance_modes: FloatArray = field(default_factory=lambda: np.empty((0, 0, 0)))
    nuisance_counts: IntArray = field(default_factory=lambda: np.empty(0, int))

    @property
    def tooth(self) -> int:
        """First damaged tooth, 0 for none."""
        return int(self.case["tooth"] or 0)

    @cached_property
    def relative_compression(self) -> FloatArray:
        """(N,) compression as a fraction of the static one."""
        return self.compression / self.static_compression

    @cached_property
    def relative_compression_response(self) -> FloatArray:
        """(N, teeth) compression per metre of index error, as a fraction of the static one."""
        return self.compression_response / self.static_compression

    @cached_property
    def relative_compression_harmonic(self) -> FloatArray:
        """(N, orders, 2) compression under harmonic excitations, as a fraction of the static one."""
        return self.compression_harmonic / self.static_compression

    @cached_property
    def relative_mesh_force(self) -> FloatArray:
        """(N,) mesh force as a fraction of the static one."""
        return self.mesh_force / self.static_force

    @cached_property
    def relative_mesh_force_response(self) -> FloatArray:
        """(N, teeth) mesh force per metre of index error, as a fraction of the static one."""
        return self.mesh_force_response / self.static_force

    @cached_property
    def relative_mesh_force_harmonic(self) -> FloatArray:
        """(N, orders, 2) mesh force under harmonic excitations, as a fraction of the static one."""
        return self.mesh_force_harmonic / self.static_force

    def to_row(self, sensors: Sequence[str]) -> dict[str, CaseValue | FloatArray]:
        """Return the row of the table ``templates``; columns that it leaves out are null.

        Parameters
        ----------
        sensors
            The stored sensors, in the order of the sensor axes; the first one's columns have no suffix.

        Returns
        -------
        dict
            Values by column name; arrays are flat, row-major, float32 (``orders`` float64).
        """
        numbers = {name: float(getattr(self, name)) for name in _RESULTS}
        row: dict[str, CaseValue | FloatArray] = {
            **self.case,
            "status": self.status,
            "status_code": self.status_code,
            "contact_loss": self.contact_loss,
        }
        row |= {name: None if isnan(value) else value for name, value in numbers.items()}
        if self.status != "ok":
            return row
        arrays, of_sensors = ["compression", "mesh_force"], {"tsa": self.signals}
        if not self.contact_loss:
            arrays += ["compression_response", "compression_harmonic", "mesh_force_response", "mesh_force_harmonic"]
            of_sensors |= {"specimen_response": self.specimen_response, "harmonic_response": self.harmonic_response}
            of_sensors |= {"nuisance_modes": self.nuisance_modes} if self.nuisance_modes.size else {}
            arrays += ["nuisance_counts"] if self.nuisance_modes.shape[1] else []
        row |= {"orders": np.asarray(self.orders, float)} | {name: _flat(getattr(self, name)) for name in arrays}
        for i, sensor in enumerate(sensors):
            row[suffixed("reference_variance", sensors, sensor)] = float(self.reference_variance[i])
            row |= {suffixed(name, sensors, sensor): _flat(values[i]) for name, values in of_sensors.items()}
        return row

    @classmethod
    def from_row(
        cls, row: Mapping[str, pa.Scalar], sensors: Sequence[str], *, only: Sequence[str] | None = None
    ) -> Self:
        """Return the template of a row of the table ``templates``.

        Parameters
        ----------
        row
            Arrow values by column name. A column that was not read leaves its attribute empty.
        sensors
            The stored sensors, in the database's order.
        only
            The sensors to read, in the order of the sensor axes; all if left out.
        """
        wanted = sensors if only is None else only

        def number(name: str) -> float:
            return float(row[name].as_py()) if name in row and row[name].is_valid else nan

        def array(name: str) -> FloatArray:
            return row[name].values.to_numpy().astype(float) if name in row and row[name].is_valid else _none()

        def each_sensor(name: str) -> FloatArray:
            return np.array([array(suffixed(name, sensors, sensor)) for sensor in wanted])

        def response(values: FloatArray, *shape: int) -> FloatArray:
            return values.reshape(shape) if values.size else np.zeros(shape)

        teeth, orders, modes = int(row["teeth"].as_py()), array("orders"), each_sensor("nuisance_modes")
        signals, compression = each_sensor("tsa"), array("compression")
        s, n, N = *signals.shape, len(compression)
        return cls(
            case={name: row[name].as_py() for name in _case_columns(row, sensors)},
            status=row["status"].as_py(),
            status_code=row["status_code"].as_py() if "status_code" in row else None,
            contact_loss=row["contact_loss"].as_py(),
            floquet_multiplier=number("floquet_multiplier"),
            static_compression=number("static_compression"),
            min_compression=number("min_compression"),
            least_elsewhere=number("least_elsewhere"),
            static_force=number("static_force"),
            min_mesh_force=number("min_mesh_force"),
            least_force_elsewhere=number("least_force_elsewhere"),
            error=number("error"),
            compression=compression,
            mesh_force=array("mesh_force"),
            compression_response=response(array("compression_response"), N, teeth),
            compression_harmonic=response(array("compression_harmonic"), N, len(orders), 2),
            mesh_force_response=response(array("mesh_force_response"), N, teeth),
            mesh_force_harmonic=response(array("mesh_force_harmonic"), N, len(orders), 2),
            orders=orders,
            reference_variance=np.array([number(suffixed("reference_variance", sensors, each)) for each in wanted]),
            signals=signals,
            specimen_response=response(each_sensor("specimen_response"), s, n, teeth),
            harmonic_response=response(each_sensor("harmonic_response"), s, n, len(orders), 2),
            nuisance_modes=modes.reshape(s, n, modes.shape[1] // max(n, 1)),
            nuisance_counts=array("nuisance_counts").astype(int),
        )


def _case_columns(row: Mapping[str, pa.Scalar], sensors: Sequence[str]) -> list[str]:
    results = {
        "status",
        "status_code",
        "contact_loss",
        *_RESULTS,
        *(suffixed("reference_variance", sensors, each) for each in sensors),
    }
    return [name for name, value in row.items() if name not in results and not pa.types.is_list(value.type)]


def _flat(values: FloatArray) -> FloatArray:
    return values.astype(np.float32).ravel()


def stored_templates(
    database: StoredTables,
    *,
    speed_rpm: float,
    torque: float,
    teeth: int,
    sensor: str | None = None,
    where: str | None = None,
    untied: bool = False,
) -> list[Template]:
    """Return the templates of one operating point, tooth count and sensor that have a result and keep contact.

    Their compressions and mesh forces are not read.

    Parameters
    ----------
    database
        A database with templates.
    speed_rpm, torque, teeth
        Operating point (rpm, N m), and tooth count of the damaged gear, as the database has them.
    sensor
        A stored sensor; the first one if left out.
    where
        Only these templates: one SQL expression on their columns.
    untied
        Whether templates of a rig that does not turn exactly serve too: each is of damage at its own tooth.

    Raises
    ------
    NotApplicableError
        If the rig does not turn exactly, unless templates may be untied.
    InputError
        If there is no such template.
    """
    rig, gear = rig_of(database)
    if not untied and not rig.turns_exactly(gear):
        raise NotApplicableError(
            f"{database.store}: the rig {rig.name} has {len(rig.meshes)} meshes, so that damage at another tooth is "
            "not a turn of the damage at the first; templates that are turned are those of rigs with one mesh"
        )
    sensor = database.stored_sensor(sensor)
    chosen = f"speed_rpm = {speed_rpm!r} and torque = {torque!r} and teeth = {teeth} and status = 'ok'"
    chosen += " and not contact_loss" + (f" and ({where})" if where else "")
    schema = database.dataset("templates").schema
    scalars = [column.name for column in schema if not pa.types.is_list(column.type)]
    arrays = [
        suffixed(name, database.sensors, sensor)
        for name in ("tsa", "specimen_response", "harmonic_response", "nuisance_modes")
    ]
    arrays = [name for name in arrays if name in schema.names]
    lists = [name for name in ("orders", "nuisance_counts") if name in schema.names]
    batches = database.batches(chosen, table="templates", columns=[*scalars, *lists, *arrays], rows=_ROWS_AT_ONCE)
    templates = [
        Template.from_row({name: batch[name][i] for name in batch.schema.names}, database.sensors, only=[sensor])
        for batch in batches
        for i in range(batch.num_rows)
    ]
    if not templates:
        raise InputError(
            f"{database.store} has no template at speed_rpm = {speed_rpm:g}, torque = {torque:g}, teeth = {teeth} that "
            "has a result and keeps contact; take an operating point of its templates"
        )
    return templates


def mate_teeth(database: StoredTables, template: Template) -> int:
    """Return the tooth count of the damaged gear's mate in a template, which a sweep may have changed."""
    rig, gear = rig_of(database)
    mate = rig.mate(gear)
    swept = [name for name in template.case if "." in name and rig.path(name) == ("gears", mate, "teeth")]
    return int(template.case[swept[0]] or 0) if swept else rig.gears[mate].teeth


def rig_of(database: StoredTables) -> tuple[Transmission, str]:
    """Return the rig that a database was made of, and the name of its damaged gear."""
    resolved = database.manifest.resolved
    rig = validated(Transmission, resolved["rig"], owner=str(database.store))
    return rig, resolved["sweep"]["gear"]
