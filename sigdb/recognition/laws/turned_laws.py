"""Normal laws of averages under templates turned to each tooth, and how likely an average is under each."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import scipy.fft
import scipy.linalg
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, blocks, plain_array
from sigdb.recognition.laws.turned_residuals import TurnedBasis, TurnedModes, TurnedResiduals, products_with_means
from sigdb.recognition.noise.noise_shape import whitened

_ROWS_AT_ONCE = 32
"""Rows worked on together: their products stay in the cache."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TurnedLaws:
    """Normal laws of an average, one for each template k turned by t teeth.

    ::

        x turned back ~ N(s_kt, noise^2 I + index_error^2 U_k diag(d_k) U_k'),   s_kt = sum_ab c_ab phi_kbt q_kab

    The coefficients c belong to the average: they say where its operating point lies. Without any they are 1, and s_kt
    is the sum of the carriers times their phases.

    As a part of :class:`~sigdb.recognition.laws.mixture_laws.MixtureLaws` the covariance is ``noise^2 I +
    index_error^2 Y C Y' + W W'``. Its modes and gains are then those of the responses to index errors of one size and
    of nuisances W together.

    Attributes
    ----------
    teeth
        Tooth count of the damaged gear.
    healthy
        (templates,) whether a template is of a healthy gear, which has no turn.
    modes
        (templates, n, r) U_k, orthonormal columns; where there is a basis of them, (templates, b, r) along it.
    gains
        (templates, r) square roots of d_k: rms of each mode's amplitude per index error, unit of the signal per m. With
        nuisances the rms itself, for one size of the index errors.
    carriers
        (templates, a, b, n) q_kab, in the sensor's unit.
    phases
        (templates, b, teeth) phi_kbt, or (templates, b, 1) where a turn does not change them.
    turn_invariant
        Whether the law of a healthy gear is the same from every tooth but for rounding: its likelihood is then the mean
        over the turns, which turning x does not change.
    with_nuisances
        Whether the modes are those of nuisances too.
    mode_basis
        (b, n) orthonormal basis of the modes, the strongest first; None where these are in samples.
    compared
        Number of vectors of that basis that averages are compared along.
    with_means
        (templates, 2 a b, r) of :func:`products_with_means`, where the modes are along a basis.
    precision
        Greatest norm of what may be left out of a mode, and of a carrier over that of the greatest one, so that fewer
        products with averages are needed. At 1e-4 the log-likelihood of a template that resembles the average changes
        by less than 0.01.
    """

    teeth: int
    healthy: BoolArray
    modes: FloatArray
    gains: FloatArray
    carriers: FloatArray
    phases: FloatArray
    turn_invariant: bool = False
    with_nuisances: bool = False
    mode_basis: FloatArray | None = None
    compared: int = 0
    with_means: FloatArray | None = None
    precision: float = 1e-7

    @property
    def gear_teeth(self) -> int:
        """Tooth count of the damaged gear, for each tooth of which there are likelihoods."""
        return self.teeth

    @property
    def samples(self) -> int:
        """Samples of an average, n."""
        return self.carriers.shape[-1]

    def log_likelihood(
        self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike, coefficients: FloatArray | None = None
    ) -> FloatArray:
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
            Size of the index errors, m; a number, or (rows,). 0 is the nominal specimen. With nuisances it has no
            effect.
        coefficients
            (rows, a, b) c of each average; 1 if left out.

        Returns
        -------
        ndarray, (rows, templates, teeth)
            float64; entry t - 1 of the last axis is the damage at tooth t, and the same for all t for a healthy gear.

        Raises
        ------
        InputError
            If the averages are not of the templates' length, or the noise is not above 0.
        """
        x = self.checked(x, noise)
        noise, index_error = (np.broadcast_to(np.asarray(value, float), len(x)) for value in (noise, index_error))
        likelihood = np.empty((len(x), len(self.carriers), self.teeth))
        for some in blocks(len(x), _ROWS_AT_ONCE):
            weights = self.weights(None if coefficients is None else coefficients[some])
            likelihood[some] = self._log_likelihood(x[some], noise[some], index_error[some], weights)
        return self.completed(likelihood)

    def completed(self, likelihood: FloatArray) -> FloatArray:
        """Return log-likelihoods (rows, templates, teeth) in which a healthy gear has one for all its turns."""
        none = likelihood[:, self.healthy]
        likelihood[:, self.healthy] = none.mean(axis=2, keepdims=True) if self.turn_invariant else none[:, :, :1]
        return likelihood

    def checked(self, x: ArrayLike, noise: ArrayLike) -> FloatArray:
        """Return averages as an array, if they and their noise can have a likelihood."""
        x = plain_array("log_likelihood", "x", x, float)
        noise = plain_array("log_likelihood", "noise", noise, float)
        if x.ndim != 2 or x.shape[1] != self.samples:
            raise InputError(f"x has the shape {x.shape}; give rows of {self.samples} samples, as the templates have")
        if not (noise > 0).all():
            raise InputError(f"noise = {noise.min():g} must be above 0: without noise there is no density")
        return x

    def _log_likelihood(
        self, x: FloatArray, noise: FloatArray, index_error: FloatArray, weights: FloatArray
    ) -> FloatArray:
        return self.density(self._modes, self._turned_basis.residuals(x, weights), noise, index_error)

    def density(
        self, modes: TurnedModes, residuals: TurnedResiduals, noise: FloatArray, index_error: FloatArray
    ) -> FloatArray:
        """Return the log-likelihood (rows, templates, teeth) from residuals.

        Parameters
        ----------
        modes
            The modes in a basis.
        residuals
            Residuals of averages in the same basis.
        noise, index_error
            (rows,) as of :meth:`log_likelihood`.
        """
        from sigdb.recognition.laws.explained_squares import shares_and_determinants

        shares, logs = shares_and_determinants(self.size(index_error) / noise, self.gains)
        left = residuals.square - modes.explained(residuals, shares)
        chi2 = left.transpose(1, 2, 0) / (noise**2)[:, None, None]
        return -0.5 * (chi2 + (self.samples * np.log(2 * np.pi * noise**2)[:, None] + logs)[:, :, None])

    def modes_in(self, basis: TurnedBasis) -> TurnedModes:
        """Return the modes in a basis that holds them and the carriers."""
        if self.with_means is not None:
            return TurnedModes(self.modes[:, : self.compared], self.with_means)
        return TurnedModes(basis.basis @ self.modes, products_with_means(self.modes, self._flat))

    def along_basis(self, basis: FloatArray, compared: int) -> Self:
        """Return the same laws with their modes along a basis (b, n), and the number of vectors to compare along."""
        along = np.ascontiguousarray((basis @ self.modes).transpose(1, 0, 2))  # as products with averages take them
        means = products_with_means(self.modes, self._flat)
        return replace(self, modes=along.transpose(1, 0, 2), mode_basis=basis, compared=compared, with_means=means)

    def modes_of(self, templates: int | IntArray) -> FloatArray:
        """Return the modes of a template (n, r), or of some (templates, n, r), in samples."""
        modes = self.modes[templates]
        return modes if self.mode_basis is None else self.mode_basis.T @ modes

    def along_modes(self, template: int, x: FloatArray) -> FloatArray:
        """Return the products of signals (rows, n) with the modes of a template, (rows, r)."""
        return (x if self.mode_basis is None else x @ self.mode_basis.T) @ self.modes[template]

    def sum_of_modes(self, template: int, amplitudes: FloatArray) -> FloatArray:
        """Return the sums (rows, n) of the modes of a template times amplitudes, (rows, r)."""
        along = amplitudes @ self.modes[template].T
        return along if self.mode_basis is None else along @ self.mode_basis

    def squared_distance(self, x: FloatArray, coefficients: FloatArray | None = None) -> FloatArray:
        """Return the squared distance of averages from each turned mean, (rows, templates, teeth); without modes."""
        square = self._turned_basis.residuals(x, self.weights(coefficients)).square
        return np.asarray(square.transpose(1, 2, 0))

    def whitened(self, shape: FloatArray) -> Self:
        """Return the laws of averages that are divided by a deviation by order, (n / 2 + 1,)."""
        columns = (self.modes_of(np.arange(len(self.modes))) * self.gains[:, None]).transpose(0, 2, 1)
        modes, gains, _ = np.linalg.svd(whitened(columns, shape).transpose(0, 2, 1), full_matrices=False)
        carriers = whitened(self.carriers, shape)
        return replace(self, modes=modes, gains=gains, mode_basis=None, with_means=None, carriers=carriers)

    def weights_of(self, template: int, turn: IntArray, coefficients: FloatArray | None = None) -> FloatArray:
        """Return the weights c_ab phi_kbt (rows, a b) of a template's carriers, for the turn of each row."""
        phases = self.phases[template]
        of_turns = phases.T[turn % phases.shape[1], None]
        c = np.ones((1, *self.carriers.shape[1:3])) if coefficients is None else coefficients
        return np.asarray((c * of_turns).reshape(len(turn), -1))

    def carriers_of(self, template: int) -> FloatArray:
        """Return the carriers of a template, (a b, n)."""
        return self._flat[template]

    def first_means(self, coefficients: FloatArray | None = None) -> FloatArray:
        """Return the sums of the first carriers, (rows or 1, templates, n)."""
        c = np.ones((1, self.carriers.shape[1])) if coefficients is None else coefficients[:, :, 0]
        return np.einsum("ra,kan->rkn", c, self.carriers[:, :, 0])

    def variance(self, templates: IntArray, coefficients: FloatArray | None = None) -> FloatArray:
        """Return the variance over angle of the first carriers of templates, (rows or 1, templates)."""
        first = self.carriers[templates, :, 0]
        centred = first - first.mean(axis=2, keepdims=True)
        c = np.ones((1, first.shape[1])) if coefficients is None else coefficients[:, :, 0]
        return np.einsum("ra,kab,rb->rk", c, centred @ centred.transpose(0, 2, 1), c) / self.samples

    def size(self, index_error: ArrayLike) -> FloatArray:
        """Return the factor of the gains: the size of the index errors, or 1 with nuisances."""
        return np.ones(np.shape(index_error)) if self.with_nuisances else np.asarray(index_error, float)

    def chi2(self, log_likelihood: FloatArray, *, noise: ArrayLike, index_error: ArrayLike) -> FloatArray:
        """Return the squared residual of averages under each hypothesis, whitened: chi-square of n degrees.

        Parameters
        ----------
        log_likelihood
            (rows, templates, teeth) of :meth:`log_likelihood` with the same noise and index errors.
        noise, index_error
            As there.

        Returns
        -------
        ndarray, (rows, templates, teeth)
            No unit. Over the number of samples it is the reduced chi-square, about 1 under the true hypothesis.
        """
        rows = len(log_likelihood)
        noise, index_error = (np.broadcast_to(np.asarray(value, float), rows) for value in (noise, index_error))
        d = (self.gains * (self.size(index_error) / noise)[:, None, None]) ** 2
        constant = self.samples * np.log(2 * np.pi * noise**2)[:, None] + np.log1p(d).sum(axis=2)
        return np.asarray(-2 * log_likelihood - constant[:, :, None])

    def chi2_of(
        self, template: IntArray, log_likelihood: FloatArray, *, noise: FloatArray, index_error: float
    ) -> FloatArray:
        """Return :meth:`chi2` of one template of each average, (rows,), from its log-likelihood (rows,)."""
        d = (self.gains[template] * (self.size(index_error) / noise)[:, None]) ** 2
        constant = self.samples * np.log(2 * np.pi * noise**2) + np.log1p(d).sum(axis=1)
        return np.asarray(-2 * log_likelihood - constant)

    def weights(self, coefficients: FloatArray | None) -> FloatArray:
        """Return c_ab phi_kbt, (teeth or 1, rows or 1, templates, a b)."""
        a, b = self.carriers.shape[1:3]
        c = np.ones((1, a, b)) if coefficients is None else coefficients
        weights = c[None, :, None] * self.phases.transpose(2, 0, 1)[:, None, :, None]
        return np.asarray(weights.reshape(*weights.shape[:3], a * b))

    @cached_property
    def _flat(self) -> FloatArray:
        """(templates, a b, n) carriers."""
        return self.carriers.reshape(len(self.carriers), -1, self.samples)

    @cached_property
    def _turned_basis(self) -> TurnedBasis:
        """The basis of residuals."""
        return TurnedBasis(self._basis, self._flat, self.teeth)

    @cached_property
    def _basis(self) -> FloatArray:
        """(b, n) orthonormal basis, which leaves out of each mode and carrier no more than the precision allows."""
        greatest = np.linalg.norm(self._flat, axis=2).max()
        columns = np.concatenate(
            [self._every_mode.T, self._flat.reshape(-1, self.samples) / max(greatest, np.finfo(float).tiny)]
        )
        basis, parts, _ = scipy.linalg.qr(columns.T, mode="economic", pivoting=True)
        left_out = np.sqrt(np.cumsum(parts[::-1] ** 2, axis=0)[::-1].max(axis=1))
        return np.asarray(basis[:, : max(1, int((left_out > self.precision).sum()))].T)

    @cached_property
    def _every_mode(self) -> FloatArray:
        """(n, templates r) modes."""
        return self.modes.transpose(1, 0, 2).reshape(self.samples, -1)

    @cached_property
    def _modes(self) -> TurnedModes:
        """The modes in the basis."""
        return self.modes_in(self._turned_basis)


@dataclass(frozen=True, kw_only=True, eq=False)
class UntiedLaws(TurnedLaws):
    """Normal laws of an average in a train: each template is of damage at the tooth of its case, and is not turned.

    As :class:`TurnedLaws` of a gear of one tooth, as far as turns go.

    Attributes
    ----------
    tooth
        (templates,) first damaged tooth of each, from the tacho mark; 0 for a healthy gear.
    of_teeth
        Tooth count of the damaged gear.
    """

    tooth: IntArray
    of_teeth: int

    @property
    def gear_teeth(self) -> int:
        """Tooth count of the damaged gear."""
        return self.of_teeth

    def completed(self, likelihood: FloatArray) -> FloatArray:
        """Return the same (rows, templates, teeth): -inf at teeth that a template is not of."""
        return self._at_its_tooth(super().completed(likelihood), -np.inf)

    def squared_distance(self, x: FloatArray, coefficients: FloatArray | None = None) -> FloatArray:
        """Return the same (rows, templates, teeth): infinite at teeth that a template is not of."""
        return self._at_its_tooth(super().squared_distance(x, coefficients), np.inf)

    def _at_its_tooth(self, single: FloatArray, elsewhere: float) -> FloatArray:
        values = np.full((*single.shape[:2], self.of_teeth), elsewhere)
        values[:, self.healthy] = single[:, self.healthy]
        damaged = np.flatnonzero(~self.healthy)
        values[:, damaged, self.tooth[damaged] - 1] = single[:, damaged, 0]
        return values
