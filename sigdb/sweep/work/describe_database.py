"""The description of a database, written when a sweep begins and checked when it goes on."""

from contextlib import suppress
from dataclasses import replace

from sigdb.core import CorruptionError, InputError, __version__
from sigdb.database import (
    KINDS,
    MANIFEST_FILE,
    Manifest,
    PlanRecord,
    Store,
    finished_parts,
    read_manifest,
    read_receipt,
)
from sigdb.sweep.plan.plan import PART_TEMPLATES, Plan
from sigdb.sweep.work.stored_schema import keep_schema


def plan_record(plan: Plan) -> PlanRecord:
    """Return the record of a plan that a database keeps."""
    return PlanRecord(
        hash=plan.hash,
        seed=plan.seed,
        rows=plan.rows,
        templates=plan.n_templates,
        first_row_part=plan.first_row_part,
        first_template_part=plan.first_template_part,
        resolved=plan.resolved,
    )


def describe_database(plan: Plan, store: Store, recipe: str, form: str = "rows") -> Manifest:
    """Return a database's description. It is written if there is none; otherwise it gets the newest recipe.

    Parameters
    ----------
    plan
        The plan of the database.
    store
        Where it lies.
    recipe
        Text of the recipe.
    form
        Stored form of the rows that are still to be made: ``rows`` or ``templates``.

    Raises
    ------
    InputError
        If the database is of another plan or another version of sigdb.
    """
    manifest = Manifest(
        plan=plan_record(plan),
        part_rows=plan.part_rows,
        part_templates=PART_TEMPLATES,
        sensors=plan.sensors,
        recipe=recipe,
        sigdb_version=__version__,
        store=form,
    )
    begun = _read_if_whole(store)
    if begun is None:
        _check_orphans(plan, store)
        keep_schema(plan, store)
        manifest.write(store)
        return manifest
    if begun.hash != plan.hash:
        raise InputError(
            f"{store} was made from another recipe: {_first_difference(begun.resolved, plan.resolved)}; "
            "give another directory with --out, or go back to the old recipe"
        )
    check_version(store, begun.sigdb_version)
    if (recipe and begun.recipe != recipe) or begun.store != form:
        # The same rows, but perhaps other settings of recognition or report.
        begun = replace(begun, recipe=recipe or begun.recipe, store=form)
        begun.write(store)
    return begun


def _read_if_whole(store: Store) -> Manifest | None:
    """Return a database's description; None where it is missing or damaged."""
    if store.size(MANIFEST_FILE) is None:
        return None
    try:
        return read_manifest(store)
    except CorruptionError:
        return None


def check_version(store: Store, version: str) -> None:
    """Refuse to go on with a database that another version of sigdb has begun."""
    if version != __version__:
        raise InputError(
            f"{store} was begun with sigdb {version}, this is {__version__}, whose rows may differ; go on with that "
            "version, or give another directory with --out"
        )


def _check_orphans(plan: Plan, store: Store) -> None:
    """Refuse parts without a readable description, unless they are this plan's."""
    finished = [(name, part) for name in KINDS for part in finished_parts(store, name)]
    readable = []
    for name, part in finished:
        with suppress(CorruptionError):
            readable.append(read_receipt(store, name, part))
    if (finished and not readable) or any(receipt.plan != plan.hash for receipt in readable):
        raise InputError(
            f"{store} holds parts but no readable {MANIFEST_FILE}, and they are not all of this recipe; give the "
            f"recipe that they were made with, put {MANIFEST_FILE} back from a copy, or give another "
            "directory with --out"
        )
    for receipt in readable:
        check_version(store, receipt.versions["sigdb"])


def _first_difference(old: object, new: object, path: str = "") -> str:
    """Return the first key whose values differ, with both values; empty where none do.

    Items of lists count from 1, but for those of the rig, whose dotted paths count from 0.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        # A key that holds None is not in TOML.
        for key in sorted({*old, *new}):
            if old.get(key) != new.get(key) and not (path.startswith("rig") and key in ("sources", "assumed", "title")):
                difference = _first_difference(old.get(key), new.get(key), f"{path}.{key}" if path else key)
                if difference:
                    return difference
        return ""
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True), 0 if path.startswith("rig") else 1)
        return next((_first_difference(a, b, f"{path}.{i}") for i, (a, b) in pairs if a != b), "")
    return f"{path} was {old!r} and is now {new!r}"
