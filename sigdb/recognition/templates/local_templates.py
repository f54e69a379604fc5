"""Templates near an operating point: their laws within a short range of speeds, at every torque."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.measurement import shape_of
from sigdb.recognition.laws.mixture_laws import MixtureLaws, Nuisances
from sigdb.recognition.laws.turned_laws import TurnedLaws
from sigdb.recognition.noise.noise_shape import whitened
from sigdb.recognition.noise.residual_tests import ResidualTests
from sigdb.recognition.templates.continuous_severity import ContinuousSeverity, TemplateDistances
from sigdb.recognition.templates.outward import outward_changes
from sigdb.recognition.templates.severity_grid import severity_grids
from sigdb.recognition.templates.speed_curve import PLACES, Powers, SpeedCurve, parabola, range_middles

_KEPT_SHAPES = 16
"""Shapes of noise whose laws are in memory at once, for each range."""

_KEPT_RANGES = 64
"""Ranges whose laws are in memory at once."""

_PRECISION = 1e-4
"""Precision of laws in a range of speeds (:class:`TurnedLaws`), of the size of that of the stored signals."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LocalTemplates:
    """Templates in a short range of speeds.

    Attributes
    ----------
    laws
        Their laws without nuisances. The modes are those in the middle of the range.
    mixture
        Their laws with nuisances; None without any.
    share
        (templates,) share of each among the rows of its kind, healthy or damaged.
    severity
        (templates, quantities) severities, see :class:`PointTemplates`.
    middle, half_width
        Middle and half the width of the range, rpm; the width is 0 for laws at one speed.
    powers
        For each column of the carriers, the powers of the torque; none for laws at one torque.
    outward
        (templates, sizes, n) change of the signal beyond the greatest value of each size, of any length, see
        :func:`~sigdb.recognition.templates.outward.outward_changes`.
    change
        (templates, n) change of the signal by the damage, of any size.
    kinds
        (templates,) kinds of damage, see :class:`PointTemplates`.
    noise_factor
        :meth:`effective_noise` of the shape that they are divided by.
    """

    laws: TurnedLaws
    share: FloatArray
    severity: FloatArray
    middle: float = 0.0
    half_width: float = 0.0
    powers: Sequence[Powers] = ()
    outward: FloatArray
    change: FloatArray
    kinds: tuple[str, ...] = ()
    mixture: MixtureLaws | None = None
    noise_factor: float = 1.0

    @property
    def teeth(self) -> int:
        """Tooth count of the damaged gear."""
        return self.laws.gear_teeth

    @property
    def samples(self) -> int:
        """Samples of an average."""
        return self.laws.samples

    @property
    def healthy(self) -> BoolArray:
        """(templates,) whether a template is of a healthy gear."""
        return self.laws.healthy

    def whitened(self, levels: IntArray) -> Self:
        """Return the templates for averages that are divided by the shape of their noise, (bands,) dB.

        See :func:`~sigdb.recognition.noise.noise_shape.shape_of`.
        """
        key = tuple(levels.tolist())
        if not any(key):
            return self
        if key not in self._whitened:
            while len(self._whitened) >= _KEPT_SHAPES:
                del self._whitened[next(iter(self._whitened))]
            shape = shape_of(levels, self.samples, self.teeth)
            outward, change = whitened(self.outward, shape), whitened(self.change, shape)
            mixture = None if self.mixture is None else self.mixture.whitened(shape)
            laws = self.laws.whitened(shape)
            factor = self.effective_noise(levels)
            self._whitened[key] = replace(
                self, laws=laws, mixture=mixture, outward=outward, change=change, noise_factor=factor
            )
        return self._whitened[key]

    def each_log_likelihood(
        self, x: FloatArray, *, noise: FloatArray, index_error: float, coefficients: FloatArray | None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return log-likelihoods under each part of the mixture, log weights, and averages, as of MixtureLaws."""
        if self.mixture is None:
            only = self.laws.log_likelihood(x, noise=noise, index_error=index_error, coefficients=coefficients)
            return only[None], np.zeros((1, len(x))), x
        return self.mixture.each_log_likelihood(x, noise=noise, index_error=index_error, coefficients=coefficients)

    def is_late(self, part: int) -> bool:
        """Whether the mark may be late under a part of the mixture."""
        return self.mixture is not None and bool(self.mixture.late[part])

    @cached_property
    def parts(self) -> tuple[Self, ...]:
        """The templates under the law of each part of the mixture."""
        if self.mixture is None:
            return (self,)
        return tuple(replace(self, laws=laws, mixture=None) for laws in self.mixture.parts)

    @cached_property
    def _whitened(self) -> dict[tuple[int, ...], Self]:
        return {}

    def effective_noise(self, levels: IntArray) -> float:
        """Return the deviation of white noise, over the level of a shape, in which damage stands out as much."""
        shape = shape_of(levels, self.samples, self.teeth)
        energy = (np.abs(np.fft.rfft(self.change, axis=1)) ** 2).sum(axis=0)
        return float(np.sqrt(energy.sum() / (energy / shape**2).sum()))

    def residual_tests(self, between: bool) -> ResidualTests:
        """Return the tests of residuals, where severities lie between those of templates or not."""
        if between not in self._kept_tests:
            laws, severity = self.laws, self.severity
            self._kept_tests[between] = ResidualTests(
                laws=laws, severity=severity, outward=self.outward, change=self.change, between=between
            )
        return self._kept_tests[between]

    @cached_property
    def _kept_tests(self) -> dict[bool, ResidualTests]:
        return {}

    @cached_property
    def log_prior(self) -> FloatArray:
        """(templates, teeth) logarithm of the prior: even odds of damage and none, all teeth equally likely."""
        with np.errstate(divide="ignore"):
            each = np.log(self.share / (2 * np.where(self.healthy, self.teeth, self.laws.teeth)))
        return np.repeat(each[:, None], self.teeth, axis=1)

    @cached_property
    def continuous_severity(self) -> ContinuousSeverity | None:
        """Posteriors over severities between the templates; None where these form no grid."""
        grids = severity_grids(self.severity, self.healthy)
        return ContinuousSeverity(grids, self.healthy, self.share) if grids else None

    @cached_property
    def distances(self) -> list[TemplateDistances]:
        """Distances of the templates of each grid of severities."""
        continuous = self.continuous_severity
        return [] if continuous is None else [TemplateDistances(self.laws, some) for some in continuous.templates]

    def signals(self, coefficients: FloatArray | None) -> FloatArray:
        """Return the nominal averages, (rows or 1, templates, n), without harmonic excitations."""
        return self.laws.first_means(coefficients)

    def healthy_variance(self, coefficients: FloatArray | None) -> FloatArray:
        """Return the variance of the healthy clean average, (rows,) or (1,), without harmonic excitations."""
        return self.laws.variance(np.flatnonzero(self.healthy), coefficients).mean(axis=1)

    def coefficients(self, speed_rpm: FloatArray, torque: FloatArray) -> FloatArray | None:
        """Return the coefficients of the carriers at operating points, (rows, a, b); None for laws at one point."""
        if not self.powers:
            return None
        every = sorted({power for powers in self.powers for power in powers}, reverse=True)
        if self.half_width:
            of_speed = parabola((speed_rpm - self.middle) / self.half_width)
        else:
            of_speed = np.ones((len(torque), 1))
        parts = [
            np.stack([torque**power if power in powers else np.zeros(len(torque)) for powers in self.powers], axis=1)
            for power in every
        ]
        return np.concatenate([of_speed[:, :, None] * part[:, None] for part in parts], axis=1)


class LocalNuisances(Protocol):
    """Nuisances by operating point, and the greatest norm of modes that laws leave out."""

    @property
    def least_mode(self) -> float:
        """Greatest norm of modes that laws leave out."""
        ...

    def at(self, speed_rpm: float, torque: float) -> Nuisances | None:
        """Return the nuisances at a speed, rpm, and a torque, N m; None without any."""
        ...


class SpeedRanges:
    """Templates of a tooth count in ranges of speed, as many as their laws take to be those of each speed.

    Parameters
    ----------
    curve
        Their signals over speed.
    basis
        (r, n) orthonormal basis of the coefficients.
    reach
        Least and greatest speed, rpm; beyond them the laws at the ends are taken.
    count
        Number of ranges.
    torque
        A usual torque, N m.
    teeth, index_error
        Tooth count, and size of the index errors that the responses are for, m.
    healthy, share, severity, phases, kinds
        As of :class:`PointTemplates`, for the curve's templates.
    nuisances
        The nuisances at a speed and a torque, if there are any.
    """

    def __init__(
        self,
        curve: SpeedCurve,
        *,
        basis: FloatArray,
        reach: tuple[float, float],
        count: int,
        torque: float,
        teeth: int,
        index_error: float,
        healthy: BoolArray,
        share: FloatArray,
        severity: FloatArray,
        phases: FloatArray,
        kinds: Sequence[str],
        nuisances: "LocalNuisances",
    ) -> None:
        self._curve, self._basis, self._reach, self._teeth = curve, basis, reach, teeth
        self._index_error, self._healthy, self._share = index_error, healthy, share
        self._severity, self._phases, self._count, self._torque = severity, phases, count, torque
        self._nuisances, self._kinds = nuisances, kinds
        self._kept: dict[int, LocalTemplates] = {}

    def place(self, speed_rpm: FloatArray) -> IntArray:
        """Return the range of each speed, (rows,)."""
        low, high = self._reach
        if high <= low:
            return np.zeros(len(speed_rpm), int)
        share = (np.clip(speed_rpm, low, high) - low) / (high - low)
        return np.minimum((share * self._count).astype(int), self._count - 1)

    def clipped(self, speed_rpm: FloatArray) -> FloatArray:
        """Return the speeds (rows,), those beyond the ends moved to them."""
        return np.clip(speed_rpm, *self._reach)

    @property
    def _harmonics(self) -> int:
        return self._phases.shape[1]

    def templates(self, place: int) -> LocalTemplates:
        """Return the templates of a range."""
        if place not in self._kept:
            while len(self._kept) >= _KEPT_RANGES:
                del self._kept[next(iter(self._kept))]
            self._kept[place] = self._local(place)
        return self._kept[place]

    def nuisances(self, speed_rpm: float) -> Nuisances | None:
        """Return the nuisances of the templates of the range of a speed, at a usual torque; None without any."""
        place = self.place(np.array([speed_rpm]))
        middle = range_middles(self._reach, self._count)[0][place]
        existing = np.flatnonzero(np.isfinite(self._curve.at(middle, 0)[0, :, 0, 0]))
        nuisances = self._nuisances.at(float(middle[0]), self._torque)
        return None if nuisances is None else nuisances.only(existing)

    def _local(self, place: int) -> LocalTemplates:
        middles, half = range_middles(self._reach, self._count)
        middle = float(middles[place])
        at = middle + half * PLACES if half else np.array([middle])
        parts = [self._curve.at(at, power) for power in self._curve.powers]
        response = self._curve.at(np.array([middle]), 0)[0]
        existing = np.flatnonzero(np.isfinite(response[:, 0, 0]))
        last = response.shape[1] - self._harmonics
        columns = [0, *range(last, response.shape[1])]
        carriers = np.concatenate([part[:, existing][:, :, columns].transpose(1, 0, 2, 3) for part in parts], axis=1)
        modes, spread, _ = np.linalg.svd(response[existing, 1:last].transpose(0, 2, 1), full_matrices=False)
        modes, gains = self._basis.T @ modes, spread / self._index_error if self._index_error else spread
        healthy, phases = self._healthy[existing], self._phases[existing]
        first = np.ones((len(existing), 1, self._teeth if self._harmonics else 1))
        signals = self._curve.signals(np.array([middle]), np.array([self._torque]))[0, existing, 0] @ self._basis
        laws = TurnedLaws(
            teeth=self._teeth,
            healthy=healthy,
            modes=modes,
            gains=gains,
            carriers=carriers @ self._basis,
            phases=np.concatenate([first, phases[:, :, : first.shape[2]]], axis=1),
            turn_invariant=True,
            precision=_PRECISION,
        )
        mixture, nuisances = None, self.nuisances(middle)
        if nuisances is not None:
            errors = self._basis.T @ response[existing, 1:last].transpose(0, 2, 1)
            mixture = MixtureLaws.of(laws, errors, nuisances, signals, least=self._nuisances.least_mode)
        share = self._share[existing].copy()
        for kind in (healthy, ~healthy):
            share[kind] /= share[kind].sum()
        return LocalTemplates(
            laws=laws,
            share=share,
            severity=self._severity[existing],
            middle=middle,
            half_width=half,
            powers=[self._curve.column_powers[column] for column in columns],
            outward=outward_changes(self._severity[existing], healthy, signals),
            change=signals - signals[healthy].mean(axis=0),
            kinds=tuple(self._kinds[i] for i in existing.tolist()) if self._kinds else (),
            mixture=mixture,
        )
