"""The posterior of continuous sizes of damage, from the likelihoods of templates on a grid."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import TypeAlias

import numpy as np

from sigdb.core import BoolArray, FloatArray, IntArray, blocks
from sigdb.recognition.laws.turned_laws import TurnedLaws
from sigdb.recognition.metrics.location_and_severity import crps_sample
from sigdb.recognition.templates.severity_grid import SeverityGrid, severity_weights

_STEPS = np.array([5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64])
"""Numbers of steps in which an axis may be divided. The least one has all six ends of :func:`_quadrature`."""

_NUMBERS_AT_ONCE = 150_000
"""Densities that are summed together: they stay in the cache."""

_ROWS_AT_ONCE = 64
"""Rows whose distances are computed together."""

Levels: TypeAlias = tuple[tuple[float, ...], ...]
"""Values of each size of a grid."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SeverityMarginals:
    """Marginal posteriors of the severities of averages, given damage.

    Attributes
    ----------
    axes
        Values of each size, such as stiffness loss and phase shift (deg), and numbers of damaged teeth.
    masses
        (rows, values) probabilities for each; those of sizes are a density times the weights of a sum.
    """

    axes: tuple[FloatArray, ...]
    masses: tuple[FloatArray, ...]

    def mean(self) -> FloatArray:
        """Return the posterior means, (rows, quantities)."""
        pairs = zip(self.masses, self.axes, strict=True)
        return np.column_stack([(mass @ axis).clip(axis.min(), axis.max()) for mass, axis in pairs])

    def spread(self) -> FloatArray:
        """Return the posterior standard deviations, (rows, quantities)."""
        square = np.column_stack([mass @ axis**2 for mass, axis in zip(self.masses, self.axes, strict=True)])
        return np.sqrt((square - self.mean() ** 2).clip(min=0))

    def crps(self, true: FloatArray) -> FloatArray:
        """Return the continuous ranked probability scores against true values (rows, quantities), of the
        same shape."""
        pairs = zip(self.axes, self.masses, true.T, strict=True)
        return np.column_stack(
            [crps_sample(np.broadcast_to(axis, mass.shape), value, mass) for axis, mass, value in pairs]
        )

    def quantile(self, p: float) -> FloatArray:
        """Return the p-quantiles (rows, quantities): of a density for sizes, one of the values for the teeth."""
        sizes = [_density_quantile(axis, mass, p) for axis, mass in zip(self.axes[:-1], self.masses[:-1], strict=True)]
        below = np.cumsum(self.masses[-1], axis=1)
        return np.column_stack([*sizes, self.axes[-1][(below >= p).argmax(axis=1)]])


def _density_quantile(axis: FloatArray, mass: FloatArray, p: float) -> FloatArray:
    """Return the quantile (rows,) of masses that are spread evenly around each value, up to half way to the next."""
    if len(axis) == 1:
        return np.full(len(mass), axis[0])
    edges = np.concatenate([axis[:1], (axis[1:] + axis[:-1]) / 2, axis[-1:]])
    below = np.column_stack([np.zeros(len(mass)), np.cumsum(mass, axis=1)])
    last = np.maximum((below < p).sum(axis=1) - 1, 0).clip(max=len(axis) - 1)
    rows = np.arange(len(mass))
    within = (p - below[rows, last]) / np.maximum(mass[rows, last], np.finfo(float).tiny)
    return np.asarray(edges[last] + within.clip(0, 1) * (edges[last + 1] - edges[last]))


class TemplateDistances:
    """Distances ``(s_j - s_k)' S^-1 (s_j - s_k)`` of the pairs j < k of templates under normal laws.

    The means are without harmonic signals, which all templates share, and S^-1 is the mean of those of both templates.

    Parameters
    ----------
    laws
        Laws of the templates.
    templates
        Places of the templates.
    """

    def __init__(self, laws: TurnedLaws, templates: IntArray) -> None:
        self._laws, self._templates = laws, templates
        self._first, self._second = np.triu_indices(len(templates), 1)
        signals = laws.carriers[templates, :, 0]
        between = signals[self._first] - signals[self._second]
        along = np.einsum("kan,jnm->ajkm", signals, laws.modes_of(templates), optimize=True)
        self._square = np.einsum("pan,pbn->abp", between, between, optimize=True)
        self._along = along - np.einsum("ajjm->ajm", along)[:, :, None]

    def at(
        self, *, noise: FloatArray, index_error: float | FloatArray, coefficients: FloatArray | None = None
    ) -> FloatArray:
        """Return the distances (rows, pairs) under the laws of averages.

        Parameters
        ----------
        noise, index_error, coefficients
            As of :meth:`TurnedLaws.log_likelihood`, noise (rows,).
        """
        laws, square, along = self._laws, self._square, self._along
        size = np.broadcast_to(laws.size(index_error), len(noise))
        distances = np.empty((len(noise), len(self._first)))
        for some in blocks(len(noise), _ROWS_AT_ONCE):
            c = np.ones((1, len(square))) if coefficients is None else coefficients[some, :, 0]
            d = (laws.gains[self._templates] * (size[some] / noise[some])[:, None, None]) ** 2
            amplitude = (c @ along.reshape(len(along), -1)).reshape(-1, *along.shape[1:])
            explained = (np.square(amplitude, out=amplitude) @ (d / (1 + d))[:, :, :, None])[:, :, :, 0]
            whole = (c[:, :, None] * c[:, None]).reshape(len(c), -1) @ square.reshape(-1, square.shape[2])
            mean = (explained[:, self._first, self._second] + explained[:, self._second, self._first]) / 2
            distances[some] = (whole - mean) / noise[some, None] ** 2
        return distances


class ContinuousSeverity:
    """Posteriors over severities between templates, and of the tooth whatever the severity.

    With the weights w of an interpolation, which add up to 1, the interpolated signal is ``s = sum w_k s_k``. Under a
    law of one covariance S its log-likelihood follows from those of the templates exactly::

        log p(x | s) = sum_k w_k log p(x | s_k) + 1/4 sum_jk w_j w_k (s_j - s_k)' S^-1 (s_j - s_k).

    The covariances of templates differ a little; the distance of two is taken under the mean of their S^-1.

    The prior is uniform over each size within the range of the templates; numbers of damaged teeth
    have their shares. The posterior is summed over a grid whose steps are no wider than the standard deviation of an
    estimate from the average. Its sums then err by less than a hundredth, and by a few hundredths where the density
    falls steeply from an end of the range.

    Parameters
    ----------
    grids
        Grids of the templates, one for each number of damaged teeth.
    healthy
        (templates,) whether a template is of a healthy gear.
    share
        (templates,) share of each template.
    """

    def __init__(self, grids: Sequence[SeverityGrid], healthy: BoolArray, share: FloatArray) -> None:
        self._grids = grids
        shares = np.array([share[grid.places[~healthy[grid.places]]].sum() for grid in grids])
        with np.errstate(divide="ignore"):
            self._log_share = np.log(shares / shares.sum())
        self._levels: tuple[Levels, ...] = tuple(
            tuple(tuple(level.tolist()) for level in grid.levels) for grid in grids
        )

    @property
    def templates(self) -> list[IntArray]:
        """Places of the templates of each grid."""
        return [grid.places.ravel() for grid in self._grids]

    def evidence(self, log_likelihood: FloatArray, distances: Sequence[FloatArray]) -> FloatArray:
        """Return the logarithm of the density of averages given damage at each tooth, (rows, teeth).

        Parameters
        ----------
        log_likelihood
            (rows, templates, teeth) of the averages under each template.
        distances
            For each grid, ``(s_j - s_k)' S^-1 (s_j - s_k)`` of the pairs j < k of :attr:`templates` under the law of
            each average, (rows, pairs), as of :class:`TemplateDistances`.
        """
        evidence = np.empty((len(log_likelihood), log_likelihood.shape[2]))
        for at, _, density in self._densities(log_likelihood, distances):
            evidence[at] = density.evidence()
        return evidence

    def marginals(
        self, log_likelihood: FloatArray, distances: Sequence[FloatArray]
    ) -> Iterator[tuple[IntArray, FloatArray, SeverityMarginals]]:
        """Yield the posteriors of averages, some at a time, with their places and their :meth:`evidence`.

        Parameters
        ----------
        log_likelihood, distances
            As of :meth:`evidence`.
        """
        counts = np.array([grid.damaged_teeth for grid in self._grids])
        for at, nodes, density in self._densities(log_likelihood, distances):
            shape = tuple(map(len, nodes.axes))
            masses = np.moveaxis(density.masses().reshape(len(at), len(counts), *shape), 1, -1)
            others = [tuple(k for k in range(1, masses.ndim) if k != axis) for axis in range(1, masses.ndim)]
            yield (
                at,
                density.evidence(),
                SeverityMarginals(
                    axes=(*nodes.axes, counts), masses=tuple(masses.sum(axis=summed) for summed in others)
                ),
            )

    def _densities(
        self, log_likelihood: FloatArray, distances: Sequence[FloatArray]
    ) -> Iterator[tuple[IntArray, "_Nodes", "_Densities"]]:
        """Yield places of rows that take an equally fine grid, the grid, and their densities there."""
        steps = np.stack([self._steps(axis, distances) for axis in range(len(self._levels[0]))], axis=1)
        for alike in np.unique(steps, axis=0).tolist():
            rows, nodes = np.flatnonzero((steps == alike).all(axis=1)), _nodes(self._levels, tuple(alike))
            at_once = max(1, _NUMBERS_AT_ONCE // (log_likelihood.shape[2] * len(self._grids) * nodes.count))
            products = [_pair_products(weights) for weights in nodes.weights]
            for some in blocks(len(rows), at_once):
                at = rows[some]
                raised = [distance[at] @ product for distance, product in zip(distances, products, strict=True)]
                yield at, nodes, self._density(log_likelihood[at], raised, nodes)

    def _density(self, log_likelihood: FloatArray, raised: Sequence[FloatArray], nodes: "_Nodes") -> "_Densities":
        rows, _, teeth = log_likelihood.shape
        top, relative = [], []
        parts = zip(self._grids, raised, nodes.weights, nodes.log_weights, self._log_share, strict=True)
        for grid, rise, weights, log_weight, share in parts:
            of_grid = log_likelihood[:, grid.places.ravel()].transpose(0, 2, 1).reshape(rows * teeth, -1)
            density = (of_grid @ weights.T).reshape(rows, teeth, -1)
            density += (rise + (share + log_weight))[:, None]
            top.append(density.max(axis=2, initial=np.finfo(float).min))
            # Ratios of densities are in single precision, whose exponential takes a fifth of the time.
            ratio = np.empty(density.shape, np.float32)
            np.subtract(density, top[-1][:, :, None], out=ratio, casting="same_kind")
            relative.append(np.exp(ratio, out=ratio))
        return _Densities(top=np.stack(top), relative=relative)

    def _steps(self, axis: int, distances: Sequence[FloatArray]) -> IntArray:
        """Return in how many steps, none wider than the deviation of an estimate, an axis is divided; (rows,)."""
        low, high = (end(levels[axis][at] for levels in self._levels) for end, at in ((min, 0), (max, -1)))
        greatest = np.zeros(len(distances[0]))
        if high <= low:
            return np.zeros(len(greatest), int)
        for grid, distance in zip(self._grids, distances, strict=True):
            places = np.arange(grid.places.size).reshape(grid.places.shape)
            lines = np.moveaxis(places, axis, 0).reshape(places.shape[axis], -1)
            pair = np.full((grid.places.size, grid.places.size), -1)
            pair[np.triu_indices(len(pair), 1)] = np.arange(distance.shape[1])
            between = distance[:, pair[lines[:-1], lines[1:]]].max(axis=2)
            slopes = np.sqrt(np.maximum(between, 0.0)) / np.diff(grid.levels[axis])
            greatest = np.maximum(greatest, slopes.max(axis=1))
        wanted = (high - low) * greatest
        return np.asarray(_STEPS[np.searchsorted(_STEPS[:-1], wanted)])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Densities:
    """Densities of averages at severities, with the prior.

    Attributes
    ----------
    top
        (grids, rows, teeth) logarithm of the greatest density of each tooth in each grid.
    relative
        For each grid, (rows, teeth, severities) densities over it.
    """

    top: FloatArray
    relative: Sequence[FloatArray]

    def evidence(self) -> FloatArray:
        """Return the logarithm of the sum over severities, (rows, teeth)."""
        with np.errstate(divide="ignore"):
            sums = np.log(np.stack([each.sum(axis=2) for each in self.relative]))
        return np.logaddexp.reduce(self.top + sums, axis=0)

    def masses(self) -> FloatArray:
        """Return the posterior probabilities of severities, whatever the tooth, (rows, grids, severities)."""
        of_teeth = np.exp(self.top - self.top.max(axis=(0, 2))[:, None]).astype(np.float32)
        of_grids = [(some[:, None] @ each)[:, 0] for some, each in zip(of_teeth, self.relative, strict=True)]
        masses = np.stack(of_grids, axis=1).astype(float)
        return np.asarray(masses / masses.sum(axis=(1, 2), keepdims=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Nodes:
    """Severities that a posterior is summed over.

    Attributes
    ----------
    axes
        Values along each axis.
    weights
        For each grid, weights of its templates, (nodes, templates).
    log_weights
        For each grid, logarithms of the weights of the sum (nodes,); -inf beyond the grid.
    """

    axes: Sequence[FloatArray]
    weights: Sequence[FloatArray]
    log_weights: Sequence[FloatArray]

    @property
    def count(self) -> int:
        """Number of severities."""
        return int(np.prod([len(axis) for axis in self.axes]))


@lru_cache(maxsize=64)
def _nodes(levels: tuple[Levels, ...], steps: tuple[int, ...]) -> _Nodes:
    """Return the severities for a number of steps along each axis, for grids of these levels."""
    of_axes = zip(*levels, strict=True)
    ends = [(min(level[0] for level in of_axis), max(level[-1] for level in of_axis)) for of_axis in of_axes]
    axes = [np.linspace(*end, count + 1) for end, count in zip(ends, steps, strict=True)]
    weights, log_weights = [], []
    for of_grid in levels:
        within = [
            _quadrature(len(axis)) * ((axis >= level[0] - 1e-12) & (axis <= level[-1] + 1e-12))
            for level, axis in zip(of_grid, axes, strict=True)
        ]
        weights.append(severity_weights([np.array(level) for level in of_grid], *axes))
        with np.errstate(divide="ignore"):
            log_weights.append(np.log(reduce(np.kron, within)))
    return _Nodes(axes=axes, weights=weights, log_weights=log_weights)


def _pair_products(weights: FloatArray) -> FloatArray:
    """Return half the products of the weights (nodes, templates) of each two templates, (pairs, nodes)."""
    first, second = np.triu_indices(weights.shape[1], 1)
    return np.asarray((weights[:, first] * weights[:, second]).T / 2)


def _quadrature(count: int) -> FloatArray:
    """Return the weights (count,) of a sum over equal steps that stands for a mean over an interval.

    It is Gregory's formula of the second order: the trapezoidal rule, whose ends are corrected by differences.
    """
    weights = np.ones(count)
    if count > 1:
        weights[:3] = weights[:-4:-1] = 3 / 8, 7 / 6, 23 / 24
    return weights / weights.sum()
