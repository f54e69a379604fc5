"""Variations of a rig, one number at a time, for the sensitivity of the claims."""

from collections.abc import Iterator
from dataclasses import dataclass

from sigdb.core import validated
from sigdb.transmission import Transmission

_FACTORS = {
    "speed": (0.94, 0.97, 1.03, 1.06),
    "mesh stiffness": (0.8, 1.2),
    "bearing stiffness": (0.8, 1.2),
    "damping": (0.7, 1.3),
    "contact ratio": (0.9, 1.1),
    "edge width": (0.8, 1.2),
}
"""Factors by number. In the paper's tests the speed changed by up to 6 %; the others are known no better than this."""


@dataclass(frozen=True, kw_only=True)
class Variation:
    """A rig with one number changed.

    Attributes
    ----------
    what
        Name of the number.
    factor
        Factor on it.
    rig
        The changed rig.
    """

    what: str
    factor: float
    rig: Transmission


def variations(rig: Transmission, gear: str) -> Iterator[Variation]:
    """Yield all variations that the rig allows; edge width is the flank of the mesh's profile."""
    mesh = rig.meshes_of(gear)[0]
    paths = {
        "speed": "operating.speed_rpm",
        "mesh stiffness": f"meshes.{mesh}.stiffness",
        "damping": "damping_ratio",
        "contact ratio": f"meshes.{mesh}.profile.contact_ratio",
        "edge width": f"meshes.{mesh}.profile.flank",
    }
    for what, factors in _FACTORS.items():
        if what in ("contact ratio", "edge width") and rig.meshes[mesh].profile.kind != "trapezoid":
            continue
        for factor in factors:
            if what == "bearing stiffness":
                changed = with_bearings(rig, factor)
            else:
                changed = rig.replace({paths[what]: factor * rig.value(paths[what])})
            yield Variation(what=what, factor=factor, rig=changed)


def with_bearings(rig: Transmission, factor: float) -> Transmission:
    """Return the rig with the stiffness of all bearings times a factor."""
    data = rig.model_dump()
    for bearing in data["bearings"].values():
        for name in ("stiffness", "tilt_stiffness", "stiffness_matrix"):
            if bearing.get(name) is not None:
                bearing[name] = _times(bearing[name], factor)
    return validated(Transmission, data, owner=f"rig {rig.name!r} with bearings times {factor}")


def _times(value: object, factor: float) -> object:
    if isinstance(value, list | tuple):
        return tuple(_times(item, factor) for item in value)
    return value * factor  # type: ignore[operator]
