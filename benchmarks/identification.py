"""Identification of rigs that are known: the coverage of its intervals over twins, and a published rotor.

A twin is a rotor with two disks on two bearings (example 5.9.1 of Friswell, 2010) whose numbers are drawn from their
ranges: stiffnesses of both bearings in both directions, Young's modulus, and a diameter of a disk. Its first six
natural frequencies of bending are measured with errors of 1 %. The intervals of 95 % should hold the drawn numbers in
95 of 100 cases, and each number in at least 33 of 40.

The published rotor is the geared turbo-generator of the same book: its 13 published natural frequencies, with errors
of 0.01 %, and ranges of +-30 % for both lateral stiffnesses of its four bearings. The search begins away from those
published.

Another table compares derivatives in closed form with differences of whole responses: the time of one derivative by
both, and their greatest deviation relative to the greatest derivative.

    nice -n 5 python benchmarks/identification.py [--twins 40] [--json FILE] [--folder FOLDER]
"""

import argparse
import json
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, print_table, timed

from sigdb.identification import Targets, identify
from sigdb.identification.problem import Problem
from sigdb.transmission import Range, Transmission, coupled_modes, load_transmission
from sigdb.transmission.rig import transmission_of

RIGS = Path(__file__).parents[1] / "data" / "transmissions"
ERROR, PUBLISHED_ERROR, WIDTH, MODES = 0.01, 1e-4, 0.3, 6
PUBLISHED = (11.641, 12.284, 17.268, 18.458, 23.956, 37.681, 49.889, 50.861, 56.248, 57.752, 59.188, 63.113, 74.203)
"""Damped natural frequencies of the turbo-generator, Hz."""
OFF = (0.8, 1.15, 1.2, 0.85, 1.1, 0.9, 0.75, 1.25)
"""Where the search for the turbo-generator begins, as multiples of the published stiffnesses."""
Rows = list[dict[str, Any]]


def _levels(sensor: str, *speeds_rpm: float) -> Rows:
    """Return targets of six mesh harmonics at each speed."""
    return [
        {"sensor": sensor, "speed_rpm": speed, "amplitudes": [1.0] * 6, "relative_error": 0.1} for speed in speeds_rpm
    ]


NUMBERS, STEP = 4, 1e-3
"""Numbers of each rig by which derivatives are taken, and the step of differences, in standard deviations."""
CASES = (
    ("nasa-spiral-bevel", {"modes": [{"frequency_hz": 200.0 * k, "relative_error": 0.01} for k in range(1, 7)]}),
    ("spur-test-rig", {"harmonics": _levels("pinion-vertical", 1500.0, 1800.0)}),
    ("nasa-spiral-bevel", {"harmonics": _levels("pinion-housing-vertical", 12000.0, 14400.0)}),
    ("two-stage-gearbox", {"harmonics": _levels("input-vertical", 1800.0)}),
)
"""Rigs with targets; only the kind and the number of the targets count here."""


def main() -> None:
    """Print the tables, and write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the numbers")
    parser.add_argument("--twins", type=int, default=40, help="number of twins; 40 by default")
    parser.add_argument("--folder", type=Path, help="folder that keeps the searches, so that they go on")
    options = parser.parse_args()
    tables = {
        "derivatives": [derivatives(*case) for case in CASES],
        "published rotor": published_rotor(options.folder),
        **twins(options.twins, options.folder),
    }
    machine = environment("numpy", "scipy")
    for title, rows in tables.items():
        print_table(title, rows)
    if options.json is not None:
        options.json.write_text(json.dumps({"machine": machine, "tables": tables}, indent=1) + "\n", encoding="utf-8")


def derivatives(name: str, tables: dict[str, Any]) -> dict[str, Any]:
    """Return a row on derivatives of a rig's response: their times, and how far the two methods are apart.

    A difference takes one whole response. The derivatives compared are central ones, of two responses each.
    """
    rig = load_transmission(name)
    free = rig.assumptions.free
    ranged = [number for number, each in enumerate(free) if isinstance(each.assumption, Range)]
    chosen = ranged[:: len(ranged) // NUMBERS][:NUMBERS]
    problem, z = Problem(rig, Targets(**tables)), np.full(len(free), -0.3)
    by_differences, seconds, closed, less = [], 0.0, [], 0.0
    problem.slope(z, chosen[0])
    for number in chosen:
        step = STEP * np.eye(len(z))[number]
        (forth, back), took = timed(lambda step=step: [problem.misses(z + s * step, problem.value) for s in (1, -1)])
        by_differences.append((forth - back) / (2 * STEP))
        seconds += took / 2
    problem.slope(z, chosen[0])
    for number in chosen:
        slope, took = timed(lambda number=number: problem.slope(z, number))
        closed.append(slope)
        less += took
    return {
        "rig": name,
        "targets": ", ".join(tables),
        "difference_ms": 1e3 * seconds / len(chosen),
        "closed_form_ms": 1e3 * less / len(chosen),
        "ratio": seconds / less,
        "greatest_deviation": float(np.abs(np.subtract(closed, by_differences)).max() / np.abs(by_differences).max()),
    }


def published_rotor(folder: Path | None) -> Rows:
    """Rows of the eight stiffnesses: published, interval, and whether it holds the published one."""
    data = tomllib.loads((RIGS / "friswell_turbogenerator.toml").read_text(encoding="utf-8"))
    data["meshes"]["main"]["profile"].pop("assumed", None)
    known = {}
    for bearing in data["bearings"].values():
        bearing["assumed"] = {}
    for i, (name, axis) in enumerate((name, axis) for name in data["bearings"] for axis in (0, 1)):
        bearing = data["bearings"][name]
        value = known[f"bearings.{name}.stiffness.{axis}"] = bearing["stiffness"][axis]
        bearing["assumed"][f"stiffness.{axis}"] = {"low": (1 - WIDTH) * value, "high": (1 + WIDTH) * value}
        bearing["stiffness"][axis] = OFF[i] * value
    rig = transmission_of(data, owner="turbo-generator")
    modes = coupled_modes(load_transmission("friswell-turbogenerator"))
    moves = [next(iter(modes.moves[int(np.abs(modes.frequency_hz - f).argmin())])) for f in PUBLISHED]
    targets = Targets(
        modes=[
            {"frequency_hz": f, "relative_error": PUBLISHED_ERROR, "moves": name}
            for f, name in zip(PUBLISHED, moves, strict=True)
        ]
    )
    began = time.perf_counter()
    result = identify(rig, targets, folder=folder and folder / "published")
    seconds = time.perf_counter() - began
    posterior = result.posterior()
    met = sum(result.meets_targets)
    print(f"published rotor: {met} of {len(result.members)} rigs meet the targets, {seconds:.0f} s")
    return [
        {
            "number": path,
            "published": value,
            "low": row["posterior_low"],
            "high": row["posterior_high"],
            "width": row["width"],
            "identified": bool(row["is_identified"]),
            "inside": bool(row["posterior_low"] <= value <= row["posterior_high"]),
            "median_off_percent": 100 * (row["median"] / value - 1),
        }
        for (path, value), (_, row) in zip(known.items(), posterior.loc[list(known)].iterrows(), strict=True)
    ]


def twin_rig() -> Transmission:
    """Return the rotor whose numbers are drawn."""
    data = tomllib.loads((RIGS / "friswell_5.9.1.toml").read_text(encoding="utf-8"))
    data["damping_ratio"] = 0.02
    data["shafts"]["shaft"]["segments"][0]["elements"] = 3
    for part, node in (("small", 1), ("large", 2)):
        data["disks"][part]["node"] = node
    data["bearings"]["right"]["node"] = 3
    data["shafts"]["shaft"]["motions"] = ["x", "y", "rx", "ry", "rz"]
    for name in ("left", "right"):
        data["bearings"][name]["assumed"] = {
            f"stiffness.{axis}": {"low": 5e5, "high": 2e6, "scale": "log"} for axis in (0, 1)
        }
    data["materials"]["steel"]["assumed"] = {"young_modulus": {"low": 1.9e11, "high": 2.3e11}}
    data["disks"]["large"]["assumed"] = {"outer_diameter": {"low": 0.32, "high": 0.38}}
    return transmission_of(data, owner="twin")


def twins(count: int, folder: Path | None) -> dict[str, Rows]:
    """Tables of the coverage of each number, and of all."""
    rig = twin_rig()
    paths = [number.path for number in rig.assumptions.free]
    inside: list[list[bool]] = []
    widths: list[list[float]] = []
    met = []
    began = time.perf_counter()
    for twin in range(count):
        rng = np.random.default_rng([2026, twin])
        problem = Problem(rig, Targets(modes=[{"frequency_hz": 1.0, "relative_error": 1.0}]))
        z = rng.standard_normal(len(paths))
        truth, values = problem.rig_at(z), problem.values_at(z)
        frequencies = coupled_modes(truth).frequency_hz[:MODES] * (1 + ERROR * rng.standard_normal(MODES))
        targets = Targets(modes=[{"frequency_hz": float(f), "relative_error": ERROR} for f in frequencies])
        result = identify(rig, targets, seed=twin, folder=folder and folder / f"twin-{twin}")
        posterior = result.posterior().loc[paths]
        low, high = posterior["posterior_low"], posterior["posterior_high"]
        inside.append([bool(low[path] <= values[path] <= high[path]) for path in paths])
        widths.append(list(posterior["width"]))
        met.append(sum(result.meets_targets) / len(result.members))
        print(f"twin {twin + 1} of {count}: {time.perf_counter() - began:.0f} s", flush=True)
    counts = np.sum(inside, axis=0)
    rows = [
        {"number": path, "inside": int(held), "of": count, "median_width": float(width)}
        for path, held, width in zip(paths, counts, np.median(widths, axis=0), strict=True)
    ]
    pooled = {
        "coverage": float(np.mean(inside)),
        "least_of_a_number": int(counts.min()),
        "of": count,
        "rigs_that_meet_targets": float(np.mean(met)),
        "seconds_for_each": (time.perf_counter() - began) / count,
    }
    return {"twins, by number": rows, "twins, pooled": [pooled]}


if __name__ == "__main__":
    main()
