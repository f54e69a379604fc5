"""Running a plan: what is planned minus what has a receipt, in parallel, until nothing is left."""

import os
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import joblib
from filelock import FileLock, Timeout
from joblib.externals.loky.process_executor import TerminatedWorkerError
from threadpoolctl import threadpool_limits

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.version import __version__
from sigdb.database.manifest import Manifest, read_manifest
from sigdb.database.receipts import Receipt, read_receipts
from sigdb.database.storage import clear_temporary, publish_json
from sigdb.sweep.columns import plan_schema
from sigdb.sweep.plan import PART_TEMPLATES, Plan
from sigdb.sweep.rows import make_row_part
from sigdb.sweep.templates import make_template_part

_WORKER_DEATHS = 3
"""How often in a row a worker may die without any part being finished before the sweep gives up."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """What is finished so far; nothing counts when it is only dispatched.

    Attributes
    ----------
    stage
        ``templates`` or ``rows``.
    done, total
        Templates or rows.
    before
        Those that were already there when this run began.
    """

    stage: str
    done: int
    total: int
    before: int


@dataclass(frozen=True, kw_only=True)
class Summary:
    """What a run did.

    Attributes
    ----------
    made
        Rows made by this run; 0 means that there was nothing to do.
    rows, templates
        Rows and templates in the database.
    failed
        Rows without a result; their status says why.
    bytes
        Size of all parts.
    """

    made: int
    rows: int
    templates: int
    failed: int
    bytes: int


def run(
    plan: Plan,
    out: str | Path,
    *,
    recipe: str = "",
    jobs: int = -1,
    on_progress: Callable[[Progress], Any] = lambda progress: None,
) -> Summary:
    """Make a database, or go on making it.

    Stopped at any instant, the same call goes on; rows are the same bit for bit for any number of jobs.

    Parameters
    ----------
    plan
        From :func:`sigdb.sweep.make_plan`.
    out
        Directory of the database.
    recipe
        Text of the recipe, kept as given.
    jobs
        Worker processes; -1 for one on each core.
    on_progress
        Called with what is finished whenever that changes.

    Raises
    ------
    InputError
        If the directory holds the database of another recipe.
    DatabaseError
        If another sweep is running on it, or it cannot be written.
    """
    root = Path(out)
    with _owned(root):
        clear_temporary(root)
        _begin(plan, root, recipe)
        _run_parts(plan, root, "templates", jobs, on_progress)
        made = _run_parts(plan, root, "rows", jobs, on_progress)
        receipts = {name: read_receipts(root, name) for name in ("templates", "rows")}
    return Summary(
        made=made,
        rows=plan.rows,
        templates=plan.n_templates,
        failed=sum(receipt.failed for receipt in receipts["rows"]),
        bytes=sum(file.bytes for both in receipts.values() for receipt in both for file in receipt.files),
    )


@contextmanager
def _owned(root: Path) -> Iterator[None]:
    """Hold the directory's lock, which the operating system releases when its owner dies."""
    try:
        root.mkdir(parents=True, exist_ok=True)
        lock = FileLock(root / ".lock")
        with lock.acquire(timeout=0):
            owner = root / ".owner"
            owner.write_text(f"process {os.getpid()} on {socket.gethostname()}\n", encoding="utf-8")
            try:
                yield
            finally:
                owner.unlink(missing_ok=True)
    except Timeout:
        owner = root / ".owner"
        name = owner.read_text(encoding="utf-8").strip() if owner.exists() else "another process"
        raise DatabaseError(
            f"{root}: a sweep is already running on it ({name}); wait until it ends, or stop it"
        ) from None
    except OSError as error:
        raise DatabaseError(
            f"{root}: cannot be written ({error.strerror or error}); nothing that is finished is lost"
        ) from None


def _begin(plan: Plan, root: Path, recipe: str) -> None:
    """Write the database's description, or check that it is this plan's and keep its newest recipe."""
    manifest = Manifest(
        hash=plan.hash,
        seed=plan.seed,
        rows=plan.rows,
        templates=plan.n_templates,
        part_rows=plan.part_rows,
        part_templates=PART_TEMPLATES,
        sensors=plan.sensors,
        recipe=recipe,
        resolved=plan.resolved,
        sigdb_version=__version__,
    )
    if not (root / "sigdb.toml").exists():
        publish_json(root / "schema.json", plan_schema(plan).as_json())
        manifest.write(root)
        return
    known = read_manifest(root)
    if known.hash != plan.hash:
        raise InputError(
            f"{root} was made from another recipe: {_first_difference(known.resolved, plan.resolved)}; "
            "give another directory with --out, or go back to the old recipe"
        )
    if recipe and known.recipe != recipe:
        # The same rows, but perhaps other settings of recognition or report.
        replace(known, recipe=recipe).write(root)


def _first_difference(old: Any, new: Any, path: str = "") -> str:
    if isinstance(old, dict) and isinstance(new, dict):
        # A key that holds None is not in TOML.
        for key in sorted({*old, *new}):
            if old.get(key) != new.get(key) and not (path.startswith("rig") and key in ("sources", "title")):
                found = _first_difference(old.get(key), new.get(key), f"{path}.{key}" if path else key)
                if found:
                    return found
        return ""
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return next(
            (_first_difference(a, b, f"{path}.{i}") for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b),
            "",
        )
    return f"{path} was {old!r} and is now {new!r}"


_MAKERS = {"templates": make_template_part, "rows": make_row_part}


def _run_parts(plan: Plan, root: Path, stage: str, jobs: int, on_progress: Callable[[Progress], Any]) -> int:
    """Make the missing parts of a stage; how many rows or templates were made."""
    templates = (plan.template_part_numbers, plan.n_templates)
    parts, total = templates if stage == "templates" else (plan.row_part_numbers, plan.rows)
    finished = {receipt.part: receipt.rows for receipt in read_receipts(root, stage)}
    before = sum(finished.values())
    on_progress(Progress(stage=stage, done=before, total=total, before=before))
    deaths = 0
    while missing := [part for part in parts if part not in finished]:
        at_start = len(finished)
        try:
            for receipt in _parallel(stage, plan, root, missing, jobs):
                finished[receipt.part] = receipt.rows
                on_progress(Progress(stage=stage, done=sum(finished.values()), total=total, before=before))
        except TerminatedWorkerError:
            deaths = 1 if len(finished) > at_start else deaths + 1
            finished |= {receipt.part: receipt.rows for receipt in read_receipts(root, stage)}
            if deaths >= _WORKER_DEATHS:
                raise DatabaseError(
                    f"{root}: worker processes keep dying (out of memory?); {sum(finished.values())} of {total} "
                    f"{stage} are kept; run the same command with fewer --jobs"
                ) from None
    return total - before


def _parallel(stage: str, plan: Plan, root: Path, parts: Iterable[int], jobs: int) -> Iterator[Receipt]:
    """Receipts as parts are finished. One thread in each process: the same sums in the same order, bit for bit."""
    with threadpool_limits(1), joblib.parallel_config("loky", inner_max_num_threads=1):
        pool = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="n_jobs")
        yield from pool(joblib.delayed(_MAKERS[stage])(plan, root, part) for part in parts)
