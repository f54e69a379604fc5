"""The table of the paper's claims: as text for a terminal, and as a page in Markdown."""

from collections.abc import Iterator, Sequence
from operator import attrgetter, itemgetter

from sigdb.paper import ClaimValue, EvaluatedClaim, PaperClaims, VariedClaims
from sigdb.report.text_table import Column, table

_HOLDS = {True: "yes", False: "no", None: "-"}


def claims_text(claims: PaperClaims) -> str:
    """Return the claims and their sensitivity as aligned text.

    Parameters
    ----------
    claims : PaperClaims
        From :func:`sigdb.paper.paper_claims`.

    Returns
    -------
    str
        Several tables.
    """
    columns: list[Column] = [
        ("claim", attrgetter("id")),
        ("figure", attrgetter("figure")),
        ("kind", attrgetter("kind")),
        ("holds", lambda claim: _HOLDS[claim.holds]),
        ("number", lambda claim: _number(claim.value, 3)),
        ("meaning of the number", attrgetter("leading")),
    ]
    parts = [
        f"The paper's claims on {claims.rig}, {claims.gear}, {claims.sensor}; least compression of the mesh "
        f"{claims.min_compression:.2g} of the static one",
        table(columns, claims.claims),
    ]
    if claims.sensitivity:
        parts.append("How the numbers move; a claim that does not hold in brackets")
        for kind in KINDS:
            head, rows = moved_cells(claims, kind)
            parts.append(table([(name, itemgetter(i)) for i, name in enumerate(head)], rows))
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
    yield from _lines(CLAIM_HEAD, [claim_cells(claim) for claim in claims.claims])
    for claim in claims.claims:
        yield ""
        yield f"## {claim.id}"
        yield ""
        yield f"{claim.shows} It holds where: {claim.rule[0].lower()}{claim.rule[1:]}"
        yield ""
        yield from _lines(("number", "value"), [(name, _number(value)) for name, value in claim.numbers.items()])
    if claims.sensitivity:
        yield ""
        yield "## How the numbers move"
        yield ""
        yield "One number of the rig is changed at a time. A claim that does not hold is in brackets."
        for kind in KINDS:
            yield ""
            yield from _lines(*moved_cells(claims, kind))


CLAIM_HEAD = ("claim", "figure", "kind", "what the paper shows", "number", "value", "holds")
"""Headings of :func:`claim_cells`."""


def claim_cells(claim: EvaluatedClaim) -> tuple[str, ...]:
    """Return a row of the table of claims."""
    texts = (claim.id, claim.figure, claim.kind, claim.shows, claim.leading)
    return (*texts, _number(claim.value), _HOLDS[claim.holds])


KINDS = ("check", "report")
"""Kinds of claims; the sensitivity of each kind is a table."""


def moved_cells(claims: PaperClaims, kind: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return headings and rows of the table of the sensitivity of a kind of claims, the unchanged rig first."""
    ids = [claim.id for claim in claims.claims if claim.kind == kind]
    head = ("changed", *ids, "least compression")
    rows = [
        (
            f"{row.what} {_change(row.factor)}".strip(),
            *(_cell(row, name) for name in ids),
            _number(row.min_compression, 2),
        )
        for row in (_unchanged(claims), *claims.sensitivity)
    ]
    return head, rows


def _change(factor: float) -> str:
    """Return a factor as a change in per cent; an empty text for 1."""
    return f"{100 * (factor - 1):+.0f} %" if factor != 1 else ""


def _cell(row: VariedClaims, name: str) -> str:
    """Return a claim's number on a varied rig, in brackets where the claim does not hold; a dash without a number."""
    if name not in row.claims:
        return "-"
    claim = row.claims[name]
    text = _number(claim.value, 3)
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


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"
