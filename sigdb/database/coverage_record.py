"""``coverage.json``: how well the templates stand for what lies between them, and when a signature is outside."""

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from sigdb.core.errors import DatabaseError
from sigdb.database.storage import publish_json

_NAME = "coverage.json"


@dataclass(frozen=True, kw_only=True)
class CoverageRecord:
    """What a study of coverage stored beside a database.

    Attributes
    ----------
    threshold
        Greatest misfit to the nearest template of a signature that the database covers; see :meth:`Database.match`.
    sensor
        Sensor for which it was found; None for the first one.
    details
        What else the study wrote.
    """

    threshold: float
    sensor: str | None = None
    details: dict[str, Any] = field(default_factory=dict)


def write_coverage(root: Path, record: CoverageRecord) -> None:
    """Publish ``coverage.json``."""
    publish_json(root / _NAME, asdict(record))


def read_coverage(root: Path) -> CoverageRecord | None:
    """What is stored, None where coverage was not studied.

    Raises
    ------
    DatabaseError
        If the file cannot be read.
    """
    path = root / _NAME
    if not path.exists():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        known = {name: content.pop(name) for name in ("threshold", "sensor") if name in content}
        record = CoverageRecord(**known, details=content.pop("details", {}) | content)
        if not math.isfinite(record.threshold) or record.threshold < 0:
            raise ValueError(f"threshold {record.threshold}")
    except (ValueError, TypeError, AttributeError) as error:
        raise DatabaseError(f"{path}: not a readable record of coverage ({error}); run sigdb coverage again") from None
    return record
