"""Whether a database's descriptions are whole, and agree with each other and with the plans that they tell of."""

from sigdb.core import CorruptionError, InputError, SigdbError
from sigdb.database import (
    COVERAGE_FILE,
    KINDS,
    MANIFEST_FILE,
    IntegrityFinding,
    Manifest,
    PartKey,
    Store,
    finished_parts,
    read_manifest,
    rewrite,
    unsealed_or_why,
)
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import PART_TEMPLATES, Plan, plan_schema, rows_of_a_part
from sigdb.sweep.work.describe_database import SCHEMA

Owners = dict[PartKey, Plan]
"""The parts that a database is to have, each with its plan."""


def check_descriptions(store: Store) -> tuple[Owners, list[IntegrityFinding]]:
    """The parts that a database is to have, and what is wrong with the files that describe it.

    Without a readable ``sigdb.toml`` nobody knows which parts there are to be: then there are none.

    Raises
    ------
    InputError
        If there is no database.
    """
    wrong = {}
    plans: list[Plan] = []
    try:
        manifest = read_manifest(store)
    except CorruptionError:
        wrong[MANIFEST_FILE] = "is damaged or was edited"
    except InputError:
        if not any(finished_parts(store, stage) for stage in KINDS):
            raise
        wrong[MANIFEST_FILE] = "is missing"
    else:
        try:
            plans = [plan_from(record.resolved) for record in manifest.plans]
        except SigdbError as error:
            wrong[MANIFEST_FILE] = f"its recipe cannot be planned: {error}"
        if plans and not _agree(manifest, plans):
            wrong[MANIFEST_FILE] = "the hash or the numbers in it are not those of the recipe in it"
    if MANIFEST_FILE in wrong:
        plans = []
    schema, why = unsealed_or_why(store, SCHEMA)
    if why or (plans and schema != plan_schema(plans[0]).as_json()):
        wrong[SCHEMA] = why or f"its columns are not those of {MANIFEST_FILE}"
    if store.size(COVERAGE_FILE) is not None and (why := unsealed_or_why(store, COVERAGE_FILE)[1]):
        wrong[COVERAGE_FILE] = why
    remedies = {
        MANIFEST_FILE: rewrite(store),
        SCHEMA: "write it again with --repair",
        COVERAGE_FILE: f"measure it again with: sigdb coverage {store}",
    }
    findings = [
        IntegrityFinding(kind="damage", file=name, what=what, remedy=remedies[name]) for name, what in wrong.items()
    ]
    return {(stage, part): plan for plan in plans for stage in KINDS for part in part_numbers(plan, stage)}, findings


def part_numbers(plan: Plan, stage: str) -> range:
    """Numbers of a plan's parts of ``templates`` or ``rows``."""
    return plan.template_part_numbers if stage == "templates" else plan.row_part_numbers


def _agree(manifest: Manifest, plans: list[Plan]) -> bool:
    """Whether a description says what the plans that are made from it say."""
    said = [(record.hash, record.seed, record.rows, record.templates) for record in manifest.plans]
    return (
        said == [(plan.hash, plan.seed, plan.rows, plan.n_templates) for plan in plans]
        and all(plan.sensors == manifest.sensors for plan in plans)
        and manifest.part_rows == rows_of_a_part(plans[0].rows)
        and manifest.part_templates == PART_TEMPLATES
    )
