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
    by Laplace's method.

    Attributes
    ----------
    parts
        The normal laws of the parts, with the index errors of one size.
    log_weights
        (parts,) log w.
    late
        (parts,) whether the mark may be late.
    mark
        Standard deviation of d, tooth passes.
    healthy_signal
        (a, n) mean of the first carriers of the healthy templates.
    """

    parts: tuple[TurnedLaws, ...]
    log_weights: FloatArray
    late: BoolArray
    mark: float
    healthy_signal: FloatArray

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
        slope = min(_LEFT_LATE, mixture.mark) * late_slope(signals, laws.gear_teeth)[:, :, None]
        for part, factors in zip(mixture.parts, mixture.factors(nuisances.counts), strict=True):
            some = factors > 0
            columns = [errors, nuisances.modes[:, :, some] * factors[some], *([slope] if part.late else [])]
            modes, gains = joint_modes(np.concatenate(columns, axis=2), least)
            parts.append(replace(laws, modes=modes, gains=gains, with_nuisances=True))
        return cls(
            parts=tuple(parts),
            log_weights=np.log([part.weight for part in mixture.parts]),
            late=np.array([part.late for part in mixture.parts]),
            mark=mixture.mark,
            healthy_signal=laws.carriers[laws.healthy, :, 0].mean(axis=0),
        )

    def whitened(self, shape: FloatArray) -> Self:
        """Return the laws of averages that are divided by a deviation by order, (n / 2 + 1,)."""
        parts = tuple(part.whitened(shape) for part in self.parts)
        return replace(self, parts=parts, healthy_signal=whitened(self.healthy_signal, shape))

    def each_log_likelihood(
        self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike, coefficients: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return log-likelihoods under each part (parts, rows, templates, teeth), and log weights (parts, rows).

        Parameters
        ----------
        x, noise, index_error, coefficients
            As of :meth:`TurnedLaws.log_likelihood`.
        """
        first, x = self.parts[0], self.parts[0].checked(x, noise)
        noise, size = (np.broadcast_to(np.asarray(value, float), len(x)) for value in (noise, index_error))
        straight, passes = self.in_place(x, coefficients)
        weight = self.log_weights[:, None] + self._log_late(passes)
        each = np.empty((len(self.parts), len(x), len(first.carriers), first.teeth))
        for at in blocks(len(x), _ROWS_AT_ONCE):
            weights = first.weights(None if coefficients is None else coefficients[at])
            for group, numbers, seen in zip(self._groups, self._numbers, (x, straight), strict=True):
                if group is not None:
                    each[numbers, at] = group.log_likelihood(seen[at], weights, noise=noise[at], index_error=size[at])
        return np.stack([part.completed(term) for part, term in zip(self.parts, each, strict=True)]), weight

    def log_likelihood(
        self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike, coefficients: FloatArray | None = None
    ) -> FloatArray:
        """Return the logarithm of the density of averages; parameters and shape as of :class:`TurnedLaws`."""
        each, weight = self.each_log_likelihood(x, noise=noise, index_error=index_error, coefficients=coefficients)
        return np.asarray(logsumexp(each + weight[:, :, None, None], axis=0))

    def in_place(self, x: FloatArray, coefficients: FloatArray | None) -> tuple[FloatArray, FloatArray]:
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

    def seen(self, part: int, x: FloatArray, coefficients: FloatArray | None) -> FloatArray:
        """Return averages as a part sees them: with the mark in its place where it may be late."""
        return self.in_place(x, coefficients)[0] if self.late[part] else x

    def _log_late(self, passes: FloatArray) -> FloatArray:
        """Return the logarithm of the density of lateness over that of the mode that stands for it, (parts, rows)."""
        if not self.late.any():
            return np.zeros((len(self.parts), len(passes)))
        density = np.log(min(_LEFT_LATE, self.mark) / self.mark) - (passes / self.mark) ** 2 / 2
        return np.where(self.late[:, None], density, 0.0)

    @cached_property
    def _numbers(self) -> list[IntArray]:
        """Numbers of the parts whose mark is in its place, and of those whose mark may be late."""
        return [np.flatnonzero(self.late == is_late) for is_late in (False, True)]

    @cached_property
    def _groups(self) -> "list[_PartGroup | None]":
        """The same parts together; None without any."""
        return [_PartGroup([self.parts[i] for i in numbers]) if len(numbers) else None for numbers in self._numbers]


def joint_modes(columns: FloatArray, least: float) -> tuple[FloatArray, FloatArray]:
    """Return orthonormal modes (templates, n, r) and gains (templates, r) of columns, (templates, n, columns).

    Modes whose gain is at most ``least`` for all templates are left out.
    """
    modes, gains, _ = np.linalg.svd(columns, full_matrices=False)
    kept = max(1, int((gains > least).any(axis=0).sum()))
    return modes[:, :, :kept], gains[:, :kept]


class _PartGroup:
    """Laws of one mean, and of modes of which each part of a mixture has its own.

    Parameters
    ----------
    parts
        The laws.
    """

    def __init__(self, parts: Sequence[TurnedLaws]) -> None:
        self.parts = parts

    def log_likelihood(
        self, x: FloatArray, weights: FloatArray, *, noise: FloatArray, index_error: FloatArray
    ) -> FloatArray:
        """Return log-likelihoods under each part, (parts, rows, templates, teeth).

        Parameters
        ----------
        x, noise, index_error
            As of :class:`TurnedLaws`.
        weights
            Weights of the carriers, as of :meth:`TurnedLaws.weights`.
        """
        residuals = self._basis.residuals(x, weights)
        parts = zip(self.parts, self._modes, strict=True)
        return np.stack([part.density(modes, residuals, noise, index_error) for part, modes in parts])

    @cached_property
    def _basis(self) -> TurnedBasis:
        """A basis of the modes of all parts, and of the carriers."""
        first = self.parts[0]
        carriers = first.carriers.reshape(len(first.carriers), -1, first.samples)
        modes = [part.modes * part.gains[:, None] for part in self.parts]
        tiny = np.finfo(float).tiny
        greatest = max(part.gains.max(initial=tiny) for part in self.parts)
        flat = carriers.reshape(-1, first.samples)
        rows = [each.transpose(0, 2, 1).reshape(-1, first.samples) for each in modes]
        columns = np.concatenate([*rows, flat * (greatest / max(np.linalg.norm(flat, axis=1).max(), tiny))])
        squares, vectors = scipy.linalg.eigh(columns.T @ columns)
        left_out = np.sqrt(np.cumsum(squares.clip(min=0)))
        return TurnedBasis(vectors[:, left_out > _BASIS_PRECISION * greatest].T, carriers, first.teeth)

    @cached_property
    def _modes(self) -> list[TurnedModes]:
        """The modes of each part."""
        return [part.modes_in(self._basis) for part in self.parts]
