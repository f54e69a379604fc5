"""Modal synthesis: from the assembled rig to one ``ModalSystem`` of poles, inputs, outputs and direct terms.

Component modes of each rotor and of the casing come first, equations (5) and (6); the coupled equations (8), (9)
in those coordinates, with the mean mesh stiffness and gyroscopics, give one complex eigenproblem.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg import eigh, null_space

from sigdb.core import ComplexArray, FloatArray, InputError, IntArray
from sigdb.transmission.parts.usual_ranges import unusual_numbers
from sigdb.transmission.rig import Transmission
from sigdb.transmission.system.assembly import Assembly
from sigdb.transmission.system.elements import Element, mesh_elements, meshes_among
from sigdb.transmission.system.equations import FREE, Equations, equations_of
from sigdb.transmission.system.small_matrices import small_matrices


@dataclass(frozen=True, kw_only=True)
class ModalSystem:
    """A rig as a linear system with m poles; the one form in which the dynamics knows it.

    Transfer function: ``H(w) = outputs diag(1 / (i w - poles)) inputs + direct``.

    Inputs are, in order:

    - a force along each mesh vector h (positive compresses the mesh);
    - the mean torque through the train and the load's torque alone, each as a multiple of itself;
    - the unbalance of each shaft that has one, in phase with the cosine and with the sine of its angle;
    - two friction vectors of each mesh, those of its geometry.

    Outputs are each mesh's compression and each sensor.

    Attributes
    ----------
    poles
        (m,) complex, 1/s; of a conjugate pair the one with positive imaginary part comes first, its partner next.
    inputs
        (m, meshes + 2 + 2 unbalanced + 2 meshes).
    outputs
        (meshes + sensors, m), with the time derivative that each sensor takes folded in.
    direct
        (meshes + sensors, inputs) real: residual flexibility of truncated modes for displacements, and
        ``sum c lambda b`` for accelerations.
    meshes, sensors, unbalanced
        Names, in order: meshes, sensors, and shafts with an unbalance.
    mesh_stiffness
        (meshes,) mean mesh stiffness contained in the system, N/m.
    elements
        Local elements: the meshes, in order, then those whose law of force is not linear.
    """

    poles: ComplexArray
    inputs: ComplexArray
    outputs: ComplexArray
    direct: FloatArray
    meshes: tuple[str, ...]
    sensors: tuple[str, ...]
    mesh_stiffness: FloatArray
    unbalanced: tuple[str, ...] = ()
    elements: tuple[Element, ...] = ()

    def transfer(self, omega: FloatArray) -> ComplexArray:
        """Transfer function at angular frequencies (k,), rad/s: (k, outputs, inputs)."""
        resolvent = 1 / (1j * np.asarray(omega)[:, None] - self.poles)
        residues = self.outputs.T[:, :, None] * self.inputs[:, None, :]
        modal = resolvent @ residues.reshape(len(self.poles), -1)
        return modal.reshape(len(resolvent), *self.direct.shape) + self.direct

    def truncated(self, modes: int) -> "ModalSystem":
        """The system with the conjugate pairs that take part most in the meshes' and sensors' response.

        Never the lowest modes: they are ranked by their greatest share in any output's response to any input but
        friction, and the static response of displacements is kept exact by residual flexibility.

        Parameters
        ----------
        modes
            Number of pairs to keep; real poles count as one.
        """
        friction = [column for mesh in meshes_among(self.elements) for column in mesh.columns[1:]]
        ranking = np.delete(self.inputs, friction, axis=1)
        static = np.abs(self.outputs[:, None, :] * ranking.T[None] / self.poles)
        share = (static / static.sum(axis=2, keepdims=True).clip(min=1e-300)).max(axis=(0, 1))
        upper = np.flatnonzero(self.poles.imag >= 0)
        chosen = upper[np.argsort(-share[upper], kind="stable")[:modes]]
        keep = np.zeros(len(self.poles), bool)
        keep[chosen] = True
        keep[chosen[self.poles[chosen].imag > 0] + 1] = True
        lost = self.outputs[:, ~keep] @ (self.inputs[~keep] / -self.poles[~keep, None])
        # In an acceleration the static share of a mode cancels its direct term, so both go.
        return replace(
            self,
            poles=self.poles[keep],
            inputs=self.inputs[keep],
            outputs=self.outputs[:, keep],
            direct=self.direct + lost.real,
        )


@dataclass(frozen=True, kw_only=True)
class CoupledModes:
    """Modes of a rig at its operating point, one of each conjugate pair, by rising frequency.

    Attributes
    ----------
    frequency_hz
        (m,) damped natural frequency ``Im(lambda) / 2 pi``; 0 for an overdamped mode.
    damping_ratio
        (m,) ``-Re(lambda) / |lambda|``.
    moves
        For each mode the share of kinetic energy in each motion of the rig, greatest first, adding up to 1.
    """

    frequency_hz: FloatArray
    damping_ratio: FloatArray
    moves: tuple[dict[str, float], ...]

    @classmethod
    def at(cls, poles: ComplexArray, moves: tuple[dict[str, float], ...]) -> Self:
        """Return the modes of poles (m,), with their shares of energy."""
        return cls(
            frequency_hz=poles.imag / (2 * np.pi),
            damping_ratio=-poles.real / np.abs(poles),
            moves=moves,
        )


@dataclass(frozen=True, kw_only=True)
class Synthesis:
    """The modes of a rig with m poles: ``H(s) = shapes diag(1 / (s - poles)) participation`` in its n coordinates.

    Attributes
    ----------
    equations
        The rig's equations of motion.
    poles
        (m,) complex, 1/s.
    shapes
        (n, m) right eigenvectors.
    participation
        (m, n) left eigenvectors.
    """

    equations: Equations
    poles: ComplexArray
    shapes: ComplexArray
    participation: ComplexArray

    def system(self) -> ModalSystem:
        """Return the linear system of the meshes and sensors."""
        rig, poles = self.equations.rig, self.poles
        inputs = self.participation @ self.equations.forces
        displacement, order = self.equations.displacements @ self.shapes, self.equations.derivatives
        first_moment = ((displacement * poles) @ inputs).real
        return ModalSystem(
            poles=poles,
            inputs=inputs,
            outputs=displacement * poles ** order[:, None],
            direct=np.where(order[:, None] == 2, first_moment, 0.0),
            meshes=tuple(rig.meshes),
            sensors=tuple(rig.sensors),
            mesh_stiffness=self.equations.parts.mesh_stiffness,
            unbalanced=rig.unbalanced,
            elements=mesh_elements(rig),
        )

    @property
    def oscillating(self) -> IntArray:
        """Places of the modes, one of each conjugate pair, by rising magnitude of their poles."""
        upper = np.flatnonzero(self.poles.imag >= 0)
        return upper[np.argsort(np.abs(self.poles[upper]), kind="stable")]

    def modes(self) -> CoupledModes:
        """Return the natural frequencies, damping ratios and shares of energy."""
        upper = self.oscillating
        moves = tuple(_energy_shares(self.equations.parts, self.shapes[:, i]) for i in upper)
        return CoupledModes.at(self.poles[upper], moves)


@small_matrices
def synthesise(rig: Transmission, *, component_modes: int | None = None) -> Synthesis:
    """Return the modes of a rig at its operating point; see :func:`modal_system`."""
    equations = equations_of(rig, component_modes)
    parts, basis, mass = equations.parts, equations.basis, equations.mass
    stiffness = (equations.stiffness + equations.stiffness.T) / 2

    # The train's free rotation compresses nothing; kept, it would be a defective double pole at zero.
    turning = np.linalg.lstsq(basis, parts.free_rotation, rcond=None)[0]
    elastic = null_space((mass @ turning)[None])
    squares, modes = eigh(elastic.T @ stiffness @ elastic, elastic.T @ mass @ elastic)
    _check_supported(rig, parts, basis @ elastic, squares, modes)
    phi = elastic @ modes

    n = len(squares)
    # Cross terms of bearings may make stiffness unsymmetric: they couple the symmetric part's modes.
    crossed = phi.T @ (equations.stiffness - stiffness) @ phi
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(squares) - crossed, -phi.T @ equations.damping @ phi]])
    poles, right = np.linalg.eig(state)
    left = np.linalg.inv(right)
    return Synthesis(
        equations=equations,
        poles=poles,
        shapes=basis @ phi @ right[:n],
        participation=left[:, n:] @ (basis @ phi).T,
    )


def modal_system(rig: Transmission, *, component_modes: int | None = None) -> ModalSystem:
    """Modal synthesis of a rig at its operating point.

    Parameters
    ----------
    rig
        The transmission.
    component_modes
        Modes kept of each rotor, by participation at meshes, bearings and sensors; the static response to every
        interface force is added to them, so that static compliance stays exact. None keeps all.

    Returns
    -------
    ModalSystem

    Raises
    ------
    InputError
        If a part of the rig can move freely apart from the train's rotation.

    Examples
    --------
    >>> import numpy as np, sigdb
    >>> from sigdb.transmission import modal_system
    >>> system = modal_system(sigdb.load_transmission("nasa-spiral-bevel"))
    >>> compliance = system.transfer(np.array([0.0]))[0, 0, 0].real
    >>> bool(np.isclose(compliance, 1 / system.mesh_stiffness[0]))
    True
    """
    return synthesise(rig, component_modes=component_modes).system()


def coupled_modes(rig: Transmission, *, component_modes: int | None = None) -> CoupledModes:
    """Return natural frequencies, damping and shares of energy of the modes of a rig at its operating point.

    Parameters
    ----------
    rig
        The transmission.
    component_modes
        Modes kept of each rotor; see :func:`modal_system`.

    Returns
    -------
    CoupledModes
    """
    return synthesise(rig, component_modes=component_modes).modes()


def _energy_shares(parts: Assembly, shape: ComplexArray | FloatArray) -> dict[str, float]:
    energy = (shape.conj() * (parts.mass @ shape)).real
    shares = {name: float(max(energy[dofs].sum(), 0.0)) for name, dofs in parts.motions.items()}
    total = sum(shares.values())
    return {name: share / total for name, share in sorted(shares.items(), key=lambda item: -item[1])}


def _check_supported(
    rig: Transmission, parts: Assembly, basis: FloatArray, squares: FloatArray, modes: FloatArray
) -> None:
    if squares[0] < FREE * squares[-1]:
        moving = next(iter(_energy_shares(parts, basis @ modes[:, 0])))
        if unusual := unusual_numbers(rig.model_dump()):
            raise InputError(f"rig {rig.name!r}: {moving} can move freely by these numbers: {'; '.join(unusual)}")
        raise InputError(
            f"rig {rig.name!r}: {moving} can move freely; hold it with a bearing that has stiffness in that direction"
        )
