"""Which bins of an average's spectrum belong to the shaft, to the mesh and to its sidebands."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from sigdb.core import IntArray
from sigdb.signature.checks import count, harmonics_below_nyquist, mesh_teeth


@dataclass(frozen=True, kw_only=True)
class GearOrders:
    """Bins of an average's spectrum that belong to the shaft, the mesh and the first sidebands of the mesh."""

    shaft: IntArray
    mesh: IntArray
    sidebands: IntArray

    @cached_property
    def regular(self) -> IntArray:
        """Shaft and mesh orders, each once where they overlap."""
        return np.union1d(self.shaft, self.mesh)

    @cached_property
    def residual_removes(self) -> IntArray:
        """The mean and the regular orders."""
        return np.union1d(self.regular, 0)

    @cached_property
    def difference_removes(self) -> IntArray:
        """The mean, the regular orders and the sidebands."""
        return np.union1d(self.residual_removes, self.sidebands)


def gear_orders(
    owner: str,
    n: int,
    teeth: int,
    mesh_harmonics: int | None,
    shaft_harmonics: int,
    sidebands: int = 0,
    *,
    least_mesh: int = 0,
) -> GearOrders:
    """Check the counts and lay out the orders; ``owner`` is the public function in messages."""
    z = mesh_teeth(owner, teeth, n)
    h = mesh_harmonic_count(owner, mesh_harmonics, z, n, least=least_mesh)
    s = harmonics_below_nyquist(owner, "shaft_harmonics", shaft_harmonics, spacing=1, n=n, least=0)
    return _orders(n, z, h, s, count(owner, "sidebands", sidebands, least=0))


_KEPT = 32
"""Layouts of orders that are kept: those of the tooth counts that a program works on."""


@lru_cache(_KEPT)
def _orders(n: int, teeth: int, mesh_harmonics: int, shaft_harmonics: int, pairs: int) -> GearOrders:
    return GearOrders(
        shaft=np.arange(1, shaft_harmonics + 1),
        mesh=teeth * np.arange(1, mesh_harmonics + 1),
        sidebands=sideband_orders(teeth, mesh_harmonics, pairs, n),
    )


def mesh_harmonic_count(owner: str, mesh_harmonics: int | None, teeth: int, n: int, *, least: int) -> int:
    """The count H of mesh harmonics; None stands for all below Nyquist."""
    if mesh_harmonics is None:
        return (n - 1) // 2 // teeth
    return harmonics_below_nyquist(owner, "mesh_harmonics", mesh_harmonics, spacing=teeth, n=n, least=least)


@lru_cache(_KEPT)
def sideband_orders(teeth: int, mesh_harmonics: int, pairs: int, n: int) -> IntArray:
    """Orders ``h teeth +- 1 ... pairs``, h = 1 ... H, that lie above 0 and below Nyquist, each once."""
    mesh = teeth * np.arange(1, mesh_harmonics + 1)
    # Sidebands farther than n away are outside whatever the mesh order, and a huge count must not cost memory.
    j = np.arange(1, min(pairs, n) + 1)
    orders = np.union1d(np.add.outer(mesh, j), np.subtract.outer(mesh, j))
    return orders[(orders > 0) & (2 * orders < n)]
