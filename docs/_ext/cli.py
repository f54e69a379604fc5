"""Help of a command, as the terminal shows it: the directive ``command`` takes its name, or nothing for the group."""

import click
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from sigdb.cli.main import cli


def command_help(name: str = "") -> str:
    """Return the text of ``sigdb NAME --help``, on a terminal of 80 columns."""
    group = click.Context(cli, info_name="sigdb", **cli.context_settings | {"max_content_width": 80})
    if not name:
        return group.get_help()
    command = cli.get_command(group, name)
    if command is None:
        raise ValueError(f"there is no command {name!r}")
    return click.Context(command, info_name=name, parent=group).get_help()


class Command(SphinxDirective):
    """``command`` with the name of a sub-command."""

    optional_arguments = 1

    def run(self) -> list[nodes.Node]:
        text = command_help(*self.arguments)
        return [nodes.literal_block(text, text, language="text")]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("command", Command)
    return {"parallel_read_safe": True}
