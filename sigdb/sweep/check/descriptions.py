"""Whether a database's descriptions are whole, and agree with each other and with the plans in them."""

from dataclasses import dataclass

from sigdb.core import CorruptionError, SigdbError
from sigdb.database import (
    COVERAGE_FILE,
    KINDS,
    MANIFEST_FILE,
    SCHEMA_FILE,
    IntegrityFinding,
    Manifest,
    PartKey,
    Schema,
    Store,
    finished_parts,
    read_manifest,
    rewrite,
    unsealed_or_why,
)
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import PART_TEMPLATES, Plan, rows_of_a_part
from sigdb.sweep.plan.schema import schema_conflict
from sigdb.sweep.work.stored_schema import schema_of_parts

Owners = dict[PartKey, Plan]
"""The parts that a database is to have, each with its plan."""


@dataclass(frozen=True, kw_only=True)
class Descriptions:
    """The content of the files that describe a database.

    Attributes
    ----------
    owners
        The parts that the database is to have; none without a readable ``sigdb.toml``.
    schema
        The columns of all parts: those of ``schema.json``, or of the parts where it is damaged; None without a readable
        ``sigdb.toml``.
    findings
        Damage of these files.
    """

    owners: Owners
    schema: Schema | None
    findings: list[IntegrityFinding]


def check_descriptions(store: Store) -> Descriptions:
    """Return the contents of the files that describe a database, and their damage.

    Raises
    ------
    InputError
        If there is no database.
    """
    plans, wrong = _read_plans(store)
    damage = {MANIFEST_FILE: wrong} if wrong else {}
    schema = None
    if plans:
        schema, damage[SCHEMA_FILE] = _read_schema(store, plans[0])
    else:
        damage[SCHEMA_FILE] = unsealed_or_why(store, SCHEMA_FILE)[1]
    if store.size(COVERAGE_FILE) is not None:
        damage[COVERAGE_FILE] = unsealed_or_why(store, COVERAGE_FILE)[1]
    remedies = {
        MANIFEST_FILE: rewrite(store),
        SCHEMA_FILE: "write it again with --repair",
        COVERAGE_FILE: f"measure it again with: sigdb coverage {store}",
    }
    return Descriptions(
        owners={(stage, part): plan for plan in plans for stage in KINDS for part in part_numbers(plan, stage)},
        schema=schema,
        findings=[
            IntegrityFinding(kind="damage", file=name, what=what, remedy=remedies[name])
            for name, what in damage.items()
            if what
        ],
    )


def part_numbers(plan: Plan, stage: str) -> range:
    """Return the numbers of a plan's parts of ``templates`` or ``rows``."""
    return plan.template_part_numbers if stage == "templates" else plan.row_part_numbers


def _read_plans(store: Store) -> tuple[list[Plan], str]:
    """Return the plans of a database, or none and the error in ``sigdb.toml``."""
    if store.size(MANIFEST_FILE) is None and any(finished_parts(store, stage) for stage in KINDS):
        return [], "is missing"
    try:
        manifest = read_manifest(store)
    except CorruptionError:
        return [], "is damaged or was edited"
    try:
        plans = [plan_from(record.resolved) for record in manifest.plans]
    except SigdbError as error:
        return [], f"its recipe cannot be planned: {error}"
    if not _agree(manifest, plans):
        return [], "the hash or the numbers in it are not those of the recipe in it"
    return plans, ""


def _read_schema(store: Store, plan: Plan) -> tuple[Schema, str]:
    """Return the columns of a database, and the error in ``schema.json``.

    The file need not have the columns that this version of sigdb gives a new database: a version that stores one more
    indicator finds nothing wrong with a database without it.
    """
    content, wrong = unsealed_or_why(store, SCHEMA_FILE)
    if content is not None:
        try:
            schema = Schema.from_json(content)
        except (KeyError, TypeError):
            wrong = "is no description of columns"
        else:
            why = schema_conflict(plan, schema)
            if not why:
                return schema, ""
            wrong = f"its columns are not those of {MANIFEST_FILE}: {why}"
    return schema_of_parts(plan, store), wrong


def _agree(manifest: Manifest, plans: list[Plan]) -> bool:
    """Return whether a description has the numbers of the plans that are made from its recipes."""
    recorded = [(record.hash, record.seed, record.rows, record.templates) for record in manifest.plans]
    return (
        recorded == [(plan.hash, plan.seed, plan.rows, plan.n_templates) for plan in plans]
        and all(plan.sensors == manifest.sensors for plan in plans)
        and manifest.part_rows == rows_of_a_part(plans[0].rows)
        and manifest.part_templates == PART_TEMPLATES
    )
