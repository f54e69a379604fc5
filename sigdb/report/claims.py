"""The table of the paper's claims: as text for a terminal, and as a page in Markdown."""

from collections.abc import Iterator

from sigdb.core import markdown_table
from sigdb.paper import ClaimValue, PaperClaims, VariedClaims
from sigdb.report.text_table import PLAIN, Terminal, TextTable, number

_HOLDS = {True: "yes", False: "no", None: "-"}

KINDS = ("check", "report")
"""Kinds of claims; the sensitivity of each kind is a table."""


def claims_text(claims: PaperClaims, *, terminal: Terminal = PLAIN) -> str:
    """Return the claims and their sensitivity as aligned text.

    Parameters
    ----------
    claims : PaperClaims
        From :func:`sigdb.paper.paper_claims`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several tables.
    """
    head = ("claim", "figure", "kind", "holds", "number", "meaning of the number")
    rows = [
        [claim.id, claim.figure, claim.kind, _HOLDS[claim.holds], number(claim.value, 3), claim.leading]
        for claim in claims.claims
    ]
    parts = [
        f"The paper's claims on {claims.rig}, {claims.gear}, {claims.sensor}; least compression of the mesh "
        f"{claims.min_compression:.2g} of the static one",
        TextTable(head, rows).text(terminal, indent=2),
    ]
    if claims.sensitivity:
        parts.append("How the numbers move; a claim that does not hold in brackets")
        parts += [moved_table(claims, kind).text(terminal, indent=2) for kind in KINDS]
    return "\n\n".join(parts) + "\n"


def claims_markdown(claims: PaperClaims) -> str:
    """Return the claims with all their numbers and their sensitivity as a page in Markdown.

    Parameters
    ----------
    claims : PaperClaims
        From :func:`sigdb.paper.paper_claims`.

    Returns
    -------
    str
        The page.
    """
    return "\n".join(_page(claims)) + "\n"


def _page(claims: PaperClaims) -> Iterator[str]:
    yield f"# The paper's claims on {claims.rig}"
    yield ""
    yield (
        f"Clean signals of `{claims.sensor}` over one revolution of `{claims.gear}`. The least compression of the "
        f"mesh in all cases is {claims.min_compression:.2g} of the static one. A *check* is expected to hold, a "
        "*report* only gives its result."
    )
    yield ""
    yield _markdown(claim_table(claims))
    for claim in claims.claims:
        yield ""
        yield f"## {claim.id}"
        yield ""
        yield f"{claim.shows} It holds where: {claim.rule[0].lower()}{claim.rule[1:]}"
        yield ""
        yield markdown_table(("number", "value"), [(name, number(value)) for name, value in claim.numbers.items()])
    if claims.sensitivity:
        yield ""
        yield "## How the numbers move"
        yield ""
        yield "One number of the rig is changed at a time. A claim that does not hold is in brackets."
        for kind in KINDS:
            yield ""
            yield _markdown(moved_table(claims, kind))


def _markdown(table: TextTable) -> str:
    return markdown_table(table.head, table.rows)


def claim_table(claims: PaperClaims) -> TextTable:
    """Return the table of claims."""
    head = ("claim", "figure", "kind", "what the paper shows", "number", "value", "holds")
    rows = [
        [claim.id, claim.figure, claim.kind, claim.shows, claim.leading, number(claim.value), _HOLDS[claim.holds]]
        for claim in claims.claims
    ]
    return TextTable(head, rows)


def moved_table(claims: PaperClaims, kind: str) -> TextTable:
    """Return the table of the sensitivity of a kind of claims, the unchanged rig first."""
    ids = [claim.id for claim in claims.claims if claim.kind == kind]
    head = ("changed", *ids, "least compression")
    rows = [
        (
            f"{row.what} {_change(row.factor)}".strip(),
            *(_cell(row, name) for name in ids),
            number(row.min_compression, 2),
        )
        for row in (_unchanged(claims), *claims.sensitivity)
    ]
    return TextTable(head, rows)


def _change(factor: float) -> str:
    """Return a factor as a change in per cent; an empty text for 1."""
    return f"{100 * (factor - 1):+.0f} %" if factor != 1 else ""


def _cell(row: VariedClaims, name: str) -> str:
    """Return a claim's number on a varied rig, in brackets where the claim does not hold; a dash without a number."""
    if name not in row.claims:
        return "-"
    claim = row.claims[name]
    text = number(claim.value, 3)
    return f"({text})" if claim.holds is False else text


def _unchanged(claims: PaperClaims) -> VariedClaims:
    """Return the claims on the unchanged rig as a row of the sensitivity."""
    return VariedClaims(
        what="nothing",
        factor=1.0,
        status="ok",
        min_compression=claims.min_compression,
        claims={claim.id: ClaimValue(value=claim.value, holds=claim.holds) for claim in claims.claims},
    )
