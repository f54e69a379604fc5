"""The joint law of several averages of one machine: a common damage, common index errors, independent noise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, NotApplicableError, blocks
from sigdb.database import QUANTITIES
from sigdb.recognition.rows.turned_products import TurnedProducts
from sigdb.recognition.templates.hypotheses import Hypotheses

DamageKey: TypeAlias = tuple[object, ...]
"""A template by its damage, whatever its operating point."""

_NUMBERS_AT_ONCE = 2_000_000
"""Inner products in memory at once."""


def damage_keys(cases: pd.DataFrame, apart: Sequence[str] = ()) -> list[DamageKey]:
    """Return a key of each template that is the same at all operating points.

    Parameters
    ----------
    cases
        Cases of templates, as of :class:`Hypotheses`.
    apart
        Further columns that differ between the averages of one machine.
    """
    operating = {name for name in cases if str(name).startswith("operating.")}
    left_out = {"template", "speed_rpm", "torque", *operating, *apart}
    kept = cases[sorted(str(name) for name in cases if name not in left_out)]
    return [
        tuple(None if pd.isna(value) else round(value, 12) if isinstance(value, float) else value for value in row)
        for row in kept.itertuples(index=False, name=None)
    ]


NOT_TURNED = (
    "the rig has several meshes, so that templates are not to be turned; averages are fused for rigs with one mesh"
)
"""Why averages of a train are not fused."""

NOT_FUSED = (
    "averages whose law has nuisances are not fused, since it is not known which of these they share; leave [nuisance] "
    "out of the recipe"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class AverageLaw:
    """The law of one average under templates, whose index errors are known one by one.

    Attributes
    ----------
    teeth
        Tooth count of the damaged gear.
    keys
        (templates,) damage of each template; those of the same damage at other operating points have the same.
    healthy
        (templates,) whether a template is of a healthy gear.
    severity
        (templates, quantities) severities; nan for a pattern, and where the damage does not have a quantity.
    signal, response, harmonic, phases
        As of :class:`Hypotheses`; the columns of ``response`` stand for the same index errors in all laws.
    quantities
        Quantities of the severities.
    """

    teeth: int
    keys: tuple[DamageKey, ...]
    healthy: BoolArray
    severity: FloatArray
    signal: FloatArray
    response: FloatArray
    harmonic: FloatArray
    phases: FloatArray
    quantities: tuple[str, ...] = QUANTITIES

    @classmethod
    def of(cls, law: Hypotheses) -> Self:
        """Return the law of the hypotheses of a database.

        Raises
        ------
        NotApplicableError
            If they do not say how index errors act, or have nuisances.
        """
        if law.untied:
            raise NotApplicableError(NOT_TURNED)
        if law.nuisances is not None:
            raise NotApplicableError(NOT_FUSED)
        if law.response is None:
            raise NotApplicableError("the templates do not say how index errors act; make their database again")
        return cls(
            teeth=law.teeth,
            keys=tuple(damage_keys(law.cases)),
            healthy=law.healthy,
            severity=law.cases.reindex(columns=list(QUANTITIES)).to_numpy(float),
            signal=law.signal,
            response=law.response,
            harmonic=law.harmonic,
            phases=law.phases,
        )

    def only(self, places: Sequence[int]) -> Self:
        """Return the law of some of the templates."""
        at = list(places)
        if at == list(range(len(self.keys))):
            return self
        arrays = ("healthy", "severity", "signal", "response", "harmonic", "phases")
        some = {name: getattr(self, name)[at] for name in arrays}
        return replace(self, keys=tuple(self.keys[i] for i in at), **some)

    @property
    def samples(self) -> int:
        """Samples of an average."""
        return self.signal.shape[1]

    @cached_property
    def carriers(self) -> FloatArray:
        """(templates, 1 + h, n) signals whose sum, times :attr:`weights`, is the mean."""
        return np.concatenate([self.signal[:, None], self.harmonic.transpose(0, 2, 1)], axis=1)

    @cached_property
    def weights(self) -> FloatArray:
        """(templates, 1 + h, teeth) of the carriers."""
        return np.concatenate([np.ones((len(self.signal), 1, self.teeth)), self.phases], axis=1)

    @cached_property
    def _products(self) -> TurnedProducts:
        columns = np.concatenate([self.response.transpose(0, 2, 1), self.carriers], axis=1)
        return TurnedProducts(columns.reshape(-1, columns.shape[2]), self.teeth)

    @cached_property
    def gram(self) -> FloatArray:
        """(templates, r, r) products of the responses."""
        return self.response.transpose(0, 2, 1) @ self.response

    @cached_property
    def _of_means(self) -> tuple[FloatArray, FloatArray]:
        """(teeth, templates) squared norms of the means, and (teeth, templates, r) their products with responses."""
        weights = self.weights.transpose(2, 0, 1)
        gram = self.carriers @ self.carriers.transpose(0, 2, 1)
        square = np.einsum("tkb,kbc,tkc->tk", weights, gram, weights, optimize=True)
        along = np.einsum("tkb,kbn,knr->tkr", weights, self.carriers, self.response, optimize=True)
        return square, along

    def compare(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the squared residuals (teeth, rows, templates), and their products with the responses (..., r)."""
        r = self.response.shape[2]
        products = self._products(x).reshape(self.teeth, len(x), len(self.carriers), -1)
        square, along = self._of_means
        with_means = np.einsum("tmkb,kbt->tmk", products[..., r:], self.weights)
        residual = (x**2).sum(axis=1)[:, None] - 2 * with_means + square[:, None]
        return residual, products[..., :r] - along[:, None]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLaw:
    """The law of several averages of one machine, by several sensors, at operating points, in recordings.

    Under template k turned by t teeth the averages x_i have independent noise and one and the same specimen::

        x_i turned back = s_ikt + index_error_i Y_ik C^(1/2) z + noise_i w_i,   z and w_i standard normal

    So with ``b_i = index_error_i Y_ik C^(1/2) / noise_i`` and residuals ``r_i = (x_i turned back - s_ikt) / noise_i``::

        -2 log p = sum_i n_i log(2 pi noise_i^2) + log det A + sum_i |r_i|^2 - v' A^-1 v,
        A = I + sum_i b_i' b_i,   v = sum_i b_i' r_i

    The sum of the log-likelihoods of each average alone would count the specimen once for each average.

    Attributes
    ----------
    laws
        Law of each average, all with the same templates in the same order.
    """

    laws: tuple[AverageLaw, ...]

    @classmethod
    def of(cls, laws: Sequence[AverageLaw]) -> Self:
        """Return the joint law of averages with the templates that all their laws have.

        Parameters
        ----------
        laws
            Law of each average; the same object for averages of the same law.

        Raises
        ------
        InputError
            If the averages are of gears of different tooth counts.
        NotApplicableError
            If the laws have no healthy or no damaged template in common.
        """
        if len({law.teeth for law in laws}) != 1:
            raise InputError("the averages of one machine must be of one gear; their tooth counts differ")
        places = {id(law): {key: i for i, key in enumerate(law.keys)} for law in laws}
        common = [key for key in laws[0].keys if all(key in place for place in places.values())]
        aligned = {id(law): law.only([places[id(law)][key] for key in common]) for law in laws}
        joint = cls(laws=tuple(aligned[id(law)] for law in laws))
        if not len(common) or joint.healthy.all() or not joint.healthy.any():
            raise NotApplicableError(
                "the averages have no healthy or no damaged template in common; give averages whose templates have the "
                "same damage"
            )
        return joint

    @property
    def teeth(self) -> int:
        """Tooth count of the damaged gear."""
        return self.laws[0].teeth

    @property
    def keys(self) -> tuple[DamageKey, ...]:
        """(templates,) damage of each template."""
        return self.laws[0].keys

    @property
    def severity(self) -> FloatArray:
        """(templates, 3) severities, as of :class:`AverageLaw`."""
        return self.laws[0].severity

    @property
    def healthy(self) -> BoolArray:
        """(templates,) whether a template is of a healthy gear."""
        return self.laws[0].healthy

    def log_likelihood(self, averages: Sequence[FloatArray], *, noise: ArrayLike, index_error: ArrayLike) -> FloatArray:
        """Logarithm of the joint density of the averages under each template turned to each tooth.

        Parameters
        ----------
        averages
            (machines, n) averages from the tacho mark for each law, in the unit of its signal.
        noise
            Standard deviation of the noise of each average, (machines, averages); or one or (averages,) for all.
        index_error
            Size of the index errors in each average, m; as ``noise``.

        Returns
        -------
        ndarray, (machines, templates, teeth)
            As of :meth:`Hypotheses.log_likelihood`.

        Raises
        ------
        InputError
            If there are not as many averages as laws, one has another length than its law, or the noise is not above 0.
        """
        machines = len(averages[0]) if averages else 0
        shape = machines, len(self.laws)
        noise, index_error = (np.broadcast_to(np.asarray(value, float), shape) for value in (noise, index_error))
        self._check(averages, noise)
        templates, r = self.laws[0].response.shape[::2]
        likelihood = np.empty((machines, templates, self.teeth))
        at_once = max(1, _NUMBERS_AT_ONCE // (self.teeth * templates * (r + 1)))
        for some in blocks(machines, at_once):
            x = [np.asarray(each[some], float) for each in averages]
            likelihood[some] = self._log_likelihood(x, noise[some], index_error[some])
        likelihood[:, self.healthy] = likelihood[:, self.healthy, :1]
        return likelihood

    def distances(self, templates: IntArray, *, noise: ArrayLike, index_error: ArrayLike) -> FloatArray:
        """Return ``(s_j - s_k)' S^-1 (s_j - s_k)`` of the pairs j < k of some templates, (pairs,), for one machine.

        The means are those of all averages, without harmonic signals; S^-1 is the mean of those of both templates.

        Parameters
        ----------
        templates
            Places of the templates.
        noise, index_error
            As of :meth:`log_likelihood`, (averages,) or one for all.
        """
        noise, index_error = (
            np.broadcast_to(np.asarray(value, float), len(self.laws)) for value in (noise, index_error)
        )
        r, count = self.laws[0].response.shape[2], len(templates)
        spread = np.broadcast_to(np.eye(r), (count, r, r)).copy()
        square, along = np.zeros((count, count)), np.zeros((count, count, r))
        for law, sigma, size in zip(self.laws, noise, index_error, strict=True):
            between = law.signal[templates, None] - law.signal[templates]
            response = law.response[templates] * (size / sigma)
            square += (between**2).sum(axis=2) / sigma**2
            along += between @ response / sigma
            spread += law.gram[templates] * (size / sigma) ** 2
        explained = np.einsum("jkr,jrk->jk", along, np.linalg.solve(spread, along.swapaxes(1, 2)))
        whole = square - (explained + explained.T) / 2
        return np.asarray(whole[np.triu_indices(count, 1)])

    def _check(self, averages: Sequence[FloatArray], noise: FloatArray) -> None:
        if len(averages) != len(self.laws):
            raise InputError(f"{len(averages)} averages are given for {len(self.laws)} laws; give one for each")
        for i, (x, law) in enumerate(zip(averages, self.laws, strict=True)):
            if x.shape != (len(averages[0]), law.samples):
                expected = f"{len(averages[0])} rows of {law.samples} samples"
                raise InputError(f"average {i} has the shape {x.shape}; give {expected}")
        if not (noise > 0).all():
            raise InputError(f"noise = {noise.min():g} must be above 0: without noise there is no density")

    def _log_likelihood(self, averages: Sequence[FloatArray], noise: FloatArray, index_error: FloatArray) -> FloatArray:
        templates, r = self.laws[0].response.shape[::2]
        alike, of_row = np.unique(np.hstack([noise, index_error]), axis=0, return_inverse=True)
        spread = np.broadcast_to(np.eye(r), (len(alike), templates, r, r)).copy()
        residual = np.zeros((self.teeth, len(noise), templates))
        along = np.zeros((*residual.shape, r))
        for i, (law, x) in enumerate(zip(self.laws, averages, strict=True)):
            sigma, size = noise[:, i, None], index_error[:, i, None]
            square, product = law.compare(x)
            residual += square / sigma**2
            along += product * (size / sigma**2)[..., None]
            ratio = alike[:, len(self.laws) + i] / alike[:, i]
            spread += ratio[:, None, None, None] ** 2 * law.gram
        factor = np.linalg.inv(np.linalg.cholesky(spread))
        log_det = -2 * np.log(np.diagonal(factor, axis1=2, axis2=3)).sum(axis=2)
        # (machines, templates, r, r) times (machines, templates, r, teeth)
        explained = (np.matmul(factor[of_row.ravel()], along.transpose(1, 2, 3, 0)) ** 2).sum(axis=2)
        samples = np.array([law.samples for law in self.laws])
        constant = np.log(2 * np.pi * noise**2) @ samples
        chi2 = residual.transpose(1, 2, 0) - explained
        return np.asarray(-0.5 * (constant[:, None, None] + log_det[of_row.ravel(), :, None] + chi2))

    def draw(
        self,
        stream: np.random.Generator,
        template: IntArray,
        tooth: IntArray,
        *,
        noise: ArrayLike,
        index_error: ArrayLike,
    ) -> list[FloatArray]:
        """Draw averages of machines from the law, each machine with a specimen of its own.

        Parameters
        ----------
        stream
            Where they are drawn from.
        template
            (machines,) places of their templates.
        tooth
            (machines,) first damaged tooth; it does not matter where the template is of a healthy gear.
        noise, index_error
            As in :meth:`log_likelihood`.

        Returns
        -------
        list of ndarray, (machines, n)
            For each law.
        """
        shape = len(template), len(self.laws)
        noise, index_error = (np.broadcast_to(np.asarray(value, float), shape) for value in (noise, index_error))
        z = stream.standard_normal((len(template), self.laws[0].response.shape[2]))
        turn = np.where(self.healthy[template], 0, np.asarray(tooth) - 1)
        averages = []
        for i, each in enumerate(self.laws):
            mean = np.einsum("mb,mbn->mn", each.weights[template, :, turn], each.carriers[template])
            clean = mean + index_error[:, i, None] * np.einsum("mnr,mr->mn", each.response[template], z)
            n = clean.shape[1]
            places = (np.arange(n) - (turn * (n // self.teeth))[:, None]) % n
            white = noise[:, i, None] * stream.standard_normal(clean.shape)
            averages.append(np.take_along_axis(clean, places, axis=1) + white)
        return averages
