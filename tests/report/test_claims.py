"""Unit: the table of claims says what the numbers say."""

from dataclasses import replace

import pytest

from sigdb.paper import ClaimValue, EvaluatedClaim, PaperClaims, VariedClaims
from sigdb.report import claims_markdown, claims_text


def claim(name, value, holds, kind="check"):
    return EvaluatedClaim(
        id=name,
        figure="5",
        kind=kind,
        shows=f"Something about {name}.",
        leading=f"number of {name}",
        rule="It is large.",
        value=value,
        holds=holds,
        numbers={"one": value, "another [deg]": 12.5},
    )


@pytest.fixture
def claims():
    moved = {"P1": ClaimValue(value=0.5, holds=False), "P2, the rest": ClaimValue(value=3.0, holds=None)}
    return PaperClaims(
        rig="a-rig",
        gear="pinion",
        sensor="vertical",
        min_compression=0.125,
        claims=(claim("P1", 0.25, True), claim("P2, the rest", 2.0, None, "report")),
        sensitivity=(
            VariedClaims(what="speed", factor=0.94, status="ok", min_compression=-0.5, claims=moved),
            VariedClaims(what="damping", factor=1.3, status="unstable", min_compression=None, claims={}),
        ),
    )


def test_the_text_has_a_line_for_each_claim_and_variation(claims):
    text = claims_text(claims)
    assert "a-rig, pinion, vertical; least compression of the mesh 0.12 of the static one" in text
    lines = {" ".join(line.split()) for line in text.splitlines()}
    assert "P1 5 check yes 0.25 number of P1" in lines
    assert "P2, the rest 5 report - 2 number of P2, the rest" in lines
    assert {"nothing 0.25 0.12", "speed -6 % (0.5) -0.5", "damping +30 % - -"} <= lines
    assert {"changed P2, the rest least compression", "nothing 2 0.12", "speed -6 % 3 -0.5"} <= lines
    assert "How the numbers move" not in claims_text(replace(claims, sensitivity=()))


def test_the_page_has_rules_and_all_numbers(claims):
    page = claims_markdown(claims)
    assert "| P1 | 5 | check | Something about P1. | number of P1 | 0.25 | yes |" in page
    assert "Something about P1. It holds where: it is large." in page
    assert page.count("| another [deg] | 12.5 |") == 2
    assert "| speed -6 % | (0.5) | -0.5 |" in page
    assert "| speed -6 % | 3 | -0.5 |" in page
    assert "How the numbers move" not in claims_markdown(replace(claims, sensitivity=()))
    tables = [line for line in page.splitlines() if line.startswith("|")]
    assert all(line.endswith("|") for line in tables)
