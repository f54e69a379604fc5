"""``coverage.json``: how well the templates stand for what lies between them, and when a signature is outside."""

from dataclasses import asdict, dataclass, field
from typing import Any

from sigdb.core import DatabaseError
from sigdb.database.store.manifest import Manifest
from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.database.store.store import Store

COVERAGE_FILE = "coverage.json"


@dataclass(frozen=True, kw_only=True)
class CoverageRecord:
    """What a study of coverage stored beside a database.

    Attributes
    ----------
    threshold
        Greatest misfit to the nearest template of a signature that the database covers; see :meth:`Database.match`.
    sensor
        Sensor for which it was found.
    plans
        Hashes of the database's plans then: it holds as long as these are all.
    details
        What else the study found.
    """

    threshold: float
    sensor: str
    plans: tuple[str, ...]
    details: dict[str, Any] = field(default_factory=dict)


def write_coverage(store: Store, record: CoverageRecord) -> None:
    """Publish ``coverage.json``."""
    store.put(COVERAGE_FILE, sealed_json(asdict(record)))


def read_coverage(store: Store, manifest: Manifest) -> CoverageRecord | None:
    """What is stored, None where coverage was not studied since the database was begun or extended.

    Raises
    ------
    DatabaseError
        If the file is damaged.
    """
    if store.size(COVERAGE_FILE) is None:
        return None
    try:
        content = unsealed(store.get(COVERAGE_FILE), name=store.name_of(COVERAGE_FILE))
        record = CoverageRecord(**content | {"plans": tuple(content["plans"])})
    except (DatabaseError, ValueError, TypeError, KeyError) as error:
        raise DatabaseError(f"{error}; run sigdb coverage again") from None
    return record if record.plans == tuple(plan.hash for plan in manifest.plans) else None
