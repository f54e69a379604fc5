"""The gain of several averages of one machine over one, in decibels, by the best possible answers.

Averages are drawn from the law of a small database of the NASA rig, with specimens and noise. The gain is the decrease
of the noise at which the first sensor alone is wrong as often as all averages together. The last line adds up the
log-likelihoods of the averages as if each had a pair of gears of its own.

    python benchmarks/fusion.py [--draws N] [--json FILE]
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, json_option, publish
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core import IntArray
from sigdb.database import Database
from sigdb.pipeline import load_recipe
from sigdb.recognition import AverageLaw, Hypotheses, JointLaw
from sigdb.recognition.templates.posterior import posterior
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
gear = "pinion"
seed = 5
specimens = 1
healthy = 1

[[sweep.grid]]
tooth = 1
stiffness_loss = [0.05, 0.1, 0.2, 0.3, 0.4]
damaged_teeth = [1, 2]
operating.speed_rpm = [13900.0, 14400.0]

[measurement]
averages = 102

[signature]
sensors = ["pinion-vertical", "pinion-housing-vertical"]
"""
SNR_DB, AVERAGES, INDEX_ERROR = -16.0, 102, 2e-6
LEVELS = np.arange(-8.0, 2.5, 0.5)
"""Levels of the noise of the first sensor alone, dB."""


def main() -> None:
    """Print the table, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=1500, help="machines that are drawn; 1500 by default")
    json_option(parser)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        Path(folder, "recipe.toml").write_text(RECIPE, encoding="utf-8")
        recipe = load_recipe(Path(folder, "recipe.toml"))
        run(recipe.plan(), Path(folder, "signatures"), recipe=recipe.text, jobs=1)
        rows = measure(sigdb.open(Path(folder, "signatures")), given.draws)
    machine = environment("numpy", "scipy")
    publish(machine, {f"Wrong answers at {SNR_DB:g} dB, and the gain over the first sensor": rows}, given.json)


def measure(database: Database, draws: int) -> list[dict[str, Any]]:
    """Return the shares of wrong answers, and the gains."""

    def law(speed_rpm: float, sensor: int) -> tuple[AverageLaw, float]:
        hypotheses = Hypotheses.of(
            database, speed_rpm=speed_rpm, torque=torque, teeth=12, sensor=database.sensors[sensor]
        )
        deviation = np.sqrt(hypotheses.reference_variance[0] / AVERAGES) * 10 ** (-SNR_DB / 20)
        return AverageLaw.of(hypotheses), float(deviation)

    torque = float(database.sql("select torque from templates limit 1")["torque"][0])
    slow, fast = ([law(speed, sensor) for sensor in (0, 1)] for speed in (13900.0, 14400.0))
    cases = {
        "the first sensor": [fast[0]],
        "the second sensor": [fast[1]],
        "both sensors": fast,
        "two recordings of the first sensor": [fast[0]] * 2,
        "four recordings of the first sensor": [fast[0]] * 4,
        "two operating points of the first sensor": [slow[0], fast[0]],
        "two sensors, two operating points": [*slow, *fast],
    }
    alone = np.array([wrong(cases["the first sensor"], draws, level) for level in LEVELS])
    rows = []
    for name, laws in cases.items():
        share = wrong(laws, draws)
        rows.append({"averages": name, "wrong": share, "gain, dB": -float(np.interp(share, alone, LEVELS))})
    share, calibrated = added_up(cases["four recordings of the first sensor"], draws)
    rows.append({"averages": "four recordings, log-likelihoods added up", "wrong": share, "believed": calibrated})
    return rows


def drawn(laws: list[tuple[AverageLaw, float]], draws: int, decibels: float) -> tuple[Any, ...]:
    """Return the joint law, its prior, and machines that are drawn from it: healthy or damaged, all teeth alike."""
    joint = JointLaw.of([law for law, _ in laws])
    noise = np.array([deviation for _, deviation in laws]) * 10 ** (decibels / 20)
    stream = np.random.default_rng(3)
    share = np.where(joint.healthy, 0.5 / joint.healthy.sum(), 0.5 / (~joint.healthy).sum())
    template: IntArray = stream.choice(len(share), draws, p=share)
    tooth: IntArray = stream.integers(1, 13, draws)
    averages = joint.draw(stream, template, tooth, noise=noise, index_error=INDEX_ERROR)
    prior = np.repeat(np.log(share / 12)[:, None], 12, axis=1)
    return joint, prior, averages, noise, np.where(joint.healthy[template], 0, tooth)


def wrong(laws: list[tuple[AverageLaw, float]], draws: int, decibels: float = 0.0) -> float:
    """Return the share of wrong answers, as the mean probability of error: the same, with less scatter."""
    joint, prior, averages, noise, _ = drawn(laws, draws, decibels)
    likelihood = joint.log_likelihood(averages, noise=noise, index_error=INDEX_ERROR)
    return float(posterior(likelihood, prior, joint.healthy).risk.mean())


def added_up(laws: list[tuple[AverageLaw, float]], draws: int) -> tuple[float, float]:
    """Return the share of wrong answers by the sum of log-likelihoods, and the share that it expects."""
    joint, prior, averages, noise, truth = drawn(laws, draws, 0.0)
    parts = [
        JointLaw.of([law]).log_likelihood([x], noise=sigma, index_error=INDEX_ERROR)
        for law, x, sigma in zip(joint.laws, averages, noise, strict=True)
    ]
    after = posterior(np.sum(parts, axis=0), prior, joint.healthy)
    return float((after.tooth != truth).mean()), float(after.risk.mean())


if __name__ == "__main__":
    main()
