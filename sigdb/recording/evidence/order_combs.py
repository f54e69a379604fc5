"""Combs of orders in an average: how far the mesh of a gear, and what may be another gear, stand out of the others."""

import math
from collections.abc import Collection

import numpy as np

from sigdb.core import FloatArray, IntArray

ALARM = 1e-3
"""Probability at which noise alone passes for a gear."""
OTHERS = 0.01
"""Probability above which the mesh harmonics that are no multiples of 2 or 3 are noise."""
HARMONICS = 8
"""Mesh harmonics that are tested."""
ROUNDING = 1e-28
"""Power of rounding errors, relative to the strongest line."""

_PART = 1.0, 10.0
"""Evidence of the orders of a half or a third of the teeth, as a multiple of that of the mesh and a sum, above which
the gear has that part of them, as where a tacho has two or three pulses, not one."""
_LEAST_OF_OTHERS, _MOST_OF_A_PART, _OVER_ALL, _LEAST_LINES_OF_A_COMB = 0.01, 0.1, 10.0, 3
"""Power of the harmonics that are no multiples of d, over that of the multiples, below which the gear has d times as
many teeth. Mean power of the orders of a part of the teeth, over that of the mesh and over that of all other orders,
above which it has that part of them. The least number of those orders. Assumed: in simulated gears of 32 teeth the odd
harmonics have 0.027 times the power of the even ones or more. A damaged tooth raises all orders alike."""
_MEDIAN = 0.48
"""Efficiency of a median of exponential variables as an estimate of their mean: (ln 2)^2."""


def combined(log_p: FloatArray) -> float:
    """Return Fisher's combination of probabilities; 1 without any."""
    from scipy.special import gammaincc

    # The survival function of chi-square with 2K degrees of freedom.
    return float(gammaincc(len(log_p), -np.sum(log_p))) if len(log_p) else 1.0


class OrderCombs:
    """Evidence of combs of orders in the power (top + 1,) of an average."""

    def __init__(self, power: FloatArray, teeth: int) -> None:
        self._power = np.maximum(power, power.max(initial=0.0) * ROUNDING + np.finfo(float).tiny)
        self._teeth = teeth
        self._orders = np.arange(len(power))
        self._log_p = self._log_p_of_all()

    def log_p(self, orders: IntArray) -> FloatArray:
        """Return the logarithm of the probability of each order among the orders about it."""
        return np.asarray(self._log_p[orders])

    def evidence(self, orders: IntArray) -> float:
        """Return the sum of -ln p over orders."""
        return -float(self.log_p(orders).sum())

    def rival(self, others: Collection[int]) -> tuple[str, float]:
        """Return the orders with most evidence of something else than this gear, in words, and the evidence."""
        Z, orders = self._teeth, self._orders
        foreign = orders[(orders > 0) & np.all([orders % z > 0 for z in (Z, *others)], axis=0)]
        shifts = {s: foreign[(foreign - s) % Z == 0] for s in range(-((Z - 1) // 2), Z // 2 + 1) if abs(s) > 2}
        counts = {z: foreign[foreign % z == 0] for z in range(max(Z // 2 + 1, 3), 2 * Z) if z not in (Z, *others)}
        combs = {f"orders {s:+d} from its mesh": comb for s, comb in shifts.items()} | {
            f"mesh orders of {z} teeth": comb for z, comb in counts.items()
        }
        evidence = {name: self.evidence(comb[:HARMONICS]) for name, comb in combs.items()}
        return max(evidence.items(), key=lambda item: item[1], default=("", 0.0))

    def part_of_teeth(self, mesh: IntArray, others: Collection[int]) -> str:
        """Return the half or third of the teeth whose orders have more evidence than the mesh, in words; "" if none."""
        Z, orders = self._teeth, self._orders
        for d, part in ((d, Z // d) for d in (2, 3) if Z % d == 0 and Z // d > 2):
            comb = orders[(orders % part == 0) & np.all([orders % z > 0 for z in (Z, *others)], axis=0)]
            comb = comb[: (d - 1) * HARMONICS]
            if self._is_strong(comb, mesh, orders[orders % part > 0]) or (
                self.evidence(comb) > _PART[0] * self.evidence(mesh) + _PART[1]
            ):
                return f"mesh orders of {part} teeth"
        return ""

    def _is_strong(self, comb: IntArray, mesh: IntArray, others: IntArray) -> bool:
        """Return whether orders are nearly as high as the mesh, and far higher than other orders."""
        if len(comb) < _LEAST_LINES_OF_A_COMB or not mesh.size or not others.size:
            return False
        power = float(self._power[comb].mean())
        return power > max(_MOST_OF_A_PART * self._power[mesh].mean(), _OVER_ALL * self._power[others].mean())

    def multiple(self, mesh: IntArray) -> int:
        """Return the mesh harmonic, from 2 on, only whose multiples are higher than the orders about them; else 1."""
        h = mesh // self._teeth
        for d in range(2, int(h.max(initial=0)) + 1):
            others, multiples = mesh[h % d > 0], mesh[h % d == 0]
            weak = len(others) >= _LEAST_LINES_OF_A_COMB
            weak = weak and self._power[others].sum() < _LEAST_OF_OTHERS * self._power[multiples].sum()
            if (weak or combined(self.log_p(others)) > OTHERS) and combined(self.log_p(multiples)) <= ALARM:
                return d
        return 1

    def _log_p_of_all(self) -> FloatArray:
        """Return the logarithm of the probability of each order among those about it that are no mesh harmonics."""
        reach, orders = max(self._teeth, 8), self._orders
        about = orders[:, None] + np.arange(-reach, reach + 1)
        used = (about > 0) & (about < len(orders)) & (about % self._teeth > 0)
        power = np.sort(np.where(used, self._power[np.where(used, about, 0)], np.inf), axis=1)
        count = used.sum(axis=1)
        middle = np.maximum([(count - 1) // 2, count // 2], 0)
        level = np.where(count > 0, power[orders, middle].mean(axis=0), 1.0) / math.log(2)
        N = np.maximum(_MEDIAN * count, np.finfo(float).tiny)
        return np.where(count > 0, -N * np.log1p(self._power / level / N), 0.0)
