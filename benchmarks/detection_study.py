"""The probability of detection of a detector by three methods, from 60 sizes, as MIL-HDBK-1823A asks for.

Sixty stiffness losses are spread by a scrambled Sobol sequence, each on a gear pair of its own with a tooth and noise
drawn at random. The detector answers each. Hits and misses give curves by logit and probit, and the strength of the
signal gives one by log-linear regression with censored signals (a-hat against a). Each states a90, and a90/95 by
likelihood ratio. They are compared with the share detected of many more gears.

    python benchmarks/detection_study.py [--model NAME] [--snr-db DB] [--speed-rpm RPM] [--torque NM] [--seed N]
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w
from measuring import environment, json_option, publish
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.recognition import Detector, Hypotheses, Model, signal_response
from sigdb.recognition.metrics.pod_curve import LINKS, curve_of_link
from sigdb.sweep import run

SIZES = 60
LOSSES = (0.02, 0.4)
AVERAGES, INDEX_ERROR = 102, 2e-6
MANY = 200
"""Gears of each size for the share that is really detected."""
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the table, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="nasa-detection", help="name or folder of a model of detection")
    parser.add_argument("--snr-db", type=float, default=-18.0, help="signal-to-noise ratio of a revolution; -18 dB")
    parser.add_argument("--speed-rpm", type=float, default=14_000.0, help="speed; 14 000 rpm")
    parser.add_argument("--torque", type=float, default=350.0, help="torque of the pinion; 350 N m")
    parser.add_argument("--seed", type=int, default=1, help="seed of sizes, gears and noise; 1")
    json_option(parser)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        laws = templates(Path(folder), given.speed_rpm, given.torque, given.seed)
        model = sigdb.load_model(given.model)
        rows = study(model, laws, given.speed_rpm, given.torque, given.snr_db, given.seed)
    machine = environment("numpy", "scipy")
    publish(machine, {"Stiffness loss detected with probability 0.9": rows}, given.json)


def templates(folder: Path, speed_rpm: float, torque: float, seed: int) -> Hypotheses:
    """The laws of averages of gears of all sizes, and of healthy ones, at one operating point."""
    losses = np.sort(qmc.scale(qmc.Sobol(1, seed=seed).random(64)[:SIZES], *LOSSES).ravel())
    recipe = {
        "sweep": {
            "rig": "nasa-spiral-bevel",
            "gear": "pinion",
            "seed": seed,
            "specimens": 1,
            "healthy": 1,
            "grid": [
                {
                    "tooth": 1,
                    "stiffness_loss": losses.round(4).tolist(),
                    "operating.speed_rpm": speed_rpm,
                    "operating.torque": torque,
                }
            ],
        },
        "measurement": {"averages": AVERAGES, "index_error": INDEX_ERROR, "snr_db": 0.0},
        "signature": {"sensors": ["pinion-vertical"]},
    }
    (folder / "recipe.toml").write_text(tomli_w.dumps(recipe), encoding="utf-8")
    loaded = load_recipe(folder / "recipe.toml")
    run(loaded.plan(), folder / "signatures", recipe=loaded.text, jobs=1)
    return Hypotheses.of(sigdb.open(folder / "signatures"), speed_rpm=speed_rpm, torque=torque, teeth=12)


def study(model: Model, laws: Hypotheses, speed_rpm: float, torque: float, snr_db: float, seed: int) -> Rows:
    """Rows of the table: a50, a90 and a90/95 by each method, and what is really detected."""
    detector, stream = model.estimator, np.random.default_rng(seed)
    assert isinstance(detector, Detector)
    places = np.flatnonzero(~laws.healthy)
    loss = laws.cases["stiffness_loss"].to_numpy(float)[places]
    noise = float(np.sqrt(laws.reference_variance[0] * 10 ** (-snr_db / 10) / AVERAGES))

    def scores(of: np.ndarray) -> tuple[np.ndarray, float]:
        """The scores of one gear for each place, and the threshold."""
        tooth = stream.integers(1, laws.teeth + 1, len(of))
        x = laws.draw(stream, of, tooth, noise=noise, index_error=INDEX_ERROR)
        frame = pd.DataFrame({"teeth": laws.teeth, "speed_rpm": speed_rpm, "torque": torque}, index=range(len(of)))
        frame = frame.assign(averages=AVERAGES, scatter=noise * np.sqrt(AVERAGES), tsa=list(x))
        ratio = detector.log_ratio(frame)
        return ratio, float((ratio - detector.decision_function(frame))[0])

    ratio, threshold = scores(places)
    hits = (ratio > threshold).astype(float)
    many = np.stack([scores(np.full(MANY, place))[0] > threshold for place in places]).mean(axis=1)
    found: Rows = [
        {"method": f"{name}, hits and misses", **_ends(curve_of_link(link, loss, np.diag(hits), np.eye(len(loss))))}
        for name, link in LINKS.items()
    ]
    # The root of twice the log ratio is the strength of the damage in standard deviations of the noise.
    strength, limit = np.sqrt(2 * ratio.clip(min=0)), np.sqrt(2 * max(threshold, 0.0))
    found.append(
        {"method": "signal response", **_ends(signal_response(loss, strength, threshold=limit, least=0.5 * limit))}
    )
    total = np.full((1, len(loss)), float(MANY))
    found.append(
        {"method": f"{MANY} gears of each size", **_ends(curve_of_link(LINKS["probit"], loss, many * total, total))}
    )
    return found


def _ends(curve: Any) -> dict[str, float | None]:
    if curve is None:
        return {"a50": None, "a90": None, "a90/95": None}
    return {"a50": curve.severity(0.5), "a90": curve.severity(), "a90/95": curve.severity_bound()}


if __name__ == "__main__":
    main()
