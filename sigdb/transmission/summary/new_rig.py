"""A rig file to start from, whose fields are explained where they stand: a spur pair, or a rig by known numbers."""

import os
import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from sigdb.core import InputError, publish
from sigdb.transmission.known.known_numbers import KnownNumbers
from sigdb.transmission.known.known_rig import known_rig_text
from sigdb.transmission.mesh.geometry_profiles import EnergyMethod
from sigdb.transmission.parts.bodies import Disk
from sigdb.transmission.parts.gears import Gear, Mesh, Operating, ProfileError, Trapezoid
from sigdb.transmission.parts.sensors import Sensor
from sigdb.transmission.parts.shafts import Material, Segment, Shaft
from sigdb.transmission.parts.supports import Bearing, CasingMode, Coupling
from sigdb.transmission.rig import Transmission
from sigdb.transmission.summary.rig_text import Table, commented_text, rig_text

_BEARING: dict[str, Any] = {"stiffness": [1.0e8, 1.0e8, 5.0e7]}
_SEGMENT: dict[str, Any] = {"length": 0.2, "outer_diameter": 0.03, "elements": 5}
_GEAR: dict[str, Any] = {"node": 2, "body_length": 0.02, "bore": 0.03, "material": "steel"}

_TABLES: tuple[tuple[str, type[BaseModel], dict[str, Any]], ...] = (
    ("operating", Operating, {"drive": "motor", "load": "brake", "speed_rpm": 1500.0, "torque": 60.0}),
    ("materials.steel", Material, {"density": 7850.0, "young_modulus": 2.07e11, "shear_modulus": 7.96e10}),
    ("shafts.pinion-shaft", Shaft, {"axis": [0.0, 0.0, 1.0], "material": "steel"}),
    ("[shafts.pinion-shaft.segments]", Segment, _SEGMENT),
    ("shafts.wheel-shaft", Shaft, {"axis": [0.0, 0.0, 1.0], "material": "steel"}),
    ("[shafts.wheel-shaft.segments]", Segment, _SEGMENT),
    ("gears.pinion", Gear, {"shaft": "pinion-shaft", "teeth": 23} | _GEAR),
    ("gears.wheel", Gear, {"shaft": "wheel-shaft", "teeth": 46} | _GEAR),
    (
        "meshes.main",
        Mesh,
        {
            "driving": "pinion",
            "driven": "wheel",
            "module": 0.003,
            "face_width": 0.02,
            "pressure_angle_deg": 20.0,
            "line_of_centres": [1.0, 0.0, 0.0],
            "stiffness": 3.0e8,
        },
    ),
    ("meshes.main.profile", Trapezoid, {"contact_ratio": 1.65, "flank": 0.2}),
    ("couplings.motor", Coupling, {"shaft": "pinion-shaft", "node": 5, "stiffness": 5.0e3, "inertia": 0.02}),
    ("couplings.brake", Coupling, {"shaft": "wheel-shaft", "node": 5, "stiffness": 1.0e4, "inertia": 0.04}),
    ("bearings.pinion-left", Bearing, {"shaft": "pinion-shaft", "node": 0} | _BEARING),
    ("bearings.pinion-right", Bearing, {"shaft": "pinion-shaft", "node": 4} | _BEARING),
    ("bearings.wheel-left", Bearing, {"shaft": "wheel-shaft", "node": 0} | _BEARING),
    ("bearings.wheel-right", Bearing, {"shaft": "wheel-shaft", "node": 4} | _BEARING),
    (
        "sensors.pinion-vertical",
        Sensor,
        {"gear": "pinion", "direction": [0.0, 1.0, 0.0], "quantity": "acceleration"},
    ),
)
_MORE: tuple[tuple[str, type[BaseModel]], ...] = (
    ("disks.NAME", Disk),
    ("meshes.main.profile_error", ProfileError),
    ("[casing.modes]", CasingMode),
)
"""Tables that a spur pair does not need; the file shows them as comments."""


def write_new_rig(
    path: str | Path, *, overwrite: bool = False, energy_method: bool = False, numbers: KnownNumbers | None = None
) -> Path:
    """Write a rig file that can be loaded and simulated as it is, to be changed field by field.

    Parameters
    ----------
    path
        File that ends in ``.toml``; the rig is named after it.
    overwrite
        Whether a file that exists is replaced.
    energy_method
        Whether the mesh stiffness follows from the shape of the teeth by the energy method, so that damage may be given
        by its geometry (``crack_depth``, ``pit_diameter``, ...); otherwise it is a trapezoid of a given stiffness, or
        that of ISO 6336 where numbers are known.
    numbers
        Known numbers, from which the others follow as in :func:`sigdb.new_rig`; a spur pair to start from if left out.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the name does not end in ``.toml``, the file exists, or teeth of steel would not bear the torque.
    """
    path = Path(path)
    if path.suffix != ".toml":
        raise InputError(f"{path}: a rig file's name ends in .toml")
    text = new_rig_text(path.stem, energy_method=energy_method, numbers=numbers)
    if not overwrite and os.path.lexists(path):
        raise InputError(f"{path}: exists already; choose another name, or give --force to overwrite it")
    publish(path, text)
    return path


_HEAD = (
    "A spur pair to start from. Replace every number, and its source, which says where it is from and why:",
    "`published: ...`, `derived: ...` or `assumed: ...`. SI units, but for names that end in _deg, _rpm or _hz.",
    "The casing's frame has Y upwards. A field behind a # can be left out; its value is the default, if any.",
)
_START = "assumed: a value to start from, replace it"


def new_rig_text(name: str, *, energy_method: bool = False, numbers: KnownNumbers | None = None) -> str:
    """Return the text of a rig file to start from, as :func:`write_new_rig` writes it.

    Examples
    --------
    >>> import tomllib
    >>> tomllib.loads(new_rig_text("my-rig"))["gears"]["pinion"]["teeth"]
    23
    """
    name = re.sub(r"[^A-Za-z0-9_-]", "-", name)
    name = name if name[:1].isalpha() else f"rig-{name}"
    if numbers is not None:
        return known_rig_text(numbers, name, energy_method=energy_method)
    top = {"name": name, "title": "A spur pair", "damping_ratio": 0.04}
    tables = [_table("", Transmission, top)]
    for table, section, values in _TABLES:
        if energy_method and section is Trapezoid:
            tables.append(_table(table, EnergyMethod, {"kind": "energy-method", "flank": 0.15}))
        else:
            left_out = ("stiffness",) if energy_method and section is Mesh else ()
            tables.append(_table(table, section, {key: values[key] for key in values if key not in left_out}))
    return rig_text(_HEAD, tables) + commented_text([_table(table, section, {}) for table, section in _MORE])


def _table(name: str, section: type[BaseModel], values: dict[str, Any]) -> Table:
    """Return a table whose numbers are to be replaced."""
    sources = {field: _START for field in section.model_fields if not isinstance(values.get(field, ""), str)}
    return Table(name=name, section=section, values=values, sources=sources)
