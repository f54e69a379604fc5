"""The files of an identified ensemble: a table of values, and the first member as a rig file."""

import csv
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from sigdb.core import FloatArray
from sigdb.paper.identified import ENSEMBLE, NO_EFFECT, PRIOR, changed_rigs, margins_of, with_output
from sigdb.transmission import Transmission, built_in_file

HEADER = """\
# A rig that shows the pictures of Choy, Polyshchuk, Zakrajsek, Handschuh, Townsend, Tribology International 29, 1996.
# Its assumed numbers were fitted to these pictures inside the ranges of nasa_spiral_bevel.toml, by
# benchmarks/paper_search.py; docs/guide/paper.md has the targets, and what they do not tell. That the model can show
# the pictures with these numbers is no evidence that the paper's rig had them. SI units.

"""


def write_ensemble(prior: Transmission, found: Sequence[tuple[int, FloatArray]], output: str, folder: Path) -> None:
    """Write the rigs that were found: a table, by how many changes they bear, and the first as a rig file.

    ``found`` has the number of evaluations and the point of the unit cube of each. The sensor at the pinion has the
    quantity ``output``. Of rigs that bear as many changes, the one with the greatest margins comes first.
    """
    rigs, cube = [], prior.assumptions
    for evaluations, u in found:
        rig = with_output(prior.with_assumed(cube.from_unit(u)), output)
        results = [margins_of(changed) for _, changed in changed_rigs(rig)]
        held = sum(result is not None and result.holds_targets for result in results)
        own = margins_of(rig)
        rigs.append((-held, np.inf if own is None else own.worst_target, evaluations, u, rig))
    rigs.sort(key=lambda row: row[:2])
    paths = list(dict.fromkeys(number.path for number in cube.free))
    with (folder / ENSEMBLE).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["output", "evaluations", *paths])
        for *_, evaluations, u, _ in rigs:
            values = cube.from_unit(u)
            texts = (f"{v:.10g}" if isinstance(v, float) else str(v) for v in (values.get(p, "") for p in paths))
            writer.writerow([output, evaluations, *texts])
    (folder / ENSEMBLE).with_suffix(".toml").write_text(rig_file(rigs[0][-1]), encoding="utf-8")


def rig_file(rig: Transmission) -> str:
    """Return the text of a rig file, with the fitted numbers named as such."""
    data = rig.model_dump()
    data["name"] = f"{PRIOR}-identified"
    data["title"] = "NASA Lewis spiral bevel gear fatigue rig, with assumed numbers fitted to the paper's pictures"
    for path in rig.assumptions.values_of(rig):
        part, name = _described(data, path.split("."))
        before = part["sources"].get(name, "")
        if path not in NO_EFFECT and before.startswith("assumed: "):
            part["sources"][name] = f"fitted: to the paper's pictures, inside what is assumed: {before[9:]}"
    prior = tomllib.loads(built_in_file("nasa_spiral_bevel.toml").read_text(encoding="utf-8"))
    return HEADER + tomli_w.dumps(_as_stated(data, prior))


def _described(data: Any, names: Sequence[str]) -> tuple[dict[str, Any], str]:
    """Return the innermost part with sources on the way to a number, and the name of the number's field in it."""
    described = data, names[0]
    for place, name in enumerate(names):
        if isinstance(data, dict) and "sources" in data:
            described = data, names[place]
        data = data[int(name) if name.isdigit() else name]
    return described


def _as_stated(value: Any, prior: Any) -> Any:
    """Return the fields that the prior's file states, and those of a profile that have a source: no defaults."""
    if isinstance(value, list | tuple):
        return (
            [_as_stated(*pair) for pair in zip(value, prior, strict=True)] if isinstance(prior, list) else list(value)
        )
    if not isinstance(value, dict):
        return value
    if "amplitudes" in value or "contact_ratio" in value:
        return {
            name: field for name, field in value.items() if name in {"kind", "sources", "assumed", *value["sources"]}
        }
    return {
        name: field if name in ("sources", "assumed") else _as_stated(field, prior[name])
        for name, field in value.items()
        if name in prior
    }
