"""A rig file to start from: a spur pair whose fields are explained where they stand."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from sigdb.core import InputError, unit_of
from sigdb.transmission.mesh.geometry_profiles import EnergyMethod
from sigdb.transmission.parts.bodies import Disk
from sigdb.transmission.parts.described import NOTES
from sigdb.transmission.parts.gears import Gear, Mesh, Operating, ProfileError, Trapezoid
from sigdb.transmission.parts.sensors import Sensor
from sigdb.transmission.parts.shafts import Material, Segment, Shaft
from sigdb.transmission.parts.supports import Bearing, CasingMode, Coupling
from sigdb.transmission.rig import Transmission

_BEARING: dict[str, Any] = {"stiffness": [1.0e8, 1.0e8, 5.0e7]}
_SEGMENT: dict[str, Any] = {"length": 0.2, "outer_diameter": 0.03, "elements": 5}
_GEAR: dict[str, Any] = {"node": 2, "body_length": 0.02, "bore": 0.03, "material": "steel"}

Table = tuple[str, type[BaseModel], dict[str, Any]]
"""Name of a table of the file, its section, and its values."""

_TABLES: tuple[Table, ...] = (
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


def write_new_rig(path: str | Path, *, overwrite: bool = False, energy_method: bool = False) -> Path:
    """Write a rig file that can be loaded and simulated as it is, to be changed field by field.

    Parameters
    ----------
    path
        File that ends in ``.toml``; the rig is named after it.
    overwrite
        Whether a file that exists is replaced.
    energy_method
        Whether the mesh stiffness follows from the shape of the teeth by the energy method, so that damage may be given
        by its geometry (``crack_depth``, ``pit_diameter``, ...); otherwise it is a trapezoid of a given stiffness.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the name does not end in ``.toml``, or the file exists.
    """
    path = Path(path)
    if path.suffix != ".toml":
        raise InputError(f"{path}: a rig file's name ends in .toml")
    try:
        with path.open("w" if overwrite else "x", encoding="utf-8") as file:
            file.write(new_rig_text(path.stem, energy_method=energy_method))
    except FileExistsError:
        raise InputError(f"{path}: exists already; choose another name, or give --force to overwrite it") from None
    return path


def new_rig_text(name: str, *, energy_method: bool = False) -> str:
    """Return the text of a rig file to start from, whose mesh stiffness is a trapezoid or by the energy method.

    Examples
    --------
    >>> import tomllib
    >>> tomllib.loads(new_rig_text("my-rig"))["gears"]["pinion"]["teeth"]
    23
    """
    name = re.sub(r"[^A-Za-z0-9_-]", "-", name)
    top = {"name": name if name[:1].isalpha() else f"rig-{name}", "title": "A spur pair", "damping_ratio": 0.04}
    lines = [
        "# A spur pair to start from. Replace every number, and its source, which says where it is from and why:",
        "# `published: ...`, `derived: ...` or `assumed: ...`. SI units, but for names that end in _deg, _rpm or _hz.",
        "# The casing's frame has Y upwards. A field behind a # can be left out; its value is the default, if any.",
        "",
        *_fields(Transmission, top, explained=True),
    ]
    seen: set[type[BaseModel]] = set()
    for table, section, values in map(_by_energy_method, _TABLES) if energy_method else _TABLES:
        lines += ["", f"[{table}]", *_fields(section, values, explained=section not in seen)]
        seen.add(section)
    lines += ["", "# Further tables, where the rig has such parts."]
    for table, section in _MORE:
        lines += ["", f"# [{table}]", *_fields(section, {}, explained=True)]
    return "\n".join(lines) + "\n"


def _by_energy_method(table: Table) -> Table:
    """Return a table of the file as it is where the shape of the teeth gives the mesh stiffness."""
    name, section, values = table
    if section is Mesh:
        return name, section, {key: value for key, value in values.items() if key != "stiffness"}
    return (name, EnergyMethod, {"kind": "energy-method", "flank": 0.15}) if section is Trapezoid else table


def _fields(section: type[BaseModel], values: dict[str, Any], *, explained: bool) -> Iterator[str]:
    """Lines of a table: each field with its meaning, those without a value as comments; sources last."""
    sources = []
    for name, field in section.model_fields.items():
        if name not in values and (not explained or not _leaf(field.annotation) or name in NOTES):
            continue
        if explained:
            unit = unit_of(field)
            yield f"# {field.description}{'' if unit == '-' else f' [{unit}]'}"
        if name not in values:
            yield f"# {name} ={_default(field.default)}"
            continue
        yield f"{name} = {_toml(values[name])}"
        if not isinstance(values[name], str):
            sources.append(f'sources.{name} = "assumed: a value to start from, replace it"')
    yield from sources


def _leaf(annotation: Any) -> bool:
    """Whether a field holds a value, not tables of its own."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return False
    return all(_leaf(part) for part in getattr(annotation, "__args__", ()))


def _default(value: Any) -> str:
    return "" if value is PydanticUndefined or value is None else f" {_toml(value)}"


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(_toml(item) for item in value)}]"
    if isinstance(value, float) and abs(value) >= 1e6:
        mantissa, exponent = f"{value:e}".split("e")
        return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"
    return repr(value)
