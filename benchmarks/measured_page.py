"""The page on how often a diagnosis is right, as text that is made from the stored counts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

OUTCOMES = ("right", "wrong", "missed", "abstains")
PEERS = {"floor": "healthy-only detector", "fm4": "FM4", "na4_star": "NA4*", "kurtosis": "kurtosis"}
GIVEN = {"rig": "a rig of other sizes", "counts": "both tooth counts", "teeth": "the averaged gear's tooth count"}
TITLES = {"twin": "the twin", "spectraquest": "the public stand"}
Row = Mapping[str, Any]


def page(document: Mapping[str, Row]) -> str:
    """Return the text of the page, made from the stored document and the text of ``measured_page.md``."""
    text = Template(Path(__file__).with_suffix(".md").read_text(encoding="utf-8"))
    counts = "\n".join(_counts(name, section) for name, section in document.items())
    return text.substitute(
        failures=_failures(document), counts=counts, power=_power(document), which=_which_gear(document)
    )


def _failures(document: Mapping[str, Row]) -> str:
    """Return the table of all answers that are not right, and what else failed."""
    rows = []
    for name, section in document.items():
        for row in section["questions"]:
            if row["outcome"] != "right":
                damage = "none" if row["loss"] is None else f"loss {row['loss']:g}"
                why = row["why"] if row["outcome"] == "wrong" else row["answer"]
                cells = (TITLES[name], row["outcome"], row["kind"], row["angle"], GIVEN[row["given"]], damage, why)
                rows.append((OUTCOMES.index(row["outcome"]), cells))
    rows.sort(key=lambda each: each[0])
    head = ("machine", "counts as", "kind", "angle", "given", "damage", "because")
    text = markdown_table(head, [cells for _, cells in rows]) if rows else "All answers are right.\n"
    worse = "".join(f"- {line}\n" for line in _worse(document))
    return text + (f"\n{worse}" if worse else "")


def _worse(document: Mapping[str, Row]) -> Iterator[str]:
    """Yield sentences on aims that are missed: power, and kinds in which the simple detector does better."""
    for name, section in document.items():
        for quantity, counts in section["power"].items():
            if isinstance(counts, dict) and counts["high"] < section["power"]["stated"]:
                yield (
                    f"The stated power does not hold on {TITLES[name]} ({_QUANTITIES[quantity]}): {counts['seen']} of "
                    f"{counts['of']} were seen, below the stated {section['power']['stated']:g}."
                )
        for kind, rows in _by(visible(section), "kind").items():
            ours, floor = _count(rows, _outcome), _count(rows, peer_outcome(section, "floor"))
            if ours["right"] < floor["right"] or ours["wrong"] > floor["wrong"]:
                yield (
                    f"On {TITLES[name]}, *{kind}*, the healthy-only detector does better: {floor['right']} right and "
                    f"{floor['wrong']} wrong, against {ours['right']} and {ours['wrong']}."
                )


def _counts(name: str, section: Row) -> str:
    """Return the tables of a machine: by kind against the others, by what is given, and without the gear."""
    rows = visible(section)
    methods: dict[str, Callable[[Row], str]] = {"sigdb": _outcome}
    methods |= {title: peer_outcome(section, peer) for peer, title in PEERS.items()}
    kinds = _by(rows, "kind")
    cases = {f"{kind}, {what}": some for kind in kinds for what, some in _damage(kinds[kind])}
    cases |= {
        "all, healthy" if loss is None else f"all, loss {loss:g}": some for loss, some in _by(rows, "loss").items()
    }
    cases |= {"all": rows}
    table = [
        (case, str(len(some)), *(_shown(_count(some, method)) for method in methods.values()))
        for case, some in cases.items()
    ]
    text = f"## On {TITLES[name]}\n\nEach cell has right / wrong / missed / abstaining answers.\n\n"
    text += markdown_table(("pairs", "questions", *methods), table) + "\n"
    cells = [
        (angle, GIVEN[facts], what, str(len(some)), _shown(_count(some, _outcome)))
        for angle, of_angle in _by(rows, "angle").items()
        for facts, of_facts in sorted(_by(of_angle, "given").items())
        for what, some in _damage(of_facts)
    ]
    text += markdown_table(("angle", "given", "pairs", "questions", "sigdb"), cells)
    empty = [row for row in section["questions"] if row["empty"]]
    if empty:
        unchanged = sum(row["answer"] in ("no change", "level changed") for row in empty)
        named = ", ".join(dict.fromkeys(row["kind"] for row in empty))
        damaged = sum(row["outcome"] == "wrong" for row in empty) - unchanged
        text += (
            f"\nRecordings in which the gear is not to be seen ({named}; by tacho and mesh phase): {len(empty)}. "
            f"Called unchanged: {unchanged}. Called damaged: {damaged}.\n"
        )
    return text


_QUANTITIES = {
    "stiffness_loss": "stiffness loss, with a rig or both counts",
    "pulse": "share of the rms, with one count",
}


def _power(document: Mapping[str, Row]) -> str:
    rows = [
        (
            TITLES[name],
            _QUANTITIES[quantity],
            f"{counts['seen']} of {counts['of']}",
            f"{counts['low']:.2f} to {counts['high']:.2f}",
        )
        for name, section in document.items()
        for quantity, counts in section["power"].items()
        if isinstance(counts, dict)
    ]
    return markdown_table(("machine", "stated as", "seen", "95 % interval"), rows)


def _which_gear(document: Mapping[str, Row]) -> str:
    """Return the table of the questions on which gear of a pair is damaged."""
    rows = [
        (TITLES[name], gear, f"{loss:g}", str(len(some)), _shown(_count(some, _outcome)))
        for name, section in document.items()
        for gear, of_gear in _by([row for row in section["questions"] if "gear" in row], "gear").items()
        for loss, some in _by(of_gear, "loss").items()
    ]
    return markdown_table(("machine", "damaged gear", "loss", "questions", "sigdb"), rows)


def visible(section: Row) -> list[Row]:
    """Return the questions about one gear in which it is to be seen."""
    return [row for row in section["questions"] if not row["empty"] and "gear" not in row]


def peer_outcome(section: Row, peer: str) -> Callable[[Row], str]:
    """Return the function that gives the outcome of another method at the threshold of healthy pairs."""
    limit = section["thresholds"][peer]

    def outcome(row: Row) -> str:
        value = _value(row, peer)
        if value is None:
            return "abstains"
        if row["loss"] is None:
            return "right" if value <= limit else "wrong"
        if value <= limit:
            return "missed"
        return "right" if peer != "floor" or row["floor"]["off"] <= 1.5 else "wrong"

    return outcome


def _value(row: Row, peer: str) -> float | None:
    if peer == "floor":
        return row["floor"]["value"] if "floor" in row else None
    return row["indicators"][peer] if row.get("indicators") else None


def _outcome(row: Row) -> str:
    return str(row["outcome"])


def _count(rows: Sequence[Row], method: Callable[[Row], str]) -> dict[str, int]:
    found = [method(row) for row in rows]
    return {outcome: found.count(outcome) for outcome in OUTCOMES}


def _shown(counts: Mapping[str, int]) -> str:
    return " / ".join(str(counts[outcome]) for outcome in OUTCOMES)


def _damage(rows: Sequence[Row]) -> Iterator[tuple[str, list[Row]]]:
    """Yield the healthy and the injected questions, with words."""
    for what, some in (
        ("healthy", [r for r in rows if r["loss"] is None]),
        ("injected", [r for r in rows if r["loss"] is not None]),
    ):
        if some:
            yield what, some


def _by(rows: Sequence[Row], key: str) -> dict[Any, list[Row]]:
    return {value: [row for row in rows if row[key] == value] for value in dict.fromkeys(row[key] for row in rows)}


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines).replace("| --- ", "|---").replace("|--- |", "|---|")
