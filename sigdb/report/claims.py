"""The table of the paper's claims: as text for a terminal, and as a page in Markdown."""

from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter
from typing import Any

from sigdb.report.text_table import number, table, word

_HOLDS = {True: "yes", False: "no", None: "-"}


def claims_text(facts: Mapping[str, Any]) -> str:
    """The claims, and how they move, as aligned text; ``facts`` as of :func:`sigdb.paper.paper_claims`."""
    columns = [
        ("claim", word("id")),
        ("figure", word("figure")),
        ("kind", word("kind")),
        ("holds", lambda row: _HOLDS[row["holds"]]),
        ("number", number("value", 3)),
        ("what the number is", word("leading")),
    ]
    parts = [
        f"The paper's claims on {facts['rig']}, {facts['gear']}, {facts['sensor']}; least compression of the mesh "
        f"{facts['min_compression']:.2g} of the static one",
        table(columns, facts["claims"]),
    ]
    if facts["sensitivity"]:
        parts.append("How the numbers move; a claim that does not hold in brackets")
        for kind in KINDS:
            head, rows = moved_cells(facts, kind)
            parts.append(table([(name, itemgetter(i)) for i, name in enumerate(head)], rows))
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
    yield from _lines(CLAIM_HEAD, [claim_cells(claim) for claim in facts["claims"]])
    for claim in facts["claims"]:
        yield ""
        yield f"## {claim['id']}"
        yield ""
        yield f"{claim['shows']} It holds where: {claim['rule'][0].lower()}{claim['rule'][1:]}"
        yield ""
        yield from _lines(("number", "value"), [(name, _number(one)) for name, one in claim["numbers"].items()])
    if facts["sensitivity"]:
        yield ""
        yield "## How the numbers move"
        yield ""
        yield "One number of the rig is changed at a time. A claim that does not hold is in brackets."
        for kind in KINDS:
            yield ""
            yield from _lines(*moved_cells(facts, kind))


CLAIM_HEAD = ("claim", "figure", "kind", "what the paper shows", "number", "value", "holds")
"""Headings of :func:`claim_cells`."""


def claim_cells(claim: Mapping[str, Any]) -> tuple[str, ...]:
    """A row of the table of claims."""
    texts = (claim[name] for name in ("id", "figure", "kind", "shows", "leading"))
    return (*texts, _number(claim["value"]), _HOLDS[claim["holds"]])


KINDS = ("check", "report")
"""Kinds of claims, each with a table of how its numbers move."""


def moved_cells(facts: Mapping[str, Any], kind: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows of the table of how the numbers of a kind of claims move, the unchanged rig first."""
    ids = [claim["id"] for claim in facts["claims"] if claim["kind"] == kind]
    head = ("changed", *ids, "least compression")
    rows = [
        (
            f"{row['what']} {_change(row['factor'])}".strip(),
            *(_cell(row, name) for name in ids),
            _number(row["min_compression"], 2),
        )
        for row in _with_base(facts)
    ]
    return head, rows


def _change(factor: float) -> str:
    """A factor as a change in per cent; nothing for 1."""
    return f"{100 * (factor - 1):+.0f} %" if factor != 1 else ""


def _cell(row: Mapping[str, Any], name: str) -> str:
    """A claim's number in a varied rig, in brackets where the claim does not hold; a dash where there is none."""
    if name not in row["claims"]:
        return "-"
    one = row["claims"][name]
    text = _number(one["value"], 3)
    return f"({text})" if one["holds"] is False else text


def _with_base(facts: Mapping[str, Any]) -> list[dict[str, Any]]:
    base = {claim["id"]: claim for claim in facts["claims"]}
    first = {"what": "nothing", "factor": 1, "min_compression": facts["min_compression"], "claims": base}
    return [first, *facts["sensitivity"]]


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"
