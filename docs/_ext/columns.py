"""Columns of a database: the directive ``columns`` takes a recipe, or the word recordings, and the name of a table."""

from functools import lru_cache
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import Cell, text_table

from sigdb.database.store.schema import Schema
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
        rows = [_row(column) for column in schema_of(recipe).as_json()[table]]
        return [text_table(("column", "type", "unit", "description and formula"), rows, code=(0,), sentence=3)]


def _row(column: dict[str, str]) -> tuple[Cell, ...]:
    kind = column["type"].replace("list<element: float>", "list of float")
    return column["name"], kind, column["unit"], (column["description"], column["formula"])


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("columns", Columns)
    return {"parallel_read_safe": True}
