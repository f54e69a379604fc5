"""Databases of signatures: stored tables, queries, match and export.

A directory is a database. A part is immutable; it exists when its receipt exists.
"""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Database",
    "Export",
    "IntegrityFinding",
    "LearningSet",
    "Manifest",
    "Match",
    "OpenTable",
    "OtherBitsWarning",
    "QueryCost",
    "Split",
    "database_card",
    "make_split",
    "open",
    "recordings_card",
]
