"""Fields of the sections of rigs and recipes, read from where they are declared.

The directive ``fields`` takes the dotted path of a section and makes a table of its fields: type, unit, bounds,
default, meaning. Classes that autodoc meets get the same table below their docstring.
"""

import importlib
import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from docutils import nodes
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import text_table

from sigdb.core.fields import Vector, unit_of

_HEAD = ("field", "type", "unit", "bounds", "default", "meaning")
_BOUNDS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_NO_BREAK = "\u00a0"
_PLAIN = {int: "integer", float: "number", str: "text", bool: "true or false"}


def field_rows(section: type[BaseModel]) -> list[tuple[str, ...]]:
    """A row for each field of a section; ``sources``, which every part of a rig has, comes last."""
    names = sorted(section.model_fields, key=lambda name: name == "sources")
    return [_row(name, section.model_fields[name]) for name in names]


def _row(name: str, field: FieldInfo) -> tuple[str, ...]:
    return name, _type(field.annotation), unit_of(field), _bounds(field), _default(field), field.description or ""


def _type(annotation: Any) -> str:
    if annotation in (Vector, get_args(Vector)[0]):
        return "3 numbers"
    if annotation in _PLAIN:
        return _PLAIN[annotation]
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(args[0])
    if origin is Literal:
        return " or ".join(repr(value) for value in args)
    if origin in (Union, types.UnionType):
        return " or ".join(_type(member) for member in args if member is not type(None))
    if origin is dict:
        return f"table of {_type(args[1])}"
    if origin is tuple:
        return f"list of {_type(args[0])}"
    return getattr(annotation, "__name__", str(annotation))


def _bounds(field: FieldInfo) -> str:
    rules = []
    for rule in field.metadata:
        for key, sign in _BOUNDS.items():
            if getattr(rule, key, None) is not None:
                rules.append(f"{sign}{_NO_BREAK}{getattr(rule, key)}")
        if getattr(rule, "min_length", None) is not None:
            rules.append(f"{rule.min_length} or more")
        if getattr(rule, "pattern", None) is not None:
            rules.append("a name")
    return ", ".join(rules)


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined:
        return "required" if field.default_factory is None else ""
    if isinstance(field.default, BaseModel) or field.default in (None, "", (), {}):
        return ""
    value = list(field.default) if isinstance(field.default, tuple) else field.default
    return repr(value)


class Fields(SphinxDirective):
    """``fields`` with the dotted path of a section."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        module, _, name = self.arguments[0].rpartition(".")
        section = getattr(importlib.import_module(module), name)
        return [text_table(_HEAD, field_rows(section), code=(0,), sentence=5)]


def _append_fields(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    if what != "class" or not (isinstance(obj, type) and issubclass(obj, BaseModel)):
        return
    table = [("field", "kind", "meaning")]
    for field, kind, unit, bounds, default, meaning in field_rows(obj):
        notes = (kind, unit if unit != "-" else "", bounds, _worded(default))
        table.append((f"``{field}``", ", ".join(note for note in notes if note), meaning))
    lines += ["", ".. list-table::", "   :header-rows: 1", "   :widths: auto", ""]
    for first, *others in table:
        lines += [f"   * - {first}", *(f"     - {cell}" for cell in others)]
    lines.append("")


def _worded(default: str) -> str:
    return default if default in ("", "required") else f"default ``{default}``"


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("fields", Fields)
    # After numpydoc, which rewrites the docstring.
    app.connect("autodoc-process-docstring", _append_fields, priority=900)
    return {"parallel_read_safe": True}
