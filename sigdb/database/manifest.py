"""``sigdb.toml``: what a database is, and the only thing that says so."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.fields import read_toml
from sigdb.database.storage import publish_text

FORMAT = 1
"""Version of the layout."""


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """The content of ``sigdb.toml``.

    Attributes
    ----------
    hash
        SHA-256 of all that determines the rows.
    seed
        Seed of specimens and noise.
    rows, templates
        Number of rows and templates when the sweep is complete.
    part_rows, part_templates
        Rows and templates in a part: part k holds ids ``part_rows k`` up to ``part_rows (k + 1)``.
    sensors
        Stored sensors; the first one's columns have no suffix.
    recipe
        The recipe as given, TOML text.
    resolved
        All that the hash covers: sweep, measurement, signature and rig, with every default filled in.
    sigdb_version, format, licence, citation
        What made it, and how it may be used.
    """

    hash: str
    seed: int
    rows: int
    templates: int
    part_rows: int
    part_templates: int
    sensors: tuple[str, ...]
    recipe: str
    resolved: dict[str, Any]
    sigdb_version: str
    format: int = FORMAT
    licence: str = "CC0-1.0"
    citation: str = "Cite sigdb by its CITATION.cff, and the sources of the rig named in this file."
    extensions: tuple[dict[str, Any], ...] = field(default=())

    def write(self, root: Path) -> None:
        """Publish it as ``sigdb.toml``."""
        publish_text(root / "sigdb.toml", tomli_w.dumps(_without_none(asdict(self)), multiline_strings=True))


def read_manifest(root: Path) -> Manifest:
    """Read ``sigdb.toml`` of a database.

    Raises
    ------
    InputError
        If the directory is no database.
    DatabaseError
        If its description cannot be read, or is of a format that this version does not read.
    """
    path = root / "sigdb.toml"
    if not path.exists():
        raise InputError(
            f"{root} is not a sigdb database (it has no sigdb.toml); "
            f"make one with: python -m sigdb.sweep RECIPE --out {root}"
        )
    try:
        content = read_toml(path)
        if content.get("format") != FORMAT:
            raise DatabaseError(
                f"{path}: format {content.get('format')!r} is not the format {FORMAT} that this sigdb reads"
            )
        return Manifest(**content | {key: tuple(content[key]) for key in ("sensors", "extensions")})
    except (InputError, TypeError, KeyError) as error:
        raise DatabaseError(f"{path}: not a readable database description ({error})") from None


def _without_none(value: Any) -> Any:
    """TOML has no null: a key that holds none is left out."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [_without_none(item) for item in value]
    return value
