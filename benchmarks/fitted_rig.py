"""From healthy recordings to a fitted rig: the worked example of the page 'What is known of a rig, and what is not'.

Rigs are drawn from the ranges of `spur-test-rig`, and the identification does not read their numbers. Each is recorded
at several speeds by the march in time, with index errors, noise, and a sensor whose mount resonates at 9 kHz: an
unknown smooth path. The mesh harmonics of the averages are the targets; those of one speed are held out. The first rig
is the example; all of them count how often the intervals hold the drawn numbers.

    nice -n 5 python benchmarks/fitted_rig.py --out FOLDER [--members 12] [--rigs 4] [--numbers FILE]

It writes TARGETS.toml of each rig into a folder of its own, and searches there, so that a stopped search goes on.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from measuring import environment

import sigdb
from sigdb.identification import Identification, identify
from sigdb.measurement import index_errors
from sigdb.recording import Surroundings, recorded_signature, synthetic_recording
from sigdb.signature import order_spectrum
from sigdb.transmission import Transmission, load_transmission

RIG, SENSOR, MEMBER = "spur-test-rig", "pinion-vertical", 20260
SPEEDS, HELD_OUT = (1200.0, 1800.0), 1500.0
HARMONICS, ERROR, REVOLUTIONS = 6, 0.1, 60
SURROUNDINGS = {"path": {"frequency": 9000.0, "damping_ratio": 0.1}, "noise": {"snr_db": 10.0}}
INDEX_ERROR = 2e-6
"""Standard deviation of the teeth's index errors, m."""


def main() -> None:
    """Make the targets, identify, and write the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the targets and the searches")
    parser.add_argument("--members", type=int, default=12, help="rigs of each ensemble; 12 by default")
    parser.add_argument("--rigs", type=int, default=4, help="drawn rigs; 4 by default")
    parser.add_argument("--numbers", type=Path, help="file for the numbers")
    options = parser.parse_args()
    rig = load_transmission(RIG)
    unknown = sigdb.ensemble(rig, options.rigs, rng=MEMBER)
    results = []
    for number, (drawn, values) in enumerate(zip(unknown, unknown.values, strict=True)):
        folder = options.out / f"rig-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        targets = folder / "TARGETS.toml"
        if not targets.exists():
            targets.write_text(tomli_w.dumps(targets_of(drawn)), encoding="utf-8")
        began = time.process_time()
        results.append((identify(rig, targets, members=options.members, folder=folder), dict(values)))
        print(f"rig {number}: {time.process_time() - began:.0f} s, {counts(*results[-1])}", flush=True)
    numbers = {"machine": environment("numpy", "scipy"), "tables": tables(*results[0]) | {"rigs": coverage(results)}}
    text = json.dumps(numbers, indent=1) + "\n"
    print(text)
    if options.numbers is not None:
        options.numbers.write_text(text, encoding="utf-8")


def targets_of(rig: Transmission) -> dict[str, Any]:
    """Return the targets file of a rig: the mesh harmonics of its healthy averages."""
    tables = []
    for number, speed in enumerate((*SPEEDS, HELD_OUT)):
        gears = rig.gears["pinion"].teeth, rig.gears["wheel"].teeth
        recording = synthetic_recording(
            rig.replace({"operating.speed_rpm": speed}),
            sampling_rate=51200.0,
            revolutions=REVOLUTIONS,
            index_errors=INDEX_ERROR * index_errors(np.random.default_rng(number), *gears),
            surroundings=Surroundings.model_validate(SURROUNDINGS),
            seed=number,
        )
        average = recorded_signature(recording, teeth=gears[0], channel=SENSOR)
        orders = gears[0] * np.arange(1, HARMONICS + 1)
        noise = float(average.noise[orders].max()) * np.sqrt(2 / len(average.tsa))
        tables.append(
            {
                "sensor": SENSOR,
                "speed_rpm": speed,
                "amplitudes": [float(f"{abs(a):.4g}") for a in order_spectrum(average.tsa)[1][orders]],
                "relative_error": ERROR,
                "error": float(f"{noise:.2g}"),
                "held_out": speed == HELD_OUT,
            }
        )
    return {"title": "Healthy averages at three speeds, behind an unknown path", "path_degree": 2, "harmonics": tables}


Drawn = dict[str, Any]
"""Values of the free numbers of a drawn rig by path."""


def tables(result: Identification, drawn: Drawn) -> dict[str, list[dict[str, Any]]]:
    """Return the tables of the example: each number with its true value, and what is predicted."""
    predictions = result.predictions()
    held_out = [
        {
            "quantity": label,
            "measured_db": float(row["stated"]),
            "error_db": float(row["error"]),
            "predicted_from_db": float(row["predicted_low"]),
            "predicted_to_db": float(row["predicted_high"]),
        }
        for label, row in predictions[predictions["held_out"]].iterrows()
    ]
    return {"numbers": intervals(result, drawn), "held out": held_out}


def intervals(result: Identification, drawn: Drawn) -> list[dict[str, Any]]:
    """Return a row for each number: its range, its interval, and the drawn value."""
    return [
        {
            "number": path,
            "low": float(row["low"]),
            "high": float(row["high"]),
            "interval_from": float(row["posterior_low"]),
            "interval_to": float(row["posterior_high"]),
            "truth": float(drawn[str(path)]),
            "inside": bool(row["posterior_low"] <= drawn[str(path)] <= row["posterior_high"]),
            "width": float(row["width"]),
            "identified": bool(row["is_identified"]),
        }
        for path, row in result.posterior().iterrows()
    ]


def counts(result: Identification, drawn: Drawn) -> dict[str, Any]:
    """Return how many intervals hold the drawn numbers, how many should, and how many of them are narrow."""
    rows = intervals(result, drawn)
    narrow = [row for row in rows if row["identified"]]
    return {
        "rigs_that_meet_targets": sum(result.meets_targets),
        "of": len(result.members),
        "numbers": len(rows),
        "inside": sum(row["inside"] for row in rows),
        "expected": result.level * len(rows),
        "identified": len(narrow),
        "identified_inside": sum(row["inside"] for row in narrow),
    }


def coverage(results: list[tuple[Identification, Drawn]]) -> list[dict[str, Any]]:
    """Return the counts of each drawn rig, and of all."""
    rows = [counts(*each) for each in results]
    total = {name: sum(row[name] for row in rows) for name in rows[0]}
    return [{"rig": name, **row} for name, row in zip([*range(1, len(rows) + 1), "all"], [*rows, total], strict=True)]


if __name__ == "__main__":
    main()
