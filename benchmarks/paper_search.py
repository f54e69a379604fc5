"""Search for rigs that show the paper's pictures, inside what is assumed of the built-in rig.

Usage: python benchmarks/paper_search.py [--out FOLDER] [--seed 1] [--hours 3] [--rigs 10]

The targets are `sigdb.paper.margins.target_margins`: the paper's rules about the shifts of 1.5 and 4.5 deg and the loss
of 50 %. The other cases are not simulated here. Each round draws rigs, and for each many profiles of its mesh, since
only they are quick to change. It keeps those that nearly hold P5, the hardest rules. CMA-ES [1]_ runs from the best
of them, by all rules. From the first rig that holds all, walks (`paper_walk`) lead to others. `evaluations.txt` holds
the result of each evaluation or walk: a search that was stopped reads them again and goes on. `found.jsonl` holds the
rigs.

.. [1] N. Hansen, "The CMA evolution strategy: a tutorial", 2016, arXiv:1604.00772.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cma
import numpy as np
from paper_cases import LOST, QuickMesh, QuickResponse, exact_targets, targets_of
from paper_ensemble import write_ensemble
from paper_walk import CONTACT, FINE, Walk, WalkedRig

import sigdb
from sigdb.core import BoolArray, FloatArray, SigdbError
from sigdb.paper.identified import (
    MESH,
    NO_EFFECT,
    PRIOR,
    with_one_sensor,
)
from sigdb.paper.margins import Margin, pass_margins, target_margins
from sigdb.transmission import (
    Mesh,
    Range,
    Transmission,
)
from sigdb.transmission.parts.described import Described
from sigdb.transmission.system.small_matrices import small_matrices

OUTPUT = "displacement"
"""Motion of the pinion that is searched; in a velocity order 1 is too weak for P3, in an acceleration more so."""
COARSE = 32
"""Samples in a tooth pass at first; when a rig nearly holds all there are `FINE`."""

STRUCTURES, PROFILES, STARTS = 300, 30, 8
"""Rigs drawn in a round, profiles drawn for each, and starts of CMA-ES."""
RACE = ((8, 10), (4, 15), (2, 30), (1, 300))
"""Runs that go on, and for how many generations, in turn; those with the greatest costs end."""
NEAR = 1.0
"""Cost below which the last run goes on with more samples."""
FINISH = 200
"""Generations of that run."""
WALKS, PUSHES = 8, (0.8, 0.4, 0.2, 0.1)
"""Walks towards the same corner at most; change of a margin by a single number in them: the less, the more have failed.
With little change those numbers go on that matter little."""
CORNERS = 200
"""Corners of the ranges, drawn at random; a walk goes towards the farthest one."""
WALK_INSIDE, FARTHER_INSIDE = 0.02, 0.08
"""Margins at which a walk ends, and to which a rig is led that is kept, if it is found."""
P5_WEIGHT, NEARLY = 4.0, 3.0
"""Weight of P5 in the cost, and the cost by P5 alone with which a drawn rig is evaluated in full."""
INSIDE = 0.05
"""Margin that the search keeps, so that what it finds is not on the edge of a rule."""
APART = 0.2
"""Least distance of two rigs of an ensemble: the root mean square of the differences as parts of the ranges."""
IN_REACH = 0.03
"""Cost below which a rig is solved in full."""
IMPOSSIBLE = 1e3


def lacking_of(margins: Sequence[Margin]) -> dict[str, float]:
    """Return the margins that are above 0, by rule."""
    return {f"{m.claim}: {m.rule}": m.value for m in margins if m.value > 0}


def missing(margin: float) -> float:
    """Return the square of what a margin lacks, which grows as a logarithm where that is much."""
    short = max(0.0, margin + INSIDE)
    return float(short**2 if short < 1 else 1 + 2 * np.log(short))


def cost_of(margins: Sequence[Margin], contact: float) -> float:
    """Return the weighted sum of what the margins lack."""
    weights = [P5_WEIGHT if margin.claim.startswith("P5") else 1.0 for margin in margins]
    cost = sum(weight * missing(margin.value) for weight, margin in zip(weights, margins, strict=True))
    # Signals of a mesh that opens are wrong; where it opens widely they say nothing.
    cost += P5_WEIGHT * missing(-contact / CONTACT) + 50 * max(0.0, -contact - 0.1)
    return float(cost) if np.isfinite(cost) else IMPOSSIBLE


@dataclass
class Search:
    """A search with its random numbers, its results, and those of a search that was stopped."""

    out: Path
    seed: int
    seconds: float
    rigs: int
    evaluations: int = 0
    found: list[FloatArray] = field(default_factory=list)
    found_after: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.prior = sigdb.load_transmission(PRIOR)
        self.rig = with_one_sensor(self.prior, OUTPUT)
        self.assumptions = self.rig.assumptions
        paths = [number.path for number in self.assumptions.free]
        self.ranges = np.array([isinstance(number.assumption, Range) for number in self.assumptions.free])
        self.ranges &= ~np.isin(paths, NO_EFFECT)
        self.of_profile = np.array([number.within is not None for number in self.assumptions.free])
        self.rng = np.random.default_rng(self.seed)
        self.out.mkdir(parents=True, exist_ok=True)
        stored = self.out / "evaluations.txt"
        # A line that was cut short is written again.
        self.stored = stored.read_text(encoding="utf-8").split("\n")[:-1] if stored.exists() else []
        stored.write_text("".join(f"{line}\n" for line in self.stored), encoding="utf-8")
        self.steps = 0
        self.file = stored.open("a", encoding="utf-8")
        self.found_file = (self.out / "found.jsonl").open("w", encoding="utf-8")
        self.ends = time.monotonic() + self.seconds

    @property
    def over(self) -> bool:
        """Whether there are enough rigs, or the time is up; stored steps take none."""
        late = self.steps >= len(self.stored) and time.monotonic() > self.ends
        return late or len(self.found) >= self.rigs

    def step(self, evaluate: Callable[[], list[list[float]]], evaluations: int) -> list[list[float]]:
        """Return the result of a step, stored or new."""
        if self.steps < len(self.stored):
            result: list[list[float]] = json.loads(self.stored[self.steps])
        else:
            result = evaluate()
            self.file.write(json.dumps(result) + "\n")
            self.file.flush()
        self.steps += 1
        self.evaluations += evaluations
        return result

    def at(self, u: FloatArray) -> Transmission:
        """Return the rig at a point of the unit cube."""
        return self.rig.with_assumed(self.assumptions.from_unit(u))

    def active(self, u: FloatArray) -> BoolArray:
        """Return which coordinates are ranges of numbers that the rig has."""
        values = self.assumptions.from_unit(u)
        chosen = {path: values.get(path, kind) for path, kind in self.assumptions.chosen.items()}
        return self.ranges & np.array([number.exists(chosen) for number in self.assumptions.free])

    def distance(self, u: FloatArray, v: FloatArray) -> float:
        """Return the root mean square of the differences of two rigs, in parts of the ranges that both have."""
        both = self.active(u) & self.active(v)
        return float(np.sqrt(np.mean((u - v)[both] ** 2)))

    def screen(self) -> list[tuple[float, FloatArray]]:
        """Draw a rig with many profiles; return cost and point of its best one, if any."""
        u = self.rng.random(len(self.ranges))
        profiles = self.rng.random((PROFILES, int(self.of_profile.sum())))
        points = np.tile(u, (PROFILES, 1))
        points[:, self.of_profile] = profiles
        nearly = self.step(lambda: self._screened(points), PROFILES)
        return [(cost, points[int(number)]) for cost, number in sorted(nearly)[:1]]

    def _screened(self, points: FloatArray) -> list[list[float]]:
        """Return the cost and the number of each point that nearly holds P5."""
        try:
            rig = self.at(points[0])
            response = QuickResponse(rig, COARSE)
        except (SigdbError, np.linalg.LinAlgError):
            return []
        mesh, nearly = rig.meshes[MESH], []
        for number, u in enumerate(points):
            quick = QuickMesh(response, mesh.model_copy(update={"profile": self._profile(mesh, u)}))
            healthy, least = quick.signal({})
            lost, open_by = quick.signal(LOST)
            if (
                least > 0
                and cost_of(list(pass_margins(targets_of([healthy, healthy, healthy, lost], open_by))), open_by)
                < NEARLY
            ):
                targets = quick.targets()
                nearly.append([cost_of(target_margins(targets), targets.min_compression), number])
        return nearly

    def _profile(self, mesh: Mesh, u: FloatArray) -> Described:
        values = self.assumptions.from_unit(u)
        kept: dict[str, Any] = {}
        for path, value in values.items():
            name, _, component = path.removeprefix(f"meshes.{MESH}.profile.").partition(".")
            if path == f"meshes.{MESH}.profile" or not path.startswith(f"meshes.{MESH}.profile."):
                continue
            kept[name] = (*kept.get(name, ()), value) if component else value
        return mesh.profile.model_copy(update=kept)

    def cost(self, u: FloatArray, samples: int) -> float:
        """Return the cost of a rig."""
        ((cost,),) = self.step(lambda: [[self._cost(u, samples)]], 1)
        return cost

    def _cost(self, u: FloatArray, samples: int) -> float:
        try:
            rig = self.at(u)
            targets = QuickResponse(rig, samples).with_mesh(rig.meshes[MESH]).targets()
        except (SigdbError, np.linalg.LinAlgError):
            return IMPOSSIBLE
        return cost_of(target_margins(targets), targets.min_compression)

    def report(self, what: str, u: FloatArray | None = None) -> None:
        """Print how far the search is, and the claims that a rig lacks."""
        lacking = ""
        if u is not None and self.steps >= len(self.stored):
            rig = self.at(u)
            targets = QuickResponse(rig, FINE).with_mesh(rig.meshes[MESH]).targets()
            margins = {name: round(m, 2) for name, m in lacking_of(target_margins(targets)).items()}
            lacking = f", contact {targets.min_compression:.2f}, lacking {margins}"
        print(f"{time.strftime('%X')} {self.evaluations} evaluations: {what}{lacking}", flush=True)

    def walk(self, u: FloatArray, ahead: FloatArray, push: float) -> FloatArray | None:
        """Return a rig that holds all, between a point and it plus ``ahead`` or near there, if it is found."""
        ((evaluations, *end),) = self.step(lambda: [self._walk(u, ahead, push)], 0)
        self.evaluations += int(evaluations)
        return np.array(end) if end else None

    def _walk(self, u: FloatArray, ahead: FloatArray, push: float) -> list[float]:
        walked = WalkedRig(self.at, u, self.active(u), self.of_profile)
        walk = Walk(walked.parts, walked.slopes, walked.kinked, WALK_INSIDE)
        x = walk.walk(u[walked.active], ahead[walked.active], push)
        if x is None:
            return [walked.evaluations]
        if self.is_apart(walked.at(x)):
            farther = replace(walk, inside=FARTHER_INSIDE).back(x, walked.parts(x))
            x = x if farther is None else farther
        return [walked.evaluations, *walked.at(x)]

    def far_corner(self) -> FloatArray:
        """Return the corner of the unit cube, of some drawn at random, with the greatest least distance to the rigs."""
        corners = self.rng.integers(0, 2, (CORNERS, len(self.ranges))).astype(float)
        active = self.active(self.found[0])
        least = [min(np.square(corner - u)[active].sum() for u in self.found) for corner in corners]
        return np.asarray(corners[np.argmax(least)])

    def is_apart(self, u: FloatArray) -> bool:
        """Return whether a rig is apart from those that were found."""
        return all(self.distance(u, other) >= APART for other in self.found)

    def keep_if_it_holds(self, u: FloatArray) -> bool:
        """Keep a rig that is apart from the others and, solved in full, holds all targets."""
        if not self.is_apart(u):
            return False
        ((holds,),) = self.step(lambda: [[float(self._holds(u))]], 1)
        if holds:
            self.found.append(u)
            self.found_after.append(self.evaluations)
            line = {"evaluations": self.evaluations, "unit": [round(x, 9) for x in u]}
            self.found_file.write(json.dumps(line) + "\n")
            self.found_file.flush()
            self.report(f"rig {len(self.found)}")
        return bool(holds)

    def _holds(self, u: FloatArray) -> bool:
        try:
            targets = exact_targets(self.at(u))
        except SigdbError:
            return False
        return targets.min_compression > 0 and all(margin.value <= 0 for margin in target_margins(targets))


class Run:
    """A CMA-ES run over the ranges of one choice of hand, places and kind of profile. It goes on by generations."""

    def __init__(self, search: Search, u: FloatArray, sigma: float, samples: int) -> None:
        self.search, self.u, self.active, self.samples = search, u, search.active(u), samples
        options = {"bounds": [0, 1], "popsize": 16, "seed": int(search.rng.integers(1, 2**31)), "verbose": -9}
        self.es = cma.CMAEvolutionStrategy(u[self.active].clip(0.02, 0.98), sigma, options)
        self.best, self.point = np.inf, u[self.active]

    def best_point(self) -> FloatArray:
        """Return the point of the unit cube with the least cost."""
        u = self.u.copy()
        u[self.active] = np.clip(self.point, 0, 1)
        return u

    def go(self, generations: int) -> FloatArray | None:
        """Run on; return a rig that holds all, which ends the run."""
        for _ in range(generations):
            if self.search.over or self.es.stop():
                break
            points, costs = self.es.ask(), []
            for x in points:
                u = self.u.copy()
                u[self.active] = np.clip(x, 0, 1)
                cost = self.search.cost(u, self.samples)
                if self.samples == FINE and cost < IN_REACH and self.search.keep_if_it_holds(u):
                    return u
                costs.append(cost)
            self.es.tell(points, costs)
            if min(costs) < self.best:
                self.best, self.point = min(costs), self.es.best.x
        self.search.report(f"cost {self.best:.4g}", self.best_point())
        return None


@small_matrices
def rounds(search: Search) -> None:
    """Draw, race and lead away from rigs that were found, until there are enough or the time is up."""
    while not search.over:
        starts = [start for _ in range(STRUCTURES) if not search.over for start in search.screen()]
        starts.sort(key=lambda start: start[0])
        search.report(f"starts with costs {[round(start[0], 2) for start in starts[:STARTS]]}")
        runs = [Run(search, u, 0.15, COARSE) for _, u in starts[:STARTS]]
        for keep, generations in RACE:
            runs = sorted(runs, key=lambda run: run.best)[:keep]
            for run in runs:
                run.go(generations)
        best = min(runs, key=lambda run: run.best)
        if best.best < NEAR:
            u = Run(search, best.best_point(), 0.05, FINE).go(FINISH)
            if u is not None:
                wander(search)


def wander(search: Search) -> None:
    """Walk from rigs that were found towards corners of the ranges, until there are enough or the time is up.

    A corner is one of those that are far from all rigs. The first rig is on the edge of the rules: once there are
    others, walks begin at these.
    """
    while not search.over:
        begins = search.found[1:] or search.found
        u = begins[search.rng.integers(len(begins))]
        corner, failed = search.far_corner(), 0
        for _ in range(WALKS):
            if search.over or failed == len(PUSHES):
                break
            walked = search.walk(u, corner - u, PUSHES[failed])
            if walked is None:
                failed += 1
            elif search.keep_if_it_holds(walked):
                break
            else:
                u = walked


def main() -> None:
    """Search and report what was found."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("build/paper-search"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--hours", type=float, default=3.0)
    parser.add_argument("--rigs", type=int, default=10)
    parser.add_argument("--ensemble", type=Path, default=Path("data/transmissions"))
    given = parser.parse_args()
    search = Search(given.out, given.seed, given.hours * 3600, given.rigs)
    rounds(search)
    if search.found:
        write_ensemble(search.prior, list(zip(search.found_after, search.found, strict=True)), OUTPUT, given.ensemble)
    print(f"{search.evaluations} evaluations, {len(search.found)} rigs in {given.out / 'found.jsonl'}")


if __name__ == "__main__":
    main()
