"""The periodic steady state of a rig, exact for the linear, time-periodic equations.

On N points of the common period, the compressions of the meshes obey ``delta = delta_0 + G (g - kappa o delta)``:
delta_0 from torque and other forces with the mean mesh stiffness, G the periodic receptance between meshes, kappa the
mesh stiffness less its mean, and ``g = sum_j k_j e_j`` from the errors e_j of the teeth.

One mesh: the period is one revolution. Split kappa into the healthy part and the damage D, which is zero away from the
damaged teeth: then ``delta = R - P_S (D o delta)_S`` with the healthy rig's response R and its influence matrix
``P = (I + G kappa)^-1 G``, and only the system on the damaged samples S is left to solve. Several meshes: the period is
the revolutions after which all meshes repeat, and the whole system is solved by GMRES with G applied by FFT.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from sigdb.core.errors import InputError, SigdbError
from sigdb.core.typing import ComplexArray, FloatArray
from sigdb.dynamics.excitation import Harmonic, harmonics, profile_error
from sigdb.dynamics.steady_state import SteadyState
from sigdb.transmission import ModalSystem, Transmission, modal_system
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.gears import Mesh
from sigdb.transmission.mesh_stiffness import pair_stiffness, pairs_in_contact, place_in_contact, tooth_stiffness

SAMPLES_PER_TOOTH = 64
LEAST_SAMPLES_PER_TOOTH = 16
_TOLERANCE = 1e-10
_MOST_REVOLUTIONS = 60
"""Longest common period that is solved; a longer one is refused."""


@dataclass(frozen=True, kw_only=True)
class PeriodicRig:
    """A rig prepared for one gear at one operating point: all that does not depend on the damage.

    The damaged gear's mesh comes first, whatever its place in the rig.

    Attributes
    ----------
    system
        The rig's modal system.
    gear, teeth
        The damaged gear, and its tooth count.
    meshes, passes
        The meshes, the damaged gear's first, and their tooth passes in the common period. All begin at the mark.
    shaft_speed
        Speed of the damaged gear's shaft, rad/s.
    revolutions
        Revolutions of that shaft in the common period.
    samples
        n, samples in a revolution.
    harmonics
        Harmonic excitations, by order of that shaft.
    healthy
        (meshes, N) mesh stiffness without damage, N/m.
    transfer
        (harmonics of the common period, meshes + sensors, inputs) with the damaged gear's mesh first.
    influence
        (n, n) P for a rig with one mesh: healthy compression per unit force along the mesh at each sample.
    """

    system: ModalSystem
    gear: str
    teeth: int
    meshes: tuple[Mesh, ...]
    passes: tuple[int, ...]
    shaft_speed: float
    revolutions: int
    samples: int
    harmonics: tuple[Harmonic, ...]
    healthy: FloatArray
    transfer: ComplexArray
    influence: FloatArray | None

    @property
    def period(self) -> float:
        """The common period, s."""
        return self.revolutions * 2 * np.pi / self.shaft_speed

    def tooth_stiffness(self, damage: Mapping[int, ToothDamage]) -> FloatArray:
        """(teeth, n) stiffness of each tooth's pair, N/m; the mesh stiffness is the sum over teeth."""
        u = np.arange(self.samples) * self.teeth / self.samples
        return tooth_stiffness(self.meshes[0], self.teeth, u, damage)

    def mesh_stiffness(self, damage: Mapping[int, ToothDamage]) -> FloatArray:
        """(meshes, N) mesh stiffness with damage, N/m."""
        stiffness = self.healthy.copy()
        stiffness[0] = np.tile(self.tooth_stiffness(damage).sum(axis=0), self.revolutions)
        return stiffness

    def steady_state(self, damage: Mapping[int, ToothDamage]) -> SteadyState:
        """Steady state with damage by tooth number; an empty mapping is the healthy rig.

        Raises
        ------
        SigdbError
            If the solution for several meshes does not converge.
        """
        stiffness = self.mesh_stiffness(damage)
        free, forcing, direct = self._excitation(stiffness, self.tooth_stiffness(damage))
        kappa = stiffness - self._mean[:, None]
        delta = self._solve(kappa, free, forcing)
        force = forcing - kappa[:, :, None] * delta
        signals = direct + self._applied(force, slice(len(self.meshes), None))

        columns = signals.shape[2]
        n, teeth, orders = self.samples, self.teeth, len(self.harmonics)
        average = signals.reshape(len(signals), self.revolutions, n, columns).mean(axis=1)
        own = delta[0]
        static = self.transfer[0, : len(self.meshes), len(self.meshes)].real
        nominal = delta[1:, :, 0] + delta[1:, :, 1 + teeth :: 2].sum(axis=2)
        return SteadyState(
            signals=average[:, :, 0],
            specimen_response=average[:, :, 1 : 1 + teeth],
            harmonic_response=average[:, :, 1 + teeth :].reshape(len(average), n, orders, 2),
            orders=tuple(one.order for one in self.harmonics),
            compression=own[:, 0],
            compression_response=own[:, 1 : 1 + teeth],
            compression_harmonic=own[:, 1 + teeth :].reshape(len(own), orders, 2),
            mesh_stiffness=stiffness,
            static_compression=float(static[0]),
            least_elsewhere=float((nominal / static[1:, None]).min(initial=np.inf)),
        )

    @property
    def _mean(self) -> FloatArray:
        return np.array([mesh.stiffness for mesh in self.meshes])

    def _excitation(self, stiffness: FloatArray, by_tooth: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Excitations as columns: torque and profile errors, each tooth's index error, each order's two phases.

        Returns the compressions (meshes, N, columns) that forces cause with the mean mesh stiffness, the mesh forces
        ``g`` (meshes, N, columns) of errors, and the signals (sensors, N, columns) that forces cause.
        """
        m, sensors = len(self.meshes), self.transfer.shape[1] - len(self.meshes)
        total = self.samples * self.revolutions
        columns = 1 + self.teeth + 2 * len(self.harmonics)
        outputs = np.zeros((m + sensors, total, columns))
        forcing = np.zeros((m, total, columns))

        outputs[:, :, 0] = self.transfer[0, :, m].real[:, None]
        u = np.arange(self.samples) * self.teeth / self.samples
        own = by_tooth * profile_error(self.meshes[0], place_in_contact(u, self.teeth))
        forcing[0, :, 0] = np.tile(own.sum(axis=0), self.revolutions)
        for i, (mesh, passes) in enumerate(zip(self.meshes[1:], self.passes[1:], strict=True), start=1):
            x = pairs_in_contact(passes * np.arange(total) / total)
            forcing[i, :, 0] = (mesh.stiffness * pair_stiffness(mesh.profile, x) * profile_error(mesh, x)).sum(axis=0)
        forcing[0, :, 1 : 1 + self.teeth] = np.tile(by_tooth.T, (self.revolutions, 1))
        theta = 2 * np.pi * np.arange(total) / self.samples
        for i, one in enumerate(self.harmonics):
            phasor = np.exp(1j * one.order * theta)
            wave = (self.transfer[round(one.order * self.revolutions)] @ one.force)[:, None] * phasor
            error = one.error[:, None] * phasor
            for phase, part in enumerate((np.real, lambda z: -np.imag(z))):
                column = 1 + self.teeth + 2 * i + phase
                outputs[:, :, column] = part(wave)
                forcing[:, :, column] = stiffness * part(error)
        return outputs[:m], forcing, outputs[m:]

    def _solve(self, kappa: FloatArray, free: FloatArray, forcing: FloatArray) -> FloatArray:
        """(meshes, N, columns) compressions."""
        if self.influence is None:
            return self._solve_by_gmres(kappa, free + self._applied(forcing, slice(len(self.meshes))))
        healthy = (self.healthy[0] - self._mean[0])[:, None]
        response = free[0] + self.influence @ (forcing[0] - healthy * free[0])
        change = kappa[0] - healthy[:, 0]
        damaged = np.flatnonzero(change)
        if damaged.size:
            columns = self.influence[:, damaged] * change[damaged]
            local = np.linalg.solve(np.eye(damaged.size) + columns[damaged], response[damaged])
            response -= columns @ local
        return response[None]

    def _solve_by_gmres(self, kappa: FloatArray, right: FloatArray) -> FloatArray:
        shape = kappa.shape
        meshes = slice(len(self.meshes))

        def apply(x: FloatArray) -> FloatArray:
            delta = x.reshape(shape)
            return (delta + self._applied((kappa * delta)[:, :, None], meshes)[:, :, 0]).ravel()

        operator = LinearOperator((kappa.size, kappa.size), matvec=apply, dtype=float)
        solved = np.empty_like(right)
        for column in range(right.shape[2]):
            wanted = right[:, :, column].ravel()
            found, info = gmres(operator, wanted, rtol=_TOLERANCE, atol=0.0, restart=60, maxiter=20)
            if info:
                raise SigdbError("the periodic solution of the meshes does not converge; the rig may be unstable")
            solved[:, :, column] = found.reshape(shape)
        return solved

    def _applied(self, force: FloatArray, outputs: slice) -> FloatArray:
        """Outputs (k, N, columns) of forces along the meshes (meshes, N, columns), with the mean mesh stiffness."""
        spectrum = np.fft.rfft(force, axis=1)
        response = np.einsum("woi,iwc->owc", self.transfer[:, outputs, : len(self.meshes)], spectrum, optimize=True)
        return np.fft.irfft(response, n=force.shape[1], axis=1)


def prepare(
    rig: Transmission,
    *,
    gear: str | None = None,
    samples_per_tooth: int = SAMPLES_PER_TOOTH,
    system: ModalSystem | None = None,
) -> PeriodicRig:
    """Prepare the periodic problem of a gear: all that its damage does not change.

    Parameters
    ----------
    rig
        A transmission with torque through its meshes.
    gear
        The damaged gear; the driving gear of the first mesh if left out.
    samples_per_tooth
        Samples in a tooth pass; n is this times the gear's teeth.
    system
        The rig's modal system, for example a truncated one; synthesised in full if left out.

    Raises
    ------
    InputError
        If the rig has no such gear, no torque, or meshes that do not repeat within a reasonable time.

    Examples
    --------
    >>> import sigdb
    >>> healthy = prepare(sigdb.load_transmission("nasa-spiral-bevel")).steady_state({})
    >>> healthy.signals.shape, bool(healthy.min_compression > 0)
    ((2, 768), True)
    """
    gear = damaged_gear(rig, gear)
    if rig.operating.drive is None or not rig.operating.torque or not rig.operating.speed_rpm:
        raise InputError(
            f"rig {rig.name!r} has no torque through its meshes; give operating.drive, load, speed and torque"
        )
    own = rig.meshes_of(gear)
    if len(own) > 1:
        raise InputError(
            f"gear {gear!r} of rig {rig.name!r} takes part in {len(own)} meshes; damage is simulated in one"
        )
    first = list(rig.meshes).index(own[0])
    order = [first, *(i for i in range(len(rig.meshes)) if i != first)]
    meshes = tuple(list(rig.meshes.values())[i] for i in order)
    shaft = rig.gears[gear].shaft
    speed = abs(rig.speed(shaft))
    revolutions, all_passes = common_period(rig, gear)
    passes = tuple(all_passes[i] for i in order)

    teeth = rig.gears[gear].teeth
    n = samples_per_tooth * teeth
    total = n * revolutions
    system = system or modal_system(rig)
    outputs = [*order, *range(len(order), len(order) + len(rig.sensors))]
    inputs = [*order, *range(len(order), system.inputs.shape[1])]
    transfer = system.transfer(speed / revolutions * np.arange(total // 2 + 1))[:, outputs][:, :, inputs]
    healthy = np.array(
        [
            mesh.stiffness
            * pair_stiffness(mesh.profile, pairs_in_contact(count * np.arange(total) / total)).sum(axis=0)
            for mesh, count in zip(meshes, passes, strict=True)
        ]
    )
    return PeriodicRig(
        system=system,
        gear=gear,
        teeth=teeth,
        meshes=meshes,
        passes=passes,
        shaft_speed=speed,
        revolutions=revolutions,
        samples=n,
        harmonics=tuple(replace(one, error=one.error[order]) for one in harmonics(rig, system, shaft, revolutions)),
        healthy=healthy,
        transfer=transfer,
        influence=_influence(transfer[:, 0, 0], healthy[0] - meshes[0].stiffness) if len(meshes) == 1 else None,
    )


def _influence(receptance: ComplexArray, kappa: FloatArray) -> FloatArray:
    """``P = (I + G kappa)^-1 G`` with G the circulant of a receptance at harmonics of the period."""
    n = len(kappa)
    response = np.fft.irfft(receptance, n=n)
    circulant = response[(np.arange(n)[:, None] - np.arange(n)) % n]
    return np.linalg.solve(np.eye(n) + circulant * kappa, circulant)


def common_period(rig: Transmission, gear: str) -> tuple[int, tuple[int, ...]]:
    """Least revolutions of a gear in which every mesh makes whole tooth passes, and each mesh's passes in them.

    Raises
    ------
    InputError
        If that takes too many revolutions to be solved.

    Examples
    --------
    >>> import sigdb
    >>> common_period(sigdb.load_transmission("two-stage-gearbox"), "input-pinion")
    (5, (160, 96))
    """
    own = abs(rig.ratio(rig.gears[gear].shaft))
    driving = [rig.gears[mesh.driving] for mesh in rig.meshes.values()]
    per_turn = [one.teeth * abs(rig.ratio(one.shaft)) / own for one in driving]
    for revolutions in range(1, _MOST_REVOLUTIONS + 1):
        passes = [revolutions * one for one in per_turn]
        if np.allclose(passes, np.round(passes), rtol=0, atol=1e-6):
            return revolutions, tuple(round(one) for one in passes)
    raise InputError(
        f"the meshes of rig {rig.name!r} do not repeat within {_MOST_REVOLUTIONS} revolutions; choose tooth counts "
        "with a shorter common period"
    )


def damaged_gear(rig: Transmission, gear: str | None) -> str:
    """The gear that damage refers to: the one named, or the driving gear of the first mesh.

    Raises
    ------
    InputError
        If the rig has no such gear, or the gear meshes with none.
    """
    if gear is None:
        if not rig.meshes:
            raise InputError(f"rig {rig.name!r} has no mesh, so no gear can be damaged")
        return next(iter(rig.meshes.values())).driving
    if not rig.meshes_of(gear):
        raise InputError(f"gear {gear!r} of rig {rig.name!r} takes part in no mesh; name a gear that does")
    return gear
