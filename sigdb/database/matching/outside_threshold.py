"""``coverage.json``: the coverage of the grid, and the threshold above which a signature is outside the database."""

from dataclasses import asdict, dataclass, field
from typing import Any

from sigdb.database.store.manifest import Manifest
from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.database.store.store import DamagedFileError, FileError, Store

COVERAGE_FILE = "coverage.json"


@dataclass(frozen=True, kw_only=True)
class CoverageRecord:
    """The result of a study of the grid's coverage, as a database stores it.

    Attributes
    ----------
    threshold
        Greatest residual distance to the nearest template of a signature inside the database; see
        :meth:`Database.match`.
    sensor
        The sensor of the study.
    plans
        Hashes of the database's plans at the time of the study. The record is void once the database has others.
    details
        Further results of the study by name.
    """

    threshold: float
    sensor: str
    plans: tuple[str, ...]
    details: dict[str, Any] = field(default_factory=dict)


def write_coverage(store: Store, record: CoverageRecord) -> None:
    """Publish ``coverage.json``."""
    store.put(COVERAGE_FILE, sealed_json(asdict(record)))


def read_coverage(store: Store, manifest: Manifest) -> CoverageRecord | None:
    """Return the stored record; None if coverage was not studied since the database was begun or extended.

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
    except FileError as error:
        raise error.with_remedy("run sigdb coverage again") from None
    except (ValueError, TypeError, KeyError):
        problem = "is not a record of coverage"
        raise DamagedFileError(store.name_of(COVERAGE_FILE), problem, "run sigdb coverage again") from None
    return record if record.plans == tuple(plan.hash for plan in manifest.plans) else None
