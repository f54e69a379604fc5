"""Signatures as they are written in the source, links to the names of the top level, short citations.

Autodoc expands an alias such as ``ArrayLike`` to a paragraph of unions; the source says it in a word.
"""

import ast
import dataclasses
import inspect
import re
import sys
import textwrap
from typing import Any

from docutils import nodes
from pydantic import BaseModel
from sphinx.application import Sphinx

import sigdb


def written_signature(function: Any, *, drop_first: bool) -> tuple[str, str | None]:
    """Arguments and result of a function in the words of its source."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    (definition,) = tree.body
    assert isinstance(definition, ast.FunctionDef)
    arguments = definition.args
    if drop_first:
        arguments.args = arguments.args[1:]
    return f"({ast.unparse(arguments)})", ast.unparse(definition.returns) if definition.returns else None


def _process(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None] | None:
    if isinstance(obj, type):
        if issubclass(obj, BaseModel):
            return f"({', '.join(['*', *(name for name in obj.model_fields if name != 'sources')])})", None
        if issubclass(obj, Exception):
            return None
        if dataclasses.is_dataclass(obj) or not inspect.isfunction(obj.__init__):
            return "", None
        return written_signature(obj.__init__, drop_first=True)[0], None
    if inspect.isfunction(obj):
        return written_signature(obj, drop_first=what == "method")
    return None


def _top_level(app: Sphinx, env: Any, node: Any, contnode: nodes.Element) -> nodes.Element | None:
    """A link to ``sigdb.NAME`` leads to where the name is documented."""
    target = node.get("reftarget", "")
    name = target.rpartition(".")[2]
    if node.get("refdomain") != "py" or target not in (f"sigdb.{name}", name) or name not in sigdb.__all__:
        return None
    home = getattr(sigdb, name)
    module = inspect.getmodule(home)
    if module is None or inspect.ismodule(home):
        return None
    domain = env.get_domain("py")
    ends = [full for full in domain.objects if full.endswith(f".{name}") and _resolve(full) is home]
    if not ends:
        return None
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", ends[0], node, contnode)


def _resolve(full: str) -> Any:
    module, _, name = full.rpartition(".")
    return getattr(sys.modules.get(module), name, None)


def _short_citations(app: Sphinx, document: nodes.document, name: str) -> None:
    """``[1]`` where numpydoc, to keep the pages' citations apart, has put ``[R60f2d0ee4b2c-1]``."""
    for text in list(document.findall(nodes.Text)):
        match = re.fullmatch(r"\[R[0-9a-f]+-(\d+)\]", text)
        if match:
            text.parent.replace(text, nodes.Text(f"[{match.group(1)}]"))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-signature", _process)
    app.connect("missing-reference", _top_level)
    app.connect("doctree-resolved", _short_citations)
    return {"parallel_read_safe": True}
