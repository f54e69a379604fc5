"""The card of a database: a page in Markdown on its size, its cases, its purpose and its limits."""

from collections.abc import Iterator, Mapping, Sequence

from sigdb.core import markdown_table
from sigdb.database import AxisFacts, DatabaseFacts, IndicatorFacts, RecordingFacts, StatusFacts

_REASONS = 5
"""Reasons of failures that are listed, the most frequent ones."""


def database_card_markdown(facts: DatabaseFacts, *, title: str) -> str:
    """Return the card of a database as a page in Markdown.

    Parameters
    ----------
    facts : dict
        From :func:`sigdb.database.database_card`.
    title : str
        Heading of the page.

    Returns
    -------
    str
        The page.
    """
    return "\n".join(_lines(facts, title)) + "\n"


def _lines(facts: DatabaseFacts, title: str) -> Iterator[str]:
    rig, origins = facts["rig"], facts["rig"]["origins"]
    fitted = f", {origins['fitted']} fitted" if origins["fitted"] else ""
    yield f"# {title}"
    yield ""
    yield (
        f"Simulated signatures of the rig `{rig['name']}` ({rig['title']}) with damage on its `{facts['gear']}`. The "
        f"rig has {origins['published']} published numbers, {origins['derived']} derived from published ones{fitted} "
        f"and {origins['assumed'] + origins['unstated']} assumed ones."
    )
    yield ""
    yield "For: development and comparison of methods that find and size tooth damage. Every signature has its truth."
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
            *((_grouped(number), text) for number, text in _counts(facts)),
            (
                f"{facts['bytes'] / 1e6:.1f} MB",
                f"in {facts['parts']} parts, {facts['bytes'] / facts['rows']:.0f} bytes a row",
            ),
        ],
    )
    yield ""
    yield "## Cases"
    yield ""
    yield _axes(facts["axes"])
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
    yield _indicators(facts["indicators"])
    yield ""
    yield "## How far to trust it"
    yield ""
    checks = facts["checks"]
    yield f"- Estimated error of the clean averages: at most {checks['error']:.1e} of the peak-to-peak."
    yield f"- Largest Floquet multiplier of a case: {checks['floquet_multiplier']:.3f}; below 1 the rig is stable."
    yield f"- Least compression of the mesh in a template: {checks['min_compression']:.2f} of the static one."
    if (force := checks["min_mesh_force"]) is not None:
        yield f"- Least mesh force in a template: {force:.2f} of the static one; at 0 the teeth part."
    yield from _coverage(facts["coverage"])
    yield from _failures(facts["statuses"])
    yield ""
    yield "## Origin"
    yield ""
    yield f"- Made with {_versions(facts['versions'])}."
    yield f"- Seed {facts['seed']}; hash of recipe and rig `{facts['hash']}`; {facts['extensions']} extensions."
    yield f"- Licence {facts['licence']}. {facts['citation']}"
    yield ""
    yield "To make it again, run `python -m sigdb.sweep RECIPE` with this recipe, then `sigdb coverage DB`:"
    yield ""
    yield "```toml"
    yield facts["recipe"].strip()
    yield "```"


def recordings_card_markdown(facts: RecordingFacts, *, title: str) -> str:
    """Return the card of a database of recordings as a page in Markdown.

    Parameters
    ----------
    facts : dict
        From :func:`sigdb.database.recordings_card`.
    title : str
        Heading of the page.

    Returns
    -------
    str
        The page.
    """
    return "\n".join(_recordings_lines(facts, title)) + "\n"


def _recordings_lines(facts: RecordingFacts, title: str) -> Iterator[str]:
    yield f"# {title}"
    yield ""
    yield f"Signatures of recordings: {', '.join(facts['sources'])}. The recordings themselves are not part of it."
    yield ""
    yield (
        "For: watching these machines, and comparison with other recordings and with simulated signatures. A label is "
        "worth what its trust says."
    )
    yield ""
    yield "Not for: other machines. Mounting, load and sensor differ between recordings too, and look like damage."
    yield ""
    yield "## Size"
    yield ""
    rows = [
        (_grouped(facts["recordings"]), "recordings"),
        (_grouped(facts["rows"]), "averages, each a row"),
        (_grouped(facts["failed"]), "rows without a result (their status says why)"),
        (_grouped(facts["machines"]), "machines that are named"),
        (_grouped(facts["specimens"]), "pairs of gears that are named"),
        (f"{facts['bytes'] / 1e6:.1f} MB", f"{facts['bytes'] / max(facts['rows'], 1):.0f} bytes a row"),
    ]
    yield markdown_table(("number", "what"), rows)
    yield ""
    yield "## Recordings"
    yield ""
    yield _axes(facts["axes"])
    yield ""
    names = {row["gear"]: f"`{row['gear']}`" if row["gear"] else "not named" for row in facts["gears"]}
    gears = [f"{names[row['gear']]} ({row['teeth']} teeth)" for row in facts["gears"]]
    yield f"Gears: {', '.join(gears)}."
    yield ""
    units = [f"`{row['sensor']}` ({row['unit'] or 'unit not stated'})" for row in facts["sensors"]]
    yield f"Sensors: {', '.join(units)}."
    yield ""
    yield "Dates: " + ("not stated" if facts["dates"] is None else " to ".join(facts["dates"])) + "."
    yield ""
    yield "## Labels"
    yield ""
    yield markdown_table(
        ("health", "kind of damage", "trust", "recordings", "averages"),
        [
            (row["health"], row["kind"], row["label_trust"], str(row["recordings"]), str(row["rows"]))
            for row in facts["labels"]
        ],
    )
    yield ""
    yield "## Indicators"
    yield ""
    yield "The 5 %, 50 % and 95 % quantiles over all machines and sensors; those with a unit are left out."
    yield ""
    yield _indicators(facts["indicators"])
    yield ""
    yield "## Origin"
    yield ""
    yield from _failures(facts["statuses"])
    yield f"- Made with {_versions(facts['versions'])}."
    yield f"- Licence {facts['licence']}. {facts['citation']}"


def _axes(axes: Sequence[AxisFacts]) -> str:
    return markdown_table(
        ("axis", "unit", "values", "least", "greatest"),
        [
            (f"`{axis['name']}`", axis["unit"], str(axis["values"]), f"{axis['least']:.6g}", f"{axis['greatest']:.6g}")
            for axis in axes
        ],
    )


def _indicators(indicators: Sequence[IndicatorFacts]) -> str:
    return markdown_table(
        ("indicator", "unit", "undamaged", "damaged"),
        [(f"`{row['name']}`", row["unit"], _triple(row["healthy"]), _triple(row["damaged"])) for row in indicators],
    )


def _versions(versions: Sequence[Mapping[str, str]]) -> str:
    return "; ".join(", ".join(f"{name} {number}" for name, number in each.items()) for each in versions)


def _counts(facts: DatabaseFacts) -> Iterator[tuple[int, str]]:
    """Yield the counts of a database, each with what it counts."""
    yield facts["rows"], "signatures"
    yield facts["healthy"], "of undamaged gears"
    yield facts["failed"], "without a result (their status says why)"
    yield facts["contact_loss"], "whose mesh loses contact"
    yield facts["templates"], "distinct cases that were simulated"
    yield facts["specimens"], "specimens: pairs of gears with their own index errors"


def _coverage(coverage: Mapping[str, float] | None) -> Iterator[str]:
    if coverage is None:
        yield "- The grid coverage is not estimated: run `sigdb coverage`."
        return
    yield (
        f"- Grid coverage: {coverage['share_above_0.97']:.1%} of {coverage['cases']} random cases between its own "
        f"match a template with 0.97 or better; the least match is {coverage['match_least']:.3f}. The nearest template "
        f"is {coverage['separation_median']:.1f} standard deviations of an average's noise away (median), at most "
        f"{coverage['separation_greatest']:.1f}."
    )
    yield f"- A signature whose residual distance is above {coverage['threshold']:.3g} is outside the database."


def _failures(statuses: Sequence[StatusFacts]) -> Iterator[str]:
    for row in statuses[:_REASONS]:
        code = f" (`{row['code']}`)" if row["code"] else ""
        yield f"- {_count_text(row['rows'], 'row')} without a result{code}: {row['status']}."
    if others := statuses[_REASONS:]:
        rows = sum(row["rows"] for row in others)
        yield f"- {_count_text(rows, 'row')} without a result for {_count_text(len(others), 'other reason')}."


def _count_text(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _grouped(number: int) -> str:
    """Return a whole number with its digits in threes."""
    return f"{number:,}".replace(",", " ")


def _triple(quantiles: Sequence[float] | None) -> str:
    return "-" if quantiles is None else " / ".join(f"{value:.4g}" for value in quantiles)
