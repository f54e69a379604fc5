"""The text of a rig file: tables whose fields are explained where they stand, with sources and ranges."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from sigdb.core import unit_of
from sigdb.transmission.parts.described import NOTES


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of a rig file.

    Attributes
    ----------
    name
        Its name, in brackets for an item of a list of tables; empty for the fields at the top.
    section
        The section that its fields are of.
    values
        Values of the fields that are stated.
    sources
        Origin of numbers, by field.
    assumed
        Range, choices or tie of numbers, by field.
    """

    name: str
    section: type[BaseModel]
    values: Mapping[str, Any]
    sources: Mapping[str, str] = field(default_factory=dict)
    assumed: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


def rig_text(head: Sequence[str], tables: Sequence[Table]) -> str:
    """Return the text of a rig file whose fields are explained in the first table of each section.

    Parameters
    ----------
    head
        Lines of comment at the top, without ``#``.
    tables
        The tables, that of the top first.
    """
    lines = [f"# {line}" for line in head]
    seen: set[type[BaseModel]] = set()
    for table in tables:
        lines += [
            "",
            *([f"[{table.name}]"] if table.name else []),
            *_fields(table, explained=table.section not in seen),
        ]
        seen.add(table.section)
    return "\n".join(lines) + "\n"


def commented_text(tables: Sequence[Table]) -> str:
    """Return tables that a rig may have as comments, every field explained."""
    lines = ["", "# Further tables, where the rig has such parts."]
    for table in tables:
        lines += ["", f"# [{table.name}]", *_fields(table, explained=True)]
    return "\n".join(lines) + "\n"


def _fields(table: Table, *, explained: bool) -> Iterator[str]:
    """Lines of a table: each field with its meaning, those without a value as comments; sources and ranges last."""
    for name, declared in table.section.model_fields.items():
        if name not in table.values and (not explained or not _leaf(declared.annotation) or name in NOTES):
            continue
        if explained:
            unit = unit_of(declared)
            yield f"# {declared.description}{'' if unit == '-' else f' [{unit}]'}"
        if name not in table.values:
            yield f"# {name} ={_default(declared.default)}"
        else:
            yield f"{name} = {toml_text(table.values[name])}"
    yield from (f"sources.{name} = {toml_text(text)}" for name, text in table.sources.items())
    yield from (f"assumed.{name} = {toml_text(assumption)}" for name, assumption in table.assumed.items())


def _leaf(annotation: Any) -> bool:
    """Whether a field holds a value, not tables of its own."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return False
    return all(_leaf(part) for part in getattr(annotation, "__args__", ()))


def _default(value: Any) -> str:
    return "" if value is PydanticUndefined or value is None else f" {toml_text(value)}"


def toml_text(value: Any) -> str:
    """Return a value as TOML has it.

    Examples
    --------
    >>> toml_text({"low": 2e8, "scale": "log"})
    '{ low = 2e8, scale = "log" }'
    """
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{name} = {toml_text(item)}' for name, item in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_text(item) for item in value)}]"
    if isinstance(value, float) and abs(value) >= 1e6:
        mantissa, exponent = f"{value:e}".split("e")
        return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"
    return repr(value)
