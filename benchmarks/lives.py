"""Lives of simulated gears: the loss at the first alarm, and the coverage of the remaining life, also off the prior.

A sweep makes gears whose loss of stiffness grows by a law, each look with noise of its own. The mean of twenty healthy
looks of the same gear is taken off, so that its index errors cancel. Some lives are hastened: of their looks after a
loss of 0.1 every fifth counts. The filter has each of three priors: a crack with rates of 0.02 to 0.4 at the limit and
exponents of 2.5 to 3.5; wear with speeds of 0.002 to 0.05; and a crack or wear, with rates of 0.01 to 1 and exponents
of 2 to 4, or speeds of 0.005 to 0.2. The alarm of a single look is the mean likelihood ratio over teeth and levels, at
a rate of 1e-3 counted on drawn healthy looks; that of the filter is its statistic above 1000 looks. A life is asked for
after each alarm, at each look with sure damage: the time until the loss is 0.4. It is counted with growth beyond the
prior, and by the law alone.

    python benchmarks/lives.py [--lives 12] [--seed 0] [--json benchmarks/lives.json]
"""

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from measuring import environment, print_table
from scipy.special import logsumexp

import sigdb
from sigdb.core import FloatArray
from sigdb.pipeline import load_recipe
from sigdb.planning import PlanSettings
from sigdb.planning.candidate_averages import CandidateAverages
from sigdb.prognosis import (
    GrowthLaw,
    SeverityFilter,
    SeverityPosterior,
    archard_wear,
    joined_laws,
    paris_crack,
    remaining_life,
    severity_after,
)
from sigdb.recognition import Hypotheses
from sigdb.sweep import life_rows, run
from sigdb.transmission import load_transmission

RIG, GEAR, SENSOR, TOOTH = "nasa-spiral-bevel", "pinion", "pinion-vertical", 5
AVERAGES, SNR_DB, START, LIMIT = 102, -10.0, 0.02, 0.4
BASELINE, FALSE_ALARM_RATE = 20, 1e-3
LEVEL, INITIATION = 0.9, 1e-5

SCENARIOS = {
    "exponent of 2.5 to 3.5": 'law = "paris", rate.min = 0.04, rate.max = 0.2, exponent.min = 2.5, exponent.max = 3.5',
    "five times as fast": 'law = "paris", rate.min = 1.0, rate.max = 2.0, exponent.min = 2.5, exponent.max = 3.5',
    "a third as fast": 'law = "paris", rate.min = 0.006, rate.max = 0.01, exponent.min = 2.5, exponent.max = 3.5',
    "exponent of 1": 'law = "paris", rate.min = 0.02, rate.max = 0.1, exponent.min = 1.0, exponent.max = 1.0',
    "exponent of 4": 'law = "paris", rate.min = 0.1, rate.max = 0.5, exponent.min = 4.0, exponent.max = 4.0',
    "exponent of 5": 'law = "paris", rate.min = 0.2, rate.max = 1.0, exponent.min = 5.0, exponent.max = 5.0',
    "exponent of 6": 'law = "paris", rate.min = 0.5, rate.max = 2.0, exponent.min = 6.0, exponent.max = 6.0',
    "constant speed": 'law = "archard", rate.min = 0.005, rate.max = 0.02',
}
HASTENED, FACTOR, FROM = ("a third as fast", "exponent of 1", "constant speed"), 5, 0.1
"""Scenarios whose lives are also hastened, by which factor, and from which loss."""

INSIDE = {
    "crack": ("exponent of 2.5 to 3.5",),
    "wear": ("constant speed",),
    "crack or wear": ("exponent of 2.5 to 3.5", "exponent of 4", "constant speed"),
}
"""Scenarios whose growth lies in a prior."""


@dataclass(frozen=True)
class Life:
    """Losses (L,), logarithms of the ratios (L, teeth, levels), and the end, in looks."""

    losses: FloatArray
    ratios: FloatArray
    end: float

    @classmethod
    def of(cls, looks: pd.DataFrame, ratios: FloatArray) -> Self:
        """Return a life of looks."""
        return cls(looks["severity"].to_numpy(), ratios, end_of(looks))

    def hastened(self) -> Self:
        """Return the life that goes on faster from a loss on."""
        before = np.count_nonzero(self.losses <= FROM)
        kept = np.concatenate([np.arange(before), np.arange(before + FACTOR - 1, len(self.losses), FACTOR)])
        end = before - 1 + (self.end - (before - 1)) / FACTOR
        return replace(self, losses=self.losses[kept], ratios=self.ratios[kept], end=end)


def main() -> None:
    """Print the tables, or write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lives", type=int, default=12, help="lives of each of two specimens; 12 by default")
    parser.add_argument("--seed", type=int, default=0, help="seed of lives and noise; 0 by default")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        looks, differences, noise = simulated(Path(folder), options.lives, options.seed)
    laws = CandidateAverages.of(load_transmission(RIG), GEAR, PlanSettings(largest=0.5))
    kept = np.flatnonzero((laws.sizes >= START) & (laws.sizes <= 0.5))
    levels, hypotheses = laws.sizes[kept], laws.by_sensor[SENSOR].only(np.concatenate([[0], 1 + kept]))
    laws_of_growth = priors(levels)
    threshold, false_alarms = healthy_looks(hypotheses, laws_of_growth["crack"], noise)
    rows, alarms = [], []
    for number, scenario in enumerate(SCENARIOS):
        some = looks[looks["grid"] == number]
        lives = [
            Life.of(life, log_ratios(hypotheses, differences[life.index.to_numpy()], noise))
            for _, life in some.groupby(["life", "specimen"])
        ]
        alarms.append(first_alarms(scenario, lives, laws_of_growth["crack"], threshold))
        rows += [outcome(scenario, name, lives, law) for name, law in laws_of_growth.items()]
        if scenario in HASTENED:
            text, hastened = f"{scenario}, then hastened", [life.hastened() for life in lives]
            rows += [outcome(text, name, hastened, law) for name, law in laws_of_growth.items()]
    print_table("First alarms", alarms)
    print_table("Lives", rows)
    print_table("Healthy looks", [false_alarms])
    if options.json is not None:
        document = {
            "machine": environment("numpy", "scipy"),
            "seed": options.seed,
            "tables": {"first alarms": alarms, "lives": rows, "healthy looks": [false_alarms]},
        }
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def priors(levels: FloatArray) -> dict[str, GrowthLaw]:
    """Priors of the growth."""
    both = [
        archard_wear(levels, rates=np.geomspace(0.005, 0.2, 7)),
        paris_crack(levels, rates=np.geomspace(0.01, 1.0, 7), exponents=[2.0, 3.0, 4.0], reference=LIMIT),
    ]
    return {
        "crack": paris_crack(levels, rates=np.geomspace(0.02, 0.4, 12), exponents=[2.5, 3.0, 3.5], reference=LIMIT),
        "wear": archard_wear(levels, rates=np.geomspace(0.002, 0.05, 12)),
        "crack or wear": joined_laws(both),
    }


def simulated(folder: Path, lives: int, seed: int) -> tuple[pd.DataFrame, FloatArray, float]:
    """Looks of all lives, the difference of each average from the healthy looks of its gear, and the noise."""
    grids = "\n".join(
        f"[[sweep.grid]]\ntooth = [{TOOTH}]\n"
        f"life = {{ start = {START}, limit = {LIMIT}, lives = {lives}, looks = 150, "
        f"seed = {1000 * seed + number}, {text} }}"
        for number, text in enumerate(SCENARIOS.values())
    )
    (folder / "recipe.toml").write_text(
        f'[sweep]\nrig = "{RIG}"\nseed = {seed}\nspecimens = 2\nhealthy = {BASELINE}\n{grids}\n'
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


def healthy_looks(hypotheses: Hypotheses, law: GrowthLaw, noise: float) -> tuple[float, dict[str, Any]]:
    """Threshold of a single look at the rate, and the false alarms of the filter in sequences of 100 looks."""
    stream = np.random.default_rng(0)
    drawn = noise * stream.standard_normal((20_000, hypotheses.signal.shape[1]))
    ratios = log_ratios(hypotheses, drawn, noise)
    threshold = float(np.quantile(logsumexp(ratios, axis=(1, 2)), 1 - FALSE_ALARM_RATE))
    alarms = 0
    for sequence in ratios.reshape(-1, 100, *ratios.shape[1:]):
        chain = SeverityFilter(law, teeth=hypotheses.teeth, initiation=INITIATION)
        alarms += any(chain.look(each, elapsed=1.0).change_statistic > 1 / FALSE_ALARM_RATE for each in sequence)
    sequences = len(ratios) // 100
    allowed = 100 * FALSE_ALARM_RATE
    return threshold, {
        "sequences": sequences,
        "looks each": 100,
        "with a false alarm": alarms / sequences,
        "at most about": allowed,
    }


def first_alarms(scenario: str, lives: Sequence[Life], law: GrowthLaw, threshold: float) -> dict[str, Any]:
    """Losses at the first alarms."""
    first: dict[str, list[float]] = {"single": [], "filter": []}
    for life in lives:
        single = logsumexp(life.ratios, axis=(1, 2)) > threshold
        first["single"].append(life.losses[single.argmax()] if single.any() else np.nan)
        alarms = np.array([after.change_statistic > 1 / FALSE_ALARM_RATE for after in posteriors(law, life.ratios)])
        first["filter"].append(life.losses[alarms.argmax()] if alarms.any() else np.nan)
    return {
        "growth": scenario,
        "lives": len(lives),
        "single look": float(np.nanmedian(first["single"])),
        "filter": float(np.nanmedian(first["filter"])),
    }


def outcome(scenario: str, prior: str, lives: Sequence[Life], law: GrowthLaw) -> dict[str, Any]:
    """Lives after the first alarms, with growth beyond the prior and by the law alone."""
    alarmed_looks = sure = given = 0
    covered, widths = dict.fromkeys(("both", "law"), 0), {"both": list[float](), "law": list[float]()}
    for life in lives:
        alarmed = False
        for time, after in enumerate(posteriors(law, life.ratios)):
            alarmed = alarmed or after.change_statistic > 1 / FALSE_ALARM_RATE
            alarmed_looks += alarmed
            if not alarmed or not after.is_sure:
                continue
            sure += 1
            both = remaining_life(after, limit=LIMIT, level=LEVEL)
            given += not both.reason
            alone = remaining_life(
                replace(after, beyond=None, log_evidence_of_change=-np.inf), limit=LIMIT, level=LEVEL
            )
            for name, remaining in (("both", both), ("law", alone)):
                covered[name] += remaining.low <= life.end - time <= remaining.high
                if not remaining.reason:
                    widths[name].append((remaining.high - remaining.low) / (life.end - time + 1))
    width = {name: float(np.median(each)) if each else None for name, each in widths.items()}
    return {
        "growth": scenario,
        "prior": prior,
        "inside": scenario in INSIDE[prior],
        "looks after an alarm": alarmed_looks,
        "damage sure": sure / max(alarmed_looks, 1),
        "life given": given / max(sure, 1),
        "covered": covered["both"] / given if given else None,
        "covered by the law alone": covered["law"] / max(sure, 1),
        "width over life": width["both"],
        "width by the law alone": width["law"],
    }


def posteriors(law: GrowthLaw, ratios: FloatArray) -> Iterator[SeverityPosterior]:
    """Posteriors after each look, one unit of time apart."""
    chain = SeverityFilter(law, teeth=ratios.shape[1], initiation=INITIATION)
    for number, ratio in enumerate(ratios):
        yield chain.look(ratio, elapsed=1.0 if number else 0.0)


def end_of(life: pd.DataFrame) -> float:
    """Time at which the loss is at the limit."""
    rate, exponent = life["rate"].iloc[0], life["exponent"].iloc[0]
    times = np.linspace(0, 20_000, 2_000_001)
    severity = severity_after(START, times, rate=rate, exponent=exponent, reference=LIMIT)
    return float(times[np.argmax(severity >= LIMIT)])


if __name__ == "__main__":
    main()
