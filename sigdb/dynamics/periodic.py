"""The periodic steady state of a rig with one mesh, exact for the linear, time-periodic equations.

On n points of one revolution of the damaged gear, the compression obeys ``delta = delta_s + G (g - kappa o delta)``:
delta_s from the torque, G the circulant of the mesh's periodic receptance, kappa the mesh stiffness less its mean, and
``g = sum_j k_j e_j`` from the index errors e_j of the teeth. Split kappa into the healthy part and the damage D, which
is zero away from the damaged teeth: then ``delta = R - P_S (D o delta)_S`` with the healthy rig's response R and its
influence matrix ``P = (I + G kappa)^-1 G``, and only the system on the damaged samples S is left to solve.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sigdb.core.errors import InputError
from sigdb.core.typing import ComplexArray, FloatArray
from sigdb.transmission import ModalSystem, Transmission, modal_system
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.gears import Mesh
from sigdb.transmission.mesh_stiffness import tooth_stiffness

SAMPLES_PER_TOOTH = 64
LEAST_SAMPLES_PER_TOOTH = 16


@dataclass(frozen=True, kw_only=True)
class SteadyState:
    """Periodic response over one revolution of a gear, affine in the index errors e of its teeth.

    Signal: ``signals + specimen_response @ e``; compression likewise.

    Attributes
    ----------
    signals
        (sensors, n) nominal signals y_D, in the sensors' units.
    specimen_response
        (sensors, n, teeth) Y_D, unit of the signal per metre of index error.
    compression
        (n,) nominal compression of the mesh along its normal, m.
    compression_response
        (n, teeth) change of the compression per metre of index error.
    mesh_stiffness
        (n,) sum over the tooth pairs in contact, N/m.
    static_compression
        Compression under the mean mesh stiffness, m.
    """

    signals: FloatArray
    specimen_response: FloatArray
    compression: FloatArray
    compression_response: FloatArray
    mesh_stiffness: FloatArray
    static_compression: float

    @property
    def mesh_force(self) -> FloatArray:
        """(n,) nominal force along the normal, N."""
        return self.mesh_stiffness * self.compression

    @property
    def min_compression(self) -> float:
        """Least compression over the revolution as a fraction of the static one; below 0 the mesh loses contact."""
        return float(self.compression.min() / self.static_compression)


@dataclass(frozen=True, kw_only=True)
class PeriodicRig:
    """A rig prepared for one gear at one operating point: all that does not depend on the damage.

    Attributes
    ----------
    system
        The rig's modal system.
    gear, teeth
        The damaged gear, and its tooth count.
    mesh
        The mesh.
    shaft_speed
        Speed of the damaged gear's shaft, rad/s.
    pass_coordinate
        (n,) angle in tooth passes.
    healthy_stiffness
        (n,) mesh stiffness without damage, N/m.
    influence
        (n, n) P: healthy compression per unit force along the mesh at each sample.
    sensor_response
        (harmonics, sensors) transfer from a force along the mesh to each sensor.
    static_compression
        Compression under the torque with the mean mesh stiffness, m.
    static_signals
        (sensors,) response of each sensor to the torque with the mean mesh stiffness.
    """

    system: ModalSystem
    gear: str
    teeth: int
    mesh: Mesh
    shaft_speed: float
    pass_coordinate: FloatArray
    healthy_stiffness: FloatArray
    influence: FloatArray
    sensor_response: ComplexArray
    static_compression: float
    static_signals: FloatArray

    def tooth_stiffness(self, damage: Mapping[int, ToothDamage]) -> FloatArray:
        """(teeth, n) stiffness of each tooth's pair, N/m; the mesh stiffness is the sum over teeth."""
        return tooth_stiffness(self.mesh, self.teeth, self.pass_coordinate, damage)

    def steady_state(self, damage: Mapping[int, ToothDamage]) -> SteadyState:
        """Steady state with damage by tooth number; an empty mapping is the healthy rig."""
        by_tooth = self.tooth_stiffness(damage)
        stiffness = by_tooth.sum(axis=0)
        kappa = stiffness - self.mesh.stiffness
        healthy_kappa = self.healthy_stiffness - self.mesh.stiffness

        # Column 0 is the torque's response, the others those of a unit index error of each tooth.
        forcing = np.column_stack([-healthy_kappa * self.static_compression, by_tooth.T])
        response = self.influence @ forcing
        response[:, 0] += self.static_compression

        changed = np.flatnonzero(stiffness != self.healthy_stiffness)
        if changed.size:
            loss = (stiffness - self.healthy_stiffness)[changed]
            columns = self.influence[:, changed] * loss
            local = np.linalg.solve(np.eye(changed.size) + columns[changed], response[changed])
            response -= columns @ local

        force = -kappa[:, None] * response
        force[:, 1:] += by_tooth.T
        spectrum = np.fft.rfft(force, axis=0)
        signals = np.fft.irfft(self.sensor_response[:, :, None] * spectrum[:, None, :], n=len(kappa), axis=0)
        signals[:, :, 0] += self.static_signals
        return SteadyState(
            signals=signals[:, :, 0].T,
            specimen_response=signals[:, :, 1:].transpose(1, 0, 2),
            compression=response[:, 0],
            compression_response=response[:, 1:],
            mesh_stiffness=stiffness,
            static_compression=self.static_compression,
        )


def prepare(rig: Transmission, *, gear: str | None = None, samples_per_tooth: int = SAMPLES_PER_TOOTH) -> PeriodicRig:
    """Factor the healthy part of the periodic problem.

    Parameters
    ----------
    rig
        A transmission with one mesh.
    gear
        The damaged gear; the driving gear of the mesh if left out.
    samples_per_tooth
        Samples in a tooth pass; n is this times the gear's teeth.

    Raises
    ------
    InputError
        If the rig has no such gear, or more than one mesh.

    Examples
    --------
    >>> import sigdb
    >>> healthy = prepare(sigdb.load_transmission("nasa-spiral-bevel")).steady_state({})
    >>> healthy.signals.shape, bool(healthy.min_compression > 0)
    ((2, 768), True)
    """
    gear = damaged_gear(rig, gear)
    if len(rig.meshes) != 1:
        raise InputError(f"rig {rig.name!r} has {len(rig.meshes)} meshes; the periodic solver takes rigs with one mesh")
    (mesh,) = rig.meshes.values()
    teeth = rig.gears[gear].teeth
    n = samples_per_tooth * teeth
    u = np.arange(n) / samples_per_tooth
    speed = abs(rig.speed(rig.gears[gear].shaft))

    system = modal_system(rig)
    transfer = system.transfer(speed * np.arange(n // 2 + 1))
    receptance = np.fft.irfft(transfer[:, 0, 0], n=n)
    circulant = receptance[(np.arange(n)[:, None] - np.arange(n)) % n]
    healthy = tooth_stiffness(mesh, teeth, u, {}).sum(axis=0)
    influence = np.linalg.solve(np.eye(n) + circulant * (healthy - mesh.stiffness), circulant)
    return PeriodicRig(
        system=system,
        gear=gear,
        teeth=teeth,
        mesh=mesh,
        shaft_speed=speed,
        pass_coordinate=u,
        healthy_stiffness=healthy,
        influence=influence,
        sensor_response=transfer[:, 1:, 0],
        static_compression=float(transfer[0, 0, 1].real),
        static_signals=transfer[0, 1:, 1].real,
    )


def damaged_gear(rig: Transmission, gear: str | None) -> str:
    """The gear that damage refers to: the one named, or the driving gear of the first mesh.

    Raises
    ------
    InputError
        If the rig has no such gear, or the gear meshes with none.
    """
    if gear is None:
        return next(iter(rig.meshes.values())).driving
    if not rig.meshes_of(gear):
        raise InputError(f"gear {gear!r} of rig {rig.name!r} takes part in no mesh; name a gear that does")
    return gear
