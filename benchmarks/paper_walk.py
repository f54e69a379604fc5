"""Walks between rigs that hold all rules: a stride along the rules' slopes, then a return to where all hold.

Most rules are smooth in a rig's numbers, so their margins have slopes. Two kinds have kinks: the amplitude near 180 deg
is a difference of two extremes within a window, and the phase's rise is an extreme. Their places are samples, which
are smooth again. So all rules are linear inequalities in the changes of the numbers, for a linear program. Each step
solves it within bounds, and again with what the rig really has there, which corrects for curvature [1]_. Between steps
slopes follow by Broyden's update.

.. [1] R. Fletcher, Practical Methods of Optimization, 2nd ed., 1987, section 14.4: sequential linear programming by the
   L1 penalty, and the second-order correction.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from paper_cases import QuickResponse
from scipy.optimize import linprog

from sigdb.core import BoolArray, FloatArray, SigdbError
from sigdb.paper import measures
from sigdb.paper.claim_results import SEEN_MODULATION, VANISHES
from sigdb.paper.identified import MESH
from sigdb.paper.margins import TARGET_LOSS, TARGET_SHIFTS, target_margins
from sigdb.paper.signals import TEETH, TOOTH, PaperSignals
from sigdb.transmission import Transmission

FINE = 64
"""Samples in a tooth pass, as `sigdb.simulate` has them."""
CONTACT = 0.2
"""Compression, relative to the static one, that counts as a whole margin."""
STEPS, REACH, LEAST_REACH, MOST_REACH = 24, 0.06, 1e-3, 0.2
"""Steps of a return at most; change of a number in one of them, as a part of its range: first, and its limits."""
HOPELESS = 6, 0.5
"""Steps after which a return ends if the rules lack more than this."""
FOLLOWED = 4
"""Steps for which slopes are updated before they are computed again."""
NEXT = 0.002
"""Change of a number for a slope."""
CENTRES = 0, -1, 1, -3, 3
"""Samples from the window of the least amplitude to those that a step tries."""
NEAR = -1.0
"""Margin above which a rule limits the change of a number in a stride."""
SLACK = 30.0
"""Weight of a lacking margin relative to the length of a stride."""
BEYOND = 0.02
"""How much more than the margin to keep a step aims at."""
FAR = -3.0
"""Margin below which a rule is left out of a step."""


@dataclass(frozen=True)
class RuleParts:
    """What the rules depend on smoothly, in a rig.

    Attributes
    ----------
    margins
        (rules + 1,) margins of the rules and of the contact.
    vanishing
        (k,) signal with the greatest loss around 180 deg; where its range within a pass is at most 1 the amplitude
        vanishes.
    phases
        (2, samples) phase modulation of both shifts in pass 6, in units of what is seen.
    """

    margins: FloatArray
    vanishing: FloatArray
    phases: FloatArray

    @classmethod
    def of(cls, s: PaperSignals, contact: float) -> "RuleParts":
        """Return the parts of the signals of the targets' cases, with the margin of the contact."""
        samples = len(s.healthy) // TEETH
        middle = len(s.healthy) // 2
        around = slice(middle - samples, middle + samples)
        phases = [measures.modulations(s.shifts[shift], TEETH)[1] for shift in TARGET_SHIFTS]
        in_pass = slice((TOOTH - 1) * samples, TOOTH * samples)
        return cls(
            margins=np.array([*(margin.value for margin in target_margins(s)), contact]),
            vanishing=s.losses[TARGET_LOSS][around] / (VANISHES * np.ptp(s.healthy)),
            phases=np.array([(phase - np.median(phase))[in_pass] for phase in phases]) / SEEN_MODULATION[1],
        )

    @property
    def vector(self) -> FloatArray:
        """All numbers in a row."""
        return np.concatenate([self.margins, self.vanishing, self.phases.ravel()])

    def from_vector(self, vector: FloatArray) -> "RuleParts":
        """Return the parts with other numbers."""
        first, second = len(self.margins), len(self.margins) + len(self.vanishing)
        return RuleParts(vector[:first], vector[first:second], vector[second:].reshape(self.phases.shape))

    def least_window(self, centre: int) -> int:
        """Return the first sample of the window with the least range, or of one whose centre is samples from it.

        The windows are as long as a pass, and their centres within half a pass of 180 deg.
        """
        samples = self.phases.shape[1]
        ranges = [np.ptp(self.vanishing[i : i + samples]) for i in range(samples + 1)]
        return int(np.clip(np.argmin(ranges) + centre, 0, samples))

    def lacking(self, inside: float) -> float:
        """Return the sum of what the margins lack."""
        return float(np.maximum(0, self.margins + inside).sum())


def kinked_rules(s: PaperSignals) -> tuple[int, int, int]:
    """Return the places of the rules with kinks: the amplitude near 180 deg, and the phase at both shifts."""
    names = [margin.rule for margin in target_margins(s)]
    first, second = (names.index(f"phase departs upwards at {shift:g} deg") for shift in TARGET_SHIFTS)
    return names.index("amplitude near 180 deg"), first, second


Evaluation = Callable[[FloatArray], RuleParts | None]
"""The parts at coordinates (n,) in the ranges; None where the rig has no steady state."""
Slopes = Callable[[FloatArray, RuleParts], FloatArray]
"""Slopes (numbers, n) of the parts."""


class WalkedRig:
    """The rig whose numbers a walk changes, with its choices: it evaluates the rules there."""

    def __init__(
        self,
        rig_at: Callable[[FloatArray], Transmission],
        u: FloatArray,
        active: BoolArray,
        of_profile: BoolArray,
    ) -> None:
        self.rig_at, self.u, self.active, self.evaluations = rig_at, u, active, 0
        self.of_profile = of_profile[active]
        rig = rig_at(u)
        self.kinked = kinked_rules(QuickResponse(rig, FINE).with_mesh(rig.meshes[MESH]).targets())

    def at(self, x: FloatArray) -> FloatArray:
        """Return the point of the unit cube."""
        u = self.u.copy()
        u[self.active] = np.clip(x, 0, 1)
        return u

    def parts(self, x: FloatArray) -> RuleParts | None:
        """Return what the rules depend on; None where the rig has no steady state."""
        try:
            rig = self._rig(x)
            return self._parts(rig, QuickResponse(rig, FINE))
        except (SigdbError, np.linalg.LinAlgError):
            return None

    def _rig(self, x: FloatArray) -> Transmission:
        return self.rig_at(self.at(x))

    def _parts(self, rig: Transmission, response: QuickResponse) -> RuleParts:
        self.evaluations += 1
        targets = response.with_mesh(rig.meshes[MESH]).targets()
        return RuleParts.of(targets, -targets.min_compression / CONTACT)

    def slopes(self, x: FloatArray, here: RuleParts) -> FloatArray:
        """Return the slopes of the parts; numbers of the profile leave the response as it is."""
        response, columns = QuickResponse(self._rig(x), FINE), []
        self.evaluations += 1
        for k, of_profile in enumerate(self.of_profile):
            beside = x.copy()
            beside[k] += NEXT if x[k] < 0.5 else -NEXT
            rig = self._rig(beside)
            there = self._parts(rig, response if of_profile else QuickResponse(rig, FINE))
            columns.append((there.vector - here.vector) / (beside[k] - x[k]))
        return np.transpose(columns)


@dataclass(frozen=True)
class Walk:
    """Walks in the ranges of some numbers.

    Attributes
    ----------
    parts
        Evaluates a point.
    slopes
        Computes the slopes there.
    kinked
        Places of the rules with kinks.
    inside
        Margin to keep.
    """

    parts: Evaluation
    slopes: Slopes
    kinked: tuple[int, int, int]
    inside: float

    def walk(self, x: FloatArray, ahead: FloatArray, push: float) -> FloatArray | None:
        """Return a point at which all rules hold, if it is found.

        The first step goes from a point towards it plus ``ahead``, as far as the rules hold by their slopes, and no
        number alone changes a margin by more than ``push``. The others lead back to where they hold.
        """
        here = self.parts(x)
        if here is None:
            return None
        slopes = self.slopes(x, here)
        near = here.margins > NEAR
        most = push / np.abs(slopes[: len(near)][near]).max(axis=0).clip(min=1e-9)
        bounded = np.clip(ahead, -most, most)
        change = self._step(here, slopes, (np.minimum(0, bounded), np.maximum(0, bounded)), np.sign(ahead))
        there = self.parts(x + change)
        if there is None:
            return None
        return self.back(x + change, there, _followed(here, slopes, change, there) if change.any() else slopes)

    def back(self, x: FloatArray, here: RuleParts | None, slopes: FloatArray | None = None) -> FloatArray | None:
        """Return a point near one at which all rules hold, if it is found."""
        reach, age = REACH, 1
        for number in range(STEPS):
            if here is None or (number >= HOPELESS[0] and here.lacking(self.inside) > HOPELESS[1]):
                return None
            if here.lacking(self.inside) == 0:
                return x
            if slopes is None:
                slopes, age = self.slopes(x, here), 0
            change, there = self._corrected(x, here, slopes, reach)
            gain = -np.inf if there is None else here.lacking(self.inside) - there.lacking(self.inside)
            if there is None or gain <= 0:
                reach *= 0.7 if age else 0.35
                slopes = None if age else slopes
            else:
                part = gain / max(
                    here.lacking(self.inside) - _by_slopes(here, slopes, change).lacking(self.inside), 1e-12
                )
                reach = min(1.5 * reach, MOST_REACH) if part > 0.6 else 0.6 * reach if part < 0.25 else reach
                slopes = _followed(here, slopes, change, there) if age < FOLLOWED and part > 0.2 else None
                x, here, age = x + change, there, age + 1
            if reach < LEAST_REACH:
                return None
        return x if here is not None and here.lacking(self.inside) == 0 else None

    def _corrected(
        self, x: FloatArray, here: RuleParts, slopes: FloatArray, reach: float
    ) -> tuple[FloatArray, RuleParts | None]:
        """Return the better one of a step and its correction, and what is there."""
        bounds = np.maximum(-reach, -x), np.minimum(reach, 1 - x)
        none = np.zeros(len(x))
        change = self._step(here, slopes, bounds, none)
        there = self.parts(x + change)
        if there is None or there.lacking(self.inside) == 0:
            return change, there
        corrected = self._step(here.from_vector(there.vector - slopes @ change), slopes, bounds, none)
        better = self.parts(x + corrected)
        if better is not None and better.lacking(self.inside) < there.lacking(self.inside):
            return corrected, better
        return change, there

    def _step(
        self, here: RuleParts, slopes: FloatArray, bounds: tuple[FloatArray, FloatArray], ahead: FloatArray
    ) -> FloatArray:
        """Return the change within bounds that lacks least by the slopes, and goes farthest ahead."""
        n, found = len(ahead), []
        for centre in CENTRES:
            # Unknown: the change, the extremes in the window, and what each rule lacks.
            rows, limits = self._inequalities(here, slopes, here.least_window(centre))
            lacks = rows.shape[1] - n - 2
            result = linprog(
                np.concatenate([-ahead, [0.0, 0.0], np.full(lacks, SLACK)]),
                A_ub=rows,
                b_ub=limits,
                bounds=[*zip(*bounds, strict=True), (None, None), (None, None), *[(0, None)] * lacks],
                method="highs",
            )
            solved = result.x is not None
            found.append((result.fun, result.x[:n]) if solved else (np.inf, np.zeros(n)))
        return min(found, key=lambda result: result[0])[1]

    def _inequalities(self, here: RuleParts, slopes: FloatArray, window: int) -> tuple[FloatArray, FloatArray]:
        """Return the rows and the limits of the inequalities.

        Columns are the change, the highest and the lowest value in the window of the least amplitude, and what each
        rule lacks.
        """
        samples = here.phases.shape[1]
        smooth = [i for i in range(len(here.margins)) if i not in self.kinked and here.margins[i] > FAR]
        rows, values, rules = [slopes[smooth]], [here.margins[smooth]], [np.array(smooth)]
        for number, rule in enumerate(self.kinked[1:]):
            phase = here.phases[number]
            at = len(here.margins) + len(here.vanishing) + number * samples
            high, size = int(phase.argmax()), np.abs(phase).max()
            lows = np.unique([*range(0, samples, 4), samples - 1, int(phase.argmin())])
            rows.append(-(slopes[at + lows] + slopes[at + high]) / size)
            values.append(-(phase[lows] + phase[high]) / size)
            rules.append(np.full(len(lows), rule))
        names = np.unique(np.concatenate([*rules, [self.kinked[0]]]))
        lack = np.eye(len(names))[np.searchsorted(names, np.concatenate([*rules, [self.kinked[0]]]))]
        inside = slice(len(here.margins) + window, len(here.margins) + window + samples)
        signal, aim = here.vector[inside], self.inside + BEYOND
        of_change = np.vstack([*rows, np.zeros((1, slopes.shape[1])), slopes[inside], -slopes[inside]])
        others = np.zeros((len(of_change), 2 + len(names)))
        others[: len(lack), 2:] = -lack
        others[len(lack) - 1, :2] = 1, -1
        others[len(lack) : len(lack) + samples, 0] = -1
        others[len(lack) + samples :, 1] = 1
        return np.hstack([of_change, others]), np.concatenate(
            [-np.concatenate(values) - aim, [1 - aim], -signal, signal]
        )


def _by_slopes(here: RuleParts, slopes: FloatArray, change: FloatArray) -> RuleParts:
    return here.from_vector(here.vector + slopes @ change)


def _followed(here: RuleParts, slopes: FloatArray, change: FloatArray, there: RuleParts) -> FloatArray:
    """Return slopes with what a change brought, by Broyden's update."""
    missed = there.vector - _by_slopes(here, slopes, change).vector
    return np.asarray(slopes + np.outer(missed, change) / (change @ change))
