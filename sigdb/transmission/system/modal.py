"""Modal synthesis: from the assembled rig to one ``ModalSystem`` of poles, inputs, outputs and direct terms.

Component modes of each rotor and of the casing come first, equations (5) and (6); the coupled equations (8), (9)
in those coordinates, with the mean mesh stiffness and gyroscopics, give one complex eigenproblem.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag, eigh, null_space

from sigdb.core import ComplexArray, FloatArray, InputError
from sigdb.transmission.parts.usual_ranges import unusual_numbers
from sigdb.transmission.rig import Transmission
from sigdb.transmission.system.assembly import Assembly, assemble
from sigdb.transmission.system.elements import Element, mesh_elements, meshes_among
from sigdb.transmission.system.small_matrices import small_matrices

_FREE = 1e-12
"""Square of a mode's frequency, as a fraction of the greatest, below which the mode moves freely."""


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


@dataclass(frozen=True, kw_only=True)
class _Synthesis:
    """The coupled eigenproblem, solved: ``shapes`` (n, m) and ``participation`` (m, n) in the rig's coordinates."""

    parts: Assembly
    poles: ComplexArray
    shapes: ComplexArray
    participation: ComplexArray


@small_matrices
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
    synthesis = _synthesise(rig, component_modes)
    parts, poles = synthesis.parts, synthesis.poles
    inputs = synthesis.participation @ np.column_stack(
        [parts.meshes, parts.torque, parts.load, parts.unbalance, parts.friction]
    )
    displacement = np.vstack([parts.meshes.T, parts.sensors]) @ synthesis.shapes
    order = np.array([0] * len(rig.meshes) + [sensor.derivative for sensor in rig.sensors.values()])
    first_moment = ((displacement * poles) @ inputs).real
    return ModalSystem(
        poles=poles,
        inputs=inputs,
        outputs=displacement * poles ** order[:, None],
        direct=np.where(order[:, None] == 2, first_moment, 0.0),
        meshes=tuple(rig.meshes),
        sensors=tuple(rig.sensors),
        mesh_stiffness=parts.mesh_stiffness,
        unbalanced=rig.unbalanced,
        elements=mesh_elements(rig),
    )


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
    synthesis = _synthesise(rig, component_modes)
    upper = np.flatnonzero(synthesis.poles.imag >= 0)
    upper = upper[np.argsort(np.abs(synthesis.poles[upper]), kind="stable")]
    poles = synthesis.poles[upper]
    return CoupledModes(
        frequency_hz=poles.imag / (2 * np.pi),
        damping_ratio=-poles.real / np.abs(poles),
        moves=tuple(_energy_shares(synthesis.parts, synthesis.shapes[:, i]) for i in upper),
    )


def _energy_shares(parts: Assembly, shape: ComplexArray | FloatArray) -> dict[str, float]:
    energy = (shape.conj() * (parts.mass @ shape)).real
    shares = {name: float(max(energy[dofs].sum(), 0.0)) for name, dofs in parts.motions.items()}
    total = sum(shares.values())
    return {name: share / total for name, share in sorted(shares.items(), key=lambda item: -item[1])}


def _synthesise(rig: Transmission, component_modes: int | None) -> _Synthesis:
    parts = assemble(rig)
    basis = _component_basis(parts, component_modes)
    mass, stiffness = basis.T @ parts.mass @ basis, basis.T @ parts.stiffness @ basis
    h = basis.T @ parts.meshes
    full = stiffness + h @ np.diag(parts.mesh_stiffness) @ h.T
    stiffness = (full + full.T) / 2
    damping = basis.T @ (parts.damping + parts.gyroscopic) @ basis
    damping = damping + _rotor_damping(rig, parts, basis, mass, stiffness)

    # The train's free rotation compresses nothing; kept, it would be a defective double pole at zero.
    turning = np.linalg.lstsq(basis, parts.free_rotation, rcond=None)[0]
    elastic = null_space((mass @ turning)[None])
    squares, modes = eigh(elastic.T @ stiffness @ elastic, elastic.T @ mass @ elastic)
    _check_supported(rig, parts, basis @ elastic, squares, modes)
    phi = elastic @ modes

    n = len(squares)
    # Cross terms of bearings may make stiffness unsymmetric: they couple the symmetric part's modes.
    crossed = phi.T @ (full - stiffness) @ phi
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(squares) - crossed, -phi.T @ damping @ phi]])
    poles, right = np.linalg.eig(state)
    left = np.linalg.inv(right)
    return _Synthesis(
        parts=parts,
        poles=poles,
        shapes=basis @ phi @ right[:n],
        participation=left[:, n:] @ (basis @ phi).T,
    )


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
    rigid = modes[:, squares < _FREE * squares[-1]]
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
    carried = stiffness[count:, :count] @ modes / np.where(squares > _FREE * squares[-1], squares, np.inf)
    relative = np.vstack([m @ modes, carried])
    return relative * (2 * rig.damping_ratio * np.sqrt(squares.clip(min=0))) @ relative.T


def _check_supported(
    rig: Transmission, parts: Assembly, basis: FloatArray, squares: FloatArray, modes: FloatArray
) -> None:
    if squares[0] < _FREE * squares[-1]:
        moving = next(iter(_energy_shares(parts, basis @ modes[:, 0])))
        if unusual := unusual_numbers(rig.model_dump()):
            raise InputError(f"rig {rig.name!r}: {moving} can move freely by these numbers: {'; '.join(unusual)}")
        raise InputError(
            f"rig {rig.name!r}: {moving} can move freely; hold it with a bearing that has stiffness in that direction"
        )
