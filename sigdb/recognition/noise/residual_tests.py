"""Tests of the residual of the most likely template: for more damage, for damage at another tooth, and for the rest."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.laws.turned_laws import TurnedLaws
from sigdb.recognition.rows.turned_products import TurnedProducts

_LEAST_DIFFERENCE = 1e-3
"""Least size of a difference of templates, over the greatest, that a residual is freed of."""

_NEIGHBOURS = 2
"""Teeth on each side of a damaged one whose damage is much like its own."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ResidualTests:
    """Score tests of averages against the normal law ``x turned back ~ N(s, S)`` of the most likely template.

    With the change c of the signal by what is tested for, ``c' S^-1 (x - s) / sqrt(c' S^-1 c)`` is a standard normal
    number under that law. The residual r leaves ``S^(-1/2) r``, white noise of variance 1. With the modes U and d as in
    :meth:`TurnedLaws.log_likelihood`::

        S^-1 = (I - U diag(rho d / (1 + rho d)) U') / noise^2,
        S^(-1/2) = (I - U diag(1 - 1 / sqrt(1 + rho d)) U') / noise.

    All tests follow from the products of the residual with the modes and with all changes, which are few.

    Attributes
    ----------
    laws
        Laws of the templates.
    severity
        (templates, quantities) severities, see :class:`PointTemplates`.
    outward
        (templates, k, n) changes of the signal beyond the templates, of any size, 0 where there are none; see
        :func:`~sigdb.recognition.templates.outward.outward_changes`.
    change
        (templates, n) change of the signal by the damage, of any size.
    between
        Whether severities lie between those of the templates. The residual of a damaged one is then freed of what
        another severity explains best. With the differences D of the templates of as many damaged teeth it is ``r - D
        (D' S^-1 D)^-1 D' S^-1 r``.
    """

    laws: TurnedLaws
    severity: FloatArray
    outward: FloatArray
    change: FloatArray
    between: bool

    @property
    def other_teeth(self) -> int:
        """Number of tests for damage at another tooth; none where templates are not turned."""
        return self._far * int((~self.laws.healthy).sum())

    @property
    def _far(self) -> int:
        """Number of teeth far from a damaged one; none where templates are not turned."""
        return max(0, self.laws.teeth - 2 * _NEIGHBOURS - 1) if self.laws.teeth == self.laws.gear_teeth else 0

    def results(
        self,
        x: FloatArray,
        best: IntArray,
        *,
        noise: FloatArray,
        index_error: float,
        coefficients: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return what is left of the residuals, the score of more damage, and that of damage at another tooth.

        Parameters
        ----------
        x
            (rows, n) averages.
        best
            (rows, 2) the most likely template of each, and its turn in teeth.
        noise, index_error, coefficients
            As for :meth:`TurnedLaws.log_likelihood`; noise (rows,).

        Returns
        -------
        white
            (rows, n) float32, ``S^(-1/2) r``, turned back; in single precision, as averages are stored.
        more
            (rows,) greatest score beyond the most severe templates; -inf where the most likely template is not one.
        others
            (rows,) greatest score of damage at another tooth. Teeth within two of the damaged one do not count. -inf
            where the most likely template is healthy, or templates are not turned.
        """
        laws = self.laws
        back = _turned_back(x, best[:, 1], laws.teeth)
        elsewhere = self._elsewhere(back, best[:, 0])
        size = np.broadcast_to(laws.size(index_error), len(x))
        white, more, others = np.empty(x.shape, np.float32), np.empty(len(x)), np.empty(len(x))
        for template in np.unique(best[:, 0]).tolist():
            at = np.flatnonzero(best[:, 0] == template)
            weights = laws.weights_of(template, best[at, 1], None if coefficients is None else coefficients[at])
            law = _Law(noise=noise[at], d=(laws.gains[template] * (size[at] / noise[at])[:, None]) ** 2)
            white[at], more[at], others[at] = self._of(template).results(back[at], elsewhere[at], weights, law)
        return white, more, others

    def _elsewhere(self, back: FloatArray, template: IntArray) -> FloatArray:
        """Return the products of averages with the changes at other teeth, (rows, tests); 0 for healthy templates."""
        products = np.zeros((len(back), self.other_teeth))
        damaged = np.flatnonzero(~self.laws.healthy[template])
        products[damaged] = self._turned(back[damaged])
        return products

    def _turned(self, x: FloatArray) -> FloatArray:
        """Return the products of x (rows, n) with the changes at other teeth, (rows, tests)."""
        if not (self.other_teeth and len(x)):
            return np.zeros((len(x), self.other_teeth))
        far = self._products(x)[_NEIGHBOURS + 1 : _NEIGHBOURS + 1 + self._far]
        return np.asarray(far.transpose(1, 0, 2).reshape(len(x), -1))

    @cached_property
    def _products(self) -> TurnedProducts:
        return TurnedProducts(self.change[~self.laws.healthy], self.laws.teeth)

    def _of(self, template: int) -> "_TemplateTests":
        """Return the tests of a template."""
        if template not in self._kept:
            self._kept[template] = self._tests(template)
        return self._kept[template]

    @cached_property
    def _kept(self) -> "dict[int, _TemplateTests]":
        return {}

    def _tests(self, template: int) -> "_TemplateTests":
        laws, healthy = self.laws, self.laws.healthy[template]
        nothing, outward = np.zeros((0, laws.samples)), self.outward[template]
        square = np.tile((self.change[~laws.healthy] ** 2).sum(axis=1), self._far)
        return _TemplateTests(
            laws=laws,
            template=template,
            severities=self._other_severities(template) if self.between and not healthy else nothing,
            outward=outward[outward.any(axis=1)],
            square=square[:0] if healthy else square,
            elsewhere=self._turned,
        )

    def _other_severities(self, template: int) -> FloatArray:
        """Return a basis (b, n) of the differences of templates of as many damaged teeth from one."""
        alike = self.severity[:, -1] == self.severity[template, -1]
        differences = self.change[alike | self.laws.healthy] - self.change[template]
        _, sizes, basis = np.linalg.svd(differences, full_matrices=False)
        return np.asarray(basis[sizes > _LEAST_DIFFERENCE * sizes[0]])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Law:
    """Noise (rows,) of averages, and variance d (rows, r) of the modes of their template over that of the noise."""

    noise: FloatArray
    d: FloatArray

    @cached_property
    def shrunk(self) -> FloatArray:
        """(rows, r) ``d / (1 + d)``."""
        return self.d / (1 + self.d)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Changes:
    """Changes c of the signal that averages are tested for.

    Attributes
    ----------
    square
        (k,) ``c' c``.
    along
        (k, r) ``c' U``.
    """

    square: FloatArray
    along: FloatArray

    def score(self, products: FloatArray, amplitude: FloatArray, law: _Law) -> FloatArray:
        """Return the greatest score (rows,), -inf without changes, from ``c' r`` (rows, k) and ``U' r`` (rows, r)."""
        square = self.square - law.shrunk @ (self.along**2).T
        product = products - (amplitude * law.shrunk) @ self.along.T
        score = product / np.sqrt(np.maximum(square, np.finfo(float).tiny))
        return np.asarray(score.max(axis=1, initial=-np.inf) / law.noise)


class _TemplateTests:
    """Tests of averages whose most likely template is the same.

    Parameters
    ----------
    laws, template
        Laws of the templates, and the template.
    severities, outward
        (b, n) D', orthonormal, and (k, n) changes beyond the template.
    square
        (tests,) squared norms of the changes at other teeth; empty where these are not tested.
    elsewhere
        Returns the products of signals (rows, n) with the changes at other teeth, (rows, tests).
    """

    def __init__(
        self,
        *,
        laws: TurnedLaws,
        template: int,
        severities: FloatArray,
        outward: FloatArray,
        square: FloatArray,
        elsewhere: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._laws, self._template = laws, template
        self._severities, self._beyond = severities, outward
        carriers, modes = laws.carriers_of(template), laws.modes_of(template)
        self._along = severities @ modes
        self._outward = _Changes(square=(outward**2).sum(axis=1), along=outward @ modes)
        self._elsewhere = _Changes(square=square, along=elsewhere(modes.T)[:, : len(square)].T)
        self._explained_elsewhere = elsewhere(np.concatenate([carriers, severities]))[:, : len(square)]

    def results(
        self, back: FloatArray, elsewhere: FloatArray, weights: FloatArray, law: _Law
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the results of averages.

        Parameters
        ----------
        back
            (rows, n) averages, turned back.
        elsewhere
            (rows, tests) their products with the changes at other teeth.
        weights
            (rows, a b) weights of the carriers.
        law
            Noise and variances.
        """
        laws, template = self._laws, self._template
        residual = back - weights @ laws.carriers_of(template)
        amplitude = laws.along_modes(template, residual)
        more = self._outward.score(residual @ self._beyond.T, amplitude, law)
        amounts = self._amounts(residual @ self._severities.T, amplitude, law)
        amplitude = amplitude - amounts @ self._along
        explained = laws.sum_of_modes(template, amplitude * (1 - 1 / np.sqrt(1 + law.d)))
        white = (residual - explained - amounts @ self._severities) / law.noise[:, None]
        elsewhere = elsewhere[:, : len(self._elsewhere.square)]
        elsewhere = elsewhere - np.hstack([weights, amounts]) @ self._explained_elsewhere
        return white, more, self._elsewhere.score(elsewhere, amplitude, law)

    def _amounts(self, along: FloatArray, amplitude: FloatArray, law: _Law) -> FloatArray:
        """Return the amounts (rows, b) ``(D' S^-1 D)^-1 D' S^-1 r`` from ``D' r`` (rows, b) and ``U' r`` (rows, r)."""
        size, r = self._along.shape
        outer = (self._along[:, None] * self._along).reshape(size * size, r)
        gram = np.eye(size) - (law.shrunk @ outer.T).reshape(len(along), size, size)
        products = along - (amplitude * law.shrunk) @ self._along.T
        return np.asarray(np.linalg.solve(gram, products[:, :, None])[:, :, 0])


def _turned_back(x: FloatArray, turn: IntArray, teeth: int) -> FloatArray:
    """Return averages (rows, n), each turned back by a number of teeth."""
    passes = (np.arange(teeth) + turn[:, None]) % teeth
    return x.reshape(len(x), teeth, -1)[np.arange(len(x))[:, None], passes].reshape(x.shape)
