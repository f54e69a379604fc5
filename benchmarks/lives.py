"""Lives of simulated gears: the loss at the first alarm, and the coverage of the remaining life, also off the prior.

A sweep makes gears whose loss of stiffness grows by a law, each look with noise of its own. The mean of twenty healthy
looks of the same gear is taken off, so that its index errors cancel. The filter has the law of Paris with rates of 0.02
to 0.4 at the limit and exponents of 2.5 to 3.5. The alarm of a single look is the mean likelihood ratio over teeth and
levels, at a rate of 1e-3 counted on drawn healthy looks; that of the filter is its statistic above 1000 looks. A life
is asked for after each alarm, at each look: the time until the loss is 0.4.

    python benchmarks/lives.py [--lives 6] [--json benchmarks/lives.json]
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from measuring import environment, print_table
from scipy.special import logsumexp

import sigdb
from sigdb.core import FloatArray
from sigdb.pipeline import load_recipe
from sigdb.planning import PlanSettings
from sigdb.planning.candidate_averages import CandidateAverages
from sigdb.prognosis import SeverityFilter, paris_crack, remaining_life, severity_after
from sigdb.recognition import Hypotheses
from sigdb.sweep import life_rows, run
from sigdb.transmission import load_transmission

RIG, GEAR, SENSOR, TOOTH = "nasa-spiral-bevel", "pinion", "pinion-vertical", 5
AVERAGES, SNR_DB, START, LIMIT = 102, -10.0, 0.02, 0.4
BASELINE, FALSE_ALARM_RATE = 20, 1e-3
LEVEL = 0.9
RATES, EXPONENTS = np.geomspace(0.02, 0.4, 12), [2.5, 3.0, 3.5]

SCENARIOS = {
    "in the prior": 'law = "paris", rate.min = 0.04, rate.max = 0.2, exponent.min = 2.5, exponent.max = 3.5',
    "five times as fast": 'law = "paris", rate.min = 1.0, rate.max = 2.0, exponent.min = 2.5, exponent.max = 3.5',
    "a third as fast": 'law = "paris", rate.min = 0.006, rate.max = 0.01, exponent.min = 2.5, exponent.max = 3.5',
    "exponent of 5": 'law = "paris", rate.min = 0.2, rate.max = 1.0, exponent.min = 5.0, exponent.max = 5.0',
    "constant speed": 'law = "archard", rate.min = 0.005, rate.max = 0.02',
}


def main() -> None:
    """Print the tables, or write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lives", type=int, default=6, help="lives of each of two specimens; 6 by default")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        looks, differences, noise = simulated(Path(folder), options.lives)
    laws = CandidateAverages.of(load_transmission(RIG), GEAR, PlanSettings(largest=0.5))
    kept = np.flatnonzero((laws.sizes >= START) & (laws.sizes <= 0.5))
    levels, hypotheses = laws.sizes[kept], laws.by_sensor[SENSOR].only(np.concatenate([[0], 1 + kept]))
    threshold, false_alarms = healthy_looks(hypotheses, levels, noise)
    rows = []
    for number, scenario in enumerate(SCENARIOS):
        one = looks["grid"] == number
        rows.append(outcome(scenario, looks[one], differences[one], hypotheses, levels, noise, threshold))
    print_table("Lives", rows)
    print_table("Healthy looks", [false_alarms])
    if options.json is not None:
        document = {"machine": environment("numpy", "scipy"), "lives": rows, "healthy looks": false_alarms}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def simulated(folder: Path, lives: int) -> tuple[pd.DataFrame, FloatArray, float]:
    """Looks of all lives, the difference of each average from the healthy looks of its gear, and the noise."""
    grids = "\n".join(
        f"[[sweep.grid]]\ntooth = [{TOOTH}]\n"
        f"life = {{ start = {START}, limit = {LIMIT}, lives = {lives}, looks = 150, seed = {seed}, {text} }}"
        for seed, text in enumerate(SCENARIOS.values())
    )
    (folder / "recipe.toml").write_text(
        f'[sweep]\nrig = "{RIG}"\nseed = 1\nspecimens = 2\nhealthy = {BASELINE}\n{grids}\n'
        f"[measurement]\naverages = {AVERAGES}\nsnr_db = {SNR_DB}\n"
        f'[signature]\nsensors = ["{SENSOR}"]\nsamples_per_tooth = 32\n',
        encoding="utf-8",
    )
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "db", recipe=recipe.text, jobs=1)
    database = sigdb.open(folder / "db")
    looks = life_rows(database)
    looks = looks[looks["status"] == "ok"].reset_index(drop=True)
    healthy = database.sql("select id, specimen, scatter, averages from features where tooth = 0 and status = 'ok'")
    averages = database.signals(healthy["id"])["tsa"]
    mean = {specimen: averages[(healthy["specimen"] == specimen).to_numpy()].mean(axis=0) for specimen in (0, 1)}
    x = database.signals(looks["id"])["tsa"]
    noise = float(np.sqrt(np.mean(healthy["scatter"] ** 2 / healthy["averages"]) * (1 + 1 / BASELINE)))
    return looks, x - np.array([mean[specimen] for specimen in looks["specimen"]]), noise


def log_ratios(hypotheses: Hypotheses, difference: FloatArray, noise: float) -> FloatArray:
    """Logarithm of the density of each look with damage (rows, teeth, levels) over that without."""
    likelihood = hypotheses.log_likelihood(hypotheses.signal[0] + difference, noise=noise, index_error=0.0)
    return (likelihood[:, 1:] - likelihood[:, :1]).transpose(0, 2, 1)


def healthy_looks(hypotheses: Hypotheses, levels: FloatArray, noise: float) -> tuple[float, dict[str, Any]]:
    """Threshold of a single look at the rate, and the false alarms of the filter in sequences of 100 looks."""
    stream = np.random.default_rng(0)
    drawn = noise * stream.standard_normal((20_000, hypotheses.signal.shape[1]))
    ratios = log_ratios(hypotheses, drawn, noise)
    threshold = float(np.quantile(logsumexp(ratios, axis=(1, 2)), 1 - FALSE_ALARM_RATE))
    alarms = 0
    for sequence in ratios.reshape(-1, 100, *ratios.shape[1:]):
        chain = the_filter(levels, hypotheses.teeth)
        alarms += any(chain.look(each, elapsed=1.0).change_statistic > 1 / FALSE_ALARM_RATE for each in sequence)
    sequences = len(ratios) // 100
    allowed = 100 * FALSE_ALARM_RATE
    return threshold, {
        "sequences": sequences,
        "looks each": 100,
        "with a false alarm": alarms / sequences,
        "at most about": allowed,
    }


def the_filter(levels: FloatArray, teeth: int) -> SeverityFilter:
    """The filter with its prior."""
    law = paris_crack(levels, rates=RATES, exponents=EXPONENTS, reference=LIMIT)
    return SeverityFilter(law, teeth=teeth, initiation=1e-5)


def outcome(
    scenario: str,
    looks: pd.DataFrame,
    differences: FloatArray,
    hypotheses: Hypotheses,
    levels: FloatArray,
    noise: float,
    threshold: float,
) -> dict[str, Any]:
    """Losses at the first alarms, and the coverage of the remaining life."""
    first: dict[str, list[float]] = {"single": [], "filter": []}
    asked = given = covered = 0
    reasons: dict[str, int] = {}
    widths = []
    for _, life in looks.groupby(["life", "specimen"]):
        ratios = log_ratios(hypotheses, differences[life.index.to_numpy() - looks.index[0]], noise)
        losses, times = life["severity"].to_numpy(), life["time"].to_numpy()
        single = logsumexp(ratios, axis=(1, 2)) > threshold
        first["single"].append(losses[single.argmax()] if single.any() else np.nan)
        end = end_of(life)
        chain, alarm = the_filter(levels, hypotheses.teeth), np.nan
        for number, ratio in enumerate(ratios):
            after = chain.look(ratio, elapsed=1.0 if number else 0.0)
            if np.isnan(alarm) and after.change_statistic > 1 / FALSE_ALARM_RATE:
                alarm = losses[number]
            if not np.isnan(alarm):
                asked += 1
                remaining = remaining_life(after, limit=LIMIT, level=LEVEL)
                if remaining.reason:
                    reasons[remaining.reason] = reasons.get(remaining.reason, 0) + 1
                else:
                    given += 1
                    covered += remaining.low <= end - times[number] <= remaining.high
                    widths.append((remaining.high - remaining.low) / (end - times[number] + 1))
        first["filter"].append(alarm)
    return {
        "scenario": scenario,
        "lives": len(first["filter"]),
        "loss at the first alarm, single look": float(np.nanmedian(first["single"])),
        "loss at the first alarm, filter": float(np.nanmedian(first["filter"])),
        "looks": asked,
        "life given": given / max(asked, 1),
        "covered of these": covered / given if given else None,
        "median width over life": float(np.median(widths)) if widths else None,
        "reasons": reasons,
    }


def end_of(life: pd.DataFrame) -> float:
    """Time at which the loss is at the limit."""
    rate, exponent = life["rate"].iloc[0], life["exponent"].iloc[0]
    times = np.linspace(0, 5000, 500_001)
    severity = severity_after(START, times, rate=rate, exponent=exponent, reference=LIMIT)
    return float(times[np.argmax(severity >= LIMIT)])


if __name__ == "__main__":
    main()
