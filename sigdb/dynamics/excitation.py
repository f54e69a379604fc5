"""What excites a rig besides its varying stiffness: torque, tooth errors, unbalance, run-out, a fluctuating load.

All of it is expressed over the angle theta of the averaged shaft. An excitation of another shaft is seen by the average
only where it turns a whole number of times in the common period of the meshes; otherwise it cancels.
"""

from dataclasses import dataclass

import numpy as np

from sigdb.core.typing import ComplexArray, FloatArray
from sigdb.transmission import ModalSystem, Transmission
from sigdb.transmission.gears import Mesh


@dataclass(frozen=True, kw_only=True)
class Harmonic:
    """Excitations of one order of the averaged shaft: ``Re(force exp(i order theta))``.

    Attributes
    ----------
    order
        Cycles per revolution.
    force
        (inputs,) complex amplitude of each input of the modal system.
    error
        (meshes,) complex amplitude of the error that all tooth pairs of a mesh have in common, m.
    """

    order: float
    force: ComplexArray
    error: ComplexArray


def harmonics(rig: Transmission, system: ModalSystem, shaft: str, revolutions: int = 1) -> tuple[Harmonic, ...]:
    """Unbalance, run-out and fluctuating load, by order of a shaft: those of whole cycles in some revolutions."""
    found: dict[int, Harmonic] = {}

    def at(speed: float, cycles: int = 1) -> Harmonic | None:
        turns = cycles * revolutions * abs(speed / rig.speed(shaft))
        if not np.isclose(turns, round(turns)) or round(turns) == 0:
            return None
        none = Harmonic(
            order=round(turns) / revolutions,
            force=np.zeros(system.inputs.shape[1], complex),
            error=np.zeros(len(rig.meshes), complex),
        )
        return found.setdefault(round(turns), none)

    for i, name in enumerate(system.unbalanced):
        harmonic = at(rig.speed(name))
        if harmonic is not None:
            cosine = len(rig.meshes) + 2 + 2 * i
            harmonic.force[cosine : cosine + 2] += [1.0, -1.0j]
    for i, mesh in enumerate(rig.meshes.values()):
        for gear in (rig.gears[mesh.driving], rig.gears[mesh.driven]):
            harmonic = at(rig.speed(gear.shaft)) if gear.runout else None
            if harmonic is not None:
                harmonic.error[i] += gear.runout * np.exp(-1j * np.deg2rad(gear.runout_angle_deg))
    operating = rig.operating
    if operating.load is not None and operating.load_fluctuation:
        harmonic = at(rig.speed(rig.couplings[operating.load].shaft), operating.load_order)
        if harmonic is not None:
            angle = operating.load_order * np.deg2rad(operating.load_angle_deg)
            harmonic.force[len(rig.meshes) + 1] += operating.load_fluctuation * np.exp(-1j * angle)
    return tuple(found[turns] for turns in sorted(found))


def profile_error(mesh: Mesh, x: FloatArray) -> FloatArray:
    """Error of a tooth pair's profile at x passes after first contact, m."""
    if mesh.profile_error is None:
        return np.zeros_like(x)
    return mesh.profile_error.amplitude * (2 * x / mesh.profile.contact_ratio - 1) ** 2
