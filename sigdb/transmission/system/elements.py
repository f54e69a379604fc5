"""Local elements: places of a rig where a force depends on the local motion otherwise than by the system's poles.

An element has input columns, along which its force acts, output rows, which give the local motion, and a law of force.
The poles hold its mean, linear part; the law gives the rest. Meshes are elements whose law is linear while their teeth
touch, with a stiffness that varies with the angle. Any other law is a function of the local motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.transmission.rig import Transmission

if TYPE_CHECKING:
    from sigdb.transmission.system.modal import ModalSystem

UNLOADED = 1e-6
"""Share of the greatest static force of a rig's meshes up to which a mesh carries no torque."""


@dataclass(frozen=True, kw_only=True)
class Element:
    """A place where a force depends on the local motion.

    Attributes
    ----------
    name
        Name of the part of the rig.
    columns
        Columns of ``ModalSystem.inputs`` along which its force acts.
    rows
        Rows of ``ModalSystem.outputs`` that give the local motion, m or rad.
    """

    name: str
    columns: tuple[int, ...]
    rows: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class MeshElement(Element):
    """A gear pair: its columns are the normal and the two friction vectors, its row is the compression.

    Attributes
    ----------
    mean_stiffness
        Stiffness that the poles hold, N/m.
    backlash
        Way from one flank to the other along the normal, m; None where the backs never touch.
    """

    mean_stiffness: float
    backlash: float | None


@dataclass(frozen=True, kw_only=True)
class NonlinearElement(Element):
    """An element whose force is any function of the local motion, such as a bearing with clearance.

    Attributes
    ----------
    law
        Forces (columns,) on the rig beyond those that the poles hold, N or N m, from the local motion (rows,), the
        static one included.
    """

    law: Callable[[FloatArray], FloatArray]


def mesh_elements(rig: Transmission) -> tuple[MeshElement, ...]:
    """Return the meshes of a rig as elements of its modal system, in the rig's order."""
    first_friction = len(rig.meshes) + 2 + 2 * len(rig.unbalanced)
    return tuple(
        MeshElement(
            name=name,
            columns=(i, first_friction + 2 * i, first_friction + 2 * i + 1),
            rows=(i,),
            mean_stiffness=mesh.stiffness,
            backlash=mesh.backlash,
        )
        for i, (name, mesh) in enumerate(rig.meshes.items())
    )


def meshes_among(elements: Sequence[Element]) -> list[MeshElement]:
    """Return those elements that are meshes, in their order."""
    return [element for element in elements if isinstance(element, MeshElement)]


def nonlinear_among(elements: Sequence[Element]) -> list[NonlinearElement]:
    """Return those elements whose law is not linear while they keep contact, in their order."""
    return [element for element in elements if isinstance(element, NonlinearElement)]


def elements_from(rig: Transmission, gear: str, system: "ModalSystem") -> list[Element]:
    """Return the elements of a rig's modal system, the mesh of a gear first."""
    first = rig.meshes_of(gear)[0]
    return sorted(system.elements, key=lambda element: element.name != first)


def static_forces(rig: Transmission, names: Sequence[str], static_compression: FloatArray) -> FloatArray:
    """Return the force (meshes,) of each mesh under the steady torque, N, as the scale of its varying force.

    A mesh that carries no torque, such as that of a wheel that idles, has the greatest force of all meshes as its
    scale.

    Parameters
    ----------
    rig
        The transmission.
    names
        Names of its meshes, in the order of the compressions.
    static_compression
        (meshes,) compressions under the mean torque and stiffness, m.

    Raises
    ------
    InputError
        If the torque pulls the teeth of a mesh apart.

    Examples
    --------
    >>> import numpy as np, sigdb
    >>> static_forces(sigdb.load_transmission("nasa-spiral-bevel"), ["main"], np.array([1e-5])).round(6)
    array([2200.])
    """
    forces = np.array([rig.meshes[name].stiffness for name in names]) * static_compression
    greatest = np.abs(forces).max(initial=0.0)
    for sentence in pulled_apart(rig, names, static_compression):
        raise InputError(f"rig {rig.name!r}: {sentence}")
    return np.where(forces > UNLOADED * greatest, forces, greatest)


def pulled_apart(rig: Transmission, names: Sequence[str], static_compression: FloatArray) -> list[str]:
    """Return a sentence for each mesh whose teeth the torque pulls apart; arguments as of :func:`static_forces`."""
    forces = np.array([rig.meshes[name].stiffness for name in names]) * static_compression
    greatest = np.abs(forces).max(initial=0.0)
    return [
        f"meshes.{name} has a static force of {force:.4g} N: the torque pulls its teeth apart, since {mesh.driven} "
        f"drives {mesh.driving}; give driving = {mesh.driven!r} and driven = {mesh.driving!r}, or reverse the torque"
        for name, mesh, force in zip(names, (rig.meshes[name] for name in names), forces.tolist(), strict=True)
        if force < -UNLOADED * greatest
    ]
