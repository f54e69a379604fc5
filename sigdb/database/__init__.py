"""A directory is a database. A part is immutable, and it exists when its receipt exists."""

from sigdb.database.manifest import Manifest
from sigdb.database.reader import Database, open

__all__ = ["Database", "Manifest", "open"]
