"""The table of robustness in the guide, from the card of a model with nuisances.

The table of a card that is named replaces the stored one; without a card the guide's table is made again.

    sigdb run pipelines/nuisances.toml
    python benchmarks/nuisances.py data/nuisances/models/location/README.md
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from measured_page import markdown_table

from sigdb.core import json_text

STORED = Path(__file__).with_name("nuisances.json")
GUIDE = Path(__file__).parents[1] / "docs" / "guide" / "recognition.md"
BEGIN, END = "<!-- Made by benchmarks/nuisances.py from benchmarks/nuisances.json; do not edit. -->\n", "<!-- End. -->"
COLUMNS = ("disturbance", "right", "outside", "sure and wrong", "alarms at 1e-2", "loss, dB")


def main() -> None:
    """Store the table of the card that is named, and write the stored one into the guide."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("card", nargs="?", type=Path, help="README.md of the model")
    card = parser.parse_args().card
    if card is not None:
        STORED.write_text(json_text(card_table(card.read_text(encoding="utf-8"))), encoding="utf-8")
    guide = GUIDE.read_text(encoding="utf-8")
    GUIDE.write_text(with_table(guide, json.loads(STORED.read_text(encoding="utf-8"))), encoding="utf-8")


def card_table(card: str) -> list[dict[str, str]]:
    """Return the rows of the table of robustness of a card, by the titles of its columns."""
    lines = card.partition("## Robustness\n")[2].partition("\n## ")[0].splitlines()
    titles, _, *rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines if line[:1] == "|"]
    return [dict(zip(titles, row, strict=True)) for row in rows]


def with_table(guide: str, rows: Sequence[dict[str, str]]) -> str:
    """Return the text of the guide with a table between its marks."""
    before, begin, rest = guide.partition(BEGIN)
    _, end, after = rest.partition(END)
    table = markdown_table(COLUMNS, [[row[name] for name in COLUMNS] for row in rows])
    return f"{before}{begin}\n{table}\n{end}{after}"


if __name__ == "__main__":
    main()
