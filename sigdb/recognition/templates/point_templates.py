"""Templates of one operating point as a bank stores them, and those of several points as signals over speed."""

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Self, TypeAlias

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.database import QUANTITIES, damage_kinds, severity_levels
from sigdb.measurement import NuisanceMixture, NuisancePart
from sigdb.recognition.laws.mixture_laws import MixtureLaws, Nuisances, stacked_modes
from sigdb.recognition.templates.compact_signals import CompactSignals
from sigdb.recognition.templates.hypotheses import Hypotheses
from sigdb.recognition.templates.local_templates import LocalTemplates
from sigdb.recognition.templates.outward import outward_changes
from sigdb.recognition.templates.speed_curve import StoredSignals


@dataclass(frozen=True, kw_only=True, eq=False)
class PointTemplates:
    """The templates of one operating point and tooth count.

    Attributes
    ----------
    speed_rpm, torque, teeth
        The operating point, and the tooth count of the damaged gear.
    signals
        (templates, 1 + r + harmonics) signals of each template: its nominal average; its response to independent index
        errors of the size ``index_error``; its harmonic signals. See :class:`Hypotheses`.
    index_error
        Size of the index errors that the modes are for, m.
    phases
        (templates, harmonics, teeth) phases of the harmonic ones.
    reference_variance
        (templates,) variance of the healthy clean average.
    healthy
        (templates,) whether a template is of a healthy gear.
    share
        (templates,) share of each among the rows of its kind, healthy or damaged.
    severity
        (templates, quantities) values of the bank's quantities; nan where the damage does not have one, or differs from
        tooth to tooth.
    nuisance
        (templates, modes) modes of the nuisances of each template; None without any.
    nuisance_counts
        Number of modes of each nuisance; None without any.
    nuisance_parts, mark
        The parts of the mixture of nuisances, and the standard deviation of the mark's place, tooth passes; see
        :class:`sigdb.measurement.NuisanceMixture`.
    least_mode
        Greatest norm of modes of nuisances that laws leave out.
    tooth
        (templates,) first damaged tooth of templates that are not to be turned, as in a train; None where they are.
    kinds
        (templates,) kind of damage of each, see :func:`sigdb.database.damage_kinds`; empty in older banks.
    """

    speed_rpm: float
    torque: float
    teeth: int
    signals: CompactSignals
    index_error: float
    phases: FloatArray
    reference_variance: FloatArray
    healthy: BoolArray
    share: FloatArray
    severity: FloatArray
    nuisance: CompactSignals | None = None
    tooth: IntArray | None = None
    kinds: tuple[str, ...] = ()
    nuisance_counts: tuple[int, ...] | None = None
    nuisance_parts: tuple[tuple[float, tuple[int, ...], float, bool], ...] | None = None
    mark: float = 0.0
    least_mode: float = 0.0

    @classmethod
    def of(
        cls,
        laws: Sequence[Hypotheses],
        shares: Sequence[FloatArray],
        *,
        points: Sequence[tuple[float, float]],
        index_error: float,
        tolerance: float = 0.0,
        quantities: Sequence[str] = QUANTITIES,
    ) -> list[Self]:
        """Templates of all operating points of one tooth count, stored compactly.

        Parameters
        ----------
        laws
            Hypotheses of each operating point.
        shares
            (templates,) share of each template among the rows of its kind, for each operating point.
        points
            Speed (rpm) and torque (N m) of each operating point.
        index_error
            Size of the index errors, m.
        tolerance
            Tolerance of the compact signals, see :meth:`CompactSignals.of`.
        quantities
            Quantities of the severity, see :func:`sigdb.database.severity_quantities`.
        """
        stored = CompactSignals.of([_signals(law, index_error) for law in laws], tolerance=tolerance)
        modes = [law.nuisances.modes.transpose(0, 2, 1) for law in laws if law.nuisances is not None]
        nuisances: Sequence[CompactSignals | None] = [None] * len(laws)
        if len(modes) == len(laws) and all(columns.size for columns in modes):
            nuisances = CompactSignals.of(modes, tolerance=_NUISANCE_TOLERANCE * tolerance)
        return [
            cls(
                speed_rpm=speed_rpm,
                torque=torque,
                teeth=law.teeth,
                signals=signals,
                index_error=index_error,
                phases=law.phases,
                reference_variance=law.reference_variance,
                healthy=law.healthy,
                share=share,
                severity=severity_levels(law.cases, quantities).to_numpy(),
                nuisance=nuisance,
                tooth=law.cases["tooth"].to_numpy(int) if law.untied else None,
                kinds=tuple(damage_kinds(law.cases)),
                nuisance_counts=None if law.nuisances is None else law.nuisances.counts,
                nuisance_parts=None if law.nuisances is None else law.nuisances.mixture.plain,
                mark=0.0 if law.nuisances is None else law.nuisances.mixture.mark,
                least_mode=_LEAST_MODE * tolerance,
            )
            for (speed_rpm, torque), law, share, signals, nuisance in zip(
                points, laws, shares, stored, nuisances, strict=True
            )
        ]

    def __getstate__(self) -> dict[str, Any]:
        state = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in state.items() if value is not None}

    @property
    def samples(self) -> int:
        """Samples of an average."""
        return self.signals.samples

    @cached_property
    def hypotheses(self) -> Hypotheses:
        """The laws, expanded."""
        expanded, h = self.signals.expanded(), self.phases.shape[1]
        signal, response, harmonic = np.split(expanded, [1, expanded.shape[1] - h], axis=1)
        modes, spread, _ = np.linalg.svd(response.transpose(0, 2, 1), full_matrices=False)
        return Hypotheses(
            teeth=self.teeth,
            cases=pd.DataFrame({"tooth": np.where(self.healthy, 0, 1) if self.tooth is None else self.tooth}),
            signal=signal[:, 0],
            modes=modes,
            gains=spread / self.index_error if self.index_error else spread,
            harmonic=harmonic.transpose(0, 2, 1),
            phases=self.phases,
            reference_variance=self.reference_variance,
            turn_invariant=True,
            nuisances=self.nuisances,
            untied=self.tooth is not None,
        )

    @property
    def nuisances(self) -> Nuisances | None:
        """The nuisances, in the signals' unit; None without any."""
        if self.nuisance is None and self.nuisance_parts is None:
            return None
        modes: FloatArray = np.empty((len(self.healthy), self.samples, 0))
        if self.nuisance is not None:
            modes = self.nuisance.expanded().transpose(0, 2, 1)
        counts = (modes.shape[2],) if self.nuisance_counts is None else self.nuisance_counts
        if self.nuisance_parts is None:  # of an earlier version
            return Nuisances(modes=modes, counts=counts, mixture=NuisanceMixture.certain(len(counts)))
        parts = tuple(NuisancePart(*part) for part in self.nuisance_parts)
        return Nuisances(modes=modes, counts=counts, mixture=NuisanceMixture(parts=parts, mark=self.mark))

    @cached_property
    def local(self) -> LocalTemplates:
        """The templates at this point alone."""
        signal = self.hypotheses.signal
        outward = np.zeros((len(self.healthy), self.severity.shape[1] - 1, self.samples))
        for tooth in np.unique(self.hypotheses.cases["tooth"])[1:]:
            at = np.flatnonzero(self.healthy | (self.hypotheses.cases["tooth"] == tooth))
            outward[at] = outward_changes(self.severity[at], self.healthy[at], signal[at])
        return LocalTemplates(
            laws=self.hypotheses.turned,
            mixture=self._mixture,
            share=self.share,
            severity=self.severity,
            outward=outward,
            change=signal - signal[self.healthy].mean(axis=0),
            kinds=self.kinds,
        )

    def distance(self, speed_rpm: FloatArray, torque: FloatArray, teeth: FloatArray | IntArray) -> FloatArray:
        """Return relative distances of operating points in speed and torque, (rows,); inf for other tooth counts."""
        tiny = np.finfo(float).tiny
        relative = np.hypot(
            (speed_rpm - self.speed_rpm) / max(abs(self.speed_rpm), tiny),
            (torque - self.torque) / max(abs(self.torque), tiny),
        )
        return np.where(teeth == self.teeth, relative, np.inf)

    @property
    def _mixture(self) -> MixtureLaws | None:
        if self.hypotheses.nuisances is None:
            return None
        return self.hypotheses.mixture_at(self.index_error, least=self.least_mode)

    @property
    def log_prior(self) -> FloatArray:
        """(templates, teeth) logarithm of the prior: even odds of damage and none, all teeth equally likely."""
        return self.local.log_prior


TemplateKey: TypeAlias = tuple[bool, tuple[float, ...], int]
"""A template by whether it is healthy, its severity, and its place among those that have the same."""

_LEAST_MODE = 500.0
"""Greatest norm of modes of nuisances that laws leave out over the tolerance of the signals: a tenth of the noise."""

_NUISANCE_TOLERANCE = 50.0
"""Tolerance of the modes of nuisances over that of the signals: they are no part of any mean."""

_LEAST_SPEEDS = 4
"""Speeds at which an interpolated template exists, or all of fewer."""


def template_keys(point: PointTemplates) -> dict[TemplateKey, int]:
    """Return the places of templates by what makes them the same at several operating points."""
    keys: dict[TemplateKey, int] = {}
    counts: Counter[tuple[bool, tuple[float, ...]]] = Counter()
    for place, (healthy, severity) in enumerate(zip(point.healthy.tolist(), point.severity.tolist(), strict=True)):
        kind = healthy, tuple(round(value, 9) if value == value else np.inf for value in severity)
        keys[*kind, counts[kind]] = place
        counts[kind] += 1
    return keys


def stored_signals(points: Sequence[PointTemplates]) -> tuple[StoredSignals, list[TemplateKey]] | None:
    """Return the signals of points of one tooth count, and their templates; None where they have too few in common."""
    if len({(point.phases.shape[1], point.signals.levels.shape[2]) for point in points}) > 1:
        return None
    places = [template_keys(point) for point in points]
    speeds = {
        key: {point.speed_rpm for point, place in zip(points, places, strict=True) if key in place}
        for key in dict.fromkeys(itertools.chain(*places))
    }
    least = min(_LEAST_SPEEDS, len({point.speed_rpm for point in points}))
    keys = [key for key, some in speeds.items() if len(some) >= least]
    every = all(key in place for place in places for key in keys if key[0])
    if not (every and {key[0] for key in keys} == {True, False}):
        return None
    _, columns = points[0].signals.levels.shape[1:]
    coefficients = np.full((len(points), len(keys), columns, len(points[0].signals.basis)), np.nan)
    for i, (point, place) in enumerate(zip(points, places, strict=True)):
        here = [j for j, key in enumerate(keys) if key in place]
        levels = point.signals.levels[:, [place[keys[j]] for j in here]]
        coefficients[i, here] = point.signals.step * np.moveaxis(levels, 0, -1)
    return StoredSignals(
        speed_rpm=np.array([point.speed_rpm for point in points]),
        torque=np.array([point.torque for point in points]),
        coefficients=coefficients,
        harmonics=points[0].phases.shape[1],
    ), keys


@dataclass(frozen=True, kw_only=True, eq=False)
class NearestNuisances:
    """Modes of nuisances between operating points: those of the nearest one, in proportion to the torque.

    Attributes
    ----------
    points
        The operating points.
    places
        By point, the place of each template among its own; None where it has no such template.
    """

    points: Sequence[PointTemplates]
    places: Sequence[Sequence[int | None]]

    @property
    def least_mode(self) -> float:
        """Greatest norm of modes that laws leave out."""
        return self.points[0].least_mode

    def at(self, speed_rpm: float, torque: float) -> Nuisances | None:
        """Return the nuisances at an operating point; None without any.

        A template that the nearest point lacks has those of the nearest point that has it.
        """
        away = [abs(point.speed_rpm - speed_rpm) for point in self.points]
        order = np.argsort(away, kind="stable").tolist()
        some = []
        for template in range(len(self.places[0])):
            number, place = next((i, at) for i in order if (at := self.places[i][template]) is not None)
            some.append((number, place))
        expanded = {number: self.points[number].nuisances for number, _ in some}
        modes, counts = [], []
        for number, place in some:
            of_point = expanded[number]
            if of_point is None:
                return None
            share = torque / self.points[number].torque if self.points[number].torque else 1.0
            modes.append(of_point.modes[place] * share)
            counts.append(np.array(of_point.counts))
        stacked, most = stacked_modes(modes, counts)
        nearest = expanded[some[0][0]]
        return None if nearest is None else Nuisances(modes=stacked, counts=most, mixture=nearest.mixture)


def nearest_nuisances(points: Sequence[PointTemplates], keys: Sequence[TemplateKey]) -> NearestNuisances:
    """Return the modes of nuisances of interpolated templates, by their keys."""
    places = [template_keys(point) for point in points]
    return NearestNuisances(points=points, places=[[place.get(key) for key in keys] for place in places])


def _signals(laws: Hypotheses, index_error: float) -> FloatArray:
    """(templates, 1 + modes + harmonics, n) signals that make up each template, in the signal's unit."""
    independent = laws.modes * laws.gains[:, None] if laws.response is None else laws.response
    response = index_error * independent
    return np.concatenate([laws.signal[:, :, None], response, laws.harmonic], axis=2).transpose(0, 2, 1)


def template_shares(laws: Hypotheses, weight: pd.Series) -> FloatArray:
    """Return the share of each template among the rows of its kind, healthy or damaged; equal shares without rows.

    Parameters
    ----------
    laws
        Laws of the templates.
    weight
        Number of rows by template.
    """
    rows = weight.reindex(laws.cases["template"]).fillna(0).to_numpy(float, copy=True)
    for some in (laws.healthy, ~laws.healthy):
        rows[some] = rows[some] / rows[some].sum() if rows[some].any() else 1 / some.sum()
    return rows
