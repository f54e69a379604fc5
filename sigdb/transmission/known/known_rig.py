"""A rig from the few numbers that are known of it: the others are of the right size and have ranges."""

import tomllib
from collections.abc import Sequence

from sigdb.core import InputError, validated
from sigdb.transmission.known.known_numbers import KnownNumbers
from sigdb.transmission.known.rig_tables import RigTables
from sigdb.transmission.rig import Transmission, transmission_of
from sigdb.transmission.summary.rig_text import rig_text

Number = float | str
"""A number in SI units, or a text with a unit."""

_HEAD = (
    "A rig from what is known of it: the sources of these numbers begin with `derived: as stated to new-rig`.",
    "The others are of the right size for it, by rules of machine design; `assumed.NAME` is the range of each.",
    "Replace what you know better, with its source, and remove its range. SI units, but for names that end in _deg,",
    '_rpm or _hz; a text such as "2.5 mm" may stand for a number. The casing\'s frame has Y upwards.',
)


def new_rig(
    teeth: str | Sequence[str | tuple[int, int]],
    *,
    speed: Number,
    torque: Number,
    module: Number | Sequence[Number] | None = None,
    helix_angle: Number = 0.0,
    energy_method: bool = False,
    name: str = "new-rig",
) -> Transmission:
    """Return a rig of one to three spur or helical stages from the few numbers that are known of it.

    All other numbers follow from rules of machine design. Each has a source that names its rule, and most have a range
    in ``assumed``. They are of the right size, which is no proof of strength.

    Parameters
    ----------
    teeth : str or sequence
        Tooth counts of driving and driven gear, ``"23/67"``; of several stages ``"23/67,19/81"``, or a list.
    speed : float or str
        Speed of the driving shaft, rpm, or a text such as ``"24.7 Hz"``.
    torque : float or str
        Mean torque on the driving shaft, N m, or a text such as ``"45 N m"``.
    module : float, str or sequence, optional
        Normal module, m, or a text such as ``"2.5 mm"``; one for all stages, or one for each. Left out, it is sized by
        the torque and has a range.
    helix_angle : float or str
        Helix angle of all stages, deg, 0 to 45.
    energy_method : bool
        Whether the mesh stiffness follows from the shape of spur teeth by the energy method, so that damage may be
        given by its size; otherwise it is that of ISO 6336.
    name : str
        Name of the rig.

    Returns
    -------
    Transmission

    Raises
    ------
    InputError
        If a number breaks a rule, or teeth of steel would not bear the torque.

    Examples
    --------
    >>> import sigdb
    >>> rig = sigdb.new_rig("23/67", module="2.5 mm", speed="1480 rpm", torque="45 N m")
    >>> rig.meshes["main"].module, rig.gears["wheel"].teeth, rig.operating.torque
    (0.0025, 67, 45.0)
    >>> sigdb.simulate(rig).min_mesh_force > 0
    True
    """
    data = {"teeth": teeth, "speed_rpm": speed, "torque": torque, "module": module, "helix_angle_deg": helix_angle}
    numbers = validated(KnownNumbers, data, owner="new_rig")
    text = known_rig_text(numbers, name, energy_method=energy_method)
    return transmission_of(tomllib.loads(text), owner=f"rig {name!r}")


def known_rig_text(numbers: KnownNumbers, name: str, *, energy_method: bool) -> str:
    """Return the text of a rig file from the known numbers of the rig.

    Raises
    ------
    InputError
        If teeth of steel would not bear the torque, or the energy method does not hold for them.
    """
    if energy_method and numbers.helix_angle_deg:
        raise InputError(
            f"new-rig: the energy method is for spur teeth, and the helix angle is {numbers.helix_angle_deg:g} deg; "
            "leave one of them out"
        )
    return rig_text(_HEAD, list(RigTables(numbers, name, energy_method=energy_method).tables()))
