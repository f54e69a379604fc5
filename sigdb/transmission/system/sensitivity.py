"""Sensitivities in closed form: modes and motion of a rig whose numbers change a little, from those of the rig itself.

With ``Z(s) = s^2 M + s C + K`` and modes x, y, where ``Z^-1 = sum x y' / (s - pole)``, a change dZ moves a pole by
``-y' dZ(pole) x``, and the motion q under forces F by ``Z^-1 (dF - dZ q)``. Nothing is solved anew.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import ComplexArray, IntArray
from sigdb.transmission.system.equations import Equations
from sigdb.transmission.system.modal import CoupledModes, Synthesis
from sigdb.transmission.system.small_matrices import small_matrices

_NEAR = 1e-3
"""Relative distance of poles below which a change can mix their modes."""


@dataclass(frozen=True)
class Sensitivity:
    """A rig with all its modes, from which rigs nearby follow.

    Attributes
    ----------
    synthesis
        Its modes; without component modes, so that its coordinates are those of rigs nearby.
    """

    synthesis: Synthesis

    @cached_property
    def modes(self) -> CoupledModes:
        """The modes of the rig itself."""
        return self.synthesis.modes()

    @small_matrices
    def modes_nearby(self, changed: Equations) -> CoupledModes:
        """Return the modes of a rig nearby, to first order in the change of its matrices.

        Their shares of energy are those of the rig itself. Near poles, as of a round shaft at rest, mix: theirs are the
        eigenvalues of the change among them.
        """
        synthesis, upper = self.synthesis, self.synthesis.oscillating
        poles, x, y = synthesis.poles[upper], synthesis.shapes[:, upper], synthesis.participation[upper]
        change = changed.further_forces(synthesis.equations, x, poles, poles)
        moved = poles - np.einsum("mn,nm->m", y, change)
        for group in _groups(poles):
            mixed = np.diag(poles[group]) - y[group] @ change[:, group]
            values = np.linalg.eigvals(mixed)
            moved[group] = values[np.argsort(np.abs(values), kind="stable")]
        return CoupledModes.at(moved, self.modes.moves)

    def motion(self, forces: ComplexArray, s: ComplexArray) -> ComplexArray:
        """Return the motion (n, k) under forces (n, k) that grow as ``exp(s t)``, without the free rotation."""
        synthesis = self.synthesis
        return synthesis.shapes @ (synthesis.participation @ forces / (s - synthesis.poles[:, None]))


def _groups(poles: ComplexArray) -> list[IntArray]:
    """Return the places of poles, which are in order of magnitude, that are near each other: two or more in a group."""
    near = np.abs(np.diff(poles)) < _NEAR * np.abs(poles[1:])
    groups = np.split(np.arange(len(poles)), np.flatnonzero(~near) + 1)
    return [group for group in groups if len(group) > 1]
