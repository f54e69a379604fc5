"""Statements that a query may be: one SELECT of views, with functions that only compute, and not too much."""

import json
import re
from collections.abc import Iterator, Sequence
from functools import cache
from math import prod
from typing import Any

import duckdb

from sigdb.core import InputError, visible_text

_LONGEST_LINE = 250
"""Letters of a message of the parser that are shown."""

_LONGEST = 1_000_000
"""Characters of a statement."""

_LARGEST = 10_000
"""Product of all lengths that a statement gives as numbers: a vector of DuckDB has 2048 such values."""

_TABLE_FUNCTIONS = frozenset({"range", "generate_series", "unnest", "json_each", "json_tree"})
"""Functions that a query may have as tables; all others read files, settings or the state of DuckDB."""

_ANY_VALUE = frozenset({"random", "setseed", "uuid", "uuidv4", "uuidv7", "gen_random_uuid", "error", "stats"})
"""Functions with side effects that a query may call."""

_SETTINGS = frozenset({"current_setting", "getvariable", "which_secret", "getenv"})

_RANGES = frozenset({"range", "generate_series"})

_LENGTHS = dict.fromkeys(("repeat", "lpad", "rpad", "bitstring", "list_resize", "array_resize"), 1) | dict.fromkeys(
    _RANGES, 0
)
"""Functions whose result is as long as a number says, with the place of their first such number."""

_FORMATS = frozenset({"printf", "format"})
"""Functions whose result is as long as a number in their first text says."""

_SHOWN = frozenset({'"tables"', '"all_tables"'})

Node = dict[str, Any]
"""A node of a parsed statement, as DuckDB describes it in JSON."""


def check_statement(cursor: duckdb.DuckDBPyConnection, text: str, owner: str = "query") -> None:
    """Refuse a text that is not one SELECT statement, or that DuckDB could not stop or that reads more than the views.

    Parameters
    ----------
    cursor
        A connection that parses it.
    text
        The statement.
    owner
        The text's name in messages.

    Raises
    ------
    InputError
        With the reason.
    """
    if not isinstance(text, str):
        raise InputError(f"{owner} {text!r} must be one SELECT statement, as text")
    if len(text) > _LONGEST:
        raise InputError(f"{owner}: it has {len(text)} characters; the most are {_LONGEST}")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise InputError(f"{owner}: character {error.start + 1} is no text in UTF-8; write it again") from None
    nodes = [*_nodes(_parsed(cursor, text, owner))]
    for node in nodes:
        if why := _why_refused(node):
            raise InputError(f"{owner}: {printable_line(why)}")
    _check_lengths(nodes, owner)


def _parsed(cursor: duckdb.DuckDBPyConnection, text: str, owner: str) -> Node:
    rows = cursor.execute("select json_serialize_sql($1::varchar)", [text]).fetchall()
    try:
        parsed: Node = json.loads(rows[0][0])
    except RecursionError:
        raise InputError(f"{owner}: its expressions are nested too deeply; write it with fewer levels") from None
    if parsed["error"] and parsed["error_type"] == "parser":
        raise InputError(f"{owner}: {printable_line(parsed['error_message'])}")
    if parsed["error"] or len(parsed["statements"]) != 1:
        shown = text if len(text) <= 200 else f"{text[:200]}..."
        raise InputError(f"{owner} {shown!r} must be one SELECT statement; a database is read-only")
    return parsed


def printable_line(text: str) -> str:
    """Return the first line of a text for a message: printable, and shortened."""
    line = visible_text(text.splitlines()[0], lines=False)
    return line if len(line) <= _LONGEST_LINE else f"{line[:_LONGEST_LINE]}..."


def _nodes(parsed: Node) -> Iterator[Node]:
    """Yield all nodes of a statement."""
    left: list[Any] = [parsed]
    while left:
        part = left.pop()
        if isinstance(part, dict):
            yield part
            left += part.values()
        elif isinstance(part, list):
            left += part


def _why_refused(node: Node) -> str:
    """Return why a query may not have a node; empty if it may."""
    kind, (views, functions) = node.get("type"), _catalogue()
    if kind == "TABLE_FUNCTION":
        name = str(node["function"].get("function_name", "")).lower()
        if name not in _TABLE_FUNCTIONS:
            return f"{name}() is not a table that it may read; the tables are features, cases, signals and templates"
    elif kind == "BASE_TABLE":
        name = str(node["table_name"]).lower()
        if node["schema_name"].lower() != "information_schema" and name in views:
            return f"{name} is not a table that it may read; the tables are features, cases, signals and templates"
    elif kind == "SHOW_REF":
        if node["show_type"] == "SHOW_SPECIAL" and node["table_name"] not in _SHOWN:
            return "it may show tables only"
    elif kind == "FUNCTION":
        name = str(node["function_name"]).lower()
        if name in functions:
            return f"{name}() does more than compute a value, which a query may not"
    return ""


def _check_lengths(nodes: Sequence[Node], owner: str) -> None:
    """Refuse functions whose result may be as long as a number says, where DuckDB could not stop them."""
    tables = {id(node["function"]) for node in nodes if node.get("type") == "TABLE_FUNCTION"}
    total = 1.0
    for node in nodes:
        if node.get("type") != "FUNCTION" or id(node) in tables:
            continue
        name, values = str(node["function_name"]).lower(), [_literal(argument) for argument in node["arguments"]]
        if name in _FORMATS:
            lengths = _widths(values[0] if values else None)
        elif name in _LENGTHS:
            wanted = values[_LENGTHS[name] :]
            lengths = [_number(value) for value in (wanted if name in _RANGES else wanted[:1])]
        else:
            continue
        if None in lengths:
            raise InputError(f"{owner}: the length of {name}() must be a number or a text in the statement")
        total *= max(1.0, prod(length for length in lengths if length))
        if total > _LARGEST:
            raise InputError(
                f"{owner}: the lengths of {name}() and others multiply to more than {_LARGEST}; shorten them"
            )


def _literal(argument: Node) -> str | None:
    """Return the text of a constant; None for an expression."""
    expression = argument["expression"]
    if expression.get("type") == "FUNCTION" and expression["function_name"] == "-":
        expression = expression["arguments"][0]["expression"]
    return str(expression["literal"]["text"]) if "literal" in expression else None


def _number(text: str | None) -> float | None:
    try:
        return None if text is None else abs(float(text))
    except ValueError:
        return 1.0


def _widths(text: str | None) -> list[float | None]:
    """Return the numbers of a format; a None if its widths are arguments, or it is no text."""
    if text is None or "*" in text or re.search(r"\{[^}]*\{", text):
        return [None]
    return [float(number) for number in re.findall(r"\d+", text)]


@cache
def _catalogue() -> tuple[frozenset[str], frozenset[str]]:
    """Return DuckDB's own views, and its functions that do more than compute a value."""
    with duckdb.connect(":memory:") as plain:
        views = plain.execute("select view_name from duckdb_views() where schema_name <> 'information_schema'")
        system = frozenset(name.lower() for (name,) in views.fetchall())
        functions = plain.execute(
            "select function_name, coalesce(has_side_effects, false), macro_definition from duckdb_functions() "
            "where function_type in ('scalar', 'aggregate', 'window', 'macro')"
        ).fetchall()
    refused = {name for name, effects, _ in functions if effects} - _ANY_VALUE | _SETTINGS
    calls = re.compile(rf"\b({'|'.join(map(re.escape, refused))})\(")
    return system, frozenset(refused | {name for name, _, body in functions if body and calls.search(body)})
