"""A rig in motion: its modal coordinates, marched step by step with backlash."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sigdb.core import ComplexArray, FloatArray, SigdbError
from sigdb.dynamics.damage_forces import damage_change
from sigdb.dynamics.excitation import profile_error
from sigdb.dynamics.stability import first_order_hold
from sigdb.transmission import (
    Element,
    Mesh,
    ModalSystem,
    ToothDamage,
    Transmission,
    meshes_among,
    nonlinear_among,
    pair_stiffness,
    pairs_in_contact,
    static_forces,
)

SAMPLES_OF_A_PASS = 4096
"""Samples a tooth pass of the tables in which mesh stiffness is interpolated. It is exact to
1e-5 on the sharpest edge of the built-in rigs, and exact at steps that divide the samples."""


@dataclass(frozen=True, kw_only=True)
class MeshTables:
    """Stiffness and errors of each mesh over its period, the damaged gear's mesh first.

    Attributes
    ----------
    rates
        (meshes,) periods of each mesh in a revolution of the damaged gear: 1 of the first, whose period is that
        revolution; tooth passes of the others.
    forces
        (meshes, 2, T + 1) stiffness, N/m, and error force ``sum k_p e_p``, N; the last sample is the first again.
    friction
        (2 or 0, 2, T + 1) the same of the two friction inputs of the first mesh.
    """

    rates: FloatArray
    forces: FloatArray
    friction: FloatArray


def mesh_tables(
    rig: Transmission, gear: str, damage: Mapping[int, ToothDamage], index_errors: FloatArray, system: ModalSystem
) -> MeshTables:
    """Return the tables of a rig with damage by tooth number and index errors (teeth,) of one gear.

    The modal system gives the force of the mesh under the steady torque of the rig, which says where a damaged flank
    touches.
    """
    main = rig.meshes_of(gear)[0]
    teeth, shaft = rig.gears[gear].teeth, rig.gears[gear].shaft
    names = meshes_from(rig, gear)
    T = teeth * SAMPLES_OF_A_PASS
    forces = np.zeros((len(names), 2, T))
    for i, name in enumerate(names):
        per_table = teeth if name == main else 1
        forces[i] = np.tile(_over_a_pass(rig.meshes[name], T // per_table), per_table)
    mesh, window = rig.meshes[main], np.arange(int(np.ceil(rig.meshes[main].profile.contact_ratio)) * SAMPLES_OF_A_PASS)
    pair = mesh.stiffness * pair_stiffness(mesh.profile, window / SAMPLES_OF_A_PASS)
    for tooth in np.flatnonzero(index_errors):
        forces[0, 1, (window + tooth * SAMPLES_OF_A_PASS) % T] += pair * index_errors[tooth]
    force = _static_force(rig, main, system) if damage else 0.0
    change = damage_change(mesh, gear, teeth, rig.geometries[main].base_pitch, damage, SAMPLES_OF_A_PASS, force)
    error = change.profile + sum(force * index_errors[tooth - 1] for tooth, force in change.errors.items())
    forces[0, 0, change.samples] += change.stiffness[0]
    forces[0, 1, change.samples] += error[0]
    friction = np.zeros((len(change.stiffness) - 1, 2, T))
    friction[:, 0, change.samples], friction[:, 1, change.samples] = change.stiffness[1:], error[1:]
    passes = [rig.gears[rig.meshes[name].driving] for name in names[1:]]
    speed = abs(rig.speed(shaft))
    rates = [1.0, *(gear.teeth * abs(rig.speed(gear.shaft)) / speed for gear in passes)]
    return MeshTables(rates=np.array(rates), forces=_closed(forces), friction=_closed(friction))


def meshes_from(rig: Transmission, gear: str) -> list[str]:
    """Return the names of the meshes, that of a gear first."""
    main = rig.meshes_of(gear)[0]
    return sorted(rig.meshes, key=lambda name: name != main)


def _static_force(rig: Transmission, mesh: str, system: ModalSystem) -> float:
    """Return the force of a mesh under the steady torque, N."""
    m = len(rig.meshes)
    compressions = system.transfer(np.zeros(1))[0, :m, m].real
    return float(static_forces(rig, list(rig.meshes), compressions)[list(rig.meshes).index(mesh)])


def _over_a_pass(mesh: Mesh, samples: int) -> FloatArray:
    """(2, samples) stiffness and force of the profile errors of a healthy mesh."""
    x = pairs_in_contact(mesh.profile, np.arange(samples) / samples)
    pairs = mesh.stiffness * pair_stiffness(mesh.profile, x)
    return np.array([pairs.sum(axis=0), (pairs * profile_error(mesh, x)).sum(axis=0)])


def _closed(table: FloatArray) -> FloatArray:
    return np.concatenate([table, table[..., :1]], axis=-1)


_OutputsAndForces = tuple[FloatArray, FloatArray]
_MOST_ITERATIONS = 50
_ACCURACY = 1e-10
"""Change of the forces of nonlinear elements, as a fraction of the greatest, at which a step is solved."""


class Marcher:
    """A rig in motion: its state, and the steps that change it.

    Meshes are solved in closed form in each step. Forces of nonlinear elements follow by iteration in each step.

    Parameters
    ----------
    system
        The rig's modal system.
    elements
        Its local elements, the meshes in the order of ``tables``.
    tables
        Stiffness and errors of the meshes.
    step
        Time step, s.
    others
        (inputs, k) further forces, as combinations of the inputs of the modal system.
    """

    def __init__(
        self, system: ModalSystem, elements: Sequence[Element], tables: MeshTables, step: float, others: FloatArray
    ) -> None:
        meshes, self._nonlinear = meshes_among(elements), nonlinear_among(elements)
        m, sensors = len(meshes), len(system.sensors)
        columns = [mesh.columns[0] for mesh in meshes] + list(meshes[0].columns[1:][: len(tables.friction)])
        local = [column for element in self._nonlinear for column in element.columns]
        unit = np.eye(system.inputs.shape[1])
        inputs = np.column_stack([unit[:, columns], others, unit[:, local]])
        local_rows = [row for element in self._nonlinear for row in element.rows]
        rows = np.array([*(mesh.rows[0] for mesh in meshes), *range(m, m + sensors), *local_rows])
        upper = np.flatnonzero(system.poles.imag >= 0)
        # Re(c z) is the real output of a conjugate pair, whose second half is not marched.
        weight = np.where(system.poles[upper].imag > 0, 2.0, 1.0)
        c, b = weight * system.outputs[np.ix_(rows, upper)], system.inputs[upper] @ inputs
        E, g0, g1 = first_order_hold(system.poles[upper], step)
        self._c, self._g1, self._direct = c, b * g1[:, None], system.direct[rows] @ inputs
        self._tables, self.meshes, self._outputs = tables, m, m + sensors
        static = (c @ (system.inputs[upper, m] / -system.poles[upper])).real + system.direct[rows, m]
        self._constants = (
            _parts(E),
            np.ascontiguousarray(_parts((E[:, None] * self._g1 + b * g0[:, None]).T).swapaxes(0, 1)),
            np.ascontiguousarray(_parts(c.conj()).swapaxes(0, 1)),
            (c @ self._g1).real + self._direct,
            static,
            np.array([mesh.mean_stiffness for mesh in meshes]),
            np.array([np.inf if mesh.backlash is None else mesh.backlash for mesh in meshes]),
        )
        self._x: FloatArray = np.zeros((2, len(upper)))
        self._f: FloatArray = np.zeros(inputs.shape[1])

    def start(
        self, state: ComplexArray, turns: float, forces: FloatArray, lift: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Begin with modal coordinates (m,), one of each conjugate pair, less those of the steady torque.

        ``turns``, ``forces`` (k,) and ``lift`` (meshes,) or (0,) are those of this instant. The outputs and mesh forces
        that are returned are too.
        """

        def begin(local: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self._start(state, turns, np.concatenate([forces, local]), lift)

        outputs, mesh_force = self._with_local_forces(begin)
        return outputs[: self._outputs], mesh_force

    def _start(
        self, state: ComplexArray, turns: float, forces: FloatArray, lift: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        m, sliding = self.meshes, len(self._tables.friction)
        static, mean = self._constants[4], self._constants[5]
        place = turns * self._tables.rates
        at = np.rint((place - np.floor(place)) * (self._tables.forces.shape[2] - 1)).astype(int)
        k, g = self._tables.forces[range(m), :, at].T
        w, v = self._tables.friction[:, :, at[0]].T
        if lift.size:
            g, v = g + k * lift, v + w * lift[0]
        p = (static + (self._c @ state).real)[:m] + self._direct[:m, m + sliding :] @ forces
        direct, across = self._direct[:m, :m], self._direct[:m, m : m + sliding]
        A = np.eye(m) + direct * (k - mean)
        A[:, 0] += across @ w
        delta = np.linalg.solve(A, p + direct @ g + across @ v)
        pressing = np.maximum(k * delta - g, 0.0)
        self._f[:m] = mean * delta - pressing
        self._f[m : m + sliding] = (v - w * delta[0]) * (pressing[0] > 0)
        self._f[m + sliding :] = forces
        self._x = _parts(state - self._g1 @ self._f)
        return static + (self._c @ state).real + self._direct @ self._f, pressing

    @property
    def static_compression(self) -> FloatArray:
        """(meshes,) compression under the steady torque, m."""
        return self._constants[4][: self.meshes]

    @property
    def state(self) -> ComplexArray:
        """(m,) modal coordinates, one of each conjugate pair, less those of the steady torque."""
        return self._x[0] + 1j * self._x[1] + self._g1 @ self._f

    def run(self, turns: FloatArray, forces: FloatArray, lift: FloatArray) -> tuple[FloatArray, FloatArray]:
        """March through steps; see :func:`~sigdb.dynamics.march.kernel.march_steps`.

        Parameters
        ----------
        turns
            (steps,) revolutions of the damaged gear's shaft at the end of each step.
        forces, lift
            (steps, k) other forces, and (steps, meshes) or (steps, 0) errors that all pairs of a mesh have in common.

        Returns
        -------
        outputs, mesh_force : ndarray, (steps, meshes + sensors) and (steps, meshes)
        """
        if not self._nonlinear:
            return self._march(turns, forces, lift)
        return self._march_each_step(turns, forces, lift)

    def _march(self, turns: FloatArray, forces: FloatArray, lift: FloatArray) -> tuple[FloatArray, FloatArray]:
        from sigdb.dynamics.march.kernel import march_steps

        outputs, mesh_force = np.empty((len(turns), len(self._c))), np.empty((len(turns), self.meshes))
        tables = self._tables
        march_steps(
            self._x, self._f, *self._constants, turns, tables.rates, tables.forces, tables.friction, forces, lift,
            outputs, mesh_force,
        )  # fmt: skip
        return outputs, mesh_force

    def _march_each_step(
        self, turns: FloatArray, forces: FloatArray, lift: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """March with nonlinear elements: each step is repeated until their forces agree with its motion."""
        outputs, mesh_force = np.empty((len(turns), self._outputs)), np.empty((len(turns), self.meshes))
        for n in range(len(turns)):
            x, f, here = self._x.copy(), self._f.copy(), slice(n, n + 1)

            def step(local: FloatArray, x: FloatArray = x, f: FloatArray = f, here: slice = here) -> _OutputsAndForces:
                self._x[:], self._f[:] = x, f
                ends, force = self._march(turns[here], np.concatenate([forces[here], local[None]], axis=1), lift[here])
                return ends[0], force[0]

            end, mesh_force[n] = self._with_local_forces(step)
            outputs[n] = end[: self._outputs]
        return outputs, mesh_force

    def _with_local_forces(
        self, solve: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    ) -> tuple[FloatArray, FloatArray]:
        """Return outputs and mesh forces of an instant, whose nonlinear forces agree with its motion."""
        local = self._f[len(self._f) - sum(len(element.columns) for element in self._nonlinear) :].copy()
        for _ in range(_MOST_ITERATIONS):
            outputs, mesh_force = solve(local)
            settled = self._local_forces(outputs)
            if np.abs(settled - local).max(initial=0.0) <= _ACCURACY * np.abs(settled).max(initial=0.0):
                return outputs, mesh_force
            local = settled
        raise SigdbError("the forces of nonlinear elements do not converge within a step; give more steps_per_tooth")

    def _local_forces(self, outputs: FloatArray) -> FloatArray:
        ends = np.cumsum([len(element.rows) for element in self._nonlinear])
        motions = np.split(outputs[self._outputs :], ends[:-1]) if self._nonlinear else []
        forces = [element.law(motion) for element, motion in zip(self._nonlinear, motions, strict=True)]
        return np.concatenate(forces) if forces else np.empty(0)


def _parts(values: ComplexArray) -> FloatArray:
    """Real and imaginary parts along a new first axis."""
    return np.array([values.real, values.imag])
