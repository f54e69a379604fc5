"""Running a plan: what is planned minus what has a receipt, in parallel, until nothing is left."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

from sigdb.core.errors import CorruptionError, DatabaseError, InputError
from sigdb.core.version import __version__
from sigdb.database.manifest import NAME, Manifest, PlanRecord, read_manifest
from sigdb.database.receipts import KINDS, finished_parts, read_receipt, read_receipts
from sigdb.database.seal import sealed_json
from sigdb.database.storage import Store
from sigdb.sweep.columns import plan_schema
from sigdb.sweep.engines import Cluster, Engine, Processes, WorkerDiedError
from sigdb.sweep.ownership import owned
from sigdb.sweep.plan import PART_TEMPLATES, Plan
from sigdb.sweep.progress import Progress
from sigdb.sweep.reconstruction import plan_from
from sigdb.sweep.rows import make_row_part
from sigdb.sweep.templates import make_template_part

SCHEMA = "schema.json"

_WORKER_DEATHS = 3
"""How often in a row a worker may die without any part being finished before the sweep gives up."""


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
    out: str | PathLike[str],
    *,
    recipe: str = "",
    jobs: int = -1,
    scheduler: str | None = None,
    retry_failed: bool = False,
    on_progress: Callable[[Progress], Any] = lambda progress: None,
) -> Summary:
    """Make a database, or go on making it.

    Stopped at any instant, the same call goes on; rows are the same bit for bit for any number of jobs, on one machine
    or many.

    Parameters
    ----------
    plan
        From :func:`sigdb.sweep.make_plan`.
    out
        Directory of the database, or its place in an object store: ``s3://bucket/prefix``.
    recipe
        Text of the recipe, kept as given.
    jobs
        Worker processes; -1 for one on each core.
    scheduler
        Address of a Dask scheduler whose workers do the work in place of processes of this machine.
    retry_failed
        Make parts again that hold templates or rows without a result.
    on_progress
        Called with what is finished whenever that changes.

    Raises
    ------
    InputError
        If the place holds the database of another recipe, or no scheduler answers.
    DatabaseError
        If another sweep is running on it, or it cannot be written.
    """
    store = Store.at(out)
    with owned(store):
        store.clear_temporary()
        manifest = _begun(plan, store, recipe)
        if retry_failed:
            _forget_failed(store, manifest)
        plans = [plan, *(plan_from(extension.resolved) for extension in manifest.extensions)]
        return carry_out(plans, store, Cluster(scheduler) if scheduler else Processes(jobs), on_progress)


def append(plan: Plan, store: Store) -> None:
    """Add an extension to a database's description; :func:`carry_out` makes its parts. The caller owns the place."""
    known = read_manifest(store)
    replace(known, extensions=(*known.extensions, _record(plan))).write(store)


def _record(plan: Plan) -> PlanRecord:
    return PlanRecord(
        hash=plan.hash,
        seed=plan.seed,
        rows=plan.rows,
        templates=plan.n_templates,
        first_row_part=plan.first_row_part,
        first_template_part=plan.first_template_part,
        resolved=plan.resolved,
    )


def _begun(plan: Plan, store: Store, recipe: str) -> Manifest:
    """The database's description: written now, or checked to be this plan's, its recipe the newest."""
    manifest = Manifest(
        plan=_record(plan),
        part_rows=plan.part_rows,
        part_templates=PART_TEMPLATES,
        sensors=plan.sensors,
        recipe=recipe,
        sigdb_version=__version__,
    )
    try:
        known = read_manifest(store)
    except (InputError, CorruptionError):
        _check_orphans(plan, store)
        write_schema(plan, store)
        manifest.write(store)
        return manifest
    if known.hash != plan.hash:
        raise InputError(
            f"{store} was made from another recipe: {_first_difference(known.resolved, plan.resolved)}; "
            "give another directory with --out, or go back to the old recipe"
        )
    check_version(store, known.sigdb_version)
    if recipe and known.recipe != recipe:
        # The same rows, but perhaps other settings of recognition or report.
        known = replace(known, recipe=recipe)
        known.write(store)
    return known


def check_version(store: Store, version: str) -> None:
    """Refuse to go on with what another version of sigdb has begun."""
    if version != __version__:
        raise InputError(
            f"{store} was begun with sigdb {version}, this is {__version__}, whose rows may differ; go on with that "
            "version, or give another directory with --out"
        )


def write_schema(plan: Plan, store: Store) -> None:
    """Publish ``schema.json``."""
    store.put(SCHEMA, sealed_json(plan_schema(plan).as_json()))


def _check_orphans(plan: Plan, store: Store) -> None:
    """Refuse parts without a readable description, unless they are this plan's."""
    found = [(name, part) for name in KINDS for part in finished_parts(store, name)]
    readable = []
    for name, part in found:
        with suppress(CorruptionError):
            readable.append(read_receipt(store, name, part))
    if (found and not readable) or any(receipt.plan != plan.hash for receipt in readable):
        raise InputError(
            f"{store} holds parts but no readable {NAME}, and they are not all of this recipe; give the recipe that "
            f"they were made with, put {NAME} back from a copy, or give another directory with --out"
        )
    for receipt in readable:
        check_version(store, receipt.versions["sigdb"])


def _forget_failed(store: Store, manifest: Manifest) -> None:
    """Delete the receipts of parts with failures, so that these parts are missing.

    Rows go before templates: stopped in between, no row is left of a template that will be made again.
    """
    for name in reversed(KINDS):
        for receipt in read_receipts(store, name, {plan.hash for plan in manifest.plans}):
            if receipt.failed:
                store.delete(receipt.path)


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


def carry_out(
    plans: Sequence[Plan], store: Store, engine: Engine, on_progress: Callable[[Progress], Any] = lambda progress: None
) -> Summary:
    """Make what is missing of a database's plans: all templates, then all rows. The caller owns the place."""
    made = [_stage(stage, plans, store, engine, on_progress) for stage in KINDS][1]
    receipts = {name: read_receipts(store, name, {plan.hash for plan in plans}) for name in KINDS}
    return Summary(
        made=made,
        rows=sum(plan.rows for plan in plans),
        templates=sum(plan.n_templates for plan in plans),
        failed=sum(receipt.failed for receipt in receipts["rows"]),
        bytes=sum(file.bytes for both in receipts.values() for receipt in both for file in receipt.files),
    )


def _stage(
    stage: str, plans: Sequence[Plan], store: Store, engine: Engine, on_progress: Callable[[Progress], Any]
) -> int:
    """Make the missing parts of a stage; how many rows or templates were made."""
    hashes = {plan.hash for plan in plans}
    total = sum(plan.n_templates if stage == "templates" else plan.rows for plan in plans)
    finished = {receipt.part: receipt.rows for receipt in read_receipts(store, stage, hashes)}
    before = done = sum(finished.values())
    on_progress(Progress(stage=stage, done=before, total=total, before=before))
    for plan in plans:
        deaths, numbers = 0, plan.template_part_numbers if stage == "templates" else plan.row_part_numbers
        while missing := [part for part in numbers if part not in finished]:
            try:
                for receipt in engine.receipts(_MAKERS[stage], plan, store, missing):
                    finished[receipt.part] = receipt.rows
                    done += receipt.rows
                    deaths = 0
                    on_progress(Progress(stage=stage, done=done, total=total, before=before))
            except WorkerDiedError:
                deaths += 1
                finished = {receipt.part: receipt.rows for receipt in read_receipts(store, stage, hashes)}
                done = sum(finished.values())
                if deaths >= _WORKER_DEATHS:
                    raise DatabaseError(
                        f"{store}: worker processes keep dying (out of memory?); {done} of {total} {stage} are kept; "
                        "run the same command with fewer --jobs"
                    ) from None
    return total - before
