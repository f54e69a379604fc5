"""Laws of averages that are mixtures over nuisances: which of them a machine has, an average says itself."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike
from scipy.special import logsumexp

from sigdb.core import BoolArray, FloatArray, IntArray, blocks
from sigdb.measurement import NuisanceMixture, late, late_slope
from sigdb.recognition.laws.turned_laws import TurnedLaws
from sigdb.recognition.laws.turned_residuals import TurnedBasis, TurnedModes
from sigdb.recognition.noise.noise_shape import whitened

_PLACES = 128
"""Places of the mark in a tooth pass among which it is sought; the best is refined by a parabola."""

_LEFT_LATE = 0.05
"""Standard deviation of what may be left of the mark's lateness once it is taken out, tooth passes, at most."""

_BASIS_PRECISION = 1e-6
"""Greatest norm of what a basis leaves out of all modes and carriers together, over that of the greatest mode."""

_MODE_PRECISION = 1e-7
"""The same of the basis that modes are kept along."""

_MOST_BEND = 0.1
"""Greatest norm of what bends away from the mode of the mark's lateness, over the noise, for which the mode will do."""

_MOST_TURNS = 4
"""Times that an average is turned by what is left of the mark's lateness, at most."""

_ROWS_AT_ONCE = 128
"""Rows whose parts are compared together."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Nuisances:
    """The nuisances of some templates.

    Attributes
    ----------
    modes
        (templates, n, q) W_k, changes of the average per standard deviation, those of each nuisance together.
    counts
        Number of modes of each nuisance.
    mixture
        Which nuisances a machine has.
    """

    modes: FloatArray
    counts: tuple[int, ...]
    mixture: NuisanceMixture

    def only(self, places: IntArray) -> Self:
        """Return those of some templates."""
        return replace(self, modes=self.modes[places])

    def whitened(self, shape: FloatArray) -> Self:
        """Return them for averages that are divided by a deviation by order, (n / 2 + 1,)."""
        return replace(self, modes=whitened(self.modes.transpose(0, 2, 1), shape).transpose(0, 2, 1))


def stacked_modes(modes: list[FloatArray], counts: list[IntArray]) -> tuple[FloatArray, tuple[int, ...]]:
    """Return modes (n, modes) of templates in one array, and how many each nuisance has in it.

    Where a template has fewer modes of a nuisance than another, columns of zeros stand for the others.
    """
    most = np.max(counts, axis=0)
    first = np.concatenate([[0], np.cumsum(most)])
    stacked = np.zeros((len(modes), len(modes[0]), int(first[-1])))
    for k, (columns, of_each) in enumerate(zip(modes, counts, strict=True)):
        places = [np.arange(count) + start for start, count in zip(first, of_each, strict=False)]
        stacked[k][:, np.concatenate([*places, np.empty(0, int)])] = columns
    return stacked, tuple(most.tolist())


@dataclass(frozen=True, kw_only=True, eq=False)
class MixtureLaws:
    """Laws of an average for each template and turn, a mixture over the nuisances that a machine may have.

    ::

        p(x | k, t) = sum_m w_m N(x turned back; s_kt, noise^2 I + index_error^2 Y_k C Y_k' + W_km W_km')

    W_km are the modes of the nuisances of part m, of the size of that part. Where the mark may be late by d tooth
    passes, x is first turned back by the d at which it resembles the healthy signal most in the orders of the mesh,
    which no damage and no turn by a tooth moves. The error of that d is one more mode, so that p is the integral over d
    by Laplace's method. Where noise is so low that a mode is too straight for the error, x is turned back by it too.

    Attributes
    ----------
    parts
        The normal laws of the parts, with the index errors of one size. Those whose mark is in its place share a basis
        of modes and carriers, and so do the others: memory holds the modes along it.
    log_weights
        (parts,) log w.
    late
        (parts,) whether the mark may be late.
    mark
        Standard deviation of d, tooth passes.
    healthy_signal
        (a, n) mean of the first carriers of the healthy templates.
    slopes
        (templates, n) change of the nominal averages per tooth pass that the mark comes late.
    """

    parts: tuple[TurnedLaws, ...]
    log_weights: FloatArray
    late: BoolArray
    mark: float
    healthy_signal: FloatArray
    slopes: FloatArray

    @classmethod
    def of(
        cls, laws: TurnedLaws, errors: FloatArray, nuisances: Nuisances, signals: FloatArray, *, least: float = 0.0
    ) -> Self:
        """The mixture of laws without nuisances.

        Parameters
        ----------
        laws
            Laws without nuisances.
        errors
            (templates, n, r) responses to independent index errors of their size.
        nuisances
            The nuisances of the templates.
        signals
            (templates, n) nominal averages.
        least
            Greatest norm of modes that are left out.
        """
        mixture, parts = nuisances.mixture, []
        slopes = late_slope(signals, laws.gear_teeth)
        left = _left(mixture.mark) * slopes[:, :, None]
        for part, factors in zip(mixture.parts, mixture.factors(nuisances.counts), strict=True):
            some = factors > 0
            columns = [errors, nuisances.modes[:, :, some] * factors[some], *([left] if part.late else [])]
            modes, gains = joint_modes(np.concatenate(columns, axis=2), least)
            parts.append(replace(laws, modes=modes, gains=gains, with_nuisances=True))
        late = np.array([part.late for part in mixture.parts])
        return cls(
            parts=_along_bases(parts, late),
            log_weights=np.log([part.weight for part in mixture.parts]),
            late=late,
            mark=mixture.mark,
            healthy_signal=laws.carriers[laws.healthy, :, 0].mean(axis=0),
            slopes=slopes,
        )

    def whitened(self, shape: FloatArray) -> Self:
        """Return the laws of averages that are divided by a deviation by order, (n / 2 + 1,)."""
        parts = _along_bases([part.whitened(shape) for part in self.parts], self.late)
        signal, slopes = whitened(self.healthy_signal, shape), whitened(self.slopes, shape)
        return replace(self, parts=parts, healthy_signal=signal, slopes=slopes)

    def each_log_likelihood(
        self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike, coefficients: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return log-likelihoods under each part, log weights, and averages with the mark in its place.

        They are (parts, rows, templates, teeth), (parts, rows) and (rows, n).

        Parameters
        ----------
        x, noise, index_error, coefficients
            As of :meth:`TurnedLaws.log_likelihood`.
        """
        first, x = self.parts[0], self.parts[0].checked(x, noise)
        noise, size = (np.broadcast_to(np.asarray(value, float), len(x)) for value in (noise, index_error))
        straight, passes = self._in_place(x, coefficients)
        each = np.empty((len(self.parts), len(x), len(first.carriers), first.teeth))
        for is_late, group in self._groups.items():
            seen = straight if is_late else x
            each[self._numbers[is_late]] = group.log_likelihood(seen, noise, size, coefficients)
        rows = np.arange(len(x))
        for _ in range(_MOST_TURNS if self.late.any() else 0):
            c = None if coefficients is None else coefficients[rows]
            more, bent = self._left_late(each[:, rows], straight[rows], noise[rows], c)
            rows, more = rows[bent], more[bent]
            if not len(rows):
                break
            passes[rows] += more
            straight[rows] = late(straight[rows], -more, first.gear_teeth)
            law = (noise[rows], size[rows], None if coefficients is None else coefficients[rows])
            each[self._numbers[True][:, None], rows] = self._groups[True].log_likelihood(straight[rows], *law)
        each = np.stack([part.completed(term) for part, term in zip(self.parts, each, strict=True)])
        return each, self.log_weights[:, None] + self._log_late(passes), straight

    def log_likelihood(
        self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike, coefficients: FloatArray | None = None
    ) -> FloatArray:
        """Return the logarithm of the density of averages; parameters and shape as of :class:`TurnedLaws`."""
        each, weight, _ = self.each_log_likelihood(x, noise=noise, index_error=index_error, coefficients=coefficients)
        return np.asarray(logsumexp(each + weight[:, :, None, None], axis=0))

    def _in_place(self, x: FloatArray, coefficients: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """Return averages (rows, n) with the mark in its place, and by how many passes it was late, (rows,)."""
        if not self.late.any():
            return x, np.zeros(len(x))
        teeth = self.parts[0].gear_teeth
        mesh = np.arange(teeth, x.shape[1] // 2, teeth)
        healthy = np.fft.rfft(self.healthy_signal, axis=1)[:, mesh]
        c = np.ones((1, len(healthy))) if coefficients is None else coefficients[:, :, 0]
        product = np.fft.rfft(x, axis=1)[:, mesh] * (c @ healthy).conj()
        places = (np.arange(_PLACES) - _PLACES // 2) / _PLACES
        alike = (product @ np.exp(2j * np.pi / teeth * np.outer(mesh, places))).real
        best = alike.argmax(axis=1)
        before, top, after = (np.take_along_axis(alike, (best + i)[:, None] % _PLACES, 1)[:, 0] for i in (-1, 0, 1))
        bend = np.minimum(before - 2 * top + after, -np.finfo(float).tiny)
        passes = places[best] + np.clip((before - after) / (2 * bend), -0.5, 0.5) / _PLACES
        return late(x, -passes, teeth), passes

    def _left_late(
        self, each: FloatArray, straight: FloatArray, noise: FloatArray, coefficients: FloatArray | None
    ) -> tuple[FloatArray, BoolArray]:
        """Return by how many passes averages are late under their most likely law, and where a mode is too straight.

        Both are (rows,). The mode is too straight where what bends away from it is more than a tenth of the noise.
        """
        numbers, rows = self._numbers[True], np.arange(len(straight))
        weighed = each[numbers] + self.log_weights[numbers][:, None, None, None]
        best = weighed.transpose(1, 0, 2, 3).reshape(len(rows), -1).argmax(axis=1)
        part, template, turn = np.unravel_index(best, (len(numbers), *each.shape[2:]))
        passes, size = np.empty(len(rows)), _left(self.mark)
        for m, k in sorted(set(zip(part.tolist(), template.tolist(), strict=True))):
            at = np.flatnonzero((part == m) & (template == k))
            laws = self.parts[numbers[m]]
            c = None if coefficients is None else coefficients[at]
            turned = straight[at[:, None], (np.arange(laws.samples) + turn[at, None] * self._step) % laws.samples]
            left = turned - laws.weights_of(k, turn[at], c) @ laws.carriers_of(k)
            d = (laws.gains[k] / noise[at, None]) ** 2
            slope = size * self.slopes[k]
            explained = d / (1 + d) * laws.along_modes(k, left) @ laws.along_modes(k, slope)
            passes[at] = size * (left @ slope - explained) / noise[at] ** 2
        return passes, passes**2 / 2 * self._bends[template] > _MOST_BEND * noise

    def _log_late(self, passes: FloatArray) -> FloatArray:
        """Return the logarithm of the density of lateness over that of the mode that stands for it, (parts, rows)."""
        if not self.late.any():
            return np.zeros((len(self.parts), len(passes)))
        density = np.log(_left(self.mark) / self.mark) - (passes / self.mark) ** 2 / 2
        return np.where(self.late[:, None], density, 0.0)

    @cached_property
    def _bends(self) -> FloatArray:
        """(templates,) norm of the second derivative of the averages by the lateness of the mark, per pass squared."""
        return np.asarray(np.linalg.norm(late_slope(self.slopes, self.parts[0].gear_teeth), axis=1))

    @property
    def _step(self) -> int:
        """Samples of a turn by one tooth; all of them where nothing is turned."""
        return self.parts[0].samples // self.parts[0].teeth

    @cached_property
    def _numbers(self) -> dict[bool, IntArray]:
        """Numbers of the parts whose mark is in its place, and of those whose mark may be late."""
        return {is_late: np.flatnonzero(self.late == is_late) for is_late in (False, True)}

    @cached_property
    def _groups(self) -> "dict[bool, _PartGroup]":
        """The same parts together, where there are any."""
        return {is_late: _PartGroup([self.parts[i] for i in at]) for is_late, at in self._numbers.items() if len(at)}


def _left(mark: float) -> float:
    """Return the standard deviation of what is left of the lateness of a mark of some standard deviation, passes."""
    return min(_LEFT_LATE, mark)


def joint_modes(columns: FloatArray, least: float) -> tuple[FloatArray, FloatArray]:
    """Return orthonormal modes (templates, n, r) and gains (templates, r) of columns, (templates, n, columns).

    Modes whose gain is at most ``least`` for all templates are left out.
    """
    modes, gains, _ = np.linalg.svd(columns, full_matrices=False)
    kept = max(1, int((gains > least).any(axis=0).sum()))
    return modes[:, :, :kept].copy(), gains[:, :kept].copy()  # a view would keep those that are left out


def _along_bases(parts: Sequence[TurnedLaws], late: BoolArray) -> tuple[TurnedLaws, ...]:
    """Return the laws of parts with their modes along a basis: one of those that may be late, one of the others."""
    compact = list(parts)
    for is_late in np.unique(late):
        at = np.flatnonzero(late == is_late).tolist()
        basis, compared = _joint_basis([parts[i] for i in at])
        for i in at:
            compact[i] = parts[i].along_basis(basis, compared)
    return tuple(compact)


def _joint_basis(parts: Sequence[TurnedLaws]) -> tuple[FloatArray, int]:
    """Return an orthonormal basis (b, n) of the modes of all parts, and the number of vectors to compare along."""
    first = parts[0]
    modes = [part.modes * part.gains[:, None] for part in parts]
    tiny = np.finfo(float).tiny
    greatest = max(part.gains.max(initial=tiny) for part in parts)
    flat = first.carriers.reshape(-1, first.samples)
    rows = [each.transpose(0, 2, 1).reshape(-1, first.samples) for each in modes]
    columns = np.concatenate([*rows, flat * (greatest / max(np.linalg.norm(flat, axis=1).max(), tiny))])
    squares, vectors = scipy.linalg.eigh(columns.T @ columns)
    left_out = np.sqrt(np.cumsum(squares.clip(min=0))) / greatest
    compared = int((left_out > _BASIS_PRECISION).sum())
    return np.ascontiguousarray(vectors[:, left_out > _MODE_PRECISION].T[::-1]), compared


class _PartGroup:
    """Laws of one mean, and of modes along one basis of which each part of a mixture has its own.

    Parameters
    ----------
    parts
        The laws.
    """

    def __init__(self, parts: Sequence[TurnedLaws]) -> None:
        self.parts = parts

    def log_likelihood(
        self, x: FloatArray, noise: FloatArray, index_error: FloatArray, coefficients: FloatArray | None
    ) -> FloatArray:
        """Return log-likelihoods under each part, (parts, rows, templates, teeth); arguments as of TurnedLaws."""
        first = self.parts[0]
        likelihood = np.empty((len(self.parts), len(x), len(first.carriers), first.teeth))
        for at in blocks(len(x), _ROWS_AT_ONCE):
            weights = first.weights(None if coefficients is None else coefficients[at])
            residuals = self._basis.residuals(x[at], weights)
            for part, modes, of_part in zip(self.parts, self._modes, likelihood, strict=True):
                of_part[at] = part.density(modes, residuals, noise[at], index_error[at])
        return likelihood

    @cached_property
    def _basis(self) -> TurnedBasis:
        """The basis of the modes of all parts, and of the carriers."""
        first = self.parts[0]
        assert first.mode_basis is not None
        carriers = first.carriers.reshape(len(first.carriers), -1, first.samples)
        return TurnedBasis(first.mode_basis[: first.compared], carriers, first.teeth)

    @cached_property
    def _modes(self) -> list[TurnedModes]:
        """The modes of each part."""
        return [part.modes_in(self._basis) for part in self.parts]
