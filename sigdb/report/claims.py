"""The table of the paper's claims: as text for a terminal, and as a page in Markdown."""

from collections.abc import Iterator, Mapping
from typing import Any

from sigdb.core import markdown_table
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number

_HOLDS = {True: "yes", False: "no", None: "-"}


def claims_text(facts: Mapping[str, Any], *, terminal: Terminal = PLAIN) -> str:
    """Return the claims, and how their numbers move, as aligned text.

    Parameters
    ----------
    facts
        What :func:`sigdb.paper.paper_claims` returns.
    terminal
        Where the text is shown.
    """
    head = ("claim", "figure", "kind", "holds", "number", "what the number is")
    rows = [
        [one["id"], one["figure"], one["kind"], _HOLDS[one["holds"]], number(one["value"], 3), one["leading"]]
        for one in facts["claims"]
    ]
    parts = [
        f"The paper's claims on {facts['rig']}, {facts['gear']}, {facts['sensor']}; least compression of the mesh "
        f"{facts['min_compression']:.2g} of the static one",
        TextTable(head, rows).text(terminal, indent=2),
    ]
    if facts["sensitivity"]:
        parts.append("How the numbers move; a claim that does not hold in brackets")
        parts += [moved_table(facts, kind).text(terminal, indent=2) for kind in KINDS]
    return "\n\n".join(parts) + "\n"


def claims_markdown(facts: Mapping[str, Any]) -> str:
    """The claims with all their numbers, and how they move, as a page."""
    return "\n".join(_page(facts)) + "\n"


def _page(facts: Mapping[str, Any]) -> Iterator[str]:
    yield f"# The paper's claims on {facts['rig']}"
    yield ""
    yield (
        f"Clean signals of `{facts['sensor']}` over one revolution of `{facts['gear']}`. The least compression of the "
        f"mesh in all cases is {facts['min_compression']:.2g} of the static one. A *check* is expected to hold, a "
        "*report* tells what comes out."
    )
    yield ""
    table = claim_table(facts)
    yield markdown_table(table.head, table.rows)
    for claim in facts["claims"]:
        yield ""
        yield f"## {claim['id']}"
        yield ""
        yield f"{claim['shows']} It holds where: {claim['rule'][0].lower()}{claim['rule'][1:]}"
        yield ""
        yield markdown_table(("number", "value"), [(name, number(one)) for name, one in claim["numbers"].items()])
    if facts["sensitivity"]:
        yield ""
        yield "## How the numbers move"
        yield ""
        yield "One number of the rig is changed at a time. A claim that does not hold is in brackets."
        for kind in KINDS:
            yield ""
            table = moved_table(facts, kind)
            yield markdown_table(table.head, table.rows)


def claim_table(facts: Mapping[str, Any]) -> TextTable:
    """Return the table of claims."""
    head = ("claim", "figure", "kind", "what the paper shows", "number", "value", "holds")
    names = ("id", "figure", "kind", "shows", "leading")
    rows = [[*(one[name] for name in names), number(one["value"]), _HOLDS[one["holds"]]] for one in facts["claims"]]
    return TextTable(head, rows)


KINDS = ("check", "report")
"""Kinds of claims, each with a table of how its numbers move."""


def moved_table(facts: Mapping[str, Any], kind: str) -> TextTable:
    """Return the table of how the numbers of a kind of claims move, the unchanged rig first."""
    ids = [claim["id"] for claim in facts["claims"] if claim["kind"] == kind]
    head = ("changed", *ids, "least compression")
    rows = [
        (
            f"{row['what']} {_change(row['factor'])}".strip(),
            *(_cell(row, name) for name in ids),
            number(row["min_compression"], 2),
        )
        for row in _with_base(facts)
    ]
    return TextTable(head, rows)


def _change(factor: float) -> str:
    """A factor as a change in per cent; nothing for 1."""
    return f"{100 * (factor - 1):+.0f} %" if factor != 1 else ""


def _cell(row: Mapping[str, Any], name: str) -> str:
    """A claim's number in a varied rig, in brackets where the claim does not hold; a dash where there is none."""
    if name not in row["claims"]:
        return "-"
    one = row["claims"][name]
    text = number(one["value"], 3)
    return f"({text})" if one["holds"] is False else text


def _with_base(facts: Mapping[str, Any]) -> list[dict[str, Any]]:
    base = {claim["id"]: claim for claim in facts["claims"]}
    first = {"what": "nothing", "factor": 1, "min_compression": facts["min_compression"], "claims": base}
    return [first, *facts["sensitivity"]]
