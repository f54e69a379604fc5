"""Columns of a database: the directive ``columns`` takes a recipe, or the word recordings, and the name of a table."""

from functools import lru_cache
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import Cell, text_table

from sigdb.database.store.schema import Column, Schema
from sigdb.ingest.schema import measured_schema
from sigdb.pipeline import load_recipe
from sigdb.sweep.plan.schema import plan_schema

ROOT = Path(__file__).parents[2]


@lru_cache
def schema_of(recipe: str) -> Schema:
    """Schema of the database that a recipe makes, or that of recordings."""
    return measured_schema() if recipe == "recordings" else plan_schema(load_recipe(ROOT / recipe).plan())


class Columns(SphinxDirective):
    """``columns RECIPE TABLE``."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        recipe, table = self.arguments
        if recipe != "recordings":
            self.env.note_dependency(str(ROOT / recipe))
        has_roles = table != "templates"
        rows = [_row(column, has_roles) for column in getattr(schema_of(recipe), table)]
        heads = ("column", "type", "unit", *(["role"] if has_roles else []), "description and formula")
        return [text_table(heads, rows, code=(0,), sentence=len(heads) - 1)]


def _row(column: Column, has_roles: bool) -> tuple[Cell, ...]:
    kind = str(column.type).replace("list<element: float>", "list of float")
    roles = (str(column.role),) if has_roles else ()
    return column.name, kind, column.unit, *roles, (column.help, column.formula)


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("columns", Columns)
    return {"parallel_read_safe": True}
