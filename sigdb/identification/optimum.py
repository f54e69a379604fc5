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
_POOR = 3.0
"""Misfit for each number above which a search is made again from another point."""


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
    """

    z: FloatArray
    cost: float
    misfit: float


def optimum(problem: Problem, value: FloatArray, prior: FloatArray, start: FloatArray) -> Optimum:
    """Return the point that comes nearest to values (m,) and to a point (d,) of the prior, from a start (d,)."""

    def residuals(z: FloatArray) -> FloatArray:
        return np.concatenate([problem.misses(z, value), z - prior])

    def slopes(z: FloatArray) -> FloatArray:
        return np.vstack([problem.slopes(z), np.eye(len(z))])

    ended = least_squares(
        residuals, start, jac=slopes, ftol=_TOLERANCE, xtol=_TOLERANCE, gtol=_TOLERANCE, max_nfev=_MOST_EVALUATIONS
    )
    missed = ended.fun[: len(value)]
    misfit = float((missed**2).sum() / problem.is_fitted.sum())
    return Optimum(z=ended.x, cost=2 * float(ended.cost), misfit=misfit)


def best_optimum(problem: Problem, value: FloatArray, prior: FloatArray, starts: list[FloatArray]) -> Optimum:
    """Return the best of the searches from several starts; a good end makes later starts needless."""
    ends: list[Optimum] = []
    for start in starts:
        ends.append(optimum(problem, value, prior, start))
        if ends[-1].misfit < _POOR:
            break
    return min(ends, key=lambda end: end.cost)


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


def drawn_member(problem: Problem, near: Linearised | None, rng: np.random.Generator, evaluations: int) -> Optimum:
    """Return a member of the ensemble: by least squares near a point, or by CMA-ES where there is none."""
    prior = rng.standard_normal(len(problem.paths))
    shift = problem.is_fitted * rng.standard_normal(len(problem.value))
    value = problem.value + shift * problem.error
    if near is not None:
        return best_optimum(problem, value, prior, [prior, near.optimum(shift, prior), near.z])
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
