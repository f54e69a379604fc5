"""Randomised maximum likelihood: a member of the posterior from each draw of the prior and of the measurements.

For a prior draw z_j and perturbed measurements d_j, a member minimises ``|(g(z) - d_j) / s|^2 + |z - z_j|^2``. Members
are exact draws of the posterior where g is linear [1]_.

References
----------
.. [1] D. S. Oliver, N. He, A. C. Reynolds, "Conditioning permeability fields to pressure data", Proceedings of the 5th
       European Conference on the Mathematics of Oil Recovery, 1996, doi:10.3997/2214-4609.201406884.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr, ndtri

from sigdb.core import FloatArray
from sigdb.identification.problem import FARTHEST, Problem
from sigdb.identification.search import minimise

_TOLERANCE = 1e-3
"""Relative change of cost and coordinates at which a search ends: members differ by far more."""
_MOST_EVALUATIONS = 40
_SCREENED, _STARTS, _FIRST, _FINISHED = 96, 12, 7, 4
"""Draws of the prior from whose best searches for optima begin; such searches at most, each with so many evaluations
at first; and those that go on."""
_SAME, _ALIKE = 0.5, 3
"""Difference of costs, and of coordinates, up to which two ends are one optimum, and how many such ends are enough."""
_FARTHER = 30.0
"""Greatest cost above the least of an optimum from which members are searched for."""


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The end of a search.

    Attributes
    ----------
    z
        (d,) coordinates.
    cost
        Sum of squares, of measurements and prior.
    misfit
        Mean square of the misses of fitted numbers, in standard deviations.
    is_final
        Whether the search ended by itself.
    """

    z: FloatArray
    cost: float
    misfit: float
    is_final: bool = True


def optimum(
    problem: Problem,
    value: FloatArray,
    prior: FloatArray,
    start: FloatArray,
    evaluations: int = _MOST_EVALUATIONS,
) -> Optimum:
    """Return the point that comes nearest to values (m,) and to a point (d,) of the prior, from a start (d,)."""

    def residuals(z: FloatArray) -> FloatArray:
        return np.concatenate([problem.misses(z, value), z - prior])

    def slopes(z: FloatArray) -> FloatArray:
        return np.vstack([problem.slopes(z), np.eye(len(z))])

    ended = least_squares(
        residuals, start, jac=slopes, ftol=_TOLERANCE, xtol=_TOLERANCE, gtol=_TOLERANCE, max_nfev=evaluations
    )
    missed = ended.fun[: len(value)]
    misfit = float((missed**2).sum() / problem.is_fitted.sum())
    return Optimum(z=ended.x, cost=2 * float(ended.cost), misfit=misfit, is_final=ended.status > 0)


@dataclass(frozen=True, kw_only=True)
class Linearised:
    """The problem near its most probable point.

    Attributes
    ----------
    z
        (d,) the point.
    misses
        (m,) misses of the stated values there.
    slopes
        (m, d) their derivatives.
    """

    z: FloatArray
    misses: FloatArray
    slopes: FloatArray

    @classmethod
    def near(cls, problem: Problem, z: FloatArray) -> "Linearised":
        """Return a problem as it is near a point (d,)."""
        return cls(z=z, misses=problem.misses(z, problem.value), slopes=problem.slopes(z))

    def optimum(self, shift: FloatArray, prior: FloatArray) -> FloatArray:
        """Return where the optimum would be for values shifted by standard deviations (m,), and a prior point (d,)."""
        matrix = np.vstack([self.slopes, np.eye(len(self.z))])
        step = np.linalg.lstsq(matrix, np.concatenate([shift - self.misses, prior - self.z]), rcond=None)[0]
        return self.z + np.clip(step, -3.0, 3.0)


def optima(problem: Problem, rng: np.random.Generator) -> list[Linearised]:
    """Return the problem near the most probable rigs, the best one first.

    A rig whose resonances are near other harmonics may be a local optimum. So searches begin at the best of many draws
    of the prior, and at the rig as it is; the best of them go on. Once the three best ends are one optimum, no other
    begins.
    """
    prior = np.zeros(len(problem.paths))
    starts = [problem.start, *rng.standard_normal((_SCREENED, len(prior)))]
    starts.sort(key=lambda z: float((problem.misses(z, problem.value) ** 2).sum() + (z**2).sum()))
    ends: list[Optimum] = []
    for start in starts[:_STARTS]:
        ends.append(optimum(problem, problem.value, prior, start, _FIRST))
        ends.sort(key=lambda end: end.cost)
        if len(ends) >= _ALIKE and all(end.is_final and _alike(end, ends[0]) for end in ends[:_ALIKE]):
            break
    best = _finished(problem, problem.value, prior, ends, _FINISHED)
    distinct: list[Optimum] = []
    for end in best:
        if end.cost < best[0].cost + _FARTHER and not any(_alike(end, other) for other in distinct):
            distinct.append(end)
    return [Linearised.near(problem, end.z) for end in distinct]


def _finished(
    problem: Problem, value: FloatArray, prior: FloatArray, ends: list[Optimum], count: int = 2
) -> list[Optimum]:
    """Return the best of some ends after their searches have gone on, the best one first."""
    best = sorted(ends, key=lambda end: end.cost)[:count]
    best = [end if end.is_final else optimum(problem, value, prior, end.z) for end in best]
    return sorted(best, key=lambda end: end.cost)


def _alike(first: Optimum, second: Optimum) -> bool:
    """Return whether two ends are one optimum."""
    return abs(first.cost - second.cost) < _SAME and float(np.abs(first.z - second.z).max()) < _SAME


def drawn_member(problem: Problem, near: list[Linearised], rng: np.random.Generator, evaluations: int) -> Optimum:
    """Return a member of the ensemble: by least squares from its draw and near optima, or else by CMA-ES."""
    prior = rng.standard_normal(len(problem.paths))
    shift = problem.is_fitted * rng.standard_normal(len(problem.value))
    value = problem.value + shift * problem.error
    if near:
        starts = [prior, *(linearised.optimum(shift, prior) for linearised in near)]
        return _finished(problem, value, prior, [optimum(problem, value, prior, start, _FIRST) for start in starts])[0]
    end = minimise(
        lambda u: problem.misfit(in_prior(u), value, prior),
        len(prior),
        rng,
        start=ndtr(prior),
        evaluations=evaluations,
        enough=-np.inf if problem.is_fitted.any() else 0.0,
    )
    z = in_prior(end.point)
    missed = problem.misses(z, value)
    return Optimum(z=z, cost=end.value, misfit=float((missed**2).sum() / max(problem.is_fitted.sum(), 1.0)))


def in_prior(u: FloatArray) -> FloatArray:
    """Return the coordinates of a point of the unit cube (d,) in which the prior is a standard normal distribution."""
    return np.clip(ndtri(u), -FARTHEST, FARTHEST)
