"""``sigdb.toml``, the description of a database."""

import os
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from sigdb.core import DatabaseError, InputError
from sigdb.database.store.seal import sealed_toml, unsealed
from sigdb.database.store.store import DamagedFileError, Store

FORMAT = 2
"""Version of the layout."""

MANIFEST_FILE = "sigdb.toml"

MEASURED_SENSOR = "measured"
"""Name of the stored sensor of a database of recordings; the column ``sensor`` has that of each row."""


@dataclass(frozen=True, kw_only=True)
class PlanRecord:
    """A plan as a database keeps it: enough to make any of its parts again.

    Attributes
    ----------
    hash
        SHA-256 of ``resolved``.
    seed
        Seed of specimens and noise.
    rows, templates
        Numbers of rows and templates of the plan.
    first_row_part, first_template_part
        Numbers of its first parts of rows and of templates.
    resolved
        All settings that determine the rows: sweep, measurement, signature and rig, with every default filled in. Those
        of recordings have the section ``ingest`` in place of ``sweep`` and ``measurement``.
    parts
        Number of its parts of rows, where the number of rows is not known before they are made; None otherwise.
    grown
        SHA-256 over the lists of recordings that were added later with the same settings; None where there are none.
    """

    hash: str
    seed: int
    rows: int
    templates: int
    first_row_part: int = 0
    first_template_part: int = 0
    resolved: dict[str, Any]
    parts: int | None = None
    grown: str | None = None


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """The content of ``sigdb.toml``.

    Attributes
    ----------
    plan
        The first plan of the database.
    extensions
        The plans that were appended later, in order.
    part_rows, part_templates
        Rows and templates in a part: part k holds ids ``part_rows k`` up to ``part_rows (k + 1)``.
    sensors
        Stored sensors; the first one's columns have no suffix.
    recipe
        The recipe, TOML text as the user wrote it.
    sigdb_version, format
        The version of sigdb that made the database, and that of the layout.
    licence, citation
        Terms of use.
    store
        Stored form of the rows of parts that are still to be made: ``rows``, or ``templates`` of which they are made
        when they are read. The receipt of a part says how the part is stored.
    """

    plan: PlanRecord
    part_rows: int
    part_templates: int
    sensors: tuple[str, ...]
    recipe: str
    sigdb_version: str
    format: int = FORMAT
    licence: str = "CC0-1.0"
    citation: str = "Cite sigdb by its CITATION.cff, and the sources of the rig named in this file."
    extensions: tuple[PlanRecord, ...] = field(default=())
    store: str = "rows"

    @property
    def hash(self) -> str:
        """Hash of the first plan."""
        return self.plan.hash

    @property
    def seed(self) -> int:
        """Seed of the first plan."""
        return self.plan.seed

    @property
    def resolved(self) -> dict[str, Any]:
        """Settings that determine the rows of the first plan."""
        return self.plan.resolved

    @property
    def plans(self) -> tuple[PlanRecord, ...]:
        """The first plan and the extensions."""
        return (self.plan, *self.extensions)

    @property
    def is_measured(self) -> bool:
        """Whether the rows come from recordings, or from averages that others simulated, and not from a sweep."""
        return "ingest" in self.resolved

    @property
    def rows(self) -> int:
        """Number of rows of all plans; 0 where recordings say how many rows they give."""
        return sum(plan.rows for plan in self.plans)

    @property
    def templates(self) -> int:
        """Number of templates of all plans."""
        return sum(plan.templates for plan in self.plans)

    def with_last_plan(self, plan: PlanRecord) -> "Manifest":
        """Return the manifest with another last plan."""
        if not self.extensions:
            return replace(self, plan=plan)
        return replace(self, extensions=(*self.extensions[:-1], plan))

    def write(self, store: Store) -> None:
        """Publish the manifest as ``sigdb.toml``."""
        content = _without_none(asdict(self))
        if self.store == "rows":  # which earlier versions know nothing of
            del content["store"]
        store.put(MANIFEST_FILE, sealed_toml(content))


def is_database(location: object) -> bool:
    """Return whether a path or a URI is the place of a database."""
    if not isinstance(location, str | os.PathLike):
        return False
    place = os.fspath(location)
    return (
        Store.at(place).size(MANIFEST_FILE) is not None if "://" in place else (Path(place) / MANIFEST_FILE).is_file()
    )


def read_manifest(store: Store) -> Manifest:
    """Read ``sigdb.toml`` of a database.

    Raises
    ------
    InputError
        If there is no database.
    CorruptionError
        If the description is damaged.
    DatabaseError
        If the database has a format that this version does not read.
    """
    if store.size(MANIFEST_FILE) is None:
        raise InputError(
            f"{store} is not a sigdb database (it has no {MANIFEST_FILE}); make one with: "
            f"python -m sigdb.sweep RECIPE --out {store}"
        )
    name = store.name_of(MANIFEST_FILE)
    text = store.get(MANIFEST_FILE)
    if text.startswith(b"hash = "):
        raise DatabaseError(
            f"{name}: format 1 is not the format {FORMAT} that this sigdb reads; make the database again"
        )
    try:
        content = unsealed(text, name=name)
    except DamagedFileError as error:
        raise error.with_remedy(rewrite(store)) from None
    if content.get("format") != FORMAT:
        raise DatabaseError(
            f"{name}: format {content.get('format')!r} is not the format {FORMAT} that this sigdb reads"
        )
    try:
        return Manifest(
            **content
            | {
                "plan": PlanRecord(**content["plan"]),
                "extensions": tuple(PlanRecord(**plan) for plan in content["extensions"]),
                "sensors": tuple(content["sensors"]),
            }
        )
    except (TypeError, KeyError) as error:
        raise DatabaseError(f"{name}: not a readable database description ({error})") from None


def rewrite(store: Store) -> str:
    """Return the remedy for a damaged description."""
    return f"write it again from the recipe that the database was made with: sigdb sweep RECIPE --out {store}"


def _without_none(value: Any) -> Any:
    """TOML has no null: a key that holds none is left out."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [_without_none(item) for item in value]
    return value
