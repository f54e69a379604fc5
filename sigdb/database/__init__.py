"""A directory is a database. A part is immutable, and it exists when its receipt exists."""

from sigdb.database.export import Export
from sigdb.database.manifest import Manifest
from sigdb.database.match import Match
from sigdb.database.reader import Database, open

__all__ = ["Database", "Export", "Manifest", "Match", "open"]
