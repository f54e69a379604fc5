"""Public sets of recordings: what cited pages state of each, and how a downloaded folder becomes a database."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "FolderCheck",
    "PublicSet",
    "SetResults",
    "check_folder",
    "evaluate_set",
    "ingest_set",
    "load_public_set",
    "public_set_names",
]
