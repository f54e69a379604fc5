"""The healthy average of a rig whose numbers change a little, in closed form from the steady state of the rig itself.

The motion q of the rig leaves a residual ``F - Z q`` in the equations of the rig nearby. The forces F include those of
the varying part of its mesh stiffness. The healthy rig, which is factored already, responds to the residual: a step of
Newton's method, exact to first order.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.dynamics.excitation import harmonics, over_a_pass
from sigdb.dynamics.period import over_the_period
from sigdb.dynamics.periodic.correction import resampled
from sigdb.dynamics.periodic.periodic import PeriodicRig
from sigdb.dynamics.periodic.truncation import GRID
from sigdb.transmission import Equations, Sensitivity, Transmission, small_matrices


@dataclass(frozen=True)
class HealthySensitivity:
    """The healthy steady state of a rig, from which that of rigs nearby follows.

    Attributes
    ----------
    prepared
        The rig, prepared for one gear with the modal system of ``modes``.
    modes
        Its modes.
    """

    prepared: PeriodicRig
    modes: Sensitivity

    @small_matrices
    def signals_nearby(self, changed: Equations) -> FloatArray:
        """Return the healthy signals (sensors, n) of a rig nearby, to first order in the change of its numbers.

        They are those without index errors, under torque, profile errors and all that turns with a shaft.

        Parameters
        ----------
        changed
            The equations of a rig with the same parts and tooth counts.
        """
        solver, period, k, q = self.prepared.solver, self.prepared.period, self._excited, self._motion
        before = self.modes.synthesis.equations
        s, s_changed = self._exponents(before.rig), self._exponents(changed.rig)
        residual = self._applied(changed) - self._forces - changed.further_forces(before, q, s_changed, s)
        outputs = before.seen(self.modes.motion(residual, s), s) + changed.seen(q, s_changed) - before.seen(q, s)
        free = np.zeros((len(outputs), period.harmonics, 1), complex)
        free[:, k, 0] = outputs[self._meshes_first(len(outputs))]
        none = np.zeros((solver.transfer.shape[2], period.harmonics, 1), complex)
        response = solver.respond(none, free)
        return self._signals + period.averaged(response[len(self.prepared.meshes) :])[:, :, 0]

    @cached_property
    def _signals(self) -> FloatArray:
        return self.prepared.healthy_signals()

    @cached_property
    def _excited(self) -> IntArray:
        """Harmonics (k,) of the period that the meshes and the shafts excite."""
        period, step = self.prepared.period, int(np.gcd.reduce(self.prepared.period.passes))
        turning = [round(harmonic.order * period.revolutions) for harmonic in self.prepared.harmonics]
        residues = {sign * cycles % step for cycles in [0, *turning] for sign in (1, -1)}
        places = np.arange((period.samples + 1) // 2)
        return places[np.isin(places % step, list(residues))]

    @cached_property
    def _forces(self) -> ComplexArray:
        """Forces (n, k) on the rig."""
        return self._applied(self.modes.synthesis.equations)

    @cached_property
    def _motion(self) -> ComplexArray:
        """The motion (n, k) of the rig, with its free rotation."""
        equations, s = self.modes.synthesis.equations, self._exponents(self.prepared.rig)
        forces, turning = self._forces, equations.parts.free_rotation
        inertia = turning @ equations.mass @ turning
        rotation = np.divide(turning @ forces, s**2 * inertia, out=np.zeros_like(s), where=s != 0)
        return self.modes.motion(forces, s) + turning[:, None] * rotation

    @cached_property
    def _compression(self) -> FloatArray:
        """(meshes, F) compressions of the meshes on a grid on which their forces have no alias."""
        m, N = len(self.prepared.meshes), self.prepared.period.samples
        rows = self.prepared.response[: m * N]
        teeth = self.prepared.teeth
        delta = rows[:, 0] + rows[:, 1 + teeth :: 2].sum(axis=1)
        return resampled(delta.reshape(m, N).T, GRID).T

    def _exponents(self, rig: Transmission) -> ComplexArray:
        speed = abs(rig.speed(rig.gears[self.prepared.gear].shaft))
        return 1j * speed / self.prepared.period.revolutions * self._excited

    def _meshes_first(self, count: int) -> list[int]:
        """Places of inputs or outputs of a modal system, the damaged gear's mesh first."""
        order = self.prepared.order
        return [*order, *range(len(order), count)]

    def _applied(self, equations: Equations) -> ComplexArray:
        """Return the forces (n, k) on a rig, its meshes being compressed as in the steady state of the rig itself."""
        prepared, period, rig = self.prepared, self.prepared.period, equations.rig
        m, F = self._compression.shape
        columns = equations.forces
        force = np.zeros((columns.shape[1], period.harmonics), complex)
        turning = harmonics(rig, prepared.system, rig.gears[prepared.gear].shaft, period.revolutions)
        angle = 2 * np.pi * period.revolutions * np.arange(F) / F
        meshes = list(rig.meshes.values())
        on_mesh = np.empty((m, F))
        for place, number in enumerate(prepared.order):
            mesh, passes = meshes[number], period.passes[place]
            stiffness, profile = over_a_pass(mesh)
            error = sum((each.error[number] * np.exp(1j * each.order * angle)).real for each in turning)
            varying = over_the_period(stiffness - mesh.stiffness, passes, F)
            on_mesh[place] = (
                over_the_period(profile, passes, F)
                + (mesh.stiffness + varying) * error
                - varying * self._compression[place]
            )
        force[list(prepared.order)] = period.spectrum(on_mesh[:, :, None])[:, :, 0]
        force[m, 0] += period.samples
        for each in turning:
            force[:, round(each.order * period.revolutions)] += period.samples / 2 * each.force
        return columns.astype(complex) @ force[:, self._excited]
