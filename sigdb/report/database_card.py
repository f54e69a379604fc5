"""The card of a database: a page in Markdown that says what it is, what it is for and what it is not."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sigdb.core import markdown_table

_COUNTS = (
    ("rows", "signatures"),
    ("healthy", "of undamaged gears"),
    ("failed", "without a result (their status says why)"),
    ("contact_loss", "whose mesh loses contact"),
    ("templates", "distinct cases that were simulated"),
    ("specimens", "specimens: pairs of gears with their own index errors"),
)

_REASONS = 5
"""Reasons of failures that are told one by one, the most frequent ones."""


def database_card_markdown(facts: Mapping[str, Any], *, title: str) -> str:
    """The card, from what :func:`sigdb.database.database_card` gives."""
    return "\n".join(_lines(facts, title)) + "\n"


def _lines(facts: Mapping[str, Any], title: str) -> Iterator[str]:
    rig, origins = facts["rig"], facts["rig"]["origins"]
    yield f"# {title}"
    yield ""
    yield (
        f"Simulated signatures of the rig `{rig['name']}` ({rig['title']}) with damage on its `{facts['gear']}`. Of "
        f"the rig's numbers {origins['published']} are published, {origins['derived']} derived from published ones and "
        f"{origins['assumed'] + origins['unstated']} assumed."
    )
    yield ""
    yield ("For: developing and comparing methods that find and size tooth damage, the truth of every signature known.")
    yield ""
    yield (
        "Not for: deciding about a machine. The signals are simulated; another machine's shafts, bearings, casing and "
        "sensor path differ, and so does the noise of its surroundings."
    )
    yield ""
    yield "## Size"
    yield ""
    yield markdown_table(
        ("number", "what"),
        [
            *((_grouped(facts[name]), said) for name, said in _COUNTS),
            (
                f"{facts['bytes'] / 1e6:.1f} MB",
                f"in {facts['parts']} parts, {facts['bytes'] / facts['rows']:.0f} bytes a row",
            ),
        ],
    )
    yield ""
    yield "## Cases"
    yield ""
    yield markdown_table(
        ("axis", "unit", "values", "least", "greatest"),
        [
            (f"`{one['name']}`", one["unit"], str(one["values"]), f"{one['least']:.6g}", f"{one['greatest']:.6g}")
            for one in facts["axes"]
        ],
    )
    if facts["patterns"]:
        yield ""
        yield "Patterns of damaged teeth: " + ", ".join(f"`{name}`" for name in facts["patterns"]) + "."
    yield ""
    yield (
        "Sensors: "
        + ", ".join(f"`{name}` ({unit})" for name, unit in facts["sensors"].items())
        + (f", {facts['samples_per_tooth']} samples a tooth.")
    )
    yield ""
    yield "## Indicators"
    yield ""
    yield f"The 5 %, 50 % and 95 % quantiles of `{next(iter(facts['sensors']))}`."
    yield ""
    yield markdown_table(
        ("indicator", "unit", "undamaged", "damaged"),
        [
            (f"`{one['name']}`", one["unit"], _triple(one["healthy"]), _triple(one["damaged"]))
            for one in facts["indicators"]
        ],
    )
    yield ""
    yield "## How far to trust it"
    yield ""
    checks = facts["checks"]
    yield f"- Estimated error of the clean averages: at most {checks['error']:.1e} of the peak-to-peak."
    yield f"- Largest Floquet multiplier of a case: {checks['floquet_multiplier']:.3f}; below 1 the rig is stable."
    yield (
        f"- Least compression of the mesh in a template: {checks['min_compression']:.2f} of the static one; below 0 "
        "the teeth part."
    )
    yield from _coverage(facts["coverage"])
    yield from _failures(facts["statuses"])
    yield ""
    yield "## Origin"
    yield ""
    versions = "; ".join(", ".join(f"{name} {number}" for name, number in one.items()) for one in facts["versions"])
    yield f"- Made with {versions}."
    yield f"- Seed {facts['seed']}; hash of recipe and rig `{facts['hash']}`; {facts['extensions']} extensions."
    yield f"- Licence {facts['licence']}. {facts['citation']}"
    yield ""
    yield "Made again by `python -m sigdb.sweep RECIPE` with this recipe, then `sigdb coverage DB`:"
    yield ""
    yield "```toml"
    yield facts["recipe"].strip()
    yield "```"


def _coverage(coverage: Mapping[str, Any] | None) -> Iterator[str]:
    if coverage is None:
        yield "- Coverage was not studied: run `sigdb coverage` on it."
        return
    yield (
        f"- Coverage: of {coverage['cases']} random cases between its own {coverage['share_above_0.97']:.1%} match a "
        f"template with 0.97 or better; the least match is {coverage['match_least']:.3f}. The nearest template is "
        f"{coverage['separation_median']:.1f} standard deviations of an average's noise away (median), at most "
        f"{coverage['separation_greatest']:.1f}."
    )
    yield f"- A signature whose residual distance is above {coverage['threshold']:.3g} is outside the database."


def _failures(statuses: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for one in statuses[:_REASONS]:
        yield f"- Without a result, {_counted(one['rows'], 'row')}: {one['status']}."
    if others := statuses[_REASONS:]:
        rows = sum(one["rows"] for one in others)
        yield f"- Without a result for {_counted(len(others), 'other reason')}, {_counted(rows, 'row')}."


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _grouped(number: int) -> str:
    """A whole number with its digits in threes."""
    return f"{number:,}".replace(",", " ")


def _triple(quantiles: Sequence[float] | None) -> str:
    return "-" if quantiles is None else " / ".join(f"{one:.4g}" for one in quantiles)
