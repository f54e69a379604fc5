"""Sphinx configuration: Markdown pages, docstrings in numpydoc's manner, tables generated from the code."""

import sys
from importlib.resources import files
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from sigdb.core.version import __version__

project = "sigdb"
author = "the sigdb authors"
copyright = "the sigdb authors"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "numpydoc",
    "cli",
    "columns",
    "explorer_page",
    "fields",
    "paper",
    "pictures",
    "signatures",
    "answers",
    "stored",
]

exclude_patterns = ["_build", "_ext", "_static", "generated", "images"]
source_suffix = {".md": "markdown"}

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autosummary_generate = False
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# One file with its fonts, which the pages take from their own folder: they are read without a network.
mathjax_path = "tex-svg.js"

html_theme = "pydata_sphinx_theme"
html_static_path = ["_static", str(files("sphinx-mathjax-offline") / "static" / "mathjax" / mathjax_path)]
html_css_files = ["tables.css"]
html_title = f"sigdb {version}"
html_show_sourcelink = False
html_show_copyright = False
html_theme_options = {
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "show_nav_level": 2,
    "footer_start": [],
    "footer_end": [],
}
html_sidebars = {"index": []}
