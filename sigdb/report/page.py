"""HTML pages: one environment of templates for all of them, and pictures as data addresses.

A page is one file without scripts that needs no network. Its template stands in the folder ``templates`` and extends
``base.html``; ``parts.html`` holds the table, the captioned picture and the list of sentences that pages share. Every
value is escaped, and a name that a template uses and the page lacks is an error.
"""

import base64
import io
from functools import cache
from typing import Any, NamedTuple

import matplotlib
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from sigdb.core import __version__


class CaptionedFigure(NamedTuple):
    """A picture with its heading and caption."""

    heading: str
    caption: str
    figure: Figure


class Cell(NamedTuple):
    """A cell of a table: a value, and its interval in smaller letters."""

    text: str
    interval: str = ""


def page(template: str, *, title: str, **values: object) -> str:
    """Return a whole page.

    Parameters
    ----------
    template
        File in the folder ``templates``.
    title
        Heading, as text.
    **values
        Values that the template shows. Text is escaped.

    Raises
    ------
    jinja2.UndefinedError
        If the template uses a name that is not among the values.
    """
    return environment().get_template(template).render(title=title, sigdb_version=__version__, **values)


@cache
def environment() -> Environment:
    """Return the environment of all templates: it escapes every value and allows no undefined name."""
    templates = Environment(
        loader=PackageLoader("sigdb.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates.filters |= {"svg": svg, "png": png}
    return templates


def svg(figure: Figure) -> str:
    """Return a picture as an SVG in a data address."""
    with matplotlib.rc_context({"svg.hashsalt": "sigdb"}):  # the same page each time
        return _address("svg+xml", figure, format="svg", dpi=200, metadata={"Date": None, "Creator": None})


def png(figure: Figure) -> str:
    """Return a picture as a PNG in a data address."""
    return _address("png", figure, format="png", dpi=150, metadata={"Software": None})


def _address(kind: str, figure: Figure, **options: Any) -> str:
    content = io.BytesIO()
    figure.savefig(content, **options)
    return f"data:image/{kind};base64,{base64.b64encode(content.getvalue()).decode()}"
