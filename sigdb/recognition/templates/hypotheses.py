"""Hypotheses: the normal law of an average under each template, and how likely an average is under each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray, IntArray, plain_array, validated
from sigdb.database import Database, Template, mate_teeth, rig_of, stored_templates
from sigdb.measurement import (
    NuisanceMixture,
    NuisanceSettings,
    independent_responses,
    index_error_covariance,
    late,
)
from sigdb.recognition.laws.mixture_laws import MixtureLaws, Nuisances, stacked_modes
from sigdb.recognition.laws.turned_laws import TurnedLaws, UntiedLaws
from sigdb.recognition.noise.noise_shape import whitened


@dataclass(frozen=True, kw_only=True, eq=False)
class Hypotheses:
    """The laws of an average at one operating point, for one sensor and one tooth count of the damaged gear.

    Under template k turned by t teeth the average of a gear with unknown index errors is normal::

        x turned back ~ N(s_kt, noise^2 I + index_error^2 U_k diag(d_k) U_k'),   s_kt = y_k + H_k phi_t,

    y_k the nominal clean average, H_k that under unbalance, run-out and a fluctuating load, whose phases phi_t are
    fixed to the shaft. U_k diag(d_k) U_k' = Y_k C Y_k' is the singular value decomposition of the response to index
    errors Y_k C^(1/2), C their covariance (:func:`sigdb.measurement.index_error_covariance`). C is circulant, so
    turning the hypothesis is turning x. A healthy gear has no turn. With nuisances the law is a mixture of such laws
    (:class:`~sigdb.recognition.laws.mixture_laws.MixtureLaws`).

    Attributes
    ----------
    teeth
        Tooth count of the damaged gear.
    cases
        One row a template: ``template`` (its number), ``tooth`` (0 for a healthy gear, else 1) and its case.
    signal
        (templates, n) y_k, in the sensor's unit.
    modes
        (templates, n, r) U_k, orthonormal columns.
    gains
        (templates, r) square roots of d_k: rms of each mode's amplitude per index error, unit of the signal per m.
    harmonic
        (templates, n, h) H_k, cosine and sine of each order.
    phases
        (templates, h, teeth) phi_t.
    reference_variance
        (templates,) variance of the healthy clean average, which ``snr_db`` refers to.
    turn_invariant
        Whether the law of a healthy gear is the same from every tooth but for rounding: its likelihood is then the mean
        over the turns, which turning x does not change.
    response
        (templates, n, r) Y_k C^(1/2), whose columns stand for the same index errors at all operating points; None where
        it is not known.
    nuisances
        The nuisances; None without any.
    untied
        Whether each template is of damage at the tooth of its case and of no other, as in a rig with several meshes,
        where damage at another tooth is not a turn of it. The likelihood at other teeth is then -inf.
    """

    teeth: int
    cases: pd.DataFrame
    signal: FloatArray
    modes: FloatArray
    gains: FloatArray
    harmonic: FloatArray
    phases: FloatArray
    reference_variance: FloatArray
    turn_invariant: bool = False
    response: FloatArray | None = None
    nuisances: Nuisances | None = None
    untied: bool = False

    @classmethod
    def of(
        cls,
        database: Database,
        *,
        speed_rpm: float,
        torque: float,
        teeth: int,
        sensor: str | None = None,
        where: str | None = None,
        untied: bool = False,
    ) -> Self:
        """The hypotheses of a database's templates at one operating point.

        Templates without a result, and those whose mesh loses contact, whose response to index errors is not linear,
        are left out. An average does not show the other swept parameters of the rig, apart from the operating point and
        the tooth count: the templates of all their values are hypotheses.

        Parameters
        ----------
        database
            A database with templates.
        speed_rpm, torque, teeth
            Operating point, and tooth count of the damaged gear, as the database has them.
        sensor
            A stored sensor; the first one if left out.
        where
            Only these templates: one SQL expression on their columns.
        untied
            Whether those of a rig that does not turn exactly serve too; they are not turned.

        Raises
        ------
        InputError
            If there is no such template, or the rig does not turn exactly (more than one mesh).
        """
        templates = stored_templates(
            database, speed_rpm=speed_rpm, torque=torque, teeth=teeth, sensor=sensor, where=where, untied=untied
        )
        mates = [mate_teeth(database, template) for template in templates]
        runout = float(database.manifest.resolved["sweep"].get("runout", 0.0))
        laws = cls.from_templates(templates, teeth=teeth, mate_teeth=mates, runout=runout)
        rig, gear = rig_of(database)
        settings = validated(
            NuisanceSettings, database.manifest.resolved.get("nuisance", {}), owner=str(database.store)
        )
        nuisances = laws.nuisances
        if nuisances is None and settings.mark:  # the place of the mark has no modes
            none = np.empty((*laws.signal.shape, 0))
            nuisances = Nuisances(modes=none, counts=(), mixture=NuisanceMixture.of(settings))
        elif nuisances is not None and len(nuisances.counts) == len(settings.each):
            nuisances = replace(nuisances, mixture=NuisanceMixture.of(settings))
        return replace(laws, untied=not rig.turns_exactly(gear), nuisances=nuisances)

    @classmethod
    def from_templates(
        cls, templates: Sequence[Template], *, teeth: int, mate_teeth: ArrayLike, runout: float = 0.0
    ) -> Self:
        """The hypotheses of some templates of one tooth count, for the first of their sensors.

        Parameters
        ----------
        templates
            The templates.
        teeth
            Tooth count of the damaged gear.
        mate_teeth
            Tooth count of its mate: one for all, or (templates,).
        runout
            Amplitude of the slow orders of the index errors, over ``index_error``.

        Notes
        -----
        If the templates have modes of nuisances, each machine has them all.
        """
        mates = np.broadcast_to(np.asarray(mate_teeth, int), len(templates))
        covariances = [index_error_covariance(teeth, int(mate), runout=runout) for mate in mates]
        response = np.stack(
            [
                independent_responses(template.specimen_response[0], covariance)
                for template, covariance in zip(templates, covariances, strict=True)
            ]
        )
        modes, gains, _ = np.linalg.svd(response, full_matrices=False)
        harmonic = [template.harmonic_response[0].reshape(template.signals.shape[1], -1) for template in templates]
        widest = max(columns.shape[1] for columns in harmonic)
        return cls(
            teeth=teeth,
            cases=pd.DataFrame([template.case for template in templates]),
            signal=np.stack([template.signals[0] for template in templates]),
            modes=modes,
            gains=gains,
            harmonic=np.stack([_padded(columns, 1, widest) for columns in harmonic]),
            phases=np.stack([_padded(_phases(template.orders, teeth), 0, widest) for template in templates]),
            reference_variance=np.array([template.reference_variance[0] for template in templates]),
            response=response,
            nuisances=_nuisances(templates),
        )

    @property
    def healthy(self) -> BoolArray:
        """(templates,) whether a template is of a healthy gear."""
        return self.cases["tooth"].to_numpy() == 0

    def only(self, places: IntArray) -> Self:
        """Some of the hypotheses, by their places in ``cases``."""
        arrays = ("signal", "modes", "gains", "harmonic", "phases", "reference_variance")
        some = {name: getattr(self, name)[places] for name in arrays}
        some["response"] = None if self.response is None else self.response[places]
        some["nuisances"] = None if self.nuisances is None else self.nuisances.only(places)
        return replace(self, cases=self.cases.iloc[places].reset_index(drop=True), **some)

    def whitened(self, shape: FloatArray) -> Self:
        """The laws of averages that are divided by a deviation by order, (n / 2 + 1,); kept for the next time."""
        key = np.ascontiguousarray(shape).tobytes()
        if key not in self._whitened:
            self._whitened[key] = self._divided(shape)
        return self._whitened[key]

    @cached_property
    def _whitened(self) -> dict[bytes, Self]:
        return {}

    def _divided(self, shape: FloatArray) -> Self:
        """Return the laws of averages that are divided by a deviation by order."""

        def of(columns: FloatArray) -> FloatArray:
            return whitened(columns.transpose(0, 2, 1), shape).transpose(0, 2, 1)

        modes, gains, _ = np.linalg.svd(of(self.modes * self.gains[:, None]), full_matrices=False)
        return replace(
            self,
            signal=whitened(self.signal, shape),
            modes=modes,
            gains=gains,
            harmonic=of(self.harmonic),
            response=None if self.response is None else of(self.response),
            nuisances=None if self.nuisances is None else self.nuisances.whitened(shape),
        )

    def log_likelihood(self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike) -> FloatArray:
        """Logarithm of the density of averages under each template turned to each tooth.

        With r = x turned back - s_kt, by the identities of Woodbury and Sylvester::

            -2 log p = n log(2 pi noise^2) + sum log(1 + rho d) + (|r|^2 - sum g (u' r)^2) / noise^2,

        rho = (index_error / noise)^2, g = rho d / (1 + rho d).

        Parameters
        ----------
        x
            (rows, n) averages from the tacho mark, unit of the signal.
        noise
            Standard deviation of the average's noise, not of one revolution's; a number, or (rows,).
        index_error
            Size of the index errors, m; a number, or (rows,). 0 is the nominal specimen.

        Returns
        -------
        ndarray, (rows, templates, teeth)
            float64; entry t - 1 of the last axis is the damage at tooth t, and the same for all t for a healthy gear.

        Raises
        ------
        InputError
            If the averages are not of the templates' length, or the noise is not above 0.
        """
        if self.nuisances is None:
            return self.turned.log_likelihood(x, noise=noise, index_error=index_error)
        x = plain_array("log_likelihood", "x", x, float)
        noise, index_error = (np.broadcast_to(np.asarray(value, float), len(x)) for value in (noise, index_error))
        likelihood = np.empty((len(x), len(self.signal), self.teeth))
        for size, at in _equal(index_error):
            likelihood[at] = self.mixture_at(size).log_likelihood(x[at], noise=noise[at], index_error=size)
        return likelihood

    def chi2(self, log_likelihood: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike) -> FloatArray:
        """Squared residual of averages under each hypothesis without nuisances; see :meth:`TurnedLaws.chi2`."""
        likelihood = plain_array("chi2", "log_likelihood", log_likelihood, float)
        return self.turned.chi2(likelihood, noise=noise, index_error=index_error)

    def mixture_at(self, index_error: float, *, least: float = 0.0) -> MixtureLaws:
        """Return the laws with nuisances for one size of the index errors, m, without modes of at most some norm."""
        key = index_error, least
        if key not in self._mixtures:
            if self.nuisances is None:
                raise TypeError("laws without nuisances are no mixture")
            independent = self.modes * self.gains[:, None] if self.response is None else self.response
            errors = index_error * independent
            self._mixtures[key] = MixtureLaws.of(self.turned, errors, self.nuisances, self.signal, least=least)
        return self._mixtures[key]

    @cached_property
    def _mixtures(self) -> dict[tuple[float, float], MixtureLaws]:
        return {}

    @cached_property
    def turned(self) -> TurnedLaws:
        """The same laws without nuisances, for likelihoods."""
        turns = 1 if self.untied else self.teeth
        carriers = np.concatenate([self.signal[:, :, None], self.harmonic], axis=2).transpose(0, 2, 1)
        first = np.ones((len(self.signal), 1, turns if self.harmonic.shape[2] else 1))
        laws = TurnedLaws(
            teeth=turns,
            healthy=self.healthy,
            modes=self.modes,
            gains=self.gains,
            carriers=carriers[:, None],
            phases=np.concatenate([first, self.phases[:, :, : first.shape[2]]], axis=1),
            turn_invariant=self.turn_invariant,
        )
        if not self.untied:
            return laws
        return UntiedLaws(**vars(laws), tooth=self.cases["tooth"].to_numpy(int), of_teeth=self.teeth)

    @cached_property
    def _means(self) -> FloatArray:
        """(teeth, templates, n) s_kt, as they lie turned back."""
        return self.signal + np.einsum("knh,kht->tkn", self.harmonic, self.phases)

    def draw(
        self,
        stream: np.random.Generator,
        template: IntArray,
        tooth: IntArray,
        *,
        noise: ArrayLike,
        index_error: ArrayLike,
    ) -> FloatArray:
        """Draw averages from the law, each with a specimen and noise of its own.

        Parameters
        ----------
        stream
            Where they are drawn from.
        template
            (rows,) places in ``cases``.
        tooth
            (rows,) first damaged tooth; it does not matter where the template is of a healthy gear, or untied.
        noise, index_error
            As in :meth:`log_likelihood`.

        Returns
        -------
        ndarray, (rows, n)
        """
        tooth = np.ones(len(template), int) if self.untied else tooth
        noise, index_error = (
            np.broadcast_to(np.asarray(value, float), len(template)) for value in (noise, index_error)
        )
        x = noise[:, None] * stream.standard_normal((len(template), self.signal.shape[1]))
        amplitude = index_error[:, None] * stream.standard_normal((len(template), self.gains.shape[1]))
        amounts, passes = self._drawn_nuisances(stream, len(template))
        step = self.signal.shape[1] // self.teeth
        for k, t, at in self._alike(template, tooth):
            clean = self._means[t, k] + (amplitude[at] * self.gains[k]) @ self.modes[k].T
            if self.nuisances is not None:
                clean = late(clean + amounts[at] @ self.nuisances.modes[k].T, passes[at], self.teeth)
            x[at] += np.roll(clean, t * step, axis=1)
        return x

    def _drawn_nuisances(self, stream: np.random.Generator, rows: int) -> tuple[FloatArray, FloatArray]:
        """Return the amounts (rows, q) of the modes of nuisances, and by how many passes the mark is late, (rows,)."""
        if self.nuisances is None:
            return np.empty((rows, 0)), np.zeros(rows)
        part, passes = self.nuisances.mixture.draw(stream, rows)
        factors = self.nuisances.mixture.factors(self.nuisances.counts)[part]
        return factors * stream.standard_normal(factors.shape), passes

    def _alike(self, template: IntArray, tooth: IntArray) -> Iterator[tuple[int, int, IntArray]]:
        """Templates and turns with the places of their rows."""
        turn = np.where(self.healthy[template], 0, np.asarray(tooth) - 1)
        code = np.asarray(template) * self.teeth + turn
        for value in np.unique(code):
            yield *divmod(int(value), self.teeth), np.flatnonzero(code == value)


def _equal(values: FloatArray) -> Iterator[tuple[float, IntArray]]:
    """Yield the different values with the places that have them."""
    for value in np.unique(values).tolist():
        yield value, np.flatnonzero(values == value)


def _phases(orders: FloatArray, teeth: int) -> FloatArray:
    """(2 orders, teeth) cosine and sine of harmonic excitations, seen from a damage at each tooth."""
    angle = np.outer(orders, np.arange(teeth)) * 2 * np.pi / teeth
    return np.stack([np.cos(angle), np.sin(angle)], axis=1).reshape(-1, teeth)


def _nuisances(templates: Sequence[Template]) -> Nuisances | None:
    """Return the nuisances of templates, all of which each machine has; None without any."""
    if not all(template.nuisance_modes.shape[-1] or len(template.nuisance_counts) for template in templates):
        return None
    counts = [
        template.nuisance_counts if len(template.nuisance_counts) else np.array([template.nuisance_modes.shape[2]])
        for template in templates
    ]
    modes, most = stacked_modes([template.nuisance_modes[0] for template in templates], counts)
    return Nuisances(modes=modes, counts=most, mixture=NuisanceMixture.certain(len(most)))


def _padded(array: FloatArray, axis: int, width: int) -> FloatArray:
    """Zeros behind an array (a, b) along an axis."""
    more = [(0, 0), (0, 0)]
    more[axis] = (0, width - array.shape[axis])
    return np.pad(array, more)
