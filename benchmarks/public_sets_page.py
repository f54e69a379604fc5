"""The page on results of public sets, made from files that ``sigdb public-sets --results`` writes.

Results of a set replace those that are stored for it; without a file the page is made again.

    python benchmarks/public_sets_page.py [RESULTS ...]
"""

import argparse
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from measured_page import markdown_table

from sigdb.core import json_text
from sigdb.public_sets import PublicSet, load_public_set, public_set_names

STORED = Path(__file__).with_name("public_sets.json")
PAGE = Path(__file__).parents[1] / "docs" / "guide" / "public_sets_results.md"
VERDICTS = ("right", "wrong", "abstained", "not known")
Results = Mapping[str, Any]


def main() -> None:
    """Store the results of the files that are named, and write the page of all that are stored."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", nargs="*", type=Path, help="files that sigdb public-sets --results wrote")
    stored = stored_results() if STORED.exists() else {}
    for path in parser.parse_args().results:
        results = json.loads(path.read_text(encoding="utf-8"))
        stored[results["name"]] = results
    STORED.write_text(json_text(dict(sorted(stored.items()))), encoding="utf-8")
    PAGE.write_text(page(stored), encoding="utf-8")


def stored_results() -> dict[str, Results]:
    """Return the stored results by the name of the set."""
    return dict(json.loads(STORED.read_text(encoding="utf-8")))


def page(stored: Mapping[str, Results]) -> str:
    """Return the text of the page: which adapters were tried, then the results of each set."""
    return "\n".join((_INTRODUCTION, _adapters(stored), *(_set(name, stored[name]) for name in sorted(stored))))


_INTRODUCTION = """# Results on public sets

<!-- Made by benchmarks/public_sets_page.py from benchmarks/public_sets.json; do not edit. -->

These are the results of `sigdb public-sets NAME --folder FOLDER --out DB --results FILE` on the files that could be
had. [Public sets](public_sets.md) describes the command. Sets without files that could be had have no results.

## Adapters that were tried

An adapter holds what cited pages state of a set. One that was not tried has met no real file of its set.
"""


def _adapters(stored: Mapping[str, Results]) -> str:
    rows = []
    for name in public_set_names():
        described = load_public_set(name)
        rows.append(
            (f"`{name}`", described.title, described.tried or "not tried", "below" if name in stored else "none")
        )
    return markdown_table(("name", "set", "tried on real files", "results"), rows)


def _set(name: str, results: Results) -> str:
    """Return the results of a set after what its pages state of it, which says what the results are worth."""
    described = load_public_set(name)
    parts = (
        f"## {described.title}\n",
        "".join(f"- {line}\n" for line in _statements(described)),
        "".join(f"{line}\n" for line in _sources(described)),
        _folder(results),
        _indicators(results),
        _answers(results),
    )
    return "\n".join(parts)


def _statements(described: PublicSet) -> Iterator[str]:
    """Yield what pages state of a set, each statement with the number of its source."""
    keys = list(described.sources)
    for label in ("where", "licence", "labels", "answer"):
        statement = getattr(described, label)
        if statement is None:
            yield f"{_LABELS[label]}: no page could be cited."
        else:
            yield f"{_LABELS[label]}: {statement.text.rstrip('.')} ({keys.index(statement.source) + 1})."


_LABELS = {"where": "Recordings", "licence": "Licence of the recordings", "labels": "Labels", "answer": "Right answer"}


def _sources(described: PublicSet) -> Iterator[str]:
    for number, source in enumerate(described.sources.values(), 1):
        yield f"{number}. [{source.title}]({re.sub('^docs/', '../', source.url)})"


def _folder(results: Results) -> str:
    """Return which recordings there were, and what became of them."""
    folder = results["folder"]
    lines = [f"Recordings: {folder['recordings']}. Missing: {_listed(folder['missing'])}. "]
    lines.append(f"Other files than the published ones: {_listed(folder['changed'])}.\n\n")
    head = ("state", "health by the label", "status", "recordings", "rows")
    names = ("state", "health", "status_code", "recordings", "rows")
    rows = [[str(row[name]) for name in names] for row in results["rows"]]
    return "### Rows\n\n" + "".join(lines) + markdown_table(head, rows)


def _listed(texts: Sequence[str]) -> str:
    return "; ".join(f"`{text}`" for text in texts) or "none"


def _indicators(results: Results) -> str:
    """Return the table of areas under the ROC: indicators by sensors."""
    rows = results["indicators"]
    sensors = list(dict.fromkeys(row["sensor"] for row in rows))
    areas = {(row["indicator"], row["sensor"]): f"{row['area']:.2f}" for row in rows}
    names = dict.fromkeys(row["indicator"] for row in rows)
    numbers = {(row["damaged"], row["healthy"]) for row in rows}
    text = "### Indicators by label\n\n"
    if not rows:
        return text + "No sensor has recordings of both labels.\n"
    counts = " or ".join(f"{damaged} and {healthy}" for damaged, healthy in sorted(numbers))
    text += (
        "Each number is the area under the ROC of the recordings labelled damaged against those labelled healthy. It\n"
        "is 1 or 0 where the indicator separates the labels without an error, 0.5 where it does not at all.\n"
        f"Recordings labelled damaged and healthy: {counts}.\n\n"
    )
    cells = [(f"`{name}`", *(areas.get((name, sensor), "") for sensor in sensors)) for name in names]
    return text + markdown_table(("indicator", *sensors), cells)


def _answers(results: Results) -> str:
    """Return how often the answers of diagnoses were right, and each of them."""
    answers = results["answers"]
    text = "### Answers of diagnoses\n\n"
    if not answers:
        return text + "No recording was diagnosed.\n"
    counts = ", ".join(f"{results['verdicts'].get(verdict, 0)} {verdict}" for verdict in VERDICTS)
    text += (
        f"Each channel is compared with healthy recordings of the nearest loads. Answers: {len(answers)}, {counts}.\n"
    )
    if all(row["expected"] == "none" for row in answers):
        text += "No damage is right each time, so that a method that never finds any would be right here too.\n"
    head = ("recording", "channel", "label", "right answer", "answer", "verdict")
    names = ("file", "channel", "state", "expected", "answer", "verdict")
    rows = [{**row, "expected": _EXPECTED[row["expected"]]} for row in answers]
    return f"{text}\n" + markdown_table(head, [[str(row[name]) for name in names] for row in rows])


_EXPECTED = {"none": "no damage", "damage": "damage", "unknown": "not known"}


if __name__ == "__main__":
    main()
