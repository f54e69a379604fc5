"""Interpolation of stored signals: exact in torque, by a cubic spline over speed, with a stated error."""

import itertools
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np
from scipy.interpolate import BarycentricInterpolator, CubicSpline

from sigdb.core import FloatArray, InputError, IntArray

Powers: TypeAlias = tuple[int, ...]
"""Powers of the torque whose sum a signal is: (1,) in proportion to it, (0,) without it, (1, 0) for both parts."""

_ENOUGH = 0.1
"""Error of the interpolation, in standard deviations of the noise, at which no further speeds are kept. It changes the
log-likelihood of the true template by 0.005 on average."""

_MOST = 0.3
"""Greatest error with which a bank answers between its speeds: 0.05 of a log-likelihood on average."""

_MOST_KEPT = 2 / 3
"""Greatest share of the speeds that is kept where the error is that at the others: fewer of these show too little."""

_MOST_SPEEDS = 64
"""Greatest number of speeds that are kept where others are left out."""

_MOST_RANGES = 512
"""Ranges in which the speeds are divided at most."""

_CUBIC = 4
"""Speeds that a cubic takes."""

_HALVED = 8.0
"""Factor between the error at a speed that is left out and that of all speeds: half the distance has a sixteenth of the
error of a cubic; the other factor 2 is for safety."""


@dataclass(frozen=True, kw_only=True)
class Interpolation:
    """The range in which a bank's templates of one tooth count are interpolated, and the error.

    Attributes
    ----------
    teeth
        Tooth count of the damaged gear.
    error
        Estimated greatest error of an interpolated signal, in norm, in standard deviations of the noise of the quietest
        average. It is that at the speeds of the database that are not kept, or estimated where all are kept.
    speeds
        Number of speeds that are kept.
    ranges
        Number of ranges of equal width from the least to the greatest speed, in each of which the covariance of the
        middle stands for all, and a parabola for the curve.
    speed_rpm
        Least and greatest speed for which it holds, rpm.
    signal_powers, harmonic_powers
        Powers of the torque that make up the signals, and those under harmonic excitations.
    """

    teeth: int
    error: float
    speeds: int
    ranges: int
    speed_rpm: tuple[float, float]
    signal_powers: Powers
    harmonic_powers: Powers

    @property
    def holds(self) -> bool:
        """Whether the error is small enough for answers between the speeds."""
        return self.error <= _MOST

    def check(self) -> None:
        """Refuse numbers that no bank states, as in a file that is not one of sigdb.

        Raises
        ------
        InputError
            If the ranges of speed are too many, or the speeds no interval.
        """
        low, high = self.speed_rpm
        if not 1 <= self.ranges <= _MOST_RANGES:
            raise InputError(f"the bank of templates has {self.ranges} ranges of speed; at most {_MOST_RANGES} exist")
        if not (np.isfinite([low, high]).all() and low <= high):
            raise InputError(f"the bank of templates holds from {low} to {high} rpm, which is no range of speeds")


@dataclass(frozen=True, kw_only=True, eq=False)
class StoredSignals:
    """Signals of templates of one tooth count at operating points, as coefficients of an orthonormal basis.

    Attributes
    ----------
    speed_rpm, torque
        (points,) operating points.
    coefficients
        (points, templates, columns, r); the columns are the nominal average, its responses to independent index errors,
        and its harmonic signals. nan where a point lacks a template.
    harmonics
        Number of harmonic columns, the last ones.
    """

    speed_rpm: FloatArray
    torque: FloatArray
    coefficients: FloatArray
    harmonics: int

    def only(self, points: IntArray) -> Self:
        """Some of the points."""
        return replace(
            self,
            speed_rpm=self.speed_rpm[points],
            torque=self.torque[points],
            coefficients=self.coefficients[points],
        )


class SpeedCurve:
    """Signals over speed, by powers of the torque.

    Parameters
    ----------
    stored
        Signals at operating points.
    signal_powers, harmonic_powers
        Powers of the torque. Two take two torques or more at every speed.

    Attributes
    ----------
    speeds
        (speeds,) the different speeds, rising, rpm.
    powers
        All powers of the torque, the greatest first.
    column_powers
        Powers of each column.
    harmonics
        Number of harmonic columns.
    """

    def __init__(self, stored: StoredSignals, signal_powers: Powers, harmonic_powers: Powers) -> None:
        self.speeds, place = np.unique(stored.speed_rpm, return_inverse=True)
        self.powers: Powers = tuple(sorted({*signal_powers, *harmonic_powers}, reverse=True))
        columns, self.harmonics = stored.coefficients.shape[2], stored.harmonics
        first_harmonic = columns - stored.harmonics
        self.column_powers: list[Powers] = [
            signal_powers if column == 0 else harmonic_powers if column >= first_harmonic else (0,)
            for column in range(columns)
        ]
        has = np.isfinite(stored.coefficients[:, :, 0, 0])
        shape = (len(self.speeds), *stored.coefficients.shape[1:])
        self._has = np.array([has[place == i].all(axis=0) for i in range(len(self.speeds))])
        self._parts = {power: np.zeros(shape) for power in {*self.powers, 0}}
        for speed, (powers, some) in itertools.product(range(len(self.speeds)), self._alike()):
            at = np.flatnonzero(place == speed)
            factors = stored.torque[at, None] ** np.array(powers, float)
            fitted = np.tensordot(np.linalg.pinv(factors), stored.coefficients[at][:, :, some], axes=1)
            for power, part in zip(powers, fitted, strict=True):
                self._parts[power][speed][:, some] = part

    def _alike(self) -> list[tuple[Powers, IntArray]]:
        """Columns by their powers of the torque."""
        return [
            (powers, np.array([i for i, of_column in enumerate(self.column_powers) if of_column == powers]))
            for powers in sorted(set(self.column_powers))
        ]

    def at(self, speed_rpm: FloatArray, power: int) -> FloatArray:
        """Return the part (speeds, templates, columns, r) that goes with a power of the torque.

        It is nan beyond the speeds that have a template, if others have not.
        """
        parts = self._parts[power]
        values_at = np.full((len(speed_rpm), *parts.shape[1:]), np.nan)
        for mask in np.unique(self._has, axis=1).T:
            if not mask.any():
                continue
            templates = np.flatnonzero((self._has == mask[:, None]).all(axis=0))
            speeds = self.speeds[mask]
            inside = mask.all() | ((speed_rpm >= speeds[0]) & (speed_rpm <= speeds[-1]))
            values = np.tensordot(spline_weights(speeds, speed_rpm), parts[np.ix_(mask, templates)], axes=1)
            values_at[:, templates] = np.where(np.reshape(inside, (-1, 1, 1, 1)), values, np.nan)
        return values_at

    def grams(self, torque: float) -> tuple[FloatArray, FloatArray]:
        """Return the products over speeds of the means at a torque, and of the responses to index errors.

        (templates, speeds, speeds) each, of the templates that all speeds have.
        """
        everywhere = self._has.all(axis=0)
        every = np.sum([torque**power * part[:, everywhere] for power, part in self._parts.items()], axis=0)
        last = every.shape[2] - self.harmonics
        mean, response = (
            np.einsum("skcr,tkcr->kst", some, some, optimize=True)
            for some in (every[:, :, [0, *range(last, every.shape[2])]], every[:, :, 1:last])
        )
        return mean, response

    def signals(self, speed_rpm: FloatArray, torque: FloatArray) -> FloatArray:
        """Return the signals at operating points, (points, templates, columns, r)."""
        return np.asarray(
            sum(
                np.asarray(torque, float)[:, None, None, None] ** power * self.at(speed_rpm, power)
                for power in self._parts
            )
        )


def spline_weights(speeds: FloatArray, at: FloatArray) -> FloatArray:
    """Return the weights (places, speeds) of values at some speeds in the interpolated ones.

    It is a cubic spline from four speeds on, else the polynomial through all; constant for one.
    """
    if len(speeds) == 1:
        return np.ones((len(at), 1))
    if len(speeds) >= _CUBIC:
        return np.asarray(CubicSpline(speeds, np.eye(len(speeds)))(at))
    return np.asarray(BarycentricInterpolator(speeds, np.eye(len(speeds)))(at))


def interpolation(stored: StoredSignals, *, teeth: int, noise: float) -> tuple[Interpolation, IntArray]:
    """Choose the powers of the torque and the speeds to keep, and state the error of the interpolation.

    Speeds are kept one after the other, first four at equal distances, then always the one with the greatest error,
    until the error at those that are left is small enough. Where all have to be kept, the error is estimated by leaving
    each out in turn.

    Parameters
    ----------
    stored
        Signals at all operating points.
    teeth
        Tooth count.
    noise
        Standard deviation of the noise of the quietest average, in the signals' unit.

    Returns
    -------
    Interpolation
        Whose error is infinite where there are too few speeds or torques to know.
    ndarray
        (points kept,) places of the points.
    """
    one_torque = min(len(set(stored.torque[stored.speed_rpm == speed])) for speed in np.unique(stored.speed_rpm)) < 2
    choices: list[tuple[Powers, Powers]]
    if one_torque:
        choices = [((1,), (0,)), ((1,), (1,))] if stored.harmonics else [((1,), ())]
    else:
        choices = [((1, 0), (1, 0) if stored.harmonics else ())]
    best = min((_chosen(stored, powers, noise) for powers in choices), key=lambda chosen: chosen[0])
    error, kept, powers = best
    curve = SpeedCurve(stored.only(kept), *powers)
    reach = _reach(stored, curve, powers, noise)
    between = Interpolation(
        teeth=teeth,
        error=error,
        speeds=len(curve.speeds),
        ranges=_ranges(curve, reach, torque=float(stored.torque.max()), noise=noise),
        speed_rpm=reach,
        signal_powers=powers[0],
        harmonic_powers=powers[1],
    )
    return between, kept


def _chosen(
    stored: StoredSignals, powers: tuple[Powers, Powers], noise: float
) -> tuple[float, IntArray, tuple[Powers, Powers]]:
    """Return the error, the places of the points that are kept, and the powers."""
    speeds = np.unique(stored.speed_rpm)
    every = np.arange(len(stored.speed_rpm))
    kept = np.unique(np.linspace(0, len(speeds) - 1, _CUBIC).round().astype(int))
    while len(kept) <= min(len(speeds) * _MOST_KEPT, _MOST_SPEEDS):
        inside = np.isin(stored.speed_rpm, speeds[kept])
        outside = _errors(stored, np.flatnonzero(inside), np.flatnonzero(~inside), powers, noise)
        if outside.max() <= _ENOUGH:
            return float(outside.max()), np.flatnonzero(inside), powers
        worst = stored.speed_rpm[~inside][outside.argmax()]
        kept = np.sort(np.append(kept, np.searchsorted(speeds, worst)))
    if len(speeds) == 1:
        return float(_errors(stored, every, every, powers, noise).max()), every, powers
    left = [every[stored.speed_rpm == speed] for speed in speeds[1:-1]]
    errors = [_errors(stored, np.setdiff1d(every, some), some, powers, noise).max() for some in left]
    # With fewer speeds it is a polynomial of a lower degree that errs as much.
    halved = len(speeds) > _CUBIC and not _has_other_part(stored, powers)
    return float(max(errors, default=np.inf)) / (_HALVED if halved else 1.0), every, powers


def _has_other_part(stored: StoredSignals, powers: tuple[Powers, Powers]) -> bool:
    """Return whether errors at speeds that are left out are those of a part that the torque does not change.

    Such a part b errs by ``b u``, with u the error of one over the torque, interpolated in the same way. Nearer speeds
    would not reduce it.
    """
    if powers[0] != (1,):
        return False
    errors, factors = [], []
    for left in range(1, len(stored.speed_rpm) - 1):
        kept = np.delete(np.arange(len(stored.speed_rpm)), left)
        kept = kept[stored.speed_rpm[kept] != stored.speed_rpm[left]]
        speeds, first = np.unique(stored.speed_rpm[kept], return_index=True)
        weights = spline_weights(speeds, stored.speed_rpm[[left]])[0]
        per_torque = np.nan_to_num(stored.coefficients[:, :, 0]) / stored.torque[:, None, None]
        errors.append(per_torque[left] - np.tensordot(weights, per_torque[kept[first]], axes=1))
        factors.append(1 / stored.torque[left] - weights @ (1 / stored.torque[kept[first]]))
    left_out, u = np.array(errors), np.array(factors)
    part = np.tensordot(u, left_out, axes=1) / max(u @ u, np.finfo(float).tiny)
    return bool((u @ u) * (part**2).sum() > (left_out**2).sum() / 2)


def _errors(
    stored: StoredSignals, kept: IntArray, left: IntArray, powers: tuple[Powers, Powers], noise: float
) -> FloatArray:
    """Return the greatest error at each of the points that are left, in standard deviations of the noise."""
    curve = SpeedCurve(stored.only(kept), *powers)
    away = curve.signals(stored.speed_rpm[left], stored.torque[left]) - stored.coefficients[left]
    return in_noise(away, stored.harmonics, noise)


def in_noise(away: FloatArray, harmonics: int, noise: float) -> FloatArray:
    """Return the greatest norm (points,) of the changes of a template's parts, over the noise; 0 where unknown.

    The parts are the nominal average with its harmonic signals, and all responses to index errors together. The
    Kullback-Leibler divergence of two laws is at most half the square of the first, and the square of the second.
    """
    square = np.nan_to_num((away**2).sum(axis=3))
    last = square.shape[2] - harmonics
    mean = square[:, :, 0] + square[:, :, last:].sum(axis=2)
    return np.asarray(np.sqrt(np.maximum(mean, square[:, :, 1:last].sum(axis=2))).max(axis=1) / noise)


def _ranges(curve: SpeedCurve, reach: tuple[float, float], *, torque: float, noise: float) -> int:
    """Return the number of ranges in which the laws are those at each speed, but for a small error."""
    mean, response = curve.grams(torque)
    count = 1
    while reach[1] > reach[0] and count < _MOST_RANGES:
        middles, half = range_middles(reach, count)
        away = np.array([-1.0, -0.5, 0.5, 1.0])
        exact = spline_weights(curve.speeds, np.add.outer(middles, half * away).ravel())
        at_places = spline_weights(curve.speeds, np.add.outer(middles, half * PLACES).ravel())
        parabolas = parabola(away) @ at_places.reshape(count, len(PLACES), -1)
        frozen = np.repeat(spline_weights(curve.speeds, middles), len(away), axis=0)
        errors = [
            ((weights @ gram) * weights).sum(axis=2).max()
            for weights, gram in ((parabolas.reshape(len(exact), -1) - exact, mean), (frozen - exact, response))
        ]
        if np.sqrt(max(errors)) <= _ENOUGH * noise:
            break
        count *= 2
    return count


def range_middles(reach: tuple[float, float], count: int) -> tuple[FloatArray, float]:
    """Return the middles of so many ranges between two speeds, and half their width, rpm."""
    low, high = reach
    half = (high - low) / (2 * count)
    return low + half * (1 + 2 * np.arange(count)), half


PLACES = np.array([-1.0, 0.0, 1.0]) * np.sqrt(0.75)
"""Places of a range, from -1 to 1, at which the parabola that errs least meets the curve."""


def parabola(place: FloatArray) -> FloatArray:
    """Return the weights (rows, 3) of the values at :data:`PLACES` in the parabola through them."""
    away = np.stack([place - other for other in PLACES], axis=1)
    weights = [
        np.prod(np.delete(away, i, axis=1), axis=1) / np.prod(np.delete(at_place - PLACES, i))
        for i, at_place in enumerate(PLACES)
    ]
    return np.stack(weights, axis=1)


def _reach(
    stored: StoredSignals, curve: SpeedCurve, powers: tuple[Powers, Powers], noise: float
) -> tuple[float, float]:
    """Return the speeds, beyond the least and the greatest, up to which the error is small enough.

    The error of a cubic at a distance d beyond its first speed grows with the product of the distances from its first
    four speeds. It is known at the end of the curve without its last speed. At most one step beyond counts.
    """
    if len(curve.speeds) <= _CUBIC:
        return float(curve.speeds[0]), float(curve.speeds[-1])
    ends = []
    for speeds in (curve.speeds, curve.speeds[::-1]):
        kept = np.isin(stored.speed_rpm, speeds[1:])
        last = np.flatnonzero(stored.speed_rpm == speeds[0])
        error = _errors(stored, np.flatnonzero(kept), last, powers, noise).max()
        away = np.abs(speeds - speeds[0])
        distances = np.linspace(0, away[1], 101)
        grown = error * np.prod(distances[:, None] + away[:4], axis=1) / np.prod(away[1:5])
        ends.append(speeds[0] - np.sign(speeds[1] - speeds[0]) * distances[grown <= _MOST].max())
    return float(ends[0]), float(ends[1])
