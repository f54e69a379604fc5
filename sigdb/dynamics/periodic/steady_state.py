"""The steady state of a rig with damage, and its signals for any specimen."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sigdb.core import BoolArray, FloatArray, SigdbError


def superpose(
    values: FloatArray,
    specimen_response: FloatArray,
    harmonic_response: FloatArray,
    index_errors: FloatArray | None = None,
    phases: FloatArray | None = None,
) -> FloatArray:
    """Return an affine response for given index errors and phases of the harmonic excitations.

    Parameters
    ----------
    values : ndarray, (...)
        The response without index errors and harmonic excitations.
    specimen_response : ndarray, (..., teeth)
        Its change per metre of each tooth's index error.
    harmonic_response : ndarray, (..., orders, 2)
        Its change by each order's excitation, in phase with the cosine and with the sine.
    index_errors : ndarray, (teeth,) or (rows, teeth), optional
        Index errors, m; none if left out.
    phases : ndarray, (orders, 2) or (rows, orders, 2), optional
        Cosine and sine of each order's phase in a frame turned by psi: ``cos(order psi)`` and ``sin(order psi)``. 1 and
        0, the frame of the tacho mark, if left out.

    Returns
    -------
    ndarray, (...) or (rows, ...)
        ``values + specimen_response @ index_errors + sum over orders of harmonic_response * phases``.

    Examples
    --------
    >>> superpose(np.ones(3), np.eye(3), np.zeros((3, 0, 2)), np.array([0.0, 0.5, 0.0]))
    array([1. , 1.5, 1. ])
    """
    total = values
    if index_errors is not None:
        total = total + _weighted_sum(specimen_response, index_errors, axes=1)
    if harmonic_response.shape[-2]:
        if phases is None:
            return total + harmonic_response[..., 0].sum(axis=-1)
        total = total + _weighted_sum(harmonic_response, phases, axes=2)
    return total


def _weighted_sum(response: FloatArray, weights: FloatArray, *, axes: int) -> FloatArray:
    """(...) or (rows, ...) the sum over the last axes of a response, times weights that may have an axis of rows."""
    kept = response.shape[: response.ndim - axes]
    flat = weights.reshape(*weights.shape[: weights.ndim - axes], -1)
    if flat.ndim == 1:
        return response.reshape(*kept, flat.size) @ flat
    return (flat @ response.reshape(-1, flat.shape[1]).T).reshape(len(flat), *kept)


@dataclass(frozen=True, kw_only=True)
class SteadyState:
    """Steady states of a rig for one or several cases of damage, averaged onto one revolution of the damaged gear.

    Where the meshes repeat only after several revolutions, signals are averages over them. Arrays marked with
    ``[cases]`` have a leading axis for the cases, unless the steady state is a single case, taken by its index.

    A case that is solved by the linear equations is affine in the index errors of the gear's teeth and in the harmonic
    excitations; see :meth:`signals_at`. A case that is marched in time holds for the index errors with which it is
    marched, and its responses are zero.

    Attributes
    ----------
    signals : ndarray, ([cases,] sensors, n)
        y_D under torque and profile errors, in the sensors' units; of a marched case under all that excites it.
    specimen_response : ndarray, ([cases,] sensors, n, teeth)
        Y_D, unit of the signal per metre of index error.
    harmonic_response : ndarray, ([cases,] sensors, n, orders, 2)
        Response to each harmonic excitation, in two phases.
    orders : tuple of float
        Orders of the harmonic excitations, cycles per revolution.
    compression : ndarray, ([cases,] N)
        Compression of the damaged gear's mesh over the common period, along the normal, m.
    compression_response : ndarray, ([cases,] N, teeth)
        Change of the compression per metre of index error.
    compression_harmonic : ndarray, ([cases,] N, orders, 2)
        Change of the compression by the harmonic excitations.
    mesh_force : ndarray, ([cases,] N)
        Force along the normal of the damaged gear's mesh, ``sum k_p (delta - e_p)`` over its tooth pairs, N.
    mesh_force_response : ndarray, ([cases,] N, teeth)
        Change of the force per metre of index error.
    mesh_force_harmonic : ndarray, ([cases,] N, orders, 2)
        Change of the force by the harmonic excitations.
    static_compression, static_force : float
        Compression (m) and force (N) of the damaged gear's mesh under the mean torque and stiffness.
    least_elsewhere : ndarray, ([cases])
        Least compression of the other meshes as a fraction of their static ones, without index errors; infinite where
        there are none.
    force_elsewhere : ndarray, ([cases,] meshes - 1, N)
        Forces of the other meshes as fractions of their static ones.
    force_elsewhere_response : ndarray, ([cases,] meshes - 1, N, teeth)
        Change of these per metre of index error.
    force_elsewhere_harmonic : ndarray, ([cases,] meshes - 1, N, orders, 2)
        Change of these by the harmonic excitations.
    error : ndarray, ([cases])
        Estimated error of the signals by the grid or the step, as a fraction of their peak-to-peak, the greatest of all
        sensors.
    meets_accuracy : ndarray of bool, ([cases])
        Whether a marched case meets the accuracy of its solver; True where the case is linear.
    is_linear : ndarray of bool, ([cases])
        Whether the case is solved by the linear equations, which hold while the meshes stay in contact.
    parts_contact : ndarray of bool, ([cases])
        Whether teeth part in a marched case; False where the case is linear.
    failures : tuple
        For each case the error that prevented its result, or None. The arrays of a case that failed are undefined.
    """

    signals: FloatArray
    specimen_response: FloatArray
    harmonic_response: FloatArray
    orders: tuple[float, ...]
    compression: FloatArray
    compression_response: FloatArray
    compression_harmonic: FloatArray
    mesh_force: FloatArray
    mesh_force_response: FloatArray
    mesh_force_harmonic: FloatArray
    static_compression: float
    static_force: float
    least_elsewhere: FloatArray
    force_elsewhere: FloatArray
    force_elsewhere_response: FloatArray
    force_elsewhere_harmonic: FloatArray
    error: FloatArray
    meets_accuracy: BoolArray
    is_linear: BoolArray
    parts_contact: BoolArray
    failures: tuple[SigdbError | None, ...]

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.failures)

    def __getitem__(self, case: int) -> Self:
        """Return one case, without the leading axis.

        Raises
        ------
        SigdbError
            If the case failed.
        """
        failure = self.failures[case]
        if failure is not None:
            raise failure
        return self.case(case)

    def case(self, case: int) -> Self:
        """Return one case, without the leading axis, whether it failed or not."""
        arrays: dict[str, Any] = {name: getattr(self, name)[case] for name in _BY_CASE}
        return replace(self, failures=(self.failures[case],), **arrays)

    @classmethod
    def stack(cls, cases: Sequence[Self]) -> Self:
        """Return several cases of one rig as one steady state with a leading axis."""
        joined: dict[str, Any] = {name: np.stack([getattr(case, name) for case in cases]) for name in _BY_CASE}
        return replace(cases[0], failures=tuple(failure for case in cases for failure in case.failures), **joined)

    def signals_at(self, index_errors: FloatArray | None = None, phases: FloatArray | None = None) -> FloatArray:
        """Return the signals of specimens.

        Parameters
        ----------
        index_errors : ndarray, (teeth,) or (rows, teeth), optional
            Index error of each tooth of the damaged gear, m; none if left out.
        phases : ndarray, (orders, 2) or (rows, orders, 2), optional
            Phases of the harmonic excitations, as of :func:`superpose`.

        Returns
        -------
        ndarray, ([rows,] [cases,] sensors, n)
            Signals in the sensors' units.
        """
        return superpose(self.signals, self.specimen_response, self.harmonic_response, index_errors, phases)

    def compression_at(self, index_errors: FloatArray | None = None, phases: FloatArray | None = None) -> FloatArray:
        """Return the compression of specimens, ([rows,] [cases,] N), m; arguments as of :meth:`signals_at`."""
        return superpose(self.compression, self.compression_response, self.compression_harmonic, index_errors, phases)

    def mesh_force_at(self, index_errors: FloatArray | None = None, phases: FloatArray | None = None) -> FloatArray:
        """Return the mesh force of specimens, ([rows,] [cases,] N), N; arguments as of :meth:`signals_at`."""
        return superpose(self.mesh_force, self.mesh_force_response, self.mesh_force_harmonic, index_errors, phases)

    def least_compression_at(
        self, index_errors: FloatArray | None = None, phases: FloatArray | None = None
    ) -> FloatArray:
        """Return the least compression of any mesh as a fraction of its static one, ([rows,] [cases]).

        Arguments are as of :meth:`signals_at`. It is that of nominal teeth: a tooth's own index error is not
        subtracted, so that :meth:`least_mesh_force_at` decides about contact.
        """
        least = self.compression_at(index_errors, phases).min(axis=-1) / self.static_compression
        return np.minimum(least, self.least_elsewhere)

    def least_mesh_force_at(
        self, index_errors: FloatArray | None = None, phases: FloatArray | None = None
    ) -> FloatArray:
        """Return the least force of any mesh as a fraction of its static one, ([rows,] [cases]).

        Arguments are as of :meth:`signals_at`. A mesh is closed while its force is positive.
        """
        least = self.mesh_force_at(index_errors, phases).min(axis=-1) / self.static_force
        others = superpose(
            self.force_elsewhere, self.force_elsewhere_response, self.force_elsewhere_harmonic, index_errors, phases
        )
        return np.minimum(least, others.min(axis=(-2, -1), initial=np.inf))

    def contact_loss_at(self, index_errors: FloatArray | None = None, phases: FloatArray | None = None) -> BoolArray:
        """Return whether a mesh loses contact, ([rows,] [cases]); arguments as of :meth:`signals_at`."""
        return np.where(self.is_linear, self.least_mesh_force_at(index_errors, phases) <= 0, self.parts_contact)

    @property
    def min_compression(self) -> FloatArray:
        """([cases]) least compression of any mesh as a fraction of its static one, without index errors."""
        return self.least_compression_at()

    @property
    def min_mesh_force(self) -> FloatArray:
        """([cases]) least force of any mesh as a fraction of its static one, without index errors."""
        return self.least_mesh_force_at()

    @property
    def least_force_elsewhere(self) -> FloatArray:
        """([cases]) least force of the other meshes as a fraction of their static ones, without index errors.

        Infinite where there are none.
        """
        nominal = superpose(self.force_elsewhere, self.force_elsewhere_response, self.force_elsewhere_harmonic)
        return np.asarray(nominal.min(axis=(-2, -1), initial=np.inf))

    @property
    def contact_loss(self) -> NDArray[np.bool_]:
        """([cases]) whether a mesh loses contact, without index errors."""
        return self.contact_loss_at()


_BY_CASE = tuple(
    attribute.name
    for attribute in fields(SteadyState)
    if attribute.name not in ("orders", "static_compression", "static_force", "failures")
)
