"""The page on the paper: its figures and tables, made at build time by a run of ``pipelines/paper.toml``.

The directive ``claims`` makes the table of claims. With ``check`` or ``report`` it makes the table of the sensitivity
of this kind of claims.
"""

import json
import shutil
import tempfile
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import text_table

from sigdb.paper import PaperClaims
from sigdb.pipeline import load_recipe, run_recipe
from sigdb.report.claims import claim_table, moved_table

RECIPE = Path(__file__).parents[2] / "pipelines" / "paper.toml"


def make(folder: Path) -> None:
    """Make the pictures and ``claims.json`` in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as out:
        run = run_recipe(load_recipe(RECIPE), out, jobs=1)
        for path in (*run.figures, Path(out) / "claims.json"):
            shutil.copy(path, folder / path.name)


class Claims(SphinxDirective):
    """``claims``, or ``claims`` with a kind."""

    optional_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = Path(self.env.srcdir) / "generated" / "claims.json"
        claims = PaperClaims.from_json(json.loads(path.read_text(encoding="utf-8")))
        if self.arguments:
            table = moved_table(claims, self.arguments[0])
            return [text_table(table.head, [[cell.replace(" %", "\u00a0%") for cell in row] for row in table.rows])]
        table = claim_table(claims)
        return [text_table(table.head, table.rows, sentence=3)]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("claims", Claims)
    app.connect("builder-inited", lambda app: make(Path(app.srcdir) / "generated"))
    return {"parallel_read_safe": True}
