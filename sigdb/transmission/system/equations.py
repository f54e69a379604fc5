"""The equations of motion of a rig: its matrices with damping of all modes, whole or by component modes."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import block_diag, eigh

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.transmission.rig import Transmission
from sigdb.transmission.system.assembly import Assembly, assemble

FREE = 1e-12
"""Square of a mode's frequency, as a fraction of the greatest, below which the mode moves freely."""


@dataclass(frozen=True, kw_only=True)
class Equations:
    """``M q'' + C q' + K q = forces``, with the mean stiffness of the meshes, in r coordinates of a rig.

    Attributes
    ----------
    rig
        The rig.
    parts
        Its assembly, in n degrees of freedom.
    basis
        (n, r) columns: the motion of each coordinate.
    mass, damping, stiffness
        (r, r) matrices; damping holds the gyroscopic terms. Cross terms of bearings make stiffness unsymmetric.
    """

    rig: Transmission
    parts: Assembly
    basis: FloatArray
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray

    @property
    def forces(self) -> FloatArray:
        """(n, inputs) forces of a unit of each input of a :class:`~sigdb.transmission.system.modal.ModalSystem`."""
        parts = self.parts
        return np.column_stack([parts.meshes, parts.torque, parts.load, parts.unbalance, parts.friction])

    @property
    def displacements(self) -> FloatArray:
        """(outputs, n) displacement that each output of a modal system sees."""
        return np.vstack([self.parts.meshes.T, self.parts.sensors])

    @property
    def derivatives(self) -> IntArray:
        """(outputs,) time derivatives that each output takes of its displacement."""
        return np.array([0] * len(self.rig.meshes) + [sensor.derivative for sensor in self.rig.sensors.values()])

    def further_forces(
        self, before: Self, motion: ComplexArray, s: ComplexArray, s_before: ComplexArray
    ) -> ComplexArray:
        """Return the forces (r, k) that a motion takes beyond those of similar equations, without cancellation.

        Parameters
        ----------
        before
            The similar equations.
        motion
            (r, k) coordinates, which move as ``exp(s t)`` here and as ``exp(s_before t)`` there.
        s, s_before
            (k,) exponents, 1/s.
        """
        squares = s**2 * motion, (s**2 - s_before**2) * motion
        firsts = s * motion, (s - s_before) * motion
        return (
            (self.mass - before.mass) @ squares[0]
            + before.mass @ squares[1]
            + (self.damping - before.damping) @ firsts[0]
            + before.damping @ firsts[1]
            + (self.stiffness - before.stiffness) @ motion
        )

    def seen(self, motion: ComplexArray, s: ComplexArray) -> ComplexArray:
        """Return the outputs (outputs, k) of a motion (n, k) that grows as ``exp(s t)``, with k exponents."""
        return s ** self.derivatives[:, None] * (self.displacements @ motion)


def equations_of(rig: Transmission, component_modes: int | None = None) -> Equations:
    """Return the equations of a rig at its operating point, in all coordinates or by component modes of each rotor."""
    parts = assemble(rig)
    basis = _component_basis(parts, component_modes)
    mass, stiffness = basis.T @ parts.mass @ basis, basis.T @ parts.stiffness @ basis
    h = basis.T @ parts.meshes
    full = stiffness + h @ np.diag(parts.mesh_stiffness) @ h.T
    damping = basis.T @ (parts.damping + parts.gyroscopic) @ basis
    damping = damping + _rotor_damping(rig, parts, basis, mass, (full + full.T) / 2)
    return Equations(rig=rig, parts=parts, basis=basis, mass=mass, damping=damping, stiffness=full)


def _component_basis(parts: Assembly, count: int | None) -> FloatArray:
    """(n, r) columns: each rotor's component modes and attachment modes, and the casing's modes."""
    if count is None:
        return np.eye(len(parts.mass))
    forces = [parts.meshes, parts.friction, parts.bearings, parts.torque, parts.load, parts.unbalance]
    interfaces = np.column_stack([*forces, parts.sensors.T])
    blocks, order = [], []
    for dofs in parts.rotors.values():
        take = np.ix_(dofs, dofs)
        blocks.append(_rotor_basis(parts.mass[take], parts.stiffness[take], interfaces[dofs], count))
        order += dofs
    blocks.append(np.eye(len(parts.casing)))
    basis = np.zeros((len(parts.mass), sum(block.shape[1] for block in blocks)))
    basis[order + parts.casing] = block_diag(*blocks)
    return basis


def _rotor_basis(mass: FloatArray, stiffness: FloatArray, forces: FloatArray, count: int) -> FloatArray:
    """Free rotation, the modes that take part most, and the static response to every interface force."""
    squares, modes = eigh((stiffness + stiffness.T) / 2, mass)
    rigid = modes[:, squares < FREE * squares[-1]]
    squares, elastic = squares[rigid.shape[1] :], modes[:, rigid.shape[1] :]
    share = (elastic.T @ forces) ** 2 / squares[:, None]
    share /= share.sum(axis=0).clip(min=1e-300)
    kept = np.sort(np.argsort(-share.max(axis=1), kind="stable")[:count])
    attachment = elastic @ ((elastic.T @ forces) / squares[:, None])
    columns = np.column_stack([elastic[:, kept], attachment])
    scale = np.linalg.norm(columns, axis=0)
    left, singular, _ = np.linalg.svd(columns[:, scale > 0] / scale[scale > 0], full_matrices=False)
    return np.column_stack([rigid, left[:, singular > 1e-10 * singular[0]]])


def _rotor_damping(
    rig: Transmission, parts: Assembly, basis: FloatArray, mass: FloatArray, stiffness: FloatArray
) -> FloatArray:
    """Damping matrix that gives every mode of the rotors, on a fixed casing, the rig's damping ratio.

    It acts on the motion relative to ``q_s = -K_rr^-1 K_rc q_c``, with which the rotors follow the casing statically. A
    mode ``K_rr phi = w^2 M_rr phi`` takes part in that motion by ``phi' M_rr q_s = -phi' K_rc q_c / w^2``.
    """
    count = basis.shape[1] - len(parts.casing)
    m, k = mass[:count, :count], stiffness[:count, :count]
    squares, modes = eigh(k, m)
    carried = stiffness[count:, :count] @ modes / np.where(squares > FREE * squares[-1], squares, np.inf)
    relative = np.vstack([m @ modes, carried])
    return relative * (2 * rig.damping_ratio * np.sqrt(squares.clip(min=0))) @ relative.T
