"""The smallest damage that the likelihood ratio finds in an average, at a rate of false alarms."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.recognition import DETECTED, Hypotheses, OperatingPoint, optimal_roc, smallest_detected_loss


@dataclass(frozen=True, kw_only=True, eq=False)
class SmallestDamage:
    """Detection of a damage of each size by the likelihood ratio of that size against the undamaged gear.

    With a known tooth the test has one hypothesis; else its numerator is the mean over all teeth. No rule that does
    not know the size finds more of it at this rate of false alarms.

    Attributes
    ----------
    hypotheses
        Laws of the undamaged gear and of each size.
    sizes
        (levels,) sizes, rising.
    tooth_known
        Whether the damaged tooth is known.
    noise
        Standard deviation of the noise of the average, unit of the signal.
    index_error
        Standard deviation of the index errors, m; 0 for a nominal gear.
    rate
        Rate of false alarms.
    draws, seed
        Averages that are drawn for each size, and their seed.
    """

    hypotheses: Hypotheses
    sizes: FloatArray
    tooth_known: bool
    noise: float
    index_error: float
    rate: float
    draws: int
    seed: int

    def p_detected(self, level: int) -> tuple[float, float]:
        """Return the probability of detection of the size with this number, and its standard error."""
        return optimal_roc(self._point, np.array([1 + level]), draws=self.draws, seed=self.seed).at(self.rate)

    @cached_property
    def a90(self) -> float:
        """Smallest size that is found with probability 0.9, by bisection of the sizes; nan if the largest is not."""
        detected: dict[int, float] = {}
        low, high = -1, len(self.sizes)
        while high - low > 1:
            level = (low + high) // 2
            detected[level], _ = self.p_detected(level)
            low, high = (low, level) if detected[level] >= DETECTED else (level, high)
        levels = sorted(detected)
        probabilities = np.array([detected[level] for level in levels])
        return smallest_detected_loss(self.sizes[levels], probabilities, rate=self.rate, draws=self.draws)

    @cached_property
    def _point(self) -> OperatingPoint:
        """The laws with one row for each size and tooth, which are equally likely."""
        teeth = self.hypotheses.teeth
        places = np.arange(1 + len(self.sizes))
        tooth = np.arange(1, 2 if self.tooth_known else teeth + 1)
        rows = pd.DataFrame(
            {
                "place": np.repeat(places, len(tooth)),
                "tooth": np.where(np.repeat(places, len(tooth)) > 0, np.tile(tooth, len(places)), 0),
                "teeth": teeth,
                "noise": self.noise,
                "index_error": self.index_error,
            }
        )
        return OperatingPoint(hypotheses=self.hypotheses, rows=rows)
