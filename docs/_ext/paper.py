"""The page on the paper: its figures and tables, made at build time by a run of ``pipelines/paper.toml``.

The directive ``claims`` makes the table of claims. With ``check`` or ``report`` it makes the table of the sensitivity
of this kind of claims. The directive ``identified`` makes the tables of the identified rigs, ``claims``, ``members``,
``changes``, ``outputs``, ``modes`` or ``numbers``, from the stored numbers of ``make paper``.
"""

import json
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tabular import text_table

from sigdb.paper import PaperClaims
from sigdb.pipeline import load_recipe, run_recipe
from sigdb.report.claims import claim_table, moved_table

RECIPE = Path(__file__).parents[2] / "pipelines" / "paper.toml"


def make(folder: Path) -> None:
    """Make the pictures and ``claims.json`` in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as out:
        run = run_recipe(load_recipe(RECIPE), out, jobs=1)
        for path in (*run.figures, Path(out) / "claims.json"):
            shutil.copy(path, folder / path.name)


class Claims(SphinxDirective):
    """``claims``, or ``claims`` with a kind."""

    optional_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = Path(self.env.srcdir) / "generated" / "claims.json"
        claims = PaperClaims.from_json(json.loads(path.read_text(encoding="utf-8")))
        if self.arguments:
            table = moved_table(claims, self.arguments[0])
            return [text_table(table.head, [[cell.replace(" %", "\u00a0%") for cell in row] for row in table.rows])]
        table = claim_table(claims)
        return [text_table(table.head, table.rows, sentence=3)]


class Identified(SphinxDirective):
    """``identified`` with the name of a table."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = Path(self.env.srcdir) / "guide" / "paper_identified.json"
        self.env.note_dependency(str(path))
        head, rows = TABLES[self.arguments[0]](json.loads(path.read_text(encoding="utf-8")))
        return [text_table(head, rows)]


Table = tuple[list[str], list[list[str]]]


def _claims(numbers: dict[str, Any]) -> Table:
    members, prior = numbers["members"], numbers["prior"]
    rows = []
    for claim, best in prior["best_margin"].items():
        margins = [member["margins"][claim] for member in members]
        rows.append(
            [
                claim,
                "held out" if claim in numbers["held_out"] else "target",
                f"{sum(margin <= 0 for margin in margins)} of {len(margins)}",
                f"{max(margins):+.2f}",
                f"{100 * prior['share'][claim]:.0f} %",
                f"{best:+.2f}",
            ]
        )
    drawn = f"share of {prior['in_contact_when_healthy']} random rigs"
    head = ["claim", "role", "rigs that hold it", "greatest margin", drawn, "best random margin"]
    return head, rows


def _changes(numbers: dict[str, Any]) -> Table:
    members = numbers["members"]
    changes = list(members[0]["holds_when_changed"])
    rows = [
        [change, f"{sum(m['holds_when_changed'][change] for m in members)} of {len(members)}"] for change in changes
    ]
    return ["change", "rigs that still hold all targets"], rows


def _members(numbers: dict[str, Any]) -> Table:
    rows = []
    for number, member in enumerate(numbers["members"], 1):
        targets = {claim: m for claim, m in member["margins"].items() if claim not in numbers["held_out"]}
        nearest = max(targets, key=lambda claim: targets[claim])
        held = [claim for claim in numbers["held_out"] if member["margins"][claim] <= 0]
        changes = [change for change, holds in member["holds_when_changed"].items() if holds]
        rows.append(
            [
                str(number),
                f"{targets[nearest]:+.3f} ({nearest})",
                f"{member['contact']:.2f}",
                f"{member['min_compression']:+.2f}",
                f"{len(held)} of {len(numbers['held_out'])}",
                f"{len(changes)} of {len(member['holds_when_changed'])}",
            ]
        )
    head = ["rig", "greatest margin of a target", "least compression, targets", "all cases"]
    return [*head, "held-out claims that hold", "changes under which it holds"], rows


def _outputs(numbers: dict[str, Any]) -> Table:
    members = numbers["members"]
    outputs = list(members[0]["outputs"])
    rows = []
    for claim in members[0]["outputs"][outputs[0]]:
        cells = [[member["outputs"][output][claim] for member in members] for output in outputs]
        rows.append([claim, *(f"{sum(m <= 0 for m in cell)} of {len(cell)}, best {min(cell):+.2f}" for cell in cells)])
    return ["claim", *outputs], rows


def _modes(numbers: dict[str, Any]) -> Table:
    rows = []
    for modes in zip(*(member["modes"] for member in numbers["members"]), strict=True):
        moves = Counter(max(mode["moves"], key=lambda part: mode["moves"][part]) for mode in modes)
        rows.append(
            [
                str(modes[0]["at_order"]),
                _range([mode["order"] for mode in modes], ".1f"),
                _range([100 * mode["damping_ratio"] for mode in modes], ".1f") + " %",
                _range([100 * mode["share"] for mode in modes], ".0f") + " %",
                ", ".join(f"{part} in {count}" for part, count in moves.most_common()),
            ]
        )
    return ["at order", "order of its greatest mode", "damping", "share of the response", "moves most"], rows


def _range(values: list[float], form: str) -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"


def _numbers(numbers: dict[str, Any]) -> Table:
    rows = []
    for path, row in numbers["numbers"].items():
        if row.get("in_common"):
            rows.append([path, f"{row['least']:.4g} to {row['greatest']:.4g}", _range(row["part"], ".2f")])
    return ["number", "in all rigs", "part of its range"], rows


TABLES: dict[str, Callable[[dict[str, Any]], Table]] = {
    "claims": _claims,
    "members": _members,
    "changes": _changes,
    "outputs": _outputs,
    "modes": _modes,
    "numbers": _numbers,
}


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("claims", Claims)
    app.add_directive("identified", Identified)
    app.connect("builder-inited", lambda app: make(Path(app.srcdir) / "generated"))
    return {"parallel_read_safe": True}
