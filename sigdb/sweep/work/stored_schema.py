"""The schema of a database, which is written with it and holds for all its parts.

Another version of sigdb may give a new database other columns of results. A database keeps the columns that it was
begun with.
"""

import pyarrow as pa

from sigdb.core import CorruptionError, DatabaseError
from sigdb.database import (
    SCHEMA_FILE,
    TABLES_OF,
    CheckedParquet,
    Column,
    Schema,
    Store,
    finished_parts,
    read_receipt,
    read_schema,
    write_schema,
)
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.plan.schema import plan_schema, schema_conflict


def keep_schema(plan: Plan, store: Store) -> Schema:
    """Return the schema of a plan's database, which is written if ``schema.json`` is missing, damaged or of another."""
    try:
        schema = read_schema(store)
    except CorruptionError:
        schema = None
    if schema is None or schema_conflict(plan, schema):
        schema = schema_of_parts(plan, store)
        write_schema(schema, store)
    return schema


def schema_of_parts(plan: Plan, store: Store) -> Schema:
    """Return the columns of a database's finished parts; of a table without parts, the columns by the plan."""
    columns = {table: _columns_of_parts(store, stage, table) for stage, tables in TABLES_OF.items() for table in tables}
    planned = plan_schema(plan)
    schema = Schema(**{table: columns[table] or getattr(planned, table) for table in columns})
    return planned if schema_conflict(plan, schema) else schema


def _columns_of_parts(store: Store, stage: str, table: str) -> tuple[Column, ...]:
    for part in finished_parts(store, stage):
        try:
            record = read_receipt(store, stage, part).file(table)
            fields = CheckedParquet(store, record).schema
        except (DatabaseError, OSError, pa.ArrowInvalid):
            continue
        return tuple(map(Column.from_field, fields))
    return ()


def check_computable(plan: Plan, schema: Schema, store: Store) -> None:
    """Refuse to go on with a database that has columns which this version does not compute.

    Raises
    ------
    DatabaseError
        Names the column and what to do.
    """
    for table, columns in _columns_by_table(schema).items():
        for column in sorted(columns - _columns_by_table(plan_schema(plan))[table]):
            raise DatabaseError(
                f"{store}: {SCHEMA_FILE} has column {column} of {table}, which this sigdb does not compute; go on with "
                "the version that began the database"
            )


def holds_these_equations(schema: Schema) -> bool:
    """Return whether a database's templates obey the equations of this version.

    Templates of earlier versions have no static force. The damping of their rotors acts on absolute motion, and a mesh
    of theirs is open where its compression is negative.
    """
    return any(column.name == "static_force" for column in schema.templates)


def check_equations(schema: Schema, store: Store) -> None:
    """Refuse to add templates to a database whose templates obey other equations.

    Raises
    ------
    DatabaseError
        If the templates are of an earlier version.
    """
    if not holds_these_equations(schema):
        raise DatabaseError(
            f"{store}: its templates are of an earlier version of sigdb, whose equations differ; go on with the "
            "version that began the database, or make it again in another place"
        )


def computable_columns(schema: Schema, plan: Plan) -> Schema:
    """Return the columns of a schema that this version computes."""
    planned = _columns_by_table(plan_schema(plan))
    return Schema(
        **{
            table: tuple(column for column in getattr(schema, table) if column.name in names)
            for table, names in planned.items()
        }
    )


def _columns_by_table(schema: Schema) -> dict[str, set[str]]:
    return {table: {column.name for column in getattr(schema, table)} for table in vars(schema)}
