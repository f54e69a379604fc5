"""Tables of stored numbers: the directive ``stored`` takes a JSON file of a benchmark and the title of a table.

The title ``machine`` shows the machine and the versions that the numbers are of.
"""

import json
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import text_table


class Stored(SphinxDirective):
    """``stored FILE TITLE``; the body may name the columns, one a line, in their order."""

    required_arguments = 2
    final_argument_whitespace = True
    has_content = True

    def run(self) -> list[nodes.Node]:
        name, title = self.arguments
        path = Path(self.env.doc2path(self.env.docname)).parent / name
        self.env.note_dependency(str(path))
        document = json.loads(path.read_text(encoding="utf-8"))
        if title == "machine":
            return [nodes.paragraph("", ", ".join(f"{name} {value}" for name, value in document["machine"].items()))]
        rows = document["tables"][title]
        columns = list(self.content) or list(rows[0])
        return [
            text_table(
                [column.replace("_", " ") for column in columns],
                [[shown(row[column]) for column in columns] for row in rows],
            )
        ]


def shown(value: object) -> str:
    """Return a value as a table shows it: three digits, four of what is great or small."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return "-" if value is None else str(value)
    if 1e3 <= abs(value) < 1e5:
        return f"{value:.0f}"
    return f"{value:.3g}" if not value or 1e-3 <= abs(value) < 1e3 else f"{value:.3e}"


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("stored", Stored)
    return {"parallel_read_safe": True}
