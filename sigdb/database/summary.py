"""Numbers of a database for its card."""

from collections.abc import Iterable
from typing import TypedDict, cast

import pyarrow as pa

from sigdb.core import InputError, validated
from sigdb.database.database import Database
from sigdb.database.matching.outside_threshold import read_coverage
from sigdb.database.store.receipts import Receipt
from sigdb.database.stored_tables import check_complete
from sigdb.transmission import Transmission, origins

_NOT_AXES = ("id", "status", "status_code", "template", "gear", "shaft", "pattern", "min_compression", "contact_loss")
_QUANTILES = (0.05, 0.5, 0.95)


class RigFacts(TypedDict):
    """A rig on a card: its name, its title, and how many of its numbers have which origin."""

    name: str
    title: str
    origins: dict[str, int]


class AxisFacts(TypedDict):
    """A parameter on a card: how many values it takes, and the least and the greatest of them."""

    name: str
    unit: str
    values: int
    least: float
    greatest: float


class StatusFacts(TypedDict):
    """A reason why rows have no result: its code, the status of one of the rows, and their number.

    The code is None in a database of an earlier version, in which each status counts for itself.
    """

    code: str | None
    status: str
    rows: int


class IndicatorFacts(TypedDict):
    """An indicator on a card: its 5 %, 50 % and 95 % quantiles; None where there are no such rows."""

    name: str
    unit: str
    healthy: list[float] | None
    damaged: list[float] | None


class CheckFacts(TypedDict):
    """The greatest error of the clean averages, the greatest Floquet multiplier, the least compression and mesh force.

    The mesh force is None in a database of an earlier version, which has no such column.
    """

    error: float
    floquet_multiplier: float
    min_compression: float
    min_mesh_force: float | None


class DatabaseFacts(TypedDict):
    """The numbers of a database; see :func:`database_card`."""

    rig: RigFacts
    gear: str
    samples_per_tooth: int
    sensors: dict[str, str]
    rows: int
    healthy: int
    failed: int
    contact_loss: int
    specimens: int
    templates: int
    parts: int
    bytes: int
    axes: list[AxisFacts]
    patterns: list[str]
    statuses: list[StatusFacts]
    indicators: list[IndicatorFacts]
    checks: CheckFacts
    coverage: dict[str, float] | None
    hash: str
    seed: int
    extensions: int
    versions: list[dict[str, str]]
    licence: str
    citation: str
    recipe: str


class LabelFacts(TypedDict):
    """Recordings and their rows with a result that have the same health, kind of damage and trust in the label."""

    health: str
    kind: str
    label_trust: str
    recordings: int
    rows: int


class RecordingFacts(TypedDict):
    """The numbers of a database of recordings; see :func:`recordings_card`."""

    rows: int
    recordings: int
    failed: int
    bytes: int
    sources: list[str]
    machines: int
    specimens: int
    sensors: list[dict[str, str]]
    gears: list[dict[str, str | int]]
    dates: list[str] | None
    axes: list[AxisFacts]
    labels: list[LabelFacts]
    statuses: list[StatusFacts]
    indicators: list[IndicatorFacts]
    versions: list[dict[str, str]]
    licence: str
    citation: str


_COUNTS = """
select count(*) as rows, count(*) filter (tooth = 0) as healthy, count(*) filter (status <> 'ok') as failed,
    count(*) filter (contact_loss) as contact_loss, count(distinct specimen) as specimens
from cases
"""
_PATTERNS = "select distinct pattern from cases where pattern <> '' order by 1"
_STATUSES = """
select {code} as code, min(status) as status, count(*) as rows from cases where status <> 'ok' group by {reason}
order by 3 desc, 2
"""
_CHECKS = """
select max(error) as error, max(floquet_multiplier) as floquet_multiplier, min(min_compression) as min_compression,
    {force} as min_mesh_force
from templates
"""

_RECORDINGS = """
select count(*) as rows, count(distinct recording) as recordings, count(*) filter (status <> 'ok') as failed,
    count(distinct nullif(machine, '')) as machines, count(distinct nullif(specimen_name, '')) as specimens,
    min(nullif(date, '')) as first, max(nullif(date, '')) as last, list_sort(list(distinct source)) as sources
from cases
"""
_LABELS = """
select coalesce(health, 'unknown') as health, coalesce(kind, 'unknown') as kind,
    coalesce(label_trust, 'unknown') as label_trust, count(distinct recording) as recordings, count(*) as rows
from cases where status = 'ok' group by all order by 1 desc, 2, 3
"""
_RECORDED = ("speed_rpm", "torque", "load", "averages", "highest_order", "kept")
"""Numbers of recordings on a card."""


def database_card(database: Database) -> DatabaseFacts:
    """Return the numbers of a finished database, as plain lists and dictionaries.

    Parameters
    ----------
    database : Database
        A finished database.

    Returns
    -------
    dict
        Its keys, with numbers in SI units, but for names that end in _deg, _rpm or _db:

        - ``rig``: name, title and counts of its numbers by origin;
        - ``gear`` and ``samples_per_tooth``;
        - ``sensors``: unit by name;
        - ``rows``, ``healthy``, ``failed``, ``contact_loss``, ``templates``, ``specimens``, ``parts`` and ``bytes``;
        - ``axes``: name, unit, number of values, least and greatest value;
        - ``patterns`` and ``statuses``;
        - ``indicators`` that the database has of its first sensor: name, unit, 5 %, 50 % and 95 % quantiles of healthy
          and of damaged rows;
        - ``checks``: greatest error of the clean averages, greatest Floquet multiplier, least compression, least mesh
          force;
        - ``coverage``: None where it was not studied;
        - ``hash``, ``seed``, ``extensions``, ``versions``, ``licence``, ``citation`` and ``recipe``.

    Raises
    ------
    DatabaseError
        If the database is not finished, or damaged.
    InputError
        If it holds recordings: these have a :func:`recordings_card`.
    """
    check_complete(database)
    if database.manifest.is_measured:
        raise InputError(f"{database.store} holds recordings; use recordings_card")
    manifest, receipts = database.manifest, [*database.receipts("templates"), *database.receipts("rows")]
    rig = validated(Transmission, manifest.resolved["rig"], owner=str(database.store))
    counts = database.arrow(_COUNTS).to_pylist()[0]
    record = read_coverage(database.store, manifest)
    has_force = "min_mesh_force" in database.dataset("templates").schema.names
    has_code = "status_code" in database.dataset("features").schema.names
    by_reason = {"code": "status_code", "reason": "status_code"} if has_code else {"code": "null", "reason": "status"}
    return DatabaseFacts(
        rig=RigFacts(name=rig.name, title=rig.title, origins=origins(rig)),
        gear=manifest.resolved["sweep"]["gear"],
        samples_per_tooth=manifest.resolved["signature"]["samples_per_tooth"],
        sensors={sensor: rig.sensors[sensor].unit for sensor in database.sensors},
        rows=counts["rows"],
        healthy=counts["healthy"],
        failed=counts["failed"],
        contact_loss=counts["contact_loss"],
        specimens=counts["specimens"],
        templates=manifest.templates,
        parts=len(receipts),
        bytes=_bytes(receipts),
        axes=_axes(database, _swept(database)),
        patterns=database.arrow(_PATTERNS)["pattern"].to_pylist(),
        statuses=database.arrow(_STATUSES.format(**by_reason)).to_pylist(),
        indicators=_indicators(database),
        checks=database.arrow(_CHECKS.format(force="min(min_mesh_force)" if has_force else "null")).to_pylist()[0],
        coverage=None if record is None else {"threshold": record.threshold, **record.details},
        hash=manifest.hash,
        seed=manifest.seed,
        extensions=len(manifest.extensions),
        versions=_versions(receipts),
        licence=manifest.licence,
        citation=manifest.citation,
        recipe=manifest.recipe,
    )


def recordings_card(database: Database) -> RecordingFacts:
    """Return the numbers of a database of recordings, as plain lists and dictionaries.

    Parameters
    ----------
    database : Database
        A database of recordings, or of averages that another program simulated.

    Returns
    -------
    dict
        Its keys, with numbers in SI units, but for names that end in _rpm:

        - ``rows``, ``recordings``, ``failed`` and ``bytes``;
        - ``sources``: ``measured`` or ``simulated elsewhere``;
        - ``machines`` and ``specimens`` that are named, ``sensors`` with units, and ``gears`` with tooth counts;
        - ``dates``: the first and the last; None where none is stated;
        - ``axes``: name, unit, number of values, least and greatest value of speed, load and quality;
        - ``labels``: recordings and rows by health, kind of damage and trust in the label;
        - ``statuses``: why rows have no result;
        - ``indicators`` without a unit: name, 5 %, 50 % and 95 % quantiles of healthy and of damaged rows;
        - ``versions``, ``licence`` and ``citation``.

    Raises
    ------
    DatabaseError
        If the database is damaged.
    InputError
        If it is of a sweep: that has a :func:`database_card`.
    """
    check_complete(database)
    if not database.manifest.is_measured:
        raise InputError(f"{database.store} holds no recordings; use database_card")
    receipts = database.receipts("rows")
    counts = database.arrow(_RECORDINGS).to_pylist()[0]
    first, last = counts["first"], counts["last"]
    distinct = "select distinct {} from cases where status = 'ok' order by all"
    return RecordingFacts(
        rows=counts["rows"],
        recordings=counts["recordings"],
        failed=counts["failed"],
        sources=counts["sources"],
        machines=counts["machines"],
        specimens=counts["specimens"],
        bytes=_bytes(receipts),
        sensors=database.arrow(distinct.format("sensor, unit")).to_pylist(),
        gears=database.arrow(distinct.format("gear, teeth")).to_pylist(),
        dates=None if first is None else [first, last],
        axes=_axes(database, _RECORDED),
        labels=database.arrow(_LABELS).to_pylist(),
        statuses=database.arrow(_STATUSES.format(code="status_code", reason="status_code")).to_pylist(),
        indicators=[each for each in _indicators(database) if each["unit"] == "-"],
        versions=_versions(receipts),
        licence=database.manifest.licence,
        citation=database.manifest.citation,
    )


def _bytes(receipts: Iterable[Receipt]) -> int:
    return sum(file.bytes for receipt in receipts for file in receipt.files)


def _versions(receipts: Iterable[Receipt]) -> list[dict[str, str]]:
    """Return the versions of the libraries that the parts were made with."""
    return [dict(each) for each in sorted({tuple(sorted(receipt.versions.items())) for receipt in receipts})]


def _swept(database: Database) -> list[str]:
    """Return the columns of a sweep's parameters."""
    names = database.dataset("features").schema.names
    return [name for name in names[: names.index("min_compression")] if name not in _NOT_AXES]


def _axes(database: Database, axes: Iterable[str]) -> list[AxisFacts]:
    """Return parameters, with the number of their values, the least and the greatest."""
    columns = ", ".join(
        f'count(distinct "{name}") as "n {name}", min("{name}") as "min {name}", max("{name}") as "max {name}"'
        for name in axes
    )
    values = database.arrow(f"select {columns} from cases").to_pylist()[0]
    return [
        AxisFacts(
            name=name,
            unit=_unit(database, name),
            values=int(values[f"n {name}"]),
            least=float(values[f"min {name}"]),
            greatest=float(values[f"max {name}"]),
        )
        for name in axes
        if values[f"n {name}"]  # rows of patterns have no value of a damage's own columns
    ]


def _indicators(database: Database) -> list[IndicatorFacts]:
    """Quantiles of the first sensor's indicators that the database has, of healthy and of damaged rows."""
    names = _indicator_columns(database)
    if not names:
        return []
    quantiles = ", ".join(f'quantile_cont("{name}", {list(_QUANTILES)}) as "{name}"' for name in names)
    rows = database.arrow(
        f"select tooth > 0 as damaged, {quantiles} from cases where status = 'ok' and tooth is not null "
        "group by damaged order by damaged"
    ).to_pylist()
    by_kind = {row["damaged"]: cast(dict[str, list[float]], row) for row in rows}
    return [
        IndicatorFacts(
            name=name,
            unit=_unit(database, name),
            healthy=by_kind[False][name] if False in by_kind else None,
            damaged=by_kind[True][name] if True in by_kind else None,
        )
        for name in names
    ]


def _indicator_columns(database: Database) -> list[str]:
    """Columns of numbers of the first sensor, which stand behind its scatter."""
    schema = database.dataset("features").schema
    behind = schema.names[schema.names.index("scatter") + 1 :]
    others = tuple(f"__{sensor}" for sensor in database.sensors[1:])
    return [name for name in behind if pa.types.is_floating(schema.field(name).type) and not name.endswith(others)]


def _unit(database: Database, name: str) -> str:
    return str(database.dataset("features").schema.field(name).metadata[b"unit"].decode())
