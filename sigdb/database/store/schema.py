"""The schema of a database: type, unit, description and formula of every column, the same for all parts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

import pyarrow as pa

from sigdb.core import shown
from sigdb.database.store.roles import Role, role_of
from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.database.store.store import DamagedFileError, Store
from sigdb.signature import Feature

TABLES = ("templates", "features", "signals")
SCHEMA_FILE = "schema.json"

_FLOAT, _LIST = pa.float32(), pa.list_(pa.field("element", pa.float32()))
_TYPES = {
    str(type): type
    for type in (
        pa.bool_(),
        pa.int32(),
        pa.int64(),
        pa.float32(),
        pa.float64(),
        pa.string(),
        _LIST,
        pa.list_(pa.field("element", pa.float64())),
    )
}
"""Types of columns, by their names in ``schema.json``."""


class StatusCode(StrEnum):
    """Short reasons why a case has no result; the status next to it is a sentence."""

    OK = "ok"
    CONTACT = "contact"
    UNSTABLE = "unstable"
    NOT_CONVERGED = "not_converged"
    NOT_TURNED = "not_turned"
    NOT_APPLICABLE = "not_applicable"
    UNREADABLE = "unreadable"
    NO_GEAR = "no_gear"
    DOUBTFUL = "doubtful"
    NO_AVERAGE = "no_average"


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name, type
        Name and Arrow type.
    unit
        SI unit, ``-`` for a number without one.
    help
        Description in a sentence.
    formula
        Definition in a line of text; empty for a parameter.
    """

    name: str
    type: pa.DataType
    unit: str = "-"
    help: str
    formula: str = ""

    def __post_init__(self) -> None:
        for text in (self.name, self.unit, self.help, self.formula):
            if not isinstance(text, str):
                raise TypeError(f"{shown(text)} is no text")

    @property
    def role(self) -> Role:
        """The role of the column for a model."""
        return role_of(self.name)

    @property
    def field(self) -> pa.Field:
        """The Arrow field, with unit, description and formula as its metadata."""
        return pa.field(
            self.name, self.type, metadata={"unit": self.unit, "description": self.help, "formula": self.formula}
        )

    @classmethod
    def from_field(cls, field: pa.Field) -> Self:
        """Return the column of an Arrow field of a part."""
        unit, help, formula = (
            (field.metadata or {}).get(key, b"").decode() for key in (b"unit", b"description", b"formula")
        )
        return cls(name=field.name, type=field.type, unit=unit, help=help, formula=formula)

    def as_json(self) -> dict[str, str]:
        """Return the column as ``schema.json`` holds it."""
        return {
            "name": self.name,
            "type": str(self.type),
            "unit": self.unit,
            "description": self.help,
            "formula": self.formula,
        }

    @classmethod
    def from_json(cls, content: Mapping[str, str]) -> Self:
        """Return the column that :meth:`as_json` wrote."""
        return cls(
            name=content["name"],
            type=_TYPES[content["type"]],
            unit=content["unit"],
            help=content["description"],
            formula=content["formula"],
        )


def suffixed(name: str, sensors: Sequence[str], sensor: str) -> str:
    """Return the name of a sensor's column: the first sensor's has no suffix, others are ``name__SENSOR``."""
    return name if sensor == sensors[0] else f"{name}__{sensor}"


@dataclass(frozen=True, kw_only=True)
class Schema:
    """The columns of the three tables of a database."""

    templates: tuple[Column, ...]
    features: tuple[Column, ...]
    signals: tuple[Column, ...]

    def arrow(self, table: str) -> pa.Schema:
        """Return the Arrow schema of a table."""
        return pa.schema([column.field for column in getattr(self, table)])

    def as_json(self) -> dict[str, list[dict[str, str]]]:
        """Return the content of ``schema.json``."""
        return {table: [column.as_json() for column in getattr(self, table)] for table in TABLES}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Self:
        """Return the schema that :meth:`as_json` wrote."""
        return cls(**{table: tuple(map(Column.from_json, content[table])) for table in TABLES})


def write_schema(schema: Schema, store: Store) -> None:
    """Publish ``schema.json``."""
    store.put(SCHEMA_FILE, sealed_json(schema.as_json()))


def read_schema(store: Store) -> Schema:
    """Read ``schema.json`` of a database: the columns that its parts have.

    Raises
    ------
    DamagedFileError
        If it is missing, damaged or holds no schema.
    """
    name = store.name_of(SCHEMA_FILE)
    content = unsealed(store.get(SCHEMA_FILE), name=name)
    try:
        return Schema.from_json(content)
    except (KeyError, TypeError) as error:
        raise DamagedFileError(name, f"does not describe columns ({error})") from None


_STATUS = Column(name="status", type=pa.string(), help="'ok', or why there is no result and what to change.")
_STATUS_CODE = Column(
    name="status_code",
    type=pa.string(),
    help="Short form of the status, to group by: 'ok'; 'contact' (a mesh loses contact where the linear solution "
    "does not hold); 'unstable' (the rig has no steady state); 'not_converged' (the solver or the march does not meet "
    "its accuracy); 'not_turned' (excitations fixed to the shaft act while contact is lost); 'not_applicable' (rig or "
    "damage is outside the method).",
)
_MIN_COMPRESSION = Column(
    name="min_compression",
    type=_FLOAT,
    help="Least mesh compression over the revolution, of nominal teeth: index errors are not subtracted.",
    formula="min(delta) / static delta",
)
_MIN_MESH_FORCE = Column(
    name="min_mesh_force",
    type=_FLOAT,
    help="Least mesh force over the revolution; a mesh is closed while its force is positive.",
    formula="min(sum k (delta - e)) / static force",
)
_CONTACT_LOSS = Column(
    name="contact_loss",
    type=pa.bool_(),
    help="Whether the mesh loses contact in this case. Its clean average comes from the march in time then, without "
    "index errors: its index_error is 0.",
)
_NUISANCE_MODES = Column(
    name="nuisance_modes",
    type=_LIST,
    unit="signal",
    help="Modes of the nuisances: changes of the average per standard deviation, (n, modes) row-major.",
)
NOISE_BY_ORDER = Column(
    name="noise",
    type=_LIST,
    unit="signal",
    help="Standard deviation of white noise with the density of the average's noise at orders 0, 1, 2 ...",
)
_NOISE_COLOUR = Column(
    name="noise_colour", type=pa.int32(), help="Number of the colour of its noise, of those drawn; 0 for white noise."
)
_NUISANCE_COUNTS = Column(
    name="nuisance_counts",
    type=_LIST,
    help="Number of modes of each nuisance, in the order of [nuisance].",
)


def database_schema(
    *,
    cases: Iterable[Column],
    rows: Iterable[Column],
    sensors: Mapping[str, str],
    signature: Iterable[Feature],
    nuisances: bool = False,
    coloured: bool = False,
) -> Schema:
    """Return the schema of a database.

    Parameters
    ----------
    cases
        Parameters that a template and a row share: operating point, damage, swept rig parameters.
    rows
        Parameters that only rows have: specimen, noise draw, measurement.
    sensors
        Unit of each stored sensor by name; the first one's columns have no suffix.
    signature
        Features of an average, in order. Those by order stand in ``signals``, others in ``features``.
    nuisances
        Whether templates hold modes of nuisances.
    coloured
        Whether rows hold their noise by order, and the number of its colour.
    """
    names = list(sensors)
    cases, signature = tuple(cases), tuple(signature)

    def each(*columns: Column) -> list[Column]:
        return [
            Column(
                name=suffixed(column.name, names, sensor),
                type=column.type,
                unit=column.unit.replace("signal", unit),
                help=f"{column.help} Sensor {sensor}.",
                formula=column.formula,
            )
            for sensor, unit in sensors.items()
            for column in columns
        ]

    return Schema(
        templates=(
            Column(name="template", type=pa.int32(), help="Number of the template."),
            _STATUS,
            _STATUS_CODE,
            Column(
                name="tooth",
                type=pa.int32(),
                help="First damaged tooth; 1 where other teeth are turns of it, 0 = undamaged.",
            ),
            *cases,
            Column(
                name="floquet_multiplier",
                type=_FLOAT,
                help="Largest Floquet multiplier over a revolution, of the healthy rig and of the softest mesh of the "
                "part's templates at this operating point.",
            ),
            Column(name="static_compression", type=_FLOAT, unit="m", help="Compression under the mean mesh stiffness."),
            _MIN_COMPRESSION,
            Column(
                name="least_elsewhere", type=_FLOAT, help="The same of the other meshes; infinite where there are none."
            ),
            Column(name="static_force", type=_FLOAT, unit="N", help="Mesh force under the mean torque."),
            _MIN_MESH_FORCE,
            Column(
                name="least_force_elsewhere",
                type=_FLOAT,
                help="The same of the other meshes; infinite where there are none.",
            ),
            _CONTACT_LOSS,
            Column(
                name="error",
                type=_FLOAT,
                help="Estimated error of the clean averages by the grid or the step, the greatest of all sensors.",
                formula="max |error| / peak-to-peak",
            ),
            Column(name="compression", type=_LIST, unit="m", help="Compression under torque and profile errors."),
            Column(name="compression_response", type=_LIST, help="Compression per index error, (n, teeth) row-major."),
            Column(
                name="compression_harmonic",
                type=_LIST,
                unit="m",
                help="Compression under harmonic excitations, (n, orders, 2) row-major.",
            ),
            Column(
                name="orders",
                type=pa.list_(pa.field("element", pa.float64())),
                unit="1/rev",
                help="Orders of harmonic excitations.",
            ),
            Column(
                name="mesh_force",
                type=_LIST,
                unit="N",
                help="Mesh force along the normal under torque and profile errors.",
                formula="sum k (delta - e)",
            ),
            Column(
                name="mesh_force_response",
                type=_LIST,
                unit="N/m",
                help="Mesh force per index error, (n, teeth) row-major.",
            ),
            Column(
                name="mesh_force_harmonic",
                type=_LIST,
                unit="N",
                help="Mesh force under harmonic excitations, (n, orders, 2) row-major.",
            ),
            *each(
                Column(
                    name="reference_variance",
                    type=pa.float64(),
                    unit="(signal)^2",
                    help="Variance of the healthy clean average at this operating point.",
                ),
                Column(
                    name="tsa", type=_LIST, unit="signal", help="Clean average y_D under torque and profile errors."
                ),
                Column(
                    name="specimen_response",
                    type=_LIST,
                    unit="(signal)/m",
                    help="Y_D: average per index error, (n, teeth) row-major.",
                ),
                Column(
                    name="harmonic_response",
                    type=_LIST,
                    unit="signal",
                    help="Average under unbalance, run-out and fluctuating load, (n, orders, 2) row-major.",
                ),
                *((_NUISANCE_MODES,) if nuisances else ()),
            ),
            *((_NUISANCE_COUNTS,) if nuisances else ()),
        ),
        features=(
            Column(name="id", type=pa.int64(), help="Number of the row in the plan."),
            _STATUS,
            _STATUS_CODE,
            Column(name="template", type=pa.int32(), help="Number of its template."),
            *cases,
            *rows,
            _MIN_COMPRESSION,
            _MIN_MESH_FORCE,
            _CONTACT_LOSS,
            *each(
                Column(
                    name="scatter",
                    type=_FLOAT,
                    unit="signal",
                    help="Measured standard deviation between revolutions, rms over angle, of the added noise.",
                ),
                *((_NOISE_COLOUR,) if coloured else ()),
                *(_of_signature(feature) for feature in signature if "order" not in feature.axes),
            ),
        ),
        signals=(
            Column(name="id", type=pa.int64(), help="Number of the row in the plan."),
            *each(
                Column(
                    name="tsa",
                    type=_LIST,
                    unit="signal",
                    help="Average of one revolution, from the tacho mark.",
                ),
                *((NOISE_BY_ORDER,) if coloured else ()),
                *(_of_signature(feature) for feature in signature if "order" in feature.axes),
            ),
        ),
    )


def _of_signature(feature: Feature) -> Column:
    return Column(
        name=feature.name,
        type=_LIST if feature.axes else _FLOAT,
        unit=feature.unit,
        help=feature.help,
        formula=feature.formula,
    )
