"""Estimate of the cost of a sweep, measured on a sample of it."""

import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import joblib
import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from sigdb.core import NOISE_BLOCK, SigdbError
from sigdb.database import Receipt, Schema, Store, write_part, write_schema
from sigdb.sweep.plan.plan import PART_TEMPLATES, Plan
from sigdb.sweep.plan.schema import plan_schema
from sigdb.sweep.work.rows import make_rows, row_digests
from sigdb.sweep.work.templates import CASES_AT_ONCE, HealthyRig, template_table


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


_SECONDS = 6.0
"""Time after which no further templates are made; one batch of a large rig may take longer."""


def estimate(plan: Plan, jobs: int = -1) -> CostEstimate:
    """Estimate size and duration of a sweep from some of its templates and rows.

    Rows and their templates are made at the beginning and in the middle of the plan. Further templates are made all
    over the plan while there is time. Linear algebra uses one thread, as in a worker.

    Parameters
    ----------
    plan : Plan
        The plan.
    jobs : int, default -1
        Number of worker processes; -1 for one on each core.

    Returns
    -------
    CostEstimate
    """
    deadline = time.perf_counter() + _SECONDS
    with threadpool_limits(1), tempfile.TemporaryDirectory() as folder:
        store, schema = Store.at(folder), plan_schema(plan)
        write_schema(schema, store)
        samples = [_sample(plan, start) for start in dict.fromkeys((0, plan.rows // 2 // NOISE_BLOCK * NOISE_BLOCK))]
        template_bytes = _make_templates(plan, store, schema, {number for *_, some in samples for number in some})
        list(make_rows(plan, store, schema, samples[0][0], samples[0][0] + 1))  # loads and compiles
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
                stored=row_digests if plan.design.store == "templates" else dict,
            )
            for i, (start, stop, _) in enumerate(samples)
        ]
        row_seconds = time.perf_counter() - started
        template_seconds = _template_seconds(plan, schema, deadline)
    scale = plan.rows / sum(receipt.rows for receipt in rows)
    workers = min(joblib.effective_n_jobs(jobs), max(plan.row_parts, plan.template_parts))
    return CostEstimate(
        bytes=plan.n_templates * template_bytes + scale * sum(map(_size, rows)),
        seconds=(template_seconds + scale * row_seconds) / workers + _start_seconds(workers),
        jobs=workers,
    )


def _sample(plan: Plan, start: int) -> tuple[int, int, list[int]]:
    """Return the ids of rows of a noise block whose templates are few, and the numbers of these templates."""
    first = plan.first_row + start
    needed = plan.table(first, min(first + NOISE_BLOCK, plan.first_row + plan.rows))["template"]
    numbers = needed.unique()[:CASES_AT_ONCE]
    rows = int(np.argmin(np.append(needed.isin(numbers), False)))
    return first, first + rows, numbers.tolist()


def _make_templates(plan: Plan, store: Store, schema: Schema, numbers: set[int]) -> float:
    """Write some templates to their parts, with nothing in the places of the others, and return bytes a template."""
    size = 0
    for part in sorted({number // PART_TEMPLATES for number in numbers}):
        table = template_table(plan, schema, part, numbers)
        blank = pa.Table.from_pylist([{"template": 0, "status": "not made"}], schema=table.schema)
        places = [table.slice(i, 1) for i in range(table.num_rows)]
        whole = [places.pop(0) if number in numbers else blank for number in plan.template_range(part)]
        pieces = [{"templates": pa.concat_tables(whole)}]
        receipt = write_part(
            store, "templates", part, pieces, plan=plan.hash, first=plan.template_range(part).start, started=0.0
        )
        size += _size(receipt)
    return size / len(numbers)


def _template_seconds(plan: Plan, schema: Schema, deadline: float) -> float:
    """Estimate the seconds of all templates: each rig is prepared, each rig's templates of a part begun, each made."""
    preparing: list[float] = []
    beginning: list[float] = []
    solving: list[float] = []
    for number in _spread(plan.template_range(0).start, plan.n_templates):
        part = number // PART_TEMPLATES
        batch = [n for n in range(number, number + CASES_AT_ONCE) if n in plan.template_range(part)]
        point = plan.rig_points[plan.case(number).rig_point]
        preparing.append(_seconds(HealthyRig, plan.solver, point.rig, plan.gear))
        first = _seconds(template_table, plan, schema, part, batch[:1])
        if len(batch) > 1:
            several = _seconds(template_table, plan, schema, part, batch)
            solving.append(max(several - first, 0) / (len(batch) - 1) or several / len(batch))
        beginning.append(first - solving[-1] if solving else first)
        if time.perf_counter() > deadline:
            break
    starts = plan.template_parts + len(plan.rig_points) - 1
    begin, solve = max(float(np.mean(beginning)), 0.0), float(np.mean(solving or [0.0]))
    return len(plan.rig_points) * float(np.mean(preparing)) + starts * begin + plan.n_templates * solve


def _spread(first: int, count: int) -> Iterator[int]:
    """Yield template numbers all over a plan: the middle, the quarters, the eighths ... as far as they differ."""
    parts = 2
    while parts <= max(2 * count // CASES_AT_ONCE, 2):
        yield from (first + count * k // parts for k in range(1, parts, 2))
        parts *= 2


def _start_seconds(workers: int) -> float:
    """Measure how long workers take until they begin; a single one is the process itself."""
    if workers == 1:
        return 0.0
    start = [sys.executable, "-c", "import sigdb.sweep.work.rows, sigdb.sweep.work.templates"]
    seconds = _seconds(partial(subprocess.run, start, capture_output=True, check=False))
    return seconds * max(workers / float(joblib.cpu_count()), 1.0)


def _seconds(work: Callable[..., object], *arguments: object) -> float:
    """Return the seconds of a call; one that finds nothing to compute takes its time too."""
    started = time.perf_counter()
    with contextlib.suppress(SigdbError):
        work(*arguments)
    return time.perf_counter() - started


def _size(receipt: Receipt) -> int:
    return sum(file.bytes for file in receipt.files)
