"""What a sweep will cost, measured on a sample of it."""

import tempfile
import time
from dataclasses import dataclass

import joblib
import numpy as np

from sigdb.core.streams import NOISE_BLOCK
from sigdb.database.receipts import Receipt
from sigdb.database.storage import Store
from sigdb.database.writer import write_part
from sigdb.sweep.plan import PART_TEMPLATES, Plan
from sigdb.sweep.rows import row_pieces
from sigdb.sweep.templates import make_template_part


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Size and duration of a sweep, scaled up from a sample.

    Attributes
    ----------
    bytes
        Of all parts.
    seconds
        With that many jobs, if they share the work evenly.
    jobs
        Worker processes.
    """

    bytes: float
    seconds: float
    jobs: int


def estimate(plan: Plan, jobs: int = -1) -> Estimate:
    """Make the first part of templates and the first block of rows in a temporary directory, and scale them up."""
    with tempfile.TemporaryDirectory() as folder:
        store = Store.at(folder)
        started = time.perf_counter()
        templates = make_template_part(plan, store, 0)
        template_seconds = time.perf_counter() - started

        first = plan.table(0, min(NOISE_BLOCK, plan.rows))
        rows = int(np.argmax(np.append(first["template"] >= PART_TEMPLATES, True)))
        list(row_pieces(plan, store, 0, rows))  # loads and compiles what a worker loads once
        started = time.perf_counter()
        written = write_part(
            store, "rows", 0, row_pieces(plan, store, 0, rows), plan=plan.hash, first=0, started=started
        )
        row_seconds = time.perf_counter() - started
    workers = min(joblib.effective_n_jobs(jobs), plan.row_parts)
    scale_templates, scale_rows = plan.n_templates / templates.rows, plan.rows / rows
    return Estimate(
        bytes=scale_templates * _size(templates) + scale_rows * _size(written),
        seconds=(scale_templates * template_seconds + scale_rows * row_seconds) / workers,
        jobs=workers,
    )


def _size(receipt: Receipt) -> int:
    return sum(file.bytes for file in receipt.files)
