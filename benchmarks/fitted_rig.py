"""From a healthy recording to a fitted rig: the worked example of the page 'What is known of a rig, and what is not'.

A rig is drawn from the ranges of `spur-test-rig`, and the identification is not told which. It is recorded at several
speeds by the march in time, with index errors, noise, and a sensor whose mount resonates at 9 kHz: an unknown smooth
path. The mesh harmonics of the averages are the targets; those of one speed are held out.

    nice -n 5 python benchmarks/fitted_rig.py --out FOLDER [--members 12] [--numbers docs/guide/fitted_rig.json]

It writes the recordings and TARGETS.toml into the folder, and searches there, so that a stopped search goes on.
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
    parser.add_argument("--out", type=Path, required=True, help="folder of the targets and the search")
    parser.add_argument("--members", type=int, default=12, help="rigs of the ensemble")
    parser.add_argument("--numbers", type=Path, help="file for the numbers")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rig = load_transmission(RIG)
    unknown = sigdb.ensemble(rig, 1, rng=MEMBER)
    targets = options.out / "TARGETS.toml"
    if not targets.exists():
        targets.write_text(tomli_w.dumps(targets_of(unknown[0])), encoding="utf-8")
    began = time.process_time()
    result = identify(rig, targets, members=options.members, folder=options.out)
    numbers = {
        "machine": environment("numpy", "scipy"),
        "processor_seconds": time.process_time() - began,
        "tables": tables(result, dict(unknown.values[0])),
    }
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


def tables(result: Identification, drawn: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Return the tables of the page: each number with its true value, what is predicted, and counts."""
    posterior, predictions = result.posterior(), result.predictions()
    numbers = [
        {
            "number": path,
            "low": float(row["low"]),
            "high": float(row["high"]),
            "interval_from": float(row["posterior_low"]),
            "interval_to": float(row["posterior_high"]),
            "truth": float(drawn[path]),
            "inside": bool(row["posterior_low"] <= drawn[path] <= row["posterior_high"]),
            "width": float(row["width"]),
            "identified": bool(row["is_identified"]),
        }
        for path, row in posterior.iterrows()
    ]
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
    counts = [
        {
            "rigs": len(result.members),
            "rigs_that_meet_targets": sum(result.meets_targets),
            "numbers": len(numbers),
            "inside": sum(row["inside"] for row in numbers),
            "identified": sum(row["identified"] for row in numbers),
        }
    ]
    return {"numbers": numbers, "held out": held_out, "counts": counts}


if __name__ == "__main__":
    main()
