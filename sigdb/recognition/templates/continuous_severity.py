"""The posterior of a continuous stiffness loss and phase shift, from the likelihoods of templates on a grid."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.metrics.location_and_severity import crps_sample
from sigdb.recognition.templates.severity_grid import SeverityGrid
from sigdb.recognition.templates.turned_laws import TurnedLaws

_LEAST_STEPS, _MOST_STEPS = 4, 64
"""Steps in which an axis is divided."""

_FAR = 20.0
"""Teeth whose likelihood is less than the greatest by a factor of exp(20) do not count."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SeverityMarginals:
    """Marginal posteriors of the severities of averages, given damage.

    Attributes
    ----------
    losses, shifts, counts
        (a,), (b,) and (c,) values of stiffness loss, phase shift (deg) and number of damaged teeth.
    masses
        (rows, a), (rows, b), (rows, c) probabilities; those of the first two are trapezoidal weights of a density.
    """

    losses: FloatArray
    shifts: FloatArray
    counts: FloatArray
    masses: tuple[FloatArray, FloatArray, FloatArray]

    @cached_property
    def _axes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.losses, self.shifts, self.counts

    def mean(self) -> FloatArray:
        """Return the posterior means, (rows, 3)."""
        return np.column_stack([mass @ axis for mass, axis in zip(self.masses, self._axes, strict=True)])

    def spread(self) -> FloatArray:
        """Return the posterior standard deviations, (rows, 3)."""
        square = np.column_stack([mass @ axis**2 for mass, axis in zip(self.masses, self._axes, strict=True)])
        return np.sqrt((square - self.mean() ** 2).clip(min=0))

    def crps(self, true: FloatArray) -> FloatArray:
        """Return the continuous ranked probability scores against true values (rows, 3), of the same shape."""
        pairs = zip(self._axes, self.masses, true.T, strict=True)
        return np.column_stack(
            [crps_sample(np.broadcast_to(axis, mass.shape), value, mass) for axis, mass, value in pairs]
        )

    def quantile(self, p: float) -> FloatArray:
        """Return the p-quantiles (rows, 3): of a density for both sizes, one of the values for the number of teeth."""
        sizes = [_density_quantile(axis, mass, p) for axis, mass in zip(self._axes[:2], self.masses[:2], strict=True)]
        below = np.cumsum(self.masses[2], axis=1)
        return np.column_stack([*sizes, self.counts[(below >= p).argmax(axis=1)]])


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


class ContinuousSeverity:
    """Posteriors over severities between templates, whatever the tooth.

    With the weights w of an interpolation, which add up to 1, the interpolated signal is ``s = sum w_k s_k``. Under a
    law of one covariance S its log-likelihood follows from those of the templates exactly::

        log p(x | s) = sum_k w_k log p(x | s_k) + 1/4 sum_jk w_j w_k (s_j - s_k)' S^-1 (s_j - s_k).

    The covariances of templates differ a little; the distance of two is taken under the mean of their S^-1.

    The prior is uniform over stiffness loss and phase shift within the range of the templates; numbers of damaged teeth
    have their shares. The posterior is summed over a grid that is as fine as the noise of an average asks for.

    Parameters
    ----------
    laws
        Laws of the templates.
    grids
        Their grids, one for each number of damaged teeth.
    share
        (templates,) share of each template.
    """

    def __init__(self, laws: TurnedLaws, grids: Sequence[SeverityGrid], share: FloatArray) -> None:
        self._laws, self._grids = laws, grids
        shares = np.array([share[grid.places[~laws.healthy[grid.places]]].sum() for grid in grids])
        with np.errstate(divide="ignore"):
            self._log_share = np.log(shares / shares.sum())
        ends = [[(levels[0], levels[-1]) for levels in grid.levels] for grid in grids]
        low, high = np.min(ends, axis=0)[:, 0], np.max(ends, axis=0)[:, 1]
        self._ends = list(zip(low.tolist(), high.tolist(), strict=True))
        self._kept: dict[tuple[int, int], _Nodes] = {}

    def marginals(
        self,
        log_likelihood: FloatArray,
        *,
        noise: FloatArray,
        index_error: float | FloatArray,
        coefficients: FloatArray | None = None,
    ) -> Iterator[tuple[IntArray, SeverityMarginals]]:
        """Yield the posteriors of averages, those that take an equally fine grid together, with their places.

        Parameters
        ----------
        log_likelihood
            (rows, templates, teeth) of :meth:`TurnedLaws.log_likelihood` with the same noise and coefficients.
        noise, index_error, coefficients
            As there.
        """
        distances = [self._distances(i, noise, index_error, coefficients) for i in range(len(self._grids))]
        steps = np.stack([self._steps(axis, distances) for axis in range(2)], axis=1)
        code = steps[:, 0] * (_MOST_STEPS + 1) + steps[:, 1]
        for value in np.unique(code):
            at = np.flatnonzero(code == value)
            losses, shifts = steps[at[0]].tolist()
            yield at, self._posterior(log_likelihood[at], [distance[at] for distance in distances], (losses, shifts))

    def _posterior(
        self, log_likelihood: FloatArray, distances: Sequence[FloatArray], steps: tuple[int, int]
    ) -> SeverityMarginals:
        rows, nodes = len(log_likelihood), self._nodes(steps)
        raised = [
            distance.reshape(rows, -1) @ products for distance, (_, products) in zip(distances, nodes.of, strict=True)
        ]
        damaged = np.unique(np.concatenate([grid.places.ravel() for grid in self._grids]))
        best = log_likelihood[:, damaged].max(axis=1)
        limit = best.max(axis=1) - _FAR - np.max([rise.max(axis=1) for rise in raised], axis=0)
        row, tooth = np.nonzero(best >= limit[:, None])
        first = np.flatnonzero(np.diff(row, prepend=-1))
        sums = []
        for grid, raise_, (weights, _), share in zip(self._grids, raised, nodes.of, self._log_share, strict=True):
            along = log_likelihood[row, :, tooth][:, grid.places.ravel()] @ weights.T
            along += raise_[row] + share + nodes.log_weight(grid)
            sums.append(along)
        top = np.maximum.reduceat(np.max([along.max(axis=1) for along in sums], axis=0), first)[row]
        masses = np.stack([np.add.reduceat(np.exp(along - top[:, None]), first, axis=0) for along in sums], axis=1)
        masses = (masses / masses.sum(axis=(1, 2), keepdims=True)).reshape(rows, len(sums), len(nodes.losses), -1)
        return SeverityMarginals(
            losses=nodes.losses,
            shifts=nodes.shifts,
            counts=np.array([grid.damaged_teeth for grid in self._grids]),
            masses=(masses.sum(axis=(1, 3)), masses.sum(axis=(1, 2)), masses.sum(axis=(2, 3))),
        )

    def _nodes(self, steps: tuple[int, int]) -> "_Nodes":
        if steps not in self._kept:
            losses, shifts = (np.linspace(*ends, count + 1) for ends, count in zip(self._ends, steps, strict=True))
            of = []
            for grid in self._grids:
                weights = grid.weights(losses, shifts)
                products = (weights[:, :, None] * weights[:, None, :]).reshape(len(weights), -1).T / 4
                of.append((weights, products))
            self._kept[steps] = _Nodes(losses=losses, shifts=shifts, of=of)
        return self._kept[steps]

    def _steps(self, axis: int, distances: Sequence[FloatArray]) -> IntArray:
        """Return in how many steps, each less than the deviation of an estimate, an axis is divided; (rows,)."""
        low, high = self._ends[axis]
        least = np.full(len(distances[0]), np.inf)
        if high <= low:
            return np.zeros(len(least), int)
        for grid, distance in zip(self._grids, distances, strict=True):
            lines = np.moveaxis(np.arange(grid.places.size).reshape(grid.places.shape), axis, 0)
            between = distance[:, lines[1:], lines[:-1]]
            width = np.diff(grid.levels[axis])[:, None]
            least = np.minimum(least, (width / np.sqrt(np.maximum(between, 1e-300))).min(axis=(1, 2)))
        wanted = np.clip((high - low) / least, _LEAST_STEPS, _MOST_STEPS)
        return np.asarray(2 ** np.ceil(np.log2(wanted)).astype(int))

    def _distances(
        self, place: int, noise: FloatArray, index_error: float | FloatArray, coefficients: FloatArray | None
    ) -> FloatArray:
        """Return (s_j - s_k)' S^-1 (s_j - s_k) of the templates of a grid, (rows, templates, templates)."""
        square, along = self._differences[place]
        templates = self._grids[place].places.ravel()
        c = np.ones((1, len(square))) if coefficients is None else coefficients[:, :, 0]
        d = (self._laws.gains[templates] * (self._laws.size(index_error) / noise)[:, None, None]) ** 2
        amplitude = np.tensordot(c, along, axes=1)
        explained = np.einsum("rjkm,rjm->rjk", amplitude**2, d / (1 + d), optimize=True)
        whole = np.einsum("ra,abjk,rb->rjk", c, square, c, optimize=True) - explained
        return np.asarray((whole + whole.swapaxes(1, 2)) / (2 * noise[:, None, None] ** 2))

    @cached_property
    def _differences(self) -> list[tuple[FloatArray, FloatArray]]:
        """For each grid, products (a, a, j, k) of the differences of templates, and their amplitudes in the modes of j.

        The latter are (a, j, k, r).
        """
        parts = []
        for grid in self._grids:
            templates = grid.places.ravel()
            first = self._laws.carriers[templates, :, 0]
            gram = np.einsum("jan,kbn->abjk", first, first, optimize=True)
            alone = np.einsum("abjj->abj", gram)
            square = alone[:, :, :, None] + alone[:, :, None] - gram - gram.swapaxes(2, 3)
            along = np.einsum("kan,jnm->ajkm", first, self._laws.modes[templates], optimize=True)
            parts.append((square, along - np.einsum("ajjm->ajm", along)[:, :, None]))
        return parts


@dataclass(frozen=True, kw_only=True, eq=False)
class _Nodes:
    """Severities that a posterior is summed over.

    Attributes
    ----------
    losses, shifts
        Values along both axes.
    of
        For each grid, weights of its templates (nodes, templates), and a quarter of their products (pairs, nodes).
    """

    losses: FloatArray
    shifts: FloatArray
    of: Sequence[tuple[FloatArray, FloatArray]]

    def log_weight(self, grid: SeverityGrid) -> FloatArray:
        """Return the logarithm of the trapezoidal weights (nodes,); -inf beyond the grid."""
        along = [
            _trapezoid(axis) * ((axis >= levels[0] - 1e-12) & (axis <= levels[-1] + 1e-12))
            for axis, levels in zip((self.losses, self.shifts), grid.levels, strict=True)
        ]
        with np.errstate(divide="ignore"):
            return np.log(np.kron(*along))


def _trapezoid(axis: FloatArray) -> FloatArray:
    weights = np.ones(len(axis))
    weights[[0, -1]] = 0.5 if len(axis) > 1 else 1.0
    return weights / weights.sum()
