"""Estimate of the cost of a sweep, measured on a sample of it."""

import tempfile
import time
from dataclasses import dataclass

import joblib
import numpy as np

from sigdb.core import NOISE_BLOCK
from sigdb.database import Receipt, Store, write_part, write_schema
from sigdb.sweep.plan.plan import PART_TEMPLATES, Plan
from sigdb.sweep.plan.schema import plan_schema
from sigdb.sweep.work.rows import make_rows
from sigdb.sweep.work.templates import make_template_part


@dataclass(frozen=True, kw_only=True)
class CostEstimate:
    """Size and duration of a sweep, scaled up from a sample.

    Attributes
    ----------
    bytes : float
        Size of all parts.
    seconds : float
        Duration with ``jobs`` processes that share the work evenly.
    jobs : int
        Number of worker processes.
    """

    bytes: float
    seconds: float
    jobs: int


_SAMPLE_PARTS = 2
"""Most parts of templates that are made for a sample of rows."""


def estimate(plan: Plan, jobs: int = -1) -> CostEstimate:
    """Estimate size and duration from some rows of the beginning and of the middle of a plan, scaled up."""
    with tempfile.TemporaryDirectory() as folder:
        store, schema = Store.at(folder), plan_schema(plan)
        write_schema(schema, store)
        samples = [_sample(plan, start) for start in dict.fromkeys((0, plan.rows // 2 // NOISE_BLOCK * NOISE_BLOCK))]
        parts = sorted({part for _, _, needed in samples for part in needed})
        if plan.template_parts > 1:
            make_template_part(plan, store, parts[0])  # loads and compiles what a worker loads once
        started = time.perf_counter()
        templates = [make_template_part(plan, store, part) for part in parts]
        template_seconds = time.perf_counter() - started
        list(make_rows(plan, store, schema, *samples[0][:2]))
        started = time.perf_counter()
        rows = [
            write_part(
                store,
                "rows",
                i,
                make_rows(plan, store, schema, start, stop),
                plan=plan.hash,
                first=start,
                started=time.perf_counter(),
            )
            for i, (start, stop, _) in enumerate(samples)
        ]
        row_seconds = time.perf_counter() - started
    scale_templates = plan.n_templates / sum(receipt.rows for receipt in templates)
    scale_rows = plan.rows / sum(receipt.rows for receipt in rows)
    workers = min(joblib.effective_n_jobs(jobs), max(plan.row_parts, plan.template_parts))
    return CostEstimate(
        bytes=scale_templates * sum(map(_size, templates)) + scale_rows * sum(map(_size, rows)),
        seconds=(scale_templates * template_seconds + scale_rows * row_seconds) / workers,
        jobs=workers,
    )


def _sample(plan: Plan, start: int) -> tuple[int, int, list[int]]:
    """Return the ids of rows of a noise block whose templates are in few parts, and these parts."""
    first = plan.first_row + start
    needed = plan.table(first, min(first + NOISE_BLOCK, plan.first_row + plan.rows))["template"] // PART_TEMPLATES
    parts = needed.unique()[:_SAMPLE_PARTS]
    rows = int(np.argmin(np.append(needed.isin(parts), False)))
    return first, first + rows, parts.tolist()


def _size(receipt: Receipt) -> int:
    return sum(file.bytes for file in receipt.files)
