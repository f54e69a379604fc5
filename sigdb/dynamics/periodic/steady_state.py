"""The periodic response of a rig to all that excites it, for any specimen."""

from dataclasses import dataclass

from sigdb.core import FloatArray


@dataclass(frozen=True, kw_only=True)
class SteadyState:
    """Periodic response, averaged over the common period onto one revolution of the damaged gear.

    Signals are affine in the index errors e of the gear's teeth and in the harmonic excitations:
    ``signals + specimen_response @ e + sum over orders of harmonic_response[..., 0]``. Seen from a frame turned by psi,
    an order's share is ``cos(order psi) harmonic_response[..., 0] + sin(order psi) harmonic_response[..., 1]``.

    Attributes
    ----------
    signals
        (sensors, n) y_D under torque and profile errors, in the sensors' units.
    specimen_response
        (sensors, n, teeth) Y_D, unit of the signal per metre of index error.
    harmonic_response
        (sensors, n, orders, 2).
    orders
        Orders of the harmonic excitations, cycles per revolution.
    compression
        (N,) of the damaged gear's mesh over the common period, along the normal, m, under torque and profile errors.
    compression_response
        (N, teeth) change of the compression per metre of index error.
    compression_harmonic
        (N, orders, 2) change of the compression by the harmonic excitations.
    mesh_stiffness
        (meshes, N) sum over the tooth pairs in contact, N/m.
    static_compression
        Compression of the damaged gear's mesh under the mean torque and stiffness, m.
    least_elsewhere
        Least compression of the other meshes as a fraction of their static ones; infinite where there are none.
    error
        Estimated error of the signals by the grid, as a fraction of their peak-to-peak, the greatest of all sensors.
    """

    signals: FloatArray
    specimen_response: FloatArray
    harmonic_response: FloatArray
    orders: tuple[float, ...]
    compression: FloatArray
    compression_response: FloatArray
    compression_harmonic: FloatArray
    mesh_stiffness: FloatArray
    static_compression: float
    least_elsewhere: float
    error: float

    @property
    def mesh_force(self) -> FloatArray:
        """(N,) force along the normal of the damaged gear's mesh, N, but for the errors' own share."""
        return self.mesh_stiffness[0] * self.compression

    @property
    def min_compression(self) -> float:
        """Least compression of any mesh as a fraction of its static one; below 0 a mesh loses contact."""
        least = (self.compression + self.compression_harmonic[..., 0].sum(axis=1)).min()
        return min(float(least / self.static_compression), self.least_elsewhere)
