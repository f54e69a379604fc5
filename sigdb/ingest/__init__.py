"""Databases of recordings: averages of measured files with their labels.

A folder of recordings becomes a database whose rows have the columns of simulated rows, so that what works on the one
works on the other.
"""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Finding",
    "IngestSettings",
    "IngestSummary",
    "RecordingFacts",
    "enter_findings",
    "ingest",
    "repair",
    "verify",
]
