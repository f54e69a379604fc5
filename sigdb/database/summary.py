"""What a database is, in numbers, for its card."""

from typing import Any

import pyarrow as pa

from sigdb.core import validated
from sigdb.database.database import Database, check_complete
from sigdb.database.matching.outside_threshold import read_coverage
from sigdb.transmission import Transmission, origins

_NOT_AXES = ("id", "status", "template", "gear", "shaft", "pattern", "min_compression", "contact_loss")
_QUANTILES = (0.05, 0.5, 0.95)


def database_card(database: Database) -> dict[str, Any]:
    """Numbers of a finished database, as plain lists and dictionaries.

    Returns
    -------
    dict
        ``rig`` (name, title, counts of its numbers by origin), ``gear``, ``samples_per_tooth``, ``sensors``
        (unit by name); ``rows``, ``healthy``, ``failed``, ``contact_loss``, ``templates``, ``specimens``, ``parts``,
        ``bytes``; ``axes`` (name, unit, how many values, least, greatest); ``patterns``; ``statuses``;
        ``indicators`` of the first sensor (name, unit, 5 %, 50 % and 95 % of healthy and of damaged rows); ``checks``
        (greatest error of the clean averages, greatest Floquet multiplier, least compression); ``coverage`` (None where
        it was not studied); ``hash``, ``seed``, ``extensions``, ``versions``, ``licence``, ``citation``, ``recipe``.
        SI units, but for names that end in _deg, _rpm or _db.

    Raises
    ------
    DatabaseError
        If it is not finished, or damaged.
    """
    check_complete(database)
    manifest, receipts = database.manifest, [*database.receipts("templates"), *database.receipts("rows")]
    rig = validated(Transmission, manifest.resolved["rig"], owner=str(database.store))
    (counts,) = _asked(
        database,
        "select count(*) as rows, count(*) filter (tooth = 0) as healthy, count(*) filter (status <> 'ok') as failed, "
        "count(*) filter (contact_loss) as contact_loss, count(distinct specimen) as specimens from cases",
    )
    record = read_coverage(database.store, manifest)
    return {
        "rig": {"name": rig.name, "title": rig.title, "origins": origins(rig)},
        "gear": manifest.resolved["sweep"]["gear"],
        "samples_per_tooth": manifest.resolved["signature"]["samples_per_tooth"],
        "sensors": {sensor: rig.sensors[sensor].unit for sensor in database.sensors},
        **counts,
        "templates": manifest.templates,
        "parts": len(receipts),
        "bytes": sum(file.bytes for receipt in receipts for file in receipt.files),
        "axes": _axes(database),
        "patterns": [
            one["pattern"]
            for one in _asked(database, "select distinct pattern from cases where pattern <> '' order by 1")
        ],
        "statuses": _asked(
            database,
            "select status, count(*) as rows from cases where status <> 'ok' group by 1 order by 2 desc, 1",
        ),
        "indicators": _indicators(database),
        "checks": _asked(
            database,
            "select max(error) as error, max(floquet_multiplier) as floquet_multiplier, "
            "min(min_compression) as min_compression from templates",
        )[0],
        "coverage": None if record is None else {"threshold": record.threshold, **record.details},
        "hash": manifest.hash,
        "seed": manifest.seed,
        "extensions": len(manifest.extensions),
        "versions": [dict(one) for one in sorted({tuple(sorted(receipt.versions.items())) for receipt in receipts})],
        "licence": manifest.licence,
        "citation": manifest.citation,
        "recipe": manifest.recipe,
    }


def _asked(database: Database, query: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = database.arrow(query).to_pylist()
    return rows


def _axes(database: Database) -> list[dict[str, Any]]:
    """Parameters that take several values: how many, the least and the greatest."""
    schema = database.dataset("features").schema
    names = schema.names[: schema.names.index("min_compression")]
    asked = [name for name in names if name not in _NOT_AXES]
    (found,) = _asked(
        database,
        "select "
        + ", ".join(
            f'count(distinct "{name}") as "n {name}", min("{name}") as "min {name}", max("{name}") as "max {name}"'
            for name in asked
        )
        + " from cases",
    )
    return [
        {
            "name": name,
            "unit": schema.field(name).metadata[b"unit"].decode(),
            "values": int(found[f"n {name}"]),
            "least": float(found[f"min {name}"]),
            "greatest": float(found[f"max {name}"]),
        }
        for name in asked
    ]


def _indicators(database: Database) -> list[dict[str, Any]]:
    """Quantiles of the first sensor's indicators that the database has, of healthy and of damaged rows."""
    schema = database.dataset("features").schema
    names = _indicator_columns(database)
    if not names:
        return []
    asked = ", ".join(f'quantile_cont("{name}", {list(_QUANTILES)}) as "{name}"' for name in names)
    rows = _asked(
        database,
        f"select tooth > 0 as damaged, {asked} from cases where status = 'ok' group by damaged order by damaged",
    )
    found = {"damaged" if row["damaged"] else "healthy": row for row in rows}
    return [
        {
            "name": name,
            "unit": schema.field(name).metadata[b"unit"].decode(),
            **{kind: found[kind][name] if kind in found else None for kind in ("healthy", "damaged")},
        }
        for name in names
    ]


def _indicator_columns(database: Database) -> list[str]:
    """Columns of numbers of the first sensor, which stand behind its scatter."""
    schema = database.dataset("features").schema
    behind = schema.names[schema.names.index("scatter") + 1 :]
    others = tuple(f"__{sensor}" for sensor in database.sensors[1:])
    return [name for name in behind if pa.types.is_floating(schema.field(name).type) and not name.endswith(others)]
