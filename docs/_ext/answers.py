"""The table of answers: the directive ``answers`` shows each kind with its meaning and exit code."""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import text_table

from sigdb.core import ANSWERS


class Answers(SphinxDirective):
    """``answers``, without arguments."""

    def run(self) -> list[nodes.Node]:
        rows = [[kind, form.meaning, str(form.exit_code)] for kind, form in ANSWERS.items()]
        return [text_table(["answer", "meaning", "exit code"], rows, code={0}, sentence=1)]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("answers", Answers)
    return {"parallel_read_safe": True}
