"""Residuals of averages from the means of templates that are turned to each tooth, in a basis."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray
from sigdb.recognition.rows.turned_products import TurnedProducts


@dataclass(frozen=True, eq=False)
class TurnedResiduals:
    """Residuals of averages from turned means.

    Attributes
    ----------
    along
        (teeth, rows, b) products with the basis of the residual from the mean of the first template.
    square
        (teeth, rows, templates) squared distances from the mean of each template.
    weights
        (teeth or 1, rows or 1, templates, a b) weights of the carriers.
    """

    along: FloatArray
    square: FloatArray
    weights: FloatArray


class TurnedBasis:
    """A basis in which averages are compared with the turned means and the modes of templates.

    Parameters
    ----------
    basis
        (b, n) orthonormal rows, which hold the carriers and whatever else averages are compared with.
    carriers
        (templates, a b, n) carriers of the means.
    teeth
        Tooth count of the damaged gear.
    """

    def __init__(self, basis: FloatArray, carriers: FloatArray, teeth: int) -> None:
        self.basis = basis
        self._products = TurnedProducts(basis, teeth)
        self._of_carriers = carriers @ basis.T
        self._gram = carriers @ carriers.transpose(0, 2, 1)

    def residuals(self, x: FloatArray, weights: FloatArray) -> TurnedResiduals:
        """Return the residuals of averages (rows, n) from the means of carriers with weights."""
        along, flat = self._products(x), self._of_carriers.reshape(-1, self.basis.shape[0])
        with_carriers = (along @ flat.T).reshape(*along.shape[:2], *self._of_carriers.shape[:2])
        energy = (times(weights, self._gram) * weights).sum(axis=-1)
        square = (x**2).sum(axis=1)[:, None] - 2 * np.einsum("...m,...m->...", with_carriers, weights) + energy
        along -= weights[:, :, 0] @ self._of_carriers[0]
        return TurnedResiduals(along, square, weights)


class TurnedModes:
    """Modes of templates, which explain ``sum_m g_m (u_m' r)^2`` of the square of a residual r.

    Parameters
    ----------
    along
        (templates, b, r) products of the basis of the residuals, which holds the modes, with these.
    between
        (templates, 2 a b, r) of :func:`products_with_means`.
    """

    def __init__(self, along: FloatArray, between: FloatArray) -> None:
        self._of_modes = along.transpose(1, 0, 2).reshape(along.shape[1], -1)
        self._between = between

    def explained(self, residuals: TurnedResiduals, shares: FloatArray) -> FloatArray:
        """Return the explained squares, (teeth, rows, templates).

        Parameters
        ----------
        residuals
            Residuals of averages.
        shares
            (rows, templates, r) g_m, the variance of each mode over that of mode and noise.
        """
        from sigdb.recognition.laws.explained_squares import explained_squares

        weights = residuals.weights
        first = np.broadcast_to(weights[:, :, :1], weights.shape)
        means = times(np.concatenate([weights, first], axis=3), self._between)
        return explained_squares(residuals.along @ self._of_modes, np.ascontiguousarray(means), shares)


def products_with_means(modes: FloatArray, carriers: FloatArray) -> FloatArray:
    """Return the products (templates, 2 a b, r) of modes with the carriers, and with those of the first template.

    Parameters
    ----------
    modes
        (templates, n, r) orthonormal modes.
    carriers
        (templates, a b, n) carriers of the means. The products with those of the first template have the other sign.
    """
    first = np.broadcast_to(carriers[:1], carriers.shape)
    return np.asarray(np.concatenate([carriers, -first], axis=1) @ modes)


def times(weights: FloatArray, matrices: FloatArray) -> FloatArray:
    """Return weights (..., templates, a b) times a matrix (a b, m) of each template, (..., templates, m)."""
    *others, templates, width = weights.shape
    products = weights.reshape(-1, templates, width).transpose(1, 0, 2) @ matrices
    return np.asarray(products.transpose(1, 0, 2).reshape(*others, templates, -1))
