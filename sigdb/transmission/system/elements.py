"""Local elements: places of a rig where a force depends on the local motion otherwise than by the system's poles.

An element has input columns, along which its force acts, output rows, which give the local motion, and a law of force.
The poles hold its mean, linear part; the law gives the rest. Meshes are elements whose law is linear while their teeth
touch, with a stiffness that varies with the angle. Any other law is a function of the local motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sigdb.core import FloatArray
from sigdb.transmission.rig import Transmission

if TYPE_CHECKING:
    from sigdb.transmission.system.modal import ModalSystem


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
