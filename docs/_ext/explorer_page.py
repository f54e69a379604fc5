"""The explorer without a server, which the page on it embeds."""

from pathlib import Path

from sphinx.application import Sphinx

import sigdb
from sigdb.explorer import DEFAULT_RIG, write_static


def write(app: Sphinx, error: Exception | None) -> None:
    """Write the page beside the built documentation."""
    if error is None and app.builder.format == "html":
        write_static(sigdb.load_transmission(DEFAULT_RIG), DEFAULT_RIG, Path(app.outdir) / "explorer.html")


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("build-finished", write)
    return {"parallel_read_safe": True}
